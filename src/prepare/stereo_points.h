// SPDX-License-Identifier: Apache-2.0
// Points where the images of a dataset agree on the depth, for datasets that have cameras alone.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "ewa/dataset.h"

namespace ewa::train {

struct StereoPoints {
    PointCloud cloud;
    size_t images = 0;  // that show them
};

/// About `count` points in the world: scene::sweep_planes of at most 96 frames, each with up to four others that see the same
/// from 2 to 30 degrees beside. A depth counts where two of them agree with it to 1.5 %, or one if there is but one. Masked
/// and transparent pixels do not count. No points where fewer than 1,000 depths count: the images show too little texture, are
/// smaller than 64 px, or are not those of pinholes with a global shutter, or all cameras are in one place. frames: of these.
/// background: behind transparent images. The seed decides which pixels. The result does not depend on the number of cores.
/// Throws InputError (an image that cannot be read).
StereoPoints points_by_stereo(const Dataset& dataset, const std::vector<int>& frames,
                              const std::array<float, 3>& background, uint32_t count, uint64_t seed);

}  // namespace ewa::train
