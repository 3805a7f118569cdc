// SPDX-License-Identifier: Apache-2.0
#include "train/appearance_choice.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "scene/statistics.h"

namespace ewa::train {
namespace {

constexpr size_t kMostImages = 64, kMostPoints = 4000, kLeastPoints = 32;
// Colours nearer to black or white say little of a factor between them.
constexpr double kDark = 24 / 255.0, kBright = 240 / 255.0;
// The root mean squares from which learning pays (docs/training.md "Appearance").
constexpr double kStopsToLearn = 0.12, kColorToLearn = 0.06;

/// Medians over the points of log2(image / point) for red, green and blue. NaN if the image shows too few of them.
std::array<double, 3> ratios_of(const Dataset& dataset, const Frame& frame) {
    const Image image = load_training_image(frame, {}).image;
    const PointCloud& points = dataset.points;
    const size_t stride = std::max<size_t>(1, points.positions.size() / kMostPoints);
    std::array<std::vector<double>, 3> ratios;
    for (size_t i = 0; i < points.positions.size(); i += stride) {
        const glm::dvec3 p = frame.camera.rotation * points.positions[i] + frame.camera.translation;
        if (!(p.z > 0)) continue;
        const double x = frame.camera.fx * p.x / p.z + frame.camera.cx;
        const double y = frame.camera.fy * p.y / p.z + frame.camera.cy;
        if (!(x >= 0 && y >= 0 && x < image.width && y < image.height)) continue;
        const float* pixel = image.at(int(x), int(y));
        const auto within = [](double v) { return v >= kDark && v <= kBright; };
        std::array<double, 3> ratio;
        bool usable = true;
        for (size_t c = 0; c < 3; ++c) {
            const double own = double(pixel[c]), usual = points.colors[i][c] / 255.0;
            usable = usable && within(own) && within(usual);
            ratio[c] = std::log2(own / usual);
        }
        for (size_t c = 0; usable && c < 3; ++c) ratios[c].push_back(ratio[c]);
    }
    std::array<double, 3> medians;
    medians.fill(std::numeric_limits<double>::quiet_NaN());
    if (ratios[0].size() < kLeastPoints) return medians;
    for (size_t c = 0; c < 3; ++c) medians[c] = scene::quantile(ratios[c], 0.5);
    return medians;
}

double root_mean_square(const std::vector<double>& values) {
    double mean = 0, sum = 0;
    for (const double value : values) mean += value / double(values.size());
    for (const double value : values) sum += (value - mean) * (value - mean);
    return values.empty() ? 0 : std::sqrt(sum / double(values.size()));
}

}  // namespace

Disagreement disagreement_of(const Dataset& dataset, const std::vector<int>& frames) {
    const size_t count = std::min(frames.size(), kMostImages);
    if (dataset.points.positions.size() < kLeastPoints ||
        dataset.points.colors.size() != dataset.points.positions.size())
        return {};
    std::vector<std::array<double, 3>> ratios(count);
    core::on_all_cores(count, [&](size_t k) {
        ratios[k] = ratios_of(dataset, dataset.frames[size_t(frames[k * frames.size() / count])]);
    });
    std::vector<double> exposures, reds, blues;
    for (const auto& [red, green, blue] : ratios) {
        if (!std::isfinite(green)) continue;
        exposures.push_back((red + green + blue) / 3);
        reds.push_back(red - green);
        blues.push_back(blue - green);
    }
    return {int(exposures.size()), root_mean_square(exposures),
            std::max(root_mean_square(reds), root_mean_square(blues))};
}

AppearanceChoice choose_appearance(const Disagreement& found) {
    if (found.images < 2) return {AppearanceModel::none, "there are no points on which images could agree"};
    const bool learn = found.exposure >= kStopsToLearn || found.color >= kColorToLearn;
    return {learn ? AppearanceModel::ppisp : AppearanceModel::none,
            fmt::format("{} images differ by {:.2f} stops, and by {:.2f} between colours", found.images,
                        found.exposure, found.color)};
}

}  // namespace ewa::train
