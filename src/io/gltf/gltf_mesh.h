// SPDX-License-Identifier: Apache-2.0
// glTF 2.0 scenes of triangles, as .glb or .gltf with its buffers and images beside it or inside.
#pragma once
#include <filesystem>

#include "scene/mesh_scene.h"

namespace ewa::io {

/// Every triangle (mode 4, 5 or 6, indexed by any of the three integer types or not at all) that the default
/// scene's nodes reach, in the file's world; materials with base colour, metallic-roughness and emissive
/// textures and factors, vertex colours, the three alpha modes; perspective cameras; KHR_lights_punctual,
/// KHR_materials_specular (its factor), _ior, _unlit and _emissive_strength; images as they are encoded. A
/// scene's "extras" may say its sky:
/// {"sky": {"zenith": [r, g, b], "horizon": [...], "ground": [...]}}, radiances. Triangles with a corner that
/// is not finite are left out and counted. What a file has and a photograph does not show is remarked; an
/// extension that the file requires and that is none of these, sparse and compressed accessors are refused.
/// No more than kMostTriangles, nor more than the file and 40 MiB account for. Throws InputError that names
/// the file and the byte, or the mesh, node, material or accessor and its property; also for a file with
/// splats and no triangles.
scene::MeshScene read_gltf_mesh(const std::filesystem::path& path);

/// Whether the file is a glTF whose meshes have triangles and no splats. False for whatever else, and for
/// what is no glTF.
bool is_gltf_mesh(const std::filesystem::path& path);

}  // namespace ewa::io
