// SPDX-License-Identifier: Apache-2.0
// Files of meshes: .ply, .obj and .glb.
#pragma once
#include <filesystem>
#include <glm/vec3.hpp>

#include "scene/triangle_mesh.h"

namespace ewa::mesh {

/// Throws InputError for a name with another extension.
void check_mesh_name(const std::filesystem::path& path);

/// Writes the mesh: a .ply in the world of the splats, .obj and .glb so that `up`, an axis of that world, is their y. -y is up in a PLY
/// of splats, and splats in a .glb are turned in the same way. Colours are sRGB in .ply and behind the positions of an .obj, and linear light in a .glb.
/// Positions far from the origin have more digits than float32. The same mesh gives the same bytes. Throws InputError, RunError (disk).
void save_mesh(const std::filesystem::path& path, const scene::TriangleMesh& mesh,
               const glm::dvec3& up = {0, -1, 0});

}  // namespace ewa::mesh
