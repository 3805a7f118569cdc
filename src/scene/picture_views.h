// SPDX-License-Identifier: Apache-2.0
// Cameras and sample points of the views whose mean is an image with depth of field or motion blur. Cameras in the OpenCV
// convention.
#pragma once
#include <glm/vec2.hpp>

#include "ewa/camera.h"

namespace ewa::scene {

/// Whether moved_eye can move the camera: a pinhole with a global shutter.
bool has_movable_eye(const Camera& camera);

/// The camera with its eye moved by `offset` along its own x and y axes (world units). Its image shifts, so that points at the distance
/// `focus` along the camera's axis keep their pixels. focus > 0; the camera has a movable eye.
Camera moved_eye(Camera camera, const glm::dvec2& offset, double focus);

/// Point i of `count` points that cover the disc of radius 1 evenly: Vogel's spiral (Vogel 1979, "A better way to construct the
/// sunflower head"). 0 <= i < count.
glm::dvec2 disc_point(int i, int count);

/// Element i >= 0 of van der Corput's sequence in base 2, in [0, 1). The first elements are evenly spread for every count, and not
/// correlated with disc_point.
double even_share(int i);

}  // namespace ewa::scene
