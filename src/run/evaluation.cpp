// SPDX-License-Identifier: Apache-2.0
#include "run/evaluation.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/typing.h"
#include "ewa/error.h"
#include "image/metric.h"
#include "image/pillow.h"

namespace ewa {

namespace train {

ViewRenderer view_renderer_of(std::shared_ptr<gpu::Device> device, const Gaussians& gaussians,
                              const RenderOptions& options) {
    const auto renderer = std::make_shared<Renderer>(std::move(device), gaussians, options);
    return {1, [renderer](std::span<const Camera> cameras) {
                std::vector<Image> images;
                for (const Camera& camera : cameras) images.push_back(renderer->render(camera).color);
                return images;
            }};
}

RenderedView with_photo(Image rendering, const Frame& frame, const RenderOptions& options,
                        const Appearance* appearance) {
    auto [photo, weights] = load_training_image(frame, options.background);
    if (appearance) rendering = with_appearance(std::move(rendering), *appearance);
    if (photo.width != rendering.width || photo.height != rendering.height)
        throw InputError("frame " + frame.name + ": the picture's size is not the camera's");
    return {std::move(photo), std::move(weights), std::move(rendering)};
}

namespace {

/// The nearest of 255 levels, as Python's float32 images become bytes. NaN becomes 0.
float level(float value, bool round_down) {
    const float levels = 255 * (value > 0 ? std::min(value, 1.0f) : 0.0f);
    return std::floor(round_down ? levels : levels + 0.5f) / 255;
}

/// Both evaluations cut the fraction off after compositing.
Image composited(const Image& image, const std::array<float, 3>& background) {
    Image result(image.width, image.height, 3);
    for (size_t i = 0; 4 * i < image.pixels.size(); ++i) {
        const double alpha = double(image.pixels[4 * i + 3]);
        for (size_t c = 0; c < 3; ++c) {
            const double color = std::round(255 * double(image.pixels[4 * i + c])) / 255;
            const double mixed = color * alpha + double(background[c]) * (1 - alpha);
            result.pixels[3 * i + c] = float(std::floor(255 * std::min(mixed, 1.0) + 1e-6)) / 255;
        }
    }
    return result;
}

Image channels_between(const Image& image, int first, int end) {
    Image result(image.width, image.height, end - first);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            std::copy(image.at(x, y) + first, image.at(x, y) + end, result.at(x, y));
    return result;
}

/// As with_photo, as another protocol than ewa's compares a frame.
RenderedView view_of_protocol(Protocol protocol, Image rendering, const Frame& frame,
                              const RenderOptions& options, const Appearance* appearance) {
    const bool inria = protocol == Protocol::inria;
    if (appearance) rendering = with_appearance(std::move(rendering), *appearance);
    for (float& value : rendering.pixels) value = level(value, !inria);
    Frame unscaled = frame;
    if (inria) unscaled.downscale = 1;
    Image photo = load_frame_image(unscaled), weights;
    if (photo.channels == 4 && frame.alpha_weighs()) {
        weights = channels_between(photo, 3, 4);
        if (inria) weights = downscale(weights, frame.downscale);
        photo = channels_between(photo, 0, 3);
    } else if (photo.channels == 4) {
        photo = composited(photo, options.background);
    }
    for (float& value : photo.pixels) value = level(value, false);
    if (inria && frame.downscale > 1)
        photo = image::resized_as_pillow(photo, frame.camera.width, frame.camera.height);
    if (photo.width != rendering.width || photo.height != rendering.height)
        throw InputError("frame " + frame.name + ": the picture's size is not the camera's");
    return {std::move(photo), std::move(weights), std::move(rendering)};
}

}  // namespace

NewViewAppearance new_view_appearance(const std::vector<Appearance>& learned, const Dataset& dataset,
                                      const std::vector<int>& train) {
    std::vector<glm::dvec3> centers;
    if (!learned.empty())
        for (const int frame : train) centers.push_back(dataset.frames[size_t(frame)].camera.position());
    return NewViewAppearance(learned, std::move(centers));
}

std::vector<Appearance> for_new_views(const NewViewAppearance& appearance, const Dataset& dataset,
                                      const std::vector<int>& frames) {
    std::vector<Appearance> found;
    for (const int frame : frames)
        if (auto of_view = appearance.at(dataset.frames[size_t(frame)].camera.position()))
            found.push_back(std::move(*of_view));
    return found;
}

Measures measures_of(const RunOptions& options) {
    Measures measures;
    if (!options.metrics.empty()) measures.meter = Meter(metrics_named(options.metrics));
    return measures;
}

namespace {

struct JudgedView {
    RenderedView view;
    EvalFrame figures;
};

/// Draws on the device while another thread reads and compares the view before: both take about as long.
class ViewComparison {
  public:
    ViewComparison(const RenderOptions& options, const Measures& measures, bool psnr_alone)
        : options_(options), measures_(measures), psnr_alone_(psnr_alone) {}

