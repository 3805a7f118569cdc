// SPDX-License-Identifier: Apache-2.0
// SPZ (nianticlabs/spz): one block an attribute, structure of arrays, quantised, then packed.
//   versions 1 to 3: all in one gzip stream: header of 16 bytes, then the blocks
//   version 4: header of 32 bytes, extension records, table of (packed, unpacked) sizes, a Zstandard frame a
//   block
// Blocks, in order:
//   positions   3 x 24-bit signed fixed point with the header's fractional bits (version 1: 3 x float16)
//   opacities   u8
//   colours     3 x u8: 0.15 * 255 * (SH coefficient 0) + 127.5
//   scales      3 x u8: 16 * (ln s + 10)
//   rotations   4 bytes: index of the largest of x y z w, the others as sign and 9 bits of 1/sqrt(2)
//   (versions 1
//               and 2: x y z in 3 x u8: 127.5 q + 127.5, w >= 0)
//   SH          3 x u8 a coefficient, RGB inner: 128 v + 128, written in steps of 8 (degree 1) or 16 (others)
// The file's frame is RUB (y up, z back): y and z, their quaternion components and the SH that are odd in
// them change sign on the way.
#pragma once
#include "ewa/splat_files.h"

namespace ewa::io {

/// Versions 1 to 4. Of SH degree 4 degree 3 is taken; extension records are skipped. Throws InputError that
/// names the file and the byte.
SplatScene read_spz(const std::filesystem::path& path);

/// options.spz_version: 3 or 4. 12 fractional bits, fewer where a coordinate would not fit. Throws RunError;
/// InputError for a coordinate beyond +-8388607 or more than 2^32 - 1 splats.
std::vector<std::string> write_spz(const std::filesystem::path& path, const Gaussians& gaussians,
                                   const SaveOptions& options);

}  // namespace ewa::io
