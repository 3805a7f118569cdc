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

/// Errors are |D - d| / d over the pixels whose map has a depth d > 0. D is the depth of the render: where it has none, 0, the error is 1.
struct DepthErrors {
    double median = 0, mean = 0;
    double within_1 = 0, within_5 = 0;  // shares of pixels whose error is at most 1 % and 5 %
};

/// Both of one channel and one size, and d > 0 somewhere.
DepthErrors depth_errors(const Image& drawn, const Image& map);

struct DepthFrame {
    std::string name;                      // Frame::name
    size_t pixels = 0;                     // with a depth in the map
    DepthErrors median_depth, mean_depth;  // of Rendering::median_depth and ::depth
};
struct DepthEvaluation {
    std::vector<DepthFrame> frames;        // those whose map has a depth
    DepthErrors median_depth, mean_depth;  // means over the frames
};

/// Throws InputError where the options draw no depth, none of the frames has a depth map, or the first map cannot be used.
void check_depth_evaluation(const Dataset& dataset, const std::vector<int>& frames,
                            const RenderOptions& options);

/// Draws the depth of each frame that has a depth map. Masked pixels do not count. frames: indices into dataset.frames.
/// before_frame: called before each. Throws as check_depth_evaluation, and InputError where no map has a depth.
DepthEvaluation evaluate_depths(std::shared_ptr<gpu::Device> device, const Gaussians& gaussians,
                                const Dataset& dataset, const std::vector<int>& frames,
                                const RenderOptions& options, const std::function<void()>& before_frame = {});

}  // namespace ewa::train
