// SPDX-License-Identifier: Apache-2.0
// Cameras: paths between them, their frusta as lines, and the aspect ratio of their images.
#pragma once
#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <span>

#include "ewa/camera.h"

namespace ewa {

/// The camera at `time` on a path through at least one key. Key i is at time i; before the first key and
/// after the last one the camera stays. Positions follow a uniform Catmull-Rom spline (Catmull and Rom 1974),
/// which is straight at its ends. Rotations follow the shortest great arc. Focal lengths are geometric means,
/// relative to the width. Size and relative principal point are the first key's.
Camera along_path(std::span<const Camera> keys, double time);

/// The world position at pixel coordinates x, y (pixel centres at +0.5) and camera z `depth` in world units.
glm::dvec3 world_point(const Camera& camera, double x, double y, double depth);

/// A line in world units.
struct Segment {
    glm::dvec3 from{0}, to{0};
};

/// The frustum as lines: four edges from the camera's centre to the image's corners at view z = depth, the
/// image's four sides (top, right, bottom, left), and two sides of a roof over the top one that mark the up
/// direction. depth > 0.
std::array<Segment, 10> frustum_segments(const Camera& camera, double depth);

/// The part of a segment in front of the camera's near plane, in px. Empty if there is none.
std::optional<std::array<glm::dvec2, 2>> projected(const Segment& segment, const Camera& camera);
/// The pixel of a point. Empty behind the near plane.
std::optional<glm::dvec2> projected(const glm::dvec3& point, const Camera& camera);

/// The camera, or one of the same view whose image is reduced to this width. Its height keeps the ratio, rounded.
Camera narrowed(const Camera& camera, int64_t most_width);

/// Whether an image of the new size is the old one resized by one factor, with each side rounded to a whole
/// pixel. A factor near 1 must be exact: an image that is a pixel off is a different one (cropped, or of
/// another camera).
bool same_aspect(int old_width, int old_height, int width, int height);

}  // namespace ewa
