// SPDX-License-Identifier: Apache-2.0
// Properties of lenses through which splats are rendered directly, without undistortion of images. shaders/lib/lens.glsl has the
// formulas.
#pragma once
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>

#include "ewa/camera.h"

namespace ewa::scene {

/// Whether splats can be rendered through this lens: a pinhole, brown, fisheye with its radial terms k1 to k4 alone,
/// equirectangular or orthographic.
bool is_native(const Distortion& lens);

/// The pixel of a point in camera coordinates, through the camera's lens. Empty behind the camera and where the lens does not show
/// it. The lens must be native. limit: lens_limit(camera), which is slow, so compute it once.
std::optional<glm::dvec2> pixel_of(const Camera& camera, double limit, const glm::dvec3& point);

/// The ray of a position in the image: from `origin` along `direction`, of unit length, in camera coordinates. Empty where the lens
/// shows nothing. limit: lens_limit(camera). x, y: px from the top left corner.
struct PixelRay {
    glm::dvec3 origin{0}, direction{0};
};
std::optional<PixelRay> ray_of(const Camera& camera, double limit, double x, double y);

/// Gives the camera the focal lengths and principal point of an equirectangular image of all directions.
void set_equirectangular(Camera& camera);

/// The view of a pinhole through another lens. A fisheye shows fisheye_degrees along the smaller side of the image, and 360° all
/// directions. Parallel rays give a world unit at `middle` (world) the size that the pinhole gives it.
Camera through_lens(Camera pinhole, const Distortion& lens, double fisheye_degrees, const glm::dvec3& middle);

/// Whether the splats of a view are ordered by their distance from the camera. Else they are by z.
bool ordered_by_distance(Lens lens);

/// Whether the left and right border of the image are one line of the scene: an equirectangular image of all directions.
bool shows_all_around(const Camera& camera);

/// The limit up to which the lens shows points off its axis. brown: the largest x^2 + y^2 of tangents, before the model folds over.
/// fisheye: the largest angle in radians, before the model folds over, and little beyond the corners of the image. Others:
/// infinite.
double lens_limit(const Camera& camera);

/// Bounds to which x / z and y / z are clamped in the projection's Jacobian, for pinholes and brown. They reach JACOBIAN_MARGIN
/// half images beyond the image on each side.
struct TangentBounds {
    glm::dvec2 low, high;
};
TangentBounds tangent_bounds(const Camera& camera);

}  // namespace ewa::scene
