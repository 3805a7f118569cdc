// SPDX-License-Identifier: Apache-2.0
// Which light a path asks: a table that draws each by its share of the power.
#pragma once
#include <cstdint>
#include <vector>

#include "scene/mesh_scene.h"

namespace ewa::pathtracer {

struct LightTable {
    std::vector<uint32_t> words;  // as layouts.h describes lights
    uint32_t count = 0;
    std::vector<double>
        triangle_density;  // per material: probability per area (device units) on its triangles
};

/// Punctual lights, then the triangles whose material emits, by their place in `order`. emission: mean
/// radiance per material. Powers: 4 pi of a point's intensity, directional light over the scene's disc, pi
/// times area and radiance of a triangle, all means over the channels.
LightTable light_table(const scene::MeshScene& scene, const glm::dvec3& origin, double unit,
                       const std::vector<uint32_t>& order, const std::vector<double>& emission);

/// Vose's alias method: entry i is kept where a number of [0, 1) is below threshold[i], else alias[i] is
/// taken.
struct AliasTable {
    std::vector<double> threshold;
    std::vector<uint32_t> alias;
};
AliasTable alias_table(const std::vector<double>& probabilities);

}  // namespace ewa::pathtracer
