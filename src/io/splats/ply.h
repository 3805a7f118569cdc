// SPDX-License-Identifier: Apache-2.0
// Splats in INRIA's PLY layout (3D Gaussian Splatting, scene/gaussian_model.py, save_ply).
//
// The element "vertex" has one row per splat. Properties are found by name:
//   x y z            means
//   nx ny nz         written as zero, ignored when read
//   f_dc_0..2        SH coefficient 0 of R, G, B
//   f_rest_0..3K-1   SH coefficients 1..K of R, then of G, then of B; K = 0, 3, 8, 15 for degree 0..3
//   opacity          logit
//   scale_0..2       natural logarithm
//   rot_0..3         w x y z
// In memory, SH is coefficient after coefficient with RGB inner. So f_rest is transposed here.
#pragma once
#include <filesystem>

#include "ewa/splat_scene.h"

namespace ewa::io {

/// Accepts any property order and scalar type, ascii and binary of either byte order. Other properties and
/// elements are ignored. Values stay as they are, finite or not. Positions in double far from the world's
/// origin become means relative to an origin of the scene. A comment "SplatRenderMode: mip" (Brush) or
/// "antialiased 1" (Postshot) sets SplatScene::antialiased. Throws InputError that names the file and the
/// byte or property.
SplatScene read_ply(const std::filesystem::path& path);

/// Writes binary_little_endian and float32, with the properties above in that order. If the scene has an
/// origin, x y z are world positions in double. The anti-aliased mark is Brush's. Throws RunError.
std::vector<std::string> write_ply(const std::filesystem::path& path, const Gaussians& gaussians,
                                   const SaveOptions& options);

/// The bytes that write_ply would write, in pieces: the header, then the rows of the splats.
std::string ply_header(const Gaussians& gaussians, const SaveOptions& options);
size_t ply_row_bytes(const Gaussians& gaussians);
/// Appends the row of splat i, ply_row_bytes() / 4 floats, to `rows`.
void append_ply_row(const Gaussians& gaussians, size_t i, std::vector<float>& rows);

}  // namespace ewa::io
