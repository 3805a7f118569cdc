// SPDX-License-Identifier: Apache-2.0
// Points on the surfaces in a dataset's depth maps.
#pragma once
#include <cstdint>
#include <vector>

#include "ewa/dataset.h"

namespace ewa::train {

/// Whether one of the frames has a depth map and a lens for which takes_depth_map is true.
bool has_depth_maps(const Dataset& dataset, const std::vector<int>& frames);

/// An image, its depths (view z, 0 for none) and its pinhole, all of one size.
struct ImageWithDepths {
    const Camera& camera;
    const Image& image;
    const Image& depths;
};
/// Adds at most `count` points in world coordinates, spread over the pixels with a depth, with the pixels' colours. seed and index
/// determine the choice of pixels.
void add_points(const ImageWithDepths& from, uint32_t count, uint64_t seed, uint32_t index,
                PointCloud& points);

/// About `count` points in world coordinates, with colours. Each frame with a depth map gives the same number, spread over its pixels
/// with a depth. Frames whose lens allows no depth maps give none. The seed chooses the pixels. Throws InputError.
PointCloud points_of_depth_maps(const Dataset& dataset, const std::vector<int>& frames, uint32_t count,
                                uint64_t seed);

}  // namespace ewa::train
