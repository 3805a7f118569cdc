// SPDX-License-Identifier: Apache-2.0
// glTF 2.0 with KHR_gaussian_splatting (Khronos; release candidate of 2026), as .glb, or as .gltf with a .bin
// beside it.
//
// A primitive of mode POINTS has the attributes
//   POSITION                                   metres, in the node's frame
//   KHR_gaussian_splatting:ROTATION            unit quaternion x y z w
//   KHR_gaussian_splatting:SCALE               linear standard deviations
//   KHR_gaussian_splatting:OPACITY             linear, 0..1
//   KHR_gaussian_splatting:SH_DEGREE_l_COEF_m  RGB, l = 0..3, m = 0..2l in INRIA's order
//   COLOR_0                                    linear colour and opacity, for programs that draw points
// glTF's world is LUF (x left, y up, z forward), which is PLY's turned by 180 degrees about z. The writer
// keeps the stored values and adds that turn as a node's rotation. The reader applies the nodes' transforms,
// to SH too.
#pragma once
#include <filesystem>

#include "ewa/splat_scene.h"

namespace ewa::io {

/// Reads every primitive with the extension that the scene's nodes reach, in the order of the nodes, into one
/// scene. Accepts float32 and the quantised component types, with or without stride, in both colour spaces.
/// Colours in linear light become sRGB values; their view dependence is converted to first order. Buffers may
/// be the .glb's own, data URIs, or files in or below the file's folder. Refuses kernels other than
/// "ellipse", sparse and compressed accessors. Throws InputError that names the file and the byte, or the
/// mesh, node or accessor and its property.
SplatScene read_gltf_splats(const std::filesystem::path& path);

/// The .bin of the same stem that holds a .gltf's values.
std::filesystem::path gltf_values_path(const std::filesystem::path& gltf);

/// Throws InputError if that .bin exists but the .gltf does not, or does not refer to it. Then it belongs to
/// another file.
void check_gltf_values(const std::filesystem::path& gltf);

/// Writes float32 throughout and sRGB colours. `binary` writes a .glb, otherwise a .gltf and its .bin. Throws
/// RunError. Throws InputError for a scene without splats, more than 4 GiB in a .glb, or as check_gltf_values
/// does.
std::vector<std::string> write_gltf_splats(const std::filesystem::path& path, const Gaussians& gaussians,
                                           const SaveOptions& options, bool binary);

}  // namespace ewa::io
