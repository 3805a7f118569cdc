// SPDX-License-Identifier: Apache-2.0
// SuperSplat's compressed PLY (playcanvas/splat-transform, write-compressed-ply.ts): a PLY container with the
// elements
//   chunk    a box per 256 splats: float min_x..z max_x..z, min_scale_x..z max_scale_x..z (logarithms),
//            min_r..b max_r..b (colours; older files lack them, which means 0..1)
//   vertex   uint packed_position, packed_scale   11, 10 and 11 bits from the top, within the chunk's box
//            uint packed_rotation                 2 bits: which of w x y z is the largest;
//                                                 each other component c as c / sqrt(2) + 0.5 in 10 bits
//            uint packed_color                    8 bits each: r g b within the chunk's box, opacity
//   sh       uchar f_rest_i, channel-major: v = (byte + 0.5) / 32 - 4; the ends are -4 and 4
#pragma once
#include "ewa/splat_scene.h"
#include "io/splats/ply_table.h"

namespace ewa::io {

/// Whether the header declares this layout.
bool is_compressed_ply(const PlyTable& table);

/// Throws InputError that names the file and the byte or property.
SplatScene read_compressed_ply(const std::filesystem::path& path);

/// Writes the splats in Morton order, which keeps the boxes of the chunks small. Throws RunError.
std::vector<std::string> write_compressed_ply(const std::filesystem::path& path, const Gaussians& gaussians,
                                              const SaveOptions& options);

}  // namespace ewa::io
