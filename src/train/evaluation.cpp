// SPDX-License-Identifier: Apache-2.0
#include "train/evaluation.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "ewa/error.h"

namespace ewa {

namespace train {

Drawing drawing_of(std::shared_ptr<gpu::Device> device, const Gaussians& gaussians,
                   const RenderOptions& options) {
    const auto renderer = std::make_shared<Renderer>(std::move(device), gaussians, options);
    return {1, [renderer](std::span<const Camera> cameras) {
                std::vector<Image> images;
                for (const Camera& camera : cameras) images.push_back(renderer->render(camera).color);
                return images;
            }};
}

RenderedView with_photo(Image rendering, const Frame& frame, const RenderOptions& options,
                        const Exposure* exposure) {
    auto [photo, weights] = load_training_image(frame, options.background);
    if (exposure) rendering = exposed(std::move(rendering), *exposure);
    if (photo.width != rendering.width || photo.height != rendering.height)
        throw InputError("frame " + frame.name + ": the picture's size is not the camera's");
    return {std::move(photo), std::move(weights), std::move(rendering)};
}

Evaluation evaluate_views(const Drawing& drawing, const Dataset& dataset, const std::vector<int>& frames,
                          const RenderOptions& options, const std::vector<Exposure>& exposures,
                          const std::function<void()>& before_frame,
                          const std::function<void(size_t, const RenderedView&, const EvalFrame&)>& on_view) {
    const auto start = std::chrono::steady_clock::now();
    Evaluation result;
    std::vector<Image> drawn;
    for (size_t i = 0; i < frames.size(); ++i) {
        if (before_frame) before_frame();
        const size_t place = i % drawing.at_once;
        if (place == 0) {
            std::vector<Camera> cameras;
            for (size_t k = i; k < std::min(i + drawing.at_once, frames.size()); ++k)
                cameras.push_back(dataset.frames[size_t(frames[k])].camera);
            drawn = drawing.images(cameras);
        }
        const Frame& frame = dataset.frames[size_t(frames[i])];
        const RenderedView view = with_photo(std::move(drawn[place]), frame, options,
                                             exposures.empty() ? nullptr : &exposures.at(i));
        const double db = psnr(view.rendering, view.photo, view.weights);
        if (std::isnan(db)) continue;  // no pixel counts
        result.frames.push_back({frame.name, db, ssim(view.rendering, view.photo, view.weights)});
        if (on_view) on_view(i, view, result.frames.back());
    }
    for (const EvalFrame& frame : result.frames) {
        result.psnr += frame.psnr / double(result.frames.size());
        result.ssim += frame.ssim / double(result.frames.size());
    }
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return result;
}

}  // namespace train

Evaluation evaluate(std::shared_ptr<gpu::Device> device, const Gaussians& gaussians, const Dataset& dataset,
                    const std::vector<int>& frames, const RenderOptions& options,
                    const std::vector<Exposure>& exposures, const std::function<void()>& before_frame) {
    return train::evaluate_views(train::drawing_of(std::move(device), gaussians, options), dataset, frames,
                                 options, exposures, before_frame, {});
}

}  // namespace ewa
