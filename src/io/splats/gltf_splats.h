// SPDX-License-Identifier: Apache-2.0
// glTF 2.0 with KHR_gaussian_splatting (Khronos; release candidate of 2026), as .glb or .gltf with a .bin
// beside.
//
// A primitive of mode POINTS with the attributes
//   POSITION                                            metres, in the node's frame
//   KHR_gaussian_splatting:ROTATION                     unit quaternion x y z w
//   KHR_gaussian_splatting:SCALE                        linear standard deviations
//   KHR_gaussian_splatting:OPACITY                      linear, 0..1
//   KHR_gaussian_splatting:SH_DEGREE_l_COEF_m           RGB, l = 0..3, m = 0..2l in INRIA's order
//   COLOR_0                                             for programs that draw points: colour in linear
//   light, opacity
// glTF's world is LUF (x left, y up, z forward): PLY's turned half round z. Files written here keep the
// stored values and say so with a node's rotation; readers turn what nodes say, SH included.
#pragma once
#include "ewa/splat_files.h"

namespace ewa::io {

/// Every primitive with the extension that the scene's nodes reach, in the order of the nodes, in one scene.
/// float32 and the quantised component types, with or without stride; both colour spaces (colours in linear
/// light become sRGB values, view dependence to first order). Buffers: the .glb's own, data URIs, files in or
/// below the file's folder. Kernels other than "ellipse", sparse and compressed accessors are refused. Throws
/// InputError that names the file and the byte, or the mesh, node or accessor and its property.
SplatScene read_gltf_splats(const std::filesystem::path& path);

/// The .bin of the same stem that holds a .gltf's values.
std::filesystem::path gltf_values_path(const std::filesystem::path& gltf);

/// Throws InputError where that .bin is there and the .gltf is not, or does not refer to it: it is another's.
void check_gltf_values(const std::filesystem::path& gltf);

/// float32 throughout, sRGB colours. `binary`: .glb, else .gltf and its .bin. Throws RunError; InputError for
/// a scene without splats, more than 4 GiB in a .glb, or as check_gltf_values does.
std::vector<std::string> write_gltf_splats(const std::filesystem::path& path, const Gaussians& gaussians,
                                           const SaveOptions& options, bool binary);

}  // namespace ewa::io
