// SPDX-License-Identifier: Apache-2.0
// A surface of triangles that share vertices, with colours.
#pragma once
#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

namespace ewa::scene {

struct TriangleMesh {
    glm::dvec3 origin{0};                            // world; positions are relative to it
    std::vector<glm::vec3> positions;                // world units
    std::vector<glm::vec3> normals;                  // of length 1
    std::vector<std::array<uint8_t, 3>> colors;      // sRGB; one a vertex, or none
    std::vector<std::array<uint32_t, 3>> triangles;  // counter-clockwise from the front
};

}  // namespace ewa::scene
