// SPDX-License-Identifier: Apache-2.0
#include "run/depth_evaluation.h"

#include <algorithm>
#include <cmath>

#include "ewa/error.h"
#include "ewa/renderer.h"
#include "scene/dataset_files.h"
#include "scene/depth_map.h"
#include "scene/methods.h"

namespace ewa::train {
namespace {

std::vector<const Frame*> frames_with_maps(const Dataset& dataset, const std::vector<int>& frames) {
    std::vector<const Frame*> found;
    for (const int i : frames)
        if (const Frame& frame = dataset.frames.at(size_t(i)); !frame.depth_path.empty())
            found.push_back(&frame);
    return found;
}

Image map_of(const Frame& frame) {
    Image map = load_depth_map(frame);
    drop_masked(map, load_frame_image(frame));
    return map;
}

void add(DepthErrors& sum, const DepthErrors& errors, double weight) {
    sum.median += weight * errors.median;
    sum.mean += weight * errors.mean;
    sum.within_1 += weight * errors.within_1;
    sum.within_5 += weight * errors.within_5;
}

}  // namespace

DepthErrors depth_errors(const Image& drawn, const Image& map) {
    std::vector<double> errors;
    for (size_t i = 0; i < map.pixels.size(); ++i) {
        const double d = double(map.pixels[i]);
        if (d > 0) errors.push_back(std::abs(double(drawn.pixels[i]) - d) / d);
    }
    DepthErrors out;
    const double share = 1 / double(errors.size());
    for (const double error : errors) {
        out.mean += share * error;
        out.within_1 += error <= 0.01 ? share : 0;
        out.within_5 += error <= 0.05 ? share : 0;
    }
    const size_t middle = errors.size() / 2;
    std::ranges::nth_element(errors, errors.begin() + std::ptrdiff_t(middle));
    out.median = errors[middle];
    return out;
}

void check_depth_evaluation(const Dataset& dataset, const std::vector<int>& frames,
                            const RenderOptions& options) {
    if (scene::method_of(options).no_surface)
        throw InputError(
            "--depth compares the surfaces of splats: neither --points nor other integrators draw them");
    const std::vector<const Frame*> with_maps = frames_with_maps(dataset, frames);
    if (with_maps.empty())
        throw InputError("--depth: none of these images has a depth map (see docs/formats.md, Depth maps)");
    load_depth_map(*with_maps.front());
}

DepthEvaluation evaluate_depths(std::shared_ptr<gpu::Device> device, const Gaussians& gaussians,
                                const Dataset& dataset, const std::vector<int>& frames,
                                const RenderOptions& options, const std::function<void()>& before_frame) {
    check_depth_evaluation(dataset, frames, options);
    Renderer renderer(std::move(device), gaussians, options);
    DepthEvaluation out;
    for (const Frame* frame : frames_with_maps(dataset, frames)) {
        if (before_frame) before_frame();
        const Image map = map_of(*frame);
        const auto pixels = size_t(std::ranges::count_if(map.pixels, [](float d) { return d > 0; }));
        if (pixels == 0) continue;
        const Image median = renderer.render(frame->camera, Drawing::median_depth).median_depth;
        const Image mean = renderer.render(frame->camera, true).depth;
        out.frames.push_back({frame->name, pixels, depth_errors(median, map), depth_errors(mean, map)});
    }
    if (out.frames.empty()) throw InputError("--depth: no depth map of these images has a depth");
    for (const DepthFrame& frame : out.frames) {
        add(out.median_depth, frame.median_depth, 1 / double(out.frames.size()));
        add(out.mean_depth, frame.mean_depth, 1 / double(out.frames.size()));
    }
    return out;
}

}  // namespace ewa::train
