// SPDX-License-Identifier: Apache-2.0
// Scale, heading and place of a model by the GPS of its photos.
#pragma once
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "capture/world_axes.h"

namespace ewa::capture {

constexpr double kPerMad = 1.4826;  // of a normal distribution: sigma / median absolute deviation
// Radians by which the up direction of cameras that look one way is probably wrong: only their roll is known.
constexpr double kPitch = 0.25;

/// A camera's axes in the world, as a viewer of the upright photo sees them.
struct Shot {
    glm::dvec3 center{0}, right{0}, up{0}, forward{0};
    std::optional<image::GpsFix> gps;
};

/// A direction, and the mean squares by which it is probably wrong.
struct Up {
    glm::dvec3 direction{0};
    glm::dmat3 errors{kPitch * kPitch};
    std::string by = "the cameras";
    bool sure = false;
};

double median_of(std::vector<double> values);

/// Axes whose y points down, as rows: from the model to them.
glm::dmat3 level_axes(const glm::dvec3& up);

/// Empty where GPS does not determine them; reason: why.
std::optional<WorldAxes> axes_by_gps(const std::vector<Shot>& shots, const Up& first, std::string& reason);

}  // namespace ewa::capture
