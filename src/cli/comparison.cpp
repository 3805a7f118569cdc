// SPDX-License-Identifier: Apache-2.0
#include "cli/comparison.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "ewa/renderer.h"
#include "scene/framing.h"

namespace ewa::cli {
namespace {

constexpr int kSidePixels = 512;

/// In dB: the lower of the PSNR and the RMS error over all values.
double nearness(const ImageDifference& d) {
    if (std::isnan(d.psnr) || std::isnan(d.rms_error)) return std::nan("");
    return std::min(d.psnr, -20 * std::log10(d.rms_error));
}

}  // namespace

Compared compared(const std::string& name, const Image& a, const Image& b, const Meter& meter) {
    Compared out{name, compare_images(a, b)};
    if (!meter.empty()) out.figures = meter.measure(a, b);
    return out;
}

std::vector<Compared> compared_all_round(const Gaussians& a, const Gaussians& b, const RenderOptions& options,
                                         int sides) {
    scene::FramingHints hints;
    hints.all_round = true;
    const scene::Framing framing = scene::frame_scene(a, kSidePixels, kSidePixels, hints);
    const auto side = [&](int i) {
        return scene::orbited(framing.camera, framing.target, framing.up, 2 * std::numbers::pi * i / sides);
    };
    std::vector<Image> images;
    Renderer renderer(open_device({}), a, options);
    for (int i = 0; i < sides; ++i) images.push_back(renderer.render(side(i)).color);
    renderer.replace(b);
    std::vector<Compared> all;
    for (int i = 0; i < sides; ++i)
        all.push_back(
            compared("side " + std::to_string(i), images[size_t(i)], renderer.render(side(i)).color));
    return all;
}

CompareTotals totals_of(const std::vector<Compared>& all) {
    CompareTotals out;
    for (const Figure& figure : all.front().figures) out.figures.push_back({figure.name, 0});
    for (const Compared& one : all) {
        for (size_t k = 0; k < out.figures.size(); ++k)
            out.figures[k].value += one.figures[k].value / double(all.size());
        out.psnr += one.difference.psnr / double(all.size());
        out.ssim += one.difference.ssim / double(all.size());
        out.max_error = std::max(out.max_error, one.difference.max_error);
        // NaN is the worst, and stays.
        if (!std::isnan(out.rms) && !(one.difference.rms_error <= out.rms))
            out.rms = one.difference.rms_error;
        out.passed = out.passed && one.failed.empty();
        if (!out.worst || !(nearness(one.difference) >= nearness(out.worst->difference))) out.worst = &one;
    }
    return out;
}

report::Json finite_number(double value) {
    return std::isfinite(value) ? report::Json(value) : report::Json();
}

}  // namespace ewa::cli
