// SPDX-License-Identifier: Apache-2.0
// Depth maps of training images.
#pragma once
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>

#include "ewa/dataset.h"
#include "ewa/image.h"

namespace ewa {

/// Whether load_depth_map supports the frame's lens: a pinhole, or OpenCV's perspective model if images are undistorted.
bool takes_depth_map(const Frame& frame);

/// The frame's depth map as `frame.camera` sees it: one channel of view z in world units, 0 where the file has no depth (0,
/// negative, or not finite). The file may have another size than the image. Depths are sampled with depth_at, with a step of a
/// tenth. frame.depth_path: not empty. Throws InputError, also without takes_depth_map.
Image load_depth_map(const Frame& frame);

/// The depths of the points that the frame has seen, as an image of one channel: the nearest point of each pixel, 0 without a
/// point. Depths are view z, or the distance from the camera if scene::ordered_by_distance(lens). points: the dataset's, in world
/// coordinates. frame.seen: not null; indices into `points`.
Image depths_of_points(const Frame& frame, std::span<const glm::dvec3> points);

/// The depth at a position in px, 0 outside and where there is none. Bilinear where the four pixels around it differ by at most
/// `step`. At an edge of a surface, it is the depth of the nearest pixel, since a mean would be at no surface.
float depth_at(const Image& depth, const glm::vec2& at, float step);

/// Sets depths to 0 at pixels where the image's alpha, which includes masks, is below a half. Both images have the same size.
void drop_masked(Image& depths, const Image& photo);

}  // namespace ewa
