// SPDX-License-Identifier: Apache-2.0
// Files of meshes: .ply, .obj and .glb.
#pragma once
#include <filesystem>

#include "scene/triangle_mesh.h"

namespace ewa::mesh {

/// Throws InputError for a name with another extension.
void check_mesh_name(const std::filesystem::path& path);

/// Writes the mesh in the world of the splats. Colours are sRGB in .ply and behind the positions of an .obj, and linear light in a .glb.
/// Positions far from the origin have more digits than float32. The same mesh gives the same bytes. Throws InputError, RunError (disk).
void save_mesh(const std::filesystem::path& path, const scene::TriangleMesh& mesh);

}  // namespace ewa::mesh
