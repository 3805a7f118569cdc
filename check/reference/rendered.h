// SPDX-License-Identifier: Apache-2.0
// What the chain of an image leaves on the CPU: each pass's result, and the gradients.
#pragma once
#include <cstdint>
#include <vector>

#include "reference/blend.h"
#include "reference/loss.h"
#include "reference/values.h"

namespace ewa::reference {

/// Options of the CPU reference. The tile size changes only the lists and the speed, not the model.
struct ReferenceOptions {
    int tile_width = 16, tile_height = 16;  // px
    Smoothing smoothing;
    LossWeights loss{};
    Raster depths{};  // of the training image, with a weight of depth
};

struct Rendered {
    std::vector<Projected> projected;  // per splat
    std::vector<uint32_t> order;       // visible splats, nearest first
    Instances instances;
    Blended blended;
    uint32_t skipped_nonfinite = 0;
};

struct ReferenceGradient {
    double loss = 0, l1 = 0, l2 = 0, ssim = 0, alpha = 0, depth = 0;
    Values gradient;               // dL/d(stored value) for each stored value
    CameraMotion camera;           // dL/d(each value of the camera's motion), for no motion
    std::vector<uint8_t> in_view;  // per splat: it had a tile
    Raster image_gradient;         // dL/d(colour)
    BlendGradients blend;          // gradients of each splat, and moments of each instance
    Rendered rendered;
};

}  // namespace ewa::reference
