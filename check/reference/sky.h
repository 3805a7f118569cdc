// SPDX-License-Identifier: Apache-2.0
// The sky behind the splats: light from infinitely far by the direction of a pixel's ray.
//
// The map is an octahedron |x| + |y| + |z| = 1 in world axes, seen along z, with its half of z < 0 folded outwards: a direction
// lies at p = (x, y) for z >= 0, else at ((1 - |y|) sign x, (1 - |x|) sign y), both in [-1, 1]. The colour is interpolated
// between the centres of four texels. A border continues in itself, mirrored at its middle.
//
//   C = sum_i c_i alpha_i T_i + T sky(d):   dL/d(texel) = sum over pixels of its weight times T dL/dC
#pragma once
#include <glm/vec3.hpp>
#include <vector>

#include "ewa/camera.h"
#include "ewa/sky_map.h"
#include "reference/values.h"

namespace ewa::reference {

/// A sky map with the layout of SkyMap, in double.
struct Sky {
    int size = 0;
    std::vector<double> texels;

    Sky() = default;
    Sky(const SkyMap& map) : size(map.size), texels(map.texels.begin(), map.texels.end()) {}
};

glm::dvec3 sky_color(const Sky& sky, const glm::dvec3& direction);

/// The RGB image over the sky. left: transmittance of each pixel. The first of their rows is this row of the camera's.
Raster over_sky(const Raster& color, const Raster& left, const Camera& camera, const Sky& sky,
                int first_row = 0);

/// dL/d(texel), from dL/d(image).
std::vector<double> sky_gradient(const Sky& sky, const Raster& left, const Camera& camera,
                                 const Raster& gradient);

/// Half the sum of squared differences between neighbours, times SKY_PULL.
double sky_penalty(const Sky& sky);
std::vector<double> sky_penalty_gradient(const Sky& sky);

}  // namespace ewa::reference
