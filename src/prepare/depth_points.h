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
/// Adds at most `count` points in the world, spread over the pixels with a depth, with their colours. seed, index: decide which.
void add_points(const ImageWithDepths& from, uint32_t count, uint64_t seed, uint32_t index,
                PointCloud& points);

/// About `count` points in the world: as many of each frame with a depth map, spread over its pixels with a depth, with the image's
/// colours. Frames without one have none, nor do those whose lens has no depth maps. The seed decides which pixels. Throws InputError.
PointCloud points_of_depth_maps(const Dataset& dataset, const std::vector<int>& frames, uint32_t count,
                                uint64_t seed);

}  // namespace ewa::train
