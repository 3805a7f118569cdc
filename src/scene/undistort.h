// The Brown-Conrady lens model: x right, y down, in units of the focal length (z = 1).
#pragma once
#include <glm/vec2.hpp>
#include <optional>

#include "ewa/camera.h"
#include "ewa/dataset.h"
#include "ewa/image.h"

namespace ewa::scene {

/// Where a lens puts the ray (x, y, 1): OpenCV's formulas.
glm::dvec2 distort(const Distortion& distortion, glm::dvec2 ray);

/// The ray a lens puts there, by Newton's method; none where it does not converge.
std::optional<glm::dvec2> undistort(const Distortion& distortion, glm::dvec2 point);

/// The pinhole camera of the same pose and size whose picture is the largest axis-parallel rectangle that the
/// source covers without a blank pixel: the border's pixel centres are undistorted, the innermost of each
/// side becomes the new border (OpenCV's getOptimalNewCameraMatrix with alpha = 0, with every border pixel in
/// place of its 9 x 9 grid). Throws InputError where the lens model folds over inside the picture, so that no
/// such rectangle exists.
Camera undistorted_camera(const Camera& source, const Distortion& distortion);

/// The picture of `camera`, sampled bilinearly from that of `source`. Both have the image's size.
Image undistort_image(const Image& image, const Camera& source, const Distortion& distortion,
                      const Camera& camera);

}  // namespace ewa::scene
