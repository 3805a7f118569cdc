// SPDX-License-Identifier: Apache-2.0
// The table from which a path samples a light in proportion to its power.
#pragma once
#include <cstdint>
#include <vector>

#include "scene/mesh_scene.h"

namespace ewa::pathtracer {

struct LightTable {
    std::vector<uint32_t> words;  // see layouts.h
    uint32_t count = 0;
    std::vector<double>
        triangle_density;  // per material: probability per area (device units) on its triangles
};

/// The entries are the punctual lights, then the emitting triangles by their sorted index in `order`.
/// `emission` is the mean radiance per material. The power, averaged over the channels, is 4 pi times the
/// intensity of a point light, a directional light's irradiance on the scene's disc, and pi times area and
/// radiance of a triangle.
LightTable light_table(const scene::MeshScene& scene, const glm::dvec3& origin, double unit,
                       const std::vector<uint32_t>& order, const std::vector<double>& emission);

/// Vose's alias method (1991): for a random number in [0, 1), entry i selects i below threshold[i], else
/// alias[i].
struct AliasTable {
    std::vector<double> threshold;
    std::vector<uint32_t> alias;
};
AliasTable alias_table(const std::vector<double>& probabilities);

}  // namespace ewa::pathtracer
