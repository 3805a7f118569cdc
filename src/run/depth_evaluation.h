// SPDX-License-Identifier: Apache-2.0
// How far the depth of renders is from the dataset's depth maps.
#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/device.h"
#include "ewa/gaussians.h"
#include "ewa/image.h"
#include "ewa/render_options.h"

namespace ewa::train {

/// Relative depth errors |D - d| / d over the pixels with a depth d > 0 in the depth map. D is the depth of the render. Where the
/// render has no depth, D is 0 and the error is 1.
struct DepthErrors {
    double median = 0, mean = 0;
    double within_1 = 0, within_5 = 0;  // shares of pixels whose error is at most 1 % and 5 %
};

/// The errors of one frame. Both images have one channel and the same size. `map` has a depth above 0 at some pixel.
DepthErrors depth_errors(const Image& drawn, const Image& map);

struct DepthFrame {
    std::string name;                      // Frame::name
    size_t pixels = 0;                     // pixels with a depth in the depth map
    DepthErrors median_depth, mean_depth;  // of Rendering::median_depth and ::depth
};
struct DepthEvaluation {
    std::vector<DepthFrame> frames;        // frames with a depth in their depth map
    DepthErrors median_depth, mean_depth;  // means over the frames
};

/// Throws InputError if the options draw no depth, no frame has a depth map, or the first depth map cannot be used.
void check_depth_evaluation(const Dataset& dataset, const std::vector<int>& frames,
                            const RenderOptions& options);

/// Renders the depth of each frame that has a depth map, and measures its errors. Masked pixels do not count. frames: indices into
/// dataset.frames. before_frame: called before each frame. Throws as check_depth_evaluation does, and InputError if no depth map
/// has a depth.
DepthEvaluation evaluate_depths(std::shared_ptr<gpu::Device> device, const Gaussians& gaussians,
                                const Dataset& dataset, const std::vector<int>& frames,
                                const RenderOptions& options, const std::function<void()>& before_frame = {});

}  // namespace ewa::train
