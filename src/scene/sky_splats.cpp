// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "ewa/sky_map.h"
#include "ewa/splat_edit.h"
#include "scene/framing.h"
#include "shared/constants.h"

namespace ewa {
namespace {

constexpr double kSkyDistance = 30;  // radius of the sphere, in radii of the scene
constexpr double kSkyWidth = 0.6;    // standard deviation of a splat, in distances of its neighbours
constexpr float kSkyOpacity = 4.6f;  // logit of 0.99

/// The unit vector of a position on the map, from -1 to 1 along both sides.
glm::dvec3 map_direction(double x, double y) {
    const double z = 1 - std::abs(x) - std::abs(y);
    if (z >= 0) return glm::normalize(glm::dvec3(x, y, z));
    return glm::normalize(
        glm::dvec3(std::copysign(1 - std::abs(y), x), std::copysign(1 - std::abs(x), y), z));
}

}  // namespace

Gaussians sky_splats(const SkyMap& sky, const Gaussians& scene) {
    check(sky);
    check(scene);
    const scene::Framing framing = scene::frame_scene(scene, 1, 1);
    const double radius = kSkyDistance * framing.radius;
    Gaussians out;
    out.resize(size_t(sky.size) * size_t(sky.size));
    for (size_t i = 0; i < out.size(); ++i) {
        const auto place = [&](double along) { return 2 * (along + 0.5) / sky.size - 1; };
        const size_t row_number = i / size_t(sky.size);
        const double column = double(i % size_t(sky.size)), row = double(row_number);
        const glm::dvec3 direction = map_direction(place(column), place(row));
        // Half a texel to each side does not leave the map.
        const double across = glm::distance(map_direction(place(column - 0.5), place(row)),
                                            map_direction(place(column + 0.5), place(row)));
        const double along = glm::distance(map_direction(place(column), place(row - 0.5)),
                                           map_direction(place(column), place(row + 0.5)));
        const double width = kSkyWidth * radius * std::max(across, along);
        const glm::dvec3 mean = framing.target - scene.origin + radius * direction;
        for (size_t k = 0; k < 3; ++k) {
            out.means[3 * i + k] = float(mean[int(k)]);
            out.log_scales[3 * i + k] = float(std::log(width));
            out.sh[3 * i + k] = float((double(sky.texels[3 * i + k]) - 0.5) / shared::SH_C0);
        }
        out.quaternions[4 * i] = 1;
        out.opacity_logits[i] = kSkyOpacity;
    }
    out.origin = scene.origin;
    return out;
}

}  // namespace ewa
