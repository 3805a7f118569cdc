// SPDX-License-Identifier: Apache-2.0
#include "ewa/evaluation.h"

#include <chrono>
#include <cmath>

#include "ewa/error.h"
#include "ewa/renderer.h"

namespace ewa {

Evaluation evaluate(std::shared_ptr<gpu::Device> device, const Gaussians& gaussians, const Dataset& dataset,
                    const std::vector<int>& frames, const RenderOptions& options,
                    const std::vector<Exposure>& exposures, const std::function<void()>& before_frame) {
    const auto start = std::chrono::steady_clock::now();
    Renderer renderer(std::move(device), gaussians, options);
    Evaluation result;
    for (size_t i = 0; i < frames.size(); ++i) {
        if (before_frame) before_frame();
        const Frame& frame = dataset.frames[size_t(frames[i])];
        const auto [photo, weights] = load_training_image(frame, options.background);
        Image picture = renderer.render(frame.camera).color;
        if (!exposures.empty()) picture = exposed(std::move(picture), exposures.at(i));
        if (photo.width != picture.width || photo.height != picture.height)
            throw InputError("frame " + frame.name + ": the picture's size is not the camera's");
        const double db = psnr(picture, photo, weights);
        if (std::isnan(db)) continue;  // no pixel counts
        result.frames.push_back({frame.name, db, ssim(picture, photo, weights)});
    }
    for (const EvalFrame& frame : result.frames) {
        result.psnr += frame.psnr / double(result.frames.size());
        result.ssim += frame.ssim / double(result.frames.size());
    }
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return result;
}

}  // namespace ewa
