// SPDX-License-Identifier: Apache-2.0
// A camera as something to look at: the pyramid of what it sees, and lines of the world in a picture.
#pragma once
#include <array>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>

#include "ewa/camera.h"

namespace ewa {

/// World units.
struct Segment {
    glm::dvec3 from{0}, to{0};
};

/// The four edges from the camera's centre to its picture's corners at view z = depth, the picture's four
/// sides (top, right, bottom, left), and two sides of a roof over the top one, which tell where up is. depth
/// > 0.
std::array<Segment, 10> frustum_segments(const Camera& camera, double depth);

/// The part of a segment in front of the camera's near plane in pixels; nothing where there is none.
std::optional<std::array<glm::dvec2, 2>> projected(const Segment& segment, const Camera& camera);
/// A point in pixels; nothing behind the near plane.
std::optional<glm::dvec2> projected(const glm::dvec3& point, const Camera& camera);

}  // namespace ewa
