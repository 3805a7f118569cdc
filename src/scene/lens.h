// SPDX-License-Identifier: Apache-2.0
// Lens models and undistortion. Rays are (x, y, 1): x right, y down, in units of the focal length.
//
// A lens takes a ray to the plane point q and bends that plane. q = (x, y), but for a fisheye q = angle * (x,
// y) / |(x, y)|. With r2 = |q|^2 and T(q) = (2 p1 x y + p2 (r2 + 2 x^2), p1 (r2 + 2 y^2) + 2 p2 x y):
//   brown       q (1 + k1 r2 + k2 r2^2 + k3 r2^3) / (1 + k4 r2 + k5 r2^2 + k6 r2^3) + T(q)
//               + r2 (s1 + r2 s2, s3 + r2 s4)
//   radial4     q (1 + k1 r2 + ... + k4 r2^4) + T(q)
//   fisheye     q (1 + k1 r2 + ... + k6 r2^6) + T(q) + r2 (s1 + r2 s2, s3 + r2 s4)
//   fisheye624  p + T(p) + |p|^2 (s1 + |p|^2 s2, s3 + |p|^2 s4) with p = q (1 + k1 r2 + ... + k6 r2^6)
//   fov         q atan(2 r tan(k1 / 2)) / (r k1)
//   division    q 2 / (1 + sqrt(1 - 4 k1 r2)), the inverse of p / (1 + k1 |p|^2)
//   unified     q / (k1 sqrt(k2 r2 + 1) + 1 - k1)
// At the end skew times y is added to x.
// These are the models of OpenCV (calib3d, fisheye), COLMAP (src/colmap/sensor/models.h), OpenSfM and Metashape.
#pragma once
#include <glm/vec2.hpp>
#include <optional>

#include "ewa/camera.h"
#include "ewa/image.h"

namespace ewa::scene {

/// The point of the image plane at focal length 1 to which the lens maps the ray (x, y, 1). Not finite where the model has no
/// value.
glm::dvec2 distort(const Distortion& lens, glm::dvec2 ray);

/// The inverse: the ray in front of the camera whose image is `point`. Newton's method starts on the axis,
/// and each step is cut so that it stays where the model is one to one. So of several rays, the result is the
/// one connected to the axis. Empty if the model folds on the way, or if the ray comes from the side or from
/// behind.
std::optional<glm::dvec2> undistort(const Distortion& lens, glm::dvec2 point);

/// Whether a pinhole can show a part of what the lens shows.
inline bool has_pinhole(Lens lens) {
    return lens != Lens::equirectangular && lens != Lens::orthographic;
}

/// Whether the model keeps the orientation around that ray. If it does not, it has folded over.
bool one_to_one(const Distortion& lens, glm::dvec2 ray);

/// The distortion d for focal lengths `factor` times as long, with d(ray) = distortion(factor ray) / factor: every pixel of
/// the undistorted image keeps its pixel in the file. Only Lens::brown has one; others stay as they are.
Distortion for_longer_focal(Distortion distortion, double factor);

/// The pinhole camera of the undistorted image, as COLMAP's image_undistorter chooses it (blank_pixels 0;
/// src/colmap/image/undistortion.cc). Pose and focal lengths are the source's. The size is the largest
/// without blank pixels, between 0.2 and 2 times the source's. It comes from the undistorted pixel centres of
/// the border: each axis shrinks or grows about the principal point, in one ratio, until the nearer border
/// fits. Border pixels that no ray in front reaches do not count. If the rectangle still leaves the source at
/// a corner, as in a fisheye's circle, both axes shrink further. Without distortion, the source is returned.
/// Throws InputError if no such rectangle exists because the model folds over.
Camera undistorted_camera(const Camera& source, const Distortion& distortion);

/// The pixel in the image of `source` for a pixel of `camera`, whose image is the undistorted one.
glm::dvec2 source_pixel(const Camera& source, const Distortion& distortion, const Camera& camera,
                        const glm::dvec2& pixel);

/// The image of `camera`, sampled bilinearly from the image of `source`.
Image undistort_image(const Image& image, const Camera& source, const Distortion& distortion,
                      const Camera& camera);

}  // namespace ewa::scene
