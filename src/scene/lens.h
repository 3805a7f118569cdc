// SPDX-License-Identifier: Apache-2.0
// Lens models: x right, y down, in units of the focal length (z = 1).
//
// Each takes a ray (x, y, 1) to a plane, q = (x, y) or for a fisheye q = angle * (x, y) / |(x, y)|, and bends
// that plane. With r2 = |q|^2 and T(q) = (2 p1 x y + p2 (r2 + 2 x^2), p1 (r2 + 2 y^2) + 2 p2 x y):
//   brown       q (1 + k1 r2 + k2 r2^2 + k3 r2^3) / (1 + k4 r2 + k5 r2^2 + k6 r2^3) + T(q)
//   fisheye     q (1 + k1 r2 + k2 r2^2 + k3 r2^3 + k4 r2^4) + T(q) + r2 (s1, s3)
//   fisheye624  p + T(p) + |p|^2 (s1 + |p|^2 s2, s3 + |p|^2 s4) with p = q (1 + k1 r2 + ... + k6 r2^6)
//   fov         q atan(2 r tan(k1 / 2)) / (r k1)
//   division    q 2 / (1 + sqrt(1 - 4 k1 r2)), the inverse of p / (1 + k1 |p|^2)
//   unified     q / (k1 sqrt(k2 r2 + 1) + 1 - k1)
// These are OpenCV's (calib3d, fisheye) and COLMAP's (src/colmap/sensor/models.h).
#pragma once
#include <glm/vec2.hpp>
#include <optional>

#include "ewa/dataset.h"

namespace ewa::scene {

/// Where a lens puts the ray (x, y, 1). Not finite where the model has no value.
glm::dvec2 distort(const Distortion& lens, glm::dvec2 ray);

/// The ray in front of the camera that a lens puts there. Newton's method from the axis outward, each step
/// cut so that it stays where the model is one to one: of several rays, it is the one that hangs together
/// with the axis. None where the model folds before it gets there, or where the ray comes from the side or
/// behind.
std::optional<glm::dvec2> undistort(const Distortion& lens, glm::dvec2 point);

/// Whether the model keeps the sense of rotation about that ray. Where it does not, it has folded over.
bool one_to_one(const Distortion& lens, glm::dvec2 ray);

}  // namespace ewa::scene
