// SPDX-License-Identifier: Apache-2.0
// Depth maps of training images.
#pragma once
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>

#include "ewa/dataset.h"
#include "ewa/image.h"

namespace ewa {

/// Whether the frame's lens is one that load_depth_map takes: a pinhole, or OpenCV's perspective model, which is undistorted.
bool takes_depth_map(const Frame& frame);

/// The frame's depth map as `frame.camera` sees it: one channel of view z in world units, 0 where the file has no depth
/// (0, negative, or not finite). The file may have another size than the image. Depths are those of depth_at, where pixels
/// agree to a tenth. frame.depth_path: not empty. Throws InputError, also without takes_depth_map.
Image load_depth_map(const Frame& frame);

/// The depths of the points that the frame has seen, as an image of one channel: the nearest one of a pixel, 0 without. They are view z,
/// or the distance with scene::ordered_by_distance. points: the dataset's, in the world. frame.seen: not null, indices of them.
Image depths_of_points(const Frame& frame, std::span<const glm::dvec3> points);

/// The depth at a position in px, 0 outside and where there is none. Bilinear where the four pixels around it differ by at most
/// `step`. At an edge of something it is that of the nearest pixel: a mean would lie where nothing is.
float depth_at(const Image& depth, const glm::vec2& at, float step);

/// Sets the depth to 0 where the photo's alpha, a mask's too, is below a half. Both of one size.
void drop_masked(Image& depths, const Image& photo);

}  // namespace ewa
