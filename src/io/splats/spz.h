// SPDX-License-Identifier: Apache-2.0
// SPZ (nianticlabs/spz): one block per attribute, as a structure of arrays, quantised, then compressed.
//   versions 1 to 3   one gzip stream: a header of 16 bytes, then the blocks
//   version 4         a header of 32 bytes, extension records, a table of (compressed, decompressed) sizes,
//                     then one Zstandard frame per block
// The blocks, in this order, per splat:
//   positions   3 x 24-bit signed fixed point with the header's fractional bits (version 1: 3 x float16)
//   opacities   u8
//   colours     3 x u8: 0.15 * 255 * (SH coefficient 0) + 127.5
//   scales      3 x u8: 16 * (ln s + 10)
//   rotations   4 bytes: index of the largest of x y z w, then sign and 9 bits of each other in 1/sqrt(2)
//               (versions 1 and 2: x y z in 3 x u8: 127.5 q + 127.5, w >= 0)
//   SH          3 x u8 per coefficient, RGB inner: 128 v + 128, in steps of 8 (degree 1) or 16 (others)
// The file's frame is RUB (y up, z back). So y and z, their quaternion components, and the SH that are odd in
// them change sign.
#pragma once
#include <filesystem>

#include "ewa/splat_scene.h"

namespace ewa::io {

/// Reads versions 1 to 4. SH degree 4 is cut to degree 3, and extension records are skipped. Throws
/// InputError that names the file and the byte.
SplatScene read_spz(const std::filesystem::path& path);

/// Writes version 3 or 4, as options.spz_version states. Positions have 12 fractional bits, or fewer if a
/// coordinate does not fit. Throws RunError. Throws InputError for a coordinate beyond +-8388607 or more than
/// 2^32 - 1 splats.
std::vector<std::string> write_spz(const std::filesystem::path& path, const Gaussians& gaussians,
                                   const SaveOptions& options);

}  // namespace ewa::io
