// SPDX-License-Identifier: Apache-2.0
// Splats in INRIA's PLY layout (3D Gaussian Splatting, scene/gaussian_model.py save_ply).
//
// Element "vertex", one row a splat, properties found by name:
//   x y z                                  means
//   nx ny nz                               written as zero, ignored when read
//   f_dc_0..2                              SH coefficient 0 of R, G, B
//   f_rest_0..3K-1                         SH coefficients 1..K of R, then of G, then of B; K = 0, 3, 8, 15
//   (degree 0..3) opacity                                logit scale_0..2                             natural
//   logarithm rot_0..3                               w x y z
// In memory a splat's SH is coefficient after coefficient, RGB inner, so f_rest is transposed here.
#pragma once
#include "ewa/splat_files.h"

namespace ewa::io {

/// Any property order and scalar type, binary of either byte order or ascii; other properties and elements
/// are ignored. Values are kept as they are, finite or not; positions in double far from the world's origin
/// become means relative to one of their own. A comment "SplatRenderMode: mip" (Brush) or "antialiased 1"
/// (Postshot) is the anti-aliased mark. Throws InputError that names the file and the byte or property.
SplatScene read_ply(const std::filesystem::path& path);

/// binary_little_endian, float32 (x y z double where the scene has an origin, which makes them world
/// positions), the properties above in that order; the anti-aliased mark as Brush writes it. Throws RunError.
std::vector<std::string> write_ply(const std::filesystem::path& path, const Gaussians& gaussians,
                                   const SaveOptions& options);

/// The bytes that write_ply would write, in pieces: the header, then the rows of the splats.
std::string ply_header(const Gaussians& gaussians, const SaveOptions& options);
size_t ply_row_bytes(const Gaussians& gaussians);
/// Appends the row of splat i, ply_row_bytes() / 4 floats, to `rows`.
void append_ply_row(const Gaussians& gaussians, size_t i, std::vector<float>& rows);

}  // namespace ewa::io
