// SPDX-License-Identifier: Apache-2.0
#include "scene/mesh_scene.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace ewa::scene {

uint32_t pack_normal(const glm::dvec3& normal) {
    const double sum = std::abs(normal.x) + std::abs(normal.y) + std::abs(normal.z);
    if (!(sum > 0) || !std::isfinite(sum)) return kNoNormal;
    glm::dvec2 e(normal.x / sum, normal.y / sum);
    if (normal.z < 0)
        e = glm::dvec2((1 - std::abs(e.y)) * (e.x >= 0 ? 1 : -1), (1 - std::abs(e.x)) * (e.y >= 0 ? 1 : -1));
    const auto word = [](double v) {
        return uint32_t(int32_t(std::lround(std::clamp(v, -1.0, 1.0) * 32767))) & 0xffffu;
    };
    return word(e.x) | (word(e.y) << 16);
}

bool color_depends_on_view(const MeshScene& scene) {
    std::vector<bool> used(scene.materials.size());
    for (const Triangle& triangle : scene.triangles) used[triangle.material] = true;
    for (size_t i = 0; i < used.size(); ++i)
        if (used[i] && scene.materials[i].glossy()) return true;
    return false;
}

double Box::radius() const {
    return 0.5 * glm::length(high - low);
}

Box bounds_of(const MeshScene& scene) {
    Box box;
    for (const Triangle& triangle : scene.triangles)
        for (const glm::dvec3& corner : triangle.corners) {
            box.low = glm::min(box.low, corner);
            box.high = glm::max(box.high, corner);
        }
    return box;
}

}  // namespace ewa::scene
