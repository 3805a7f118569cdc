// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <span>

#include "bench/check.h"
#include "bench/gradient_distance.h"
#include "ewa/renderer.h"
#include "reference/adam.h"
#include "reference/render.h"
#include "shared/constants.h"

namespace ewa::bench {
namespace {

constexpr double kPixelBound = 1e-5;     // of all pixels but a few
constexpr double kPixelShare = 1e-3;     // that may exceed it
constexpr double kGradientBound = 1e-3;  // |actual - expected| / |expected|
constexpr double kAdamBound = 1e-3;      // of the learning rate

}  // namespace

bool within_twins_reach(const Case& one) {
    return one.splats <= 100000 && int64_t(one.width) * one.height <= 960 * 540;
}

std::vector<Check> check_picture(const FrameRun& run, const Scene& scene) {
    const auto twin = reference::render(scene.gaussians, scene.camera, run.options());
    const pipeline::Sizes& sizes = run.frame().sizes;
    const auto planes = run.frame().planes.download<float>(sizes.planes / 4);
    double worst = 0;
    uint64_t over = 0;
    for (int y = 0; y < scene.camera.height; ++y)
        for (int x = 0; x < scene.camera.width; ++x) {
            const size_t at = size_t(y) * sizes.stride + size_t(x);
            double error = 0;
            for (size_t c = 0; c < 3; ++c) {
                const double e =
                    std::abs(planes[c * sizes.plane_floats + at] - twin.blended.color.at(x, y)[c]);
                error = std::isfinite(e) ? std::max(error, e) : INFINITY;
            }
            worst = std::max(worst, error);
            over += !(error <= kPixelBound);
        }
    const double pixels = double(scene.camera.width) * scene.camera.height;
    return {{"picture: share of pixels off by more than 1e-5", double(over) / pixels, kPixelShare},
            {"picture: worst pixel", worst, shared::ALPHA_MIN + kPixelBound}};
}

std::vector<Check> check_gradient(std::shared_ptr<gpu::Device> device, const Scene& scene) {
    RenderOptions options;
    options.sh_degree = scene.gaussians.sh_degree;
    const LossGradient actual =
        loss_gradient(std::move(device), scene.gaussians, scene.camera, scene.photo, options);
    const auto expected = reference::loss_gradient(scene.gaussians, scene.camera, scene.photo, options);
    std::vector<Check> checks{{"loss", std::abs(actual.loss - expected.loss), 1e-5}};
    for_each_group(actual.gradient, expected.gradient, [&](const char* name, const auto& a, const auto& e) {
        checks.push_back(
            {std::string("gradient: ") + name + ", relative", relative_distance(a, e), kGradientBound});
    });
    return checks;
}

std::vector<Check> check_update(std::shared_ptr<gpu::Device> device, const Scene& scene) {
    // The first step moves nothing and leaves the gradient in the moments; the second meets the same
    // gradient.
    FrameRun run(std::move(device), scene, true);
    const Gaussians m = download_model(run.model(), run.model().moments1);
    const Gaussians v = download_model(run.model(), run.model().moments2);
    constexpr float kRate = 0.01f;
    pipeline::Rates rates{kRate, kRate, kRate, kRate, kRate, kRate, 2};
    run.set_rates(rates);
    run.run();
    const Gaussians moved = download_model(run.model(), run.model().params);
    double worst = 0;
    const auto compare = [&](const std::vector<float>& from, const std::vector<float>& m1,
                             const std::vector<float>& v1, const std::vector<float>& to) {
        for (size_t i = 0; i < from.size(); ++i) {
            // A second moment near float32's smallest numbers has lost its digits, and the step with them.
            if (v1[i] != 0 && v1[i] < 1e-30f) continue;
            reference::AdamState state(1);
            state.m[0] = m1[i];
            state.v[0] = v1[i];
            double value = from[i];
            const double gradient = m1[i] / (1 - shared::ADAM_BETA1);
            reference::adam_step(std::span(&value, 1), std::span(&gradient, 1), state, kRate, 2);
            worst = std::max(worst, std::abs(value - double(to[i])) / kRate);
        }
    };
    const Gaussians& g = scene.gaussians;
    compare(g.means, m.means, v.means, moved.means);
    compare(g.quaternions, m.quaternions, v.quaternions, moved.quaternions);
    compare(g.log_scales, m.log_scales, v.log_scales, moved.log_scales);
    compare(g.opacity_logits, m.opacity_logits, v.opacity_logits, moved.opacity_logits);
    compare(g.sh, m.sh, v.sh, moved.sh);
    return {{"Adam: step, shares of the rate", worst, kAdamBound}};
}

}  // namespace ewa::bench
