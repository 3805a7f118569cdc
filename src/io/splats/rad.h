// SPDX-License-Identifier: Apache-2.0
// Spark's .rad (sparkjsdev/spark), little endian. Each part begins at a multiple of 8 bytes, after zeros.
//   file    "RAD0", u32 bytes of the JSON, the JSON, then the chunks
//   chunk   "RADC", u32 bytes of the JSON, the JSON, u64 bytes of the payload, the payload: one part for each property
// JSON of the file:
//   version 1, type "gsplat", count: of splats, chunkSize: splats of each chunk but the last
//   chunks         the offset of each from the first one, and its bytes; or the filename of a chunk beside the file
//   maxSh          SH degree
//   lodTree        true for a tree: splats with child_count > 0 stand for their children, which are child_start and those that
//                  follow. Splat 0 is the root, and children come after their parent. The others are the scene.
//   splatEncoding  ranges that suit the splats in Spark's memory
//   comment        any text; ewa has a line for each comment and mark (render_mark.h)
// JSON of a chunk: version 1, base: its first splat, count, payloadBytes, properties. A property has its offset in the payload, bytes,
// property, encoding, and perhaps compression "gz", which is raw deflate, min and max.
//
// Values are planes: the first number of all splats, then the second, and so on.
//   center       x y z
//   alpha        opacity; splats with children may have more than 1
//   rgb          colours of SH coefficient 0
//   scales       standard deviations
//   orientation  x y z of the quaternion with w >= 0
//   sh1 sh2 sh3  3, 5 and 7 coefficients of RGB; or sh1_code and so on in chunk 0, shCodeCount of them, and sh_label, a code's index
// Encodings of a number:
//   f32, f16, u16, u32
//   f32_lebytes  first the lowest byte of all numbers; f16_lebytes too
//   r8           u8 from min to max; r8_delta: less the one before in its plane, modulo 256
//   s8           i8 from -127 to 127 for -max to max; s8_delta
//   ln_f16       the logarithm
//   ln_0r8       u8: 0 for a size of 0, 1 to 255 for a logarithm from min to max
//   oct88r8      3 bytes of each splat together: x and y of the axis, an octahedron's map, from -1 to 1, and half the angle
//                from 0 to pi / 2
// Coordinates have no frame of the format's own; those of ewa are a PLY's.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "ewa/gaussians.h"

namespace ewa::io {

inline constexpr uint32_t kRadMagic = 0x30444152, kRadChunkMagic = 0x43444152;  // "RAD0", "RADC"
inline constexpr size_t kRadChunk = 65536;                                      // splats

/// Sizes up to this are written as 0: they are far below what any image shows.
inline constexpr double kRadNoSize = -30;  // logarithm

/// A splat of the file: splat `index` of a level. Level 0 is the scene.
struct RadNode {
    uint32_t index = 0, child_start = 0;
    uint16_t child_count = 0, level = 0;
};

/// A tree of splats: parents are merged from their children.
struct RadTree {
    std::vector<Gaussians> coarser;  // levels 1, 2 and so on
    std::vector<RadNode> nodes;      // in the order of the file
};

/// At least so many levels below the root, each with half of the splats of the one before, until one is few enough for the
/// root's children. A splat that is the same in several levels is one node. Splats must be drawable, at least one.
RadTree build_rad_tree(const Gaussians& gaussians, int levels);

}  // namespace ewa::io
