// SPDX-License-Identifier: Apache-2.0
// Meshes in files of any format: glTF (.gltf, .glb), PLY with faces, and OBJ.
#pragma once
#include <filesystem>

#include "scene/mesh_scene.h"

namespace ewa::io {

/// Whether the file is a mesh: a glTF whose meshes have triangles and no splats, a PLY with faces, or any .obj.
bool is_mesh(const std::filesystem::path& path);

/// Reads the triangles of a mesh file, in the file's world. A file by ewa mesh is turned back to the world of the splats. A glTF
/// gives all that read_gltf_mesh() reads; other formats give only positions. Faces of more than three corners become fans.
/// Skips and counts triangles with a corner that is not finite. The limits are those of read_gltf_mesh(). Throws InputError that
/// names the byte, or the place in the glTF.
scene::MeshScene read_mesh(const std::filesystem::path& path);

/// Readers of PLY and OBJ files, as read_mesh().
scene::MeshScene read_ply_mesh(const std::filesystem::path& path);
scene::MeshScene read_obj_mesh(const std::filesystem::path& path);

}  // namespace ewa::io
