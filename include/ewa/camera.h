// SPDX-License-Identifier: Apache-2.0
// A pinhole camera in the OpenCV convention: x right, y down, z forward, pixel centres at +0.5.
#pragma once
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

namespace ewa {

struct Camera {
    int width = 0, height = 0;              // px
    double fx = 0, fy = 0, cx = 0, cy = 0;  // px; (cx, cy) from the image's top left corner
    glm::dmat3 rotation{1.0};               // world to camera: p_camera = rotation * p_world + translation
    glm::dvec3 translation{0.0};            // world units

    /// The camera's centre in world coordinates, -R^T t.
    glm::dvec3 position() const { return -(glm::transpose(rotation) * translation); }
};

/// The same view at 1/factor of the resolution, to match downscale(Image, factor). Sizes are rounded down, to
/// at least 1 px. Focal lengths and principal point are scaled by the exact ratio of sizes per axis. factor
/// >= 1.
Camera downscale(const Camera& camera, int factor);

/// The same view in an image of another size in px.
Camera resized(const Camera& camera, int width, int height);

}  // namespace ewa
