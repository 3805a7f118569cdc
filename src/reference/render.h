// SPDX-License-Identifier: Apache-2.0
// The whole chain over a picture: project, order, list, blend; then loss and the way back.
#pragma once
#include <cstdint>
#include <vector>

#include "ewa/camera.h"
#include "ewa/gaussians.h"
#include "ewa/image.h"
#include "ewa/render_options.h"
#include "reference/blend.h"
#include "reference/blend_backward.h"
#include "reference/instances.h"
#include "reference/loss.h"
#include "reference/values.h"

namespace ewa::reference {

/// The twin's own choices, none of which changes the model: tile sizes change only speed and the lists.
struct TwinOptions {
    int tile_width = 16, tile_height = 16;  // px
    Smoothing smoothing;
};

struct Picture {
    std::vector<Projected> projected;  // one a splat
    std::vector<uint32_t> order;       // visible splats, nearest first
    Instances instances;
    Blended blended;
    uint32_t skipped_nonfinite = 0;
};

Picture render(const Values& values, const Camera& camera, const RenderOptions& options,
               const TwinOptions& twin = {});
Picture render(const Gaussians& gaussians, const Camera& camera, const RenderOptions& options,
               const TwinOptions& twin = {});

struct LossGradientTwin {
    double loss = 0, l1 = 0, ssim = 0;
    Values gradient;               // dL/d(stored value) in place of each stored value
    std::vector<uint8_t> in_view;  // one a splat: it had a tile
    Raster picture_gradient;       // dL/d(colour)
    BlendGradients blend;          // per splat, and the moments of each instance
    Picture picture;
};

/// target: RGB (further channels ignored), size of the camera.
LossGradientTwin loss_gradient(const Values& values, const Camera& camera, const Image& target,
                               const RenderOptions& options, const TwinOptions& twin = {});
LossGradientTwin loss_gradient(const Gaussians& gaussians, const Camera& camera, const Image& target,
                               const RenderOptions& options, const TwinOptions& twin = {});

}  // namespace ewa::reference
