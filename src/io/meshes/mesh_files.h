// SPDX-License-Identifier: Apache-2.0
// Meshes in files of any format: glTF (.gltf, .glb), PLY with faces, and OBJ.
#pragma once
#include <filesystem>

#include "scene/mesh_scene.h"

namespace ewa::io {

/// Whether the file is a mesh: a glTF whose meshes have triangles and no splats, a PLY with faces, or any .obj.
bool is_mesh(const std::filesystem::path& path);

/// Reads the triangles of such a file in its world; those that ewa mesh has turned, in the world of the splats. A glTF gives all that read_gltf_mesh reads, and the other formats give
/// corners alone. Faces of more corners become fans. Triangles with a corner that is not finite are skipped and counted. The limits are
/// those of read_gltf_mesh. Throws InputError that names the byte, or the place in the glTF.
scene::MeshScene read_mesh(const std::filesystem::path& path);

/// The reader of each format.
scene::MeshScene read_ply_mesh(const std::filesystem::path& path);
scene::MeshScene read_obj_mesh(const std::filesystem::path& path);

}  // namespace ewa::io