    void start(Image drawn, const Frame& frame, const Appearance* appearance) {
        judged_ =
            std::async(std::launch::async, [this, &frame, appearance, drawn = std::move(drawn)]() mutable {
                return judge(std::move(drawn), frame, appearance);
            });
    }
    bool started() const { return judged_.valid(); }
    JudgedView result() { return judged_.get(); }

  private:
    JudgedView judge(Image drawn, const Frame& frame, const Appearance* appearance) const {
        JudgedView judged;
        judged.view =
            measures_.protocol == Protocol::ewa
                ? with_photo(std::move(drawn), frame, options_, appearance)
                : view_of_protocol(measures_.protocol, std::move(drawn), frame, options_, appearance);
        const auto& [photo, weights, rendering] = judged.view;
        judged.figures = {frame.name, psnr(rendering, photo, weights), 0, {}};
        if (std::isnan(judged.figures.psnr) || psnr_alone_) return judged;
        const auto similarity = measures_.protocol == Protocol::nerfbaselines ? image::ssim_valid : ewa::ssim;
        judged.figures.ssim = similarity(rendering, photo, weights);
        judged.figures.figures = measures_.meter.measure(rendering, photo, weights);
        return judged;
    }

    const RenderOptions& options_;
    const Measures& measures_;
    bool psnr_alone_;
    std::future<JudgedView> judged_;  // last: it uses the others
};

}  // namespace

Evaluation evaluate_views(const ViewRenderer& renderer, const Dataset& dataset,
                          const std::vector<int>& frames, const RenderOptions& options,
                          const std::vector<Appearance>& appearances,
                          const std::function<void()>& before_frame,
                          const std::function<void(size_t, const RenderedView&, const EvalFrame&)>& on_view,
                          const Measures& measures, bool psnr_alone) {
    const auto start = std::chrono::steady_clock::now();
    Evaluation result;
    std::vector<Image> drawn;
    ViewComparison comparison(options, measures, psnr_alone);
    const auto take = [&](size_t i) {
        JudgedView judged = comparison.result();
        if (std::isnan(judged.figures.psnr)) return;  // no pixel counts
        result.frames.push_back(std::move(judged.figures));
        if (on_view) on_view(i, judged.view, result.frames.back());
    };
    for (size_t i = 0; i < frames.size(); ++i) {
        if (before_frame) before_frame();
        const size_t place = i % renderer.at_once;
        if (place == 0) {
            std::vector<Camera> cameras;
            for (size_t k = i; k < std::min(i + renderer.at_once, frames.size()); ++k)
                cameras.push_back(dataset.frames[size_t(frames[k])].camera);
            drawn = renderer.images(cameras);
        }
        if (comparison.started()) take(i - 1);
        comparison.start(std::move(drawn[place]), dataset.frames[size_t(frames[i])],
                         appearances.empty() ? nullptr : &appearances.at(i));
    }
    if (comparison.started()) take(frames.size() - 1);
    const double none = result.frames.empty() ? std::nan("") : 0.0;
    result.psnr = result.ssim = none;
    if (!psnr_alone)
        for (const std::string& name : measures.meter.names()) result.figures.push_back({name, none});
    for (const EvalFrame& frame : result.frames) {
        for (size_t k = 0; k < frame.figures.size(); ++k)
            result.figures[k].value += frame.figures[k].value / double(result.frames.size());
        result.psnr += frame.psnr / double(result.frames.size());
        result.ssim += frame.ssim / double(result.frames.size());
    }
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return result;
}

}  // namespace train

Evaluation evaluate(std::shared_ptr<gpu::Device> device, const Gaussians& gaussians, const Dataset& dataset,
                    const std::vector<int>& frames, const RenderOptions& options,
                    const std::vector<Appearance>& appearances, const std::function<void()>& before_frame,
                    const Measures& measures) {
    check(dataset, frames);
    for (const Appearance& each : appearances) check(each);
    if (!appearances.empty() && appearances.size() != frames.size())
        throw InputError(core::counted(appearances.size(), "appearance") + " for " +
                         core::counted(frames.size(), "frame"));
    return train::evaluate_views(train::view_renderer_of(std::move(device), gaussians, options), dataset,
                                 frames, options, appearances, before_frame, {}, measures);
}

}  // namespace ewa
