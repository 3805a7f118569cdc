// SPDX-License-Identifier: Apache-2.0
// Computes scale, heading and place of a model from the GPS positions of its photos.
#pragma once
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "capture/world_axes.h"

namespace ewa::capture {

constexpr double kPerMad = 1.4826;  // of a normal distribution: sigma / median absolute deviation
// Probable error, radians, of the up direction of cameras that all look one way. Their axes determine roll, but not pitch.
constexpr double kPitch = 0.25;

/// A camera's centre and axes in the world. The axes are those of the photo when it is upright.
struct Shot {
    glm::dvec3 center{0}, right{0}, up{0}, forward{0};
    std::optional<image::GpsFix> gps;
};

/// An up direction, and the covariance of its error, radians squared.
struct Up {
    glm::dvec3 direction{0};
    glm::dmat3 errors{kPitch * kPitch};
    std::string by = "the cameras";
    bool sure = false;
};

double median_of(std::vector<double> values);

/// The rotation from the model's world to axes whose y is -up. Its rows are these axes.
glm::dmat3 level_axes(const glm::dvec3& up);

/// The axes that fit the GPS positions. Empty if GPS does not determine them; `reason` then says why. first: up by the cameras.
std::optional<WorldAxes> axes_by_gps(const std::vector<Shot>& shots, const Up& first, std::string& reason);

}  // namespace ewa::capture
