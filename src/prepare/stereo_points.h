// SPDX-License-Identifier: Apache-2.0
// Points on whose depth the images of a dataset agree, for datasets with only cameras.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "ewa/dataset.h"

namespace ewa::train {

struct StereoPoints {
    PointCloud cloud;
    size_t images = 0;  // number of images that gave points
};

/// About `count` points in world coordinates, by scene::sweep_planes for at most 96 frames. Each frame is compared with up to four
/// others that see the same part of the scene from 2 to 30 degrees to the side. A depth counts if two of them agree with it to 1.5
/// %, or one if there is only one. Masked and transparent pixels do not count. Empty if fewer than 1,000 depths count. This happens
/// for images without texture, images below 64 px, cameras other than pinholes with a global shutter, or cameras in one position.
/// frames: indices into dataset.frames. background: RGB behind transparent images. The seed chooses the pixels. The number of cores
/// does not change the result. Throws InputError (an image that cannot be read).
StereoPoints points_by_stereo(const Dataset& dataset, const std::vector<int>& frames,
                              const std::array<float, 3>& background, uint32_t count, uint64_t seed);

}  // namespace ewa::train
