// SPDX-License-Identifier: Apache-2.0
// Projection of world points and lines through any native lens, and frusta as lines.
#pragma once
#include <array>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>

#include "ewa/camera.h"

namespace ewa {

/// The world position at pixel coordinates x, y (pixel centres at +0.5) and the depth that a render has there, in world units:
/// camera z, or the distance with scene::ordered_by_distance. If the lens shows nothing at the pixel, returns the camera's centre.
glm::dvec3 world_point(const Camera& camera, double x, double y, double depth);

/// A line in world units.
struct Segment {
    glm::dvec3 from{0}, to{0};
};

/// The frustum as ten lines: four edges from the camera's centre to the image's corners at that depth, then the image's sides (top,
/// right, bottom, left). The last two are a roof over the top side, which marks the up direction. For a fisheye or 360° lens, the
/// sides are those of the image's middle half. For an orthographic lens, the edges begin in the camera's plane. depth > 0.
std::array<Segment, 10> frustum_segments(const Camera& camera, double depth);

/// The part of a segment in front of the camera's near plane, in px. Empty if there is none. For a fisheye or 360°, it is the straight
/// line between the pixels of its ends. It is then empty if the lens does not show an end, or if the seam is between them.
std::optional<std::array<glm::dvec2, 2>> projected(const Segment& segment, const Camera& camera);
/// The pixel of a point through the camera's lens. Empty behind the near plane and where the lens does not show it.
std::optional<glm::dvec2> projected(const glm::dvec3& point, const Camera& camera);

}  // namespace ewa
