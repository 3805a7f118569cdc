// SPDX-License-Identifier: Apache-2.0
// A mesh as a binary glTF 2.0.
#pragma once
#include <filesystem>
#include <glm/gtc/quaternion.hpp>

#include "scene/triangle_mesh.h"

namespace ewa::io {

/// Writes positions, normals, and colours in linear light. The material is unlit (KHR_materials_unlit), because the colours
/// contain the scene's light. The node has the mesh's origin and the rotation `turn` from the splats' world to glTF's; read_mesh()
/// undoes it. The same mesh gives the same bytes. Throws InputError above 4 GiB, RunError (disk).
void write_glb_mesh(const std::filesystem::path& path, const scene::TriangleMesh& mesh,
                    const glm::dquat& turn = {1, 0, 0, 0});

}  // namespace ewa::io
