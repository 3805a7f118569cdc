// SPDX-License-Identifier: Apache-2.0
// Points where the depth maps of a dataset are.
#pragma once
#include <cstdint>
#include <vector>

#include "ewa/dataset.h"

namespace ewa::train {

/// Whether one of the frames has a depth map that its lens allows.
bool has_depth_maps(const Dataset& dataset, const std::vector<int>& frames);

/// An image, its depths (view z, 0 for none) and its pinhole, all of one size.
struct ImageWithDepths {
    const Camera& camera;
    const Image& image;
    const Image& depths;
};
/// Adds at most `count` points in world coordinates, spread over the pixels with a depth, with their colours. seed, index: choose them.
void add_points(const ImageWithDepths& from, uint32_t count, uint64_t seed, uint32_t index,
                PointCloud& points);

/// About `count` points in world coordinates, with colours. Each frame with a depth map gives the same number, spread over its pixels
/// with a depth. Frames whose lens allows no depth maps give none. The seed chooses the pixels. Throws InputError.
PointCloud points_of_depth_maps(const Dataset& dataset, const std::vector<int>& frames, uint32_t count,
                                uint64_t seed);

}  // namespace ewa::train
