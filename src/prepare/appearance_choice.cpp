// SPDX-License-Identifier: Apache-2.0
#include "prepare/appearance_choice.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "core/parallel.h"
#include "image/image_files.h"
#include "scene/frame_images.h"
#include "scene/native_lens.h"
#include "scene/statistics.h"

namespace ewa::train {
namespace {

constexpr size_t kMostImages = 64, kMostPoints = 200'000, kLeastPoints = 32;
// Points hide others behind them in a cell of the image.
constexpr int kCellsAcross = 64;
constexpr float kHiddenBehind = 1.1f;  // of the nearest depth in the cell
// Colours nearer to black or white say little of a factor between them.
constexpr double kDark = 24 / 255.0, kBright = 240 / 255.0;
// Brightness of an image and of the points that it shows: a smaller correlation says that they have nothing in common. Rendered
// captures have 0.3 or more, random colours under 0.06 (1,000 points).
constexpr double kLeastCorrelation = 0.15, kDeviationsOfChance = 3;
// The root mean squares from which learning pays (docs/experiments/appearance.md).
constexpr double kStopsToLearn = 0.12, kColorToLearn = 0.06;
// A factor of light is this power of it in stored values: the exponent of sRGB is about 1 / 2.2.
constexpr double kStored = 1 / 2.2;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// A value with its standard error.
struct Measured {
    double value = kUnknown, error = 0;
};
enum : size_t { kExposure, kRed, kBlue, kQuantities };  // stops; red and blue against green
using Measures = std::array<Measured, kQuantities>;

struct SeenPoint {
    size_t point;
    int x, y;     // px
    float depth;  // world units
};

std::vector<SeenPoint> seen_points(const Camera& camera, const PointCloud& points) {
    const int cell = std::max(1, camera.width / kCellsAcross);
    const int columns = camera.width / cell + 1;
    std::vector<float> nearest(size_t(columns) * size_t(camera.height / cell + 1),
                               std::numeric_limits<float>::infinity());
    const auto nearest_at = [&](int x, int y) -> float& {
        return nearest[size_t(y / cell) * size_t(columns) + size_t(x / cell)];
    };
    const double limit = scene::lens_limit(camera);
    const size_t stride = (points.positions.size() + kMostPoints - 1) / kMostPoints;
    std::vector<SeenPoint> seen;
    for (size_t i = 0; i < points.positions.size(); i += stride) {
        const glm::dvec3 p = camera.rotation * points.positions[i] + camera.translation;
        const auto pixel = scene::pixel_of(camera, limit, p);
        if (!pixel ||
            !(pixel->x >= 0 && pixel->y >= 0 && pixel->x < camera.width && pixel->y < camera.height))
            continue;
        const auto distance =
            float(scene::ordered_by_distance(camera.distortion.lens) ? glm::length(p) : p.z);
        seen.push_back({i, int(pixel->x), int(pixel->y), distance});
        float& depth = nearest_at(int(pixel->x), int(pixel->y));
        depth = std::min(depth, distance);
    }
    std::erase_if(seen, [&](const SeenPoint& p) { return p.depth > kHiddenBehind * nearest_at(p.x, p.y); });
    return seen;
}

/// The median, and its standard error where the values are normal but for some outliers.
Measured median_of(std::vector<double>& values) {
    constexpr double kOfMedian = 1.2533;  // sqrt(pi / 2), of a normal distribution
    const auto [median, deviation] = scene::center_of(values);
    return {median, kOfMedian * deviation / std::sqrt(double(values.size()))};
}

/// Whether the values go together: more than by chance, or because both are constant.
bool are_related(const std::vector<double>& a, const std::vector<double>& b) {
    constexpr double kConstant = 1e-6;  // a variance
    const double count = double(a.size());
    double mean_a = 0, mean_b = 0, aa = 0, bb = 0, ab = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        mean_a += a[i] / count;
        mean_b += b[i] / count;
    }
    for (size_t i = 0; i < a.size(); ++i) {
        aa += (a[i] - mean_a) * (a[i] - mean_a) / count;
        bb += (b[i] - mean_b) * (b[i] - mean_b) / count;
        ab += (a[i] - mean_a) * (b[i] - mean_b) / count;
    }
    if (aa < kConstant && bb < kConstant) return true;
    return ab > std::max(kLeastCorrelation, kDeviationsOfChance / std::sqrt(count)) * std::sqrt(aa * bb);
}

/// log2 of each 8-bit level, as a share of white.
std::array<double, 256> logarithms() {
    std::array<double, 256> all;
    for (size_t level = 0; level < all.size(); ++level) all[level] = std::log2(double(level) / 255.0);
    return all;
}

/// What the frame's image is against the points that it shows: log2(image / point), as medians. Unknown where the points are too
/// few, or do not have the colours of the image.
Measures against_points(const Dataset& dataset, const Frame& frame) {
    const std::shared_ptr<const Image> read = scene::image_of(frame);
    const Image& image = *read;
    static const std::array<double, 256> log_of = logarithms();
    std::array<std::vector<double>, kQuantities> values;
    std::vector<double> own, usual;
    const std::vector<SeenPoint> seen = seen_points(frame.camera, dataset.points);
    const auto pixel_at = [&](const SeenPoint& p) {
        return image.at(std::min(p.x, image.width - 1), std::min(p.y, image.height - 1));
    };
    constexpr size_t kAhead = 16;  // points, whose pixels come from memory meanwhile
    for (size_t i = 0; i < seen.size(); ++i) {
        if (i + kAhead < seen.size()) __builtin_prefetch(pixel_at(seen[i + kAhead]));
        const SeenPoint& p = seen[i];
        const float* pixel = pixel_at(p);
        const auto& color = dataset.points.colors[p.point];
        const auto usable = [&](int c) {
            const double there = double(pixel[c]), expected = color[c] / 255.0;
            return there >= kDark && there <= kBright && expected >= kDark && expected <= kBright;
        };
        if (!usable(0) || !usable(1) || !usable(2) || (image.channels == 4 && pixel[3] < 1)) continue;
        std::array<double, 3> ratio;
        for (size_t c = 0; c < 3; ++c) ratio[c] = std::log2(double(pixel[c]) * 255 / color[c]);
        const double expected = (log_of[color[0]] + log_of[color[1]] + log_of[color[2]]) / 3;
        values[kExposure].push_back((ratio[0] + ratio[1] + ratio[2]) / 3);
        values[kRed].push_back(ratio[0] - ratio[1]);
        values[kBlue].push_back(ratio[2] - ratio[1]);
        usual.push_back(expected);
        own.push_back(expected + values[kExposure].back());
    }
    if (own.size() < kLeastPoints || !are_related(own, usual)) return {};
    Measures measures;
    for (size_t q = 0; q < kQuantities; ++q) measures[q] = median_of(values[q]);
    return measures;
}

struct Found {
    std::vector<Measures> each = {};  // of the frames
    bool by_exif = false;
    int known() const {
        return int(
            std::ranges::count_if(each, [](const Measures& m) { return std::isfinite(m[kExposure].value); }));
    }
};

Found measure(const Dataset& dataset, const std::vector<int>& frames) {
    const std::vector<const Frame*> all = scene::frames_at(dataset, frames);
    Found found{std::vector<Measures>(frames.size())};
    if (dataset.points.colors.size() == dataset.points.positions.size() && !dataset.points.colors.empty())
        core::on_all_cores(
            frames.size(), [&](size_t k) { found.each[k] = against_points(dataset, *all[k]); },
            scene::images_at_once(all));
    if (found.known() >= 2) return found;
    found.by_exif = true;
    for (size_t k = 0; k < frames.size(); ++k)
        if (const auto stops = image::shot_of(all[k]->image_path).exposure)
            found.each[k] = {Measured{*stops * kStored}, Measured{0}, Measured{0}};
    return found;
}

/// How a quantity differs between the images that have it.
struct Spread {
    int images = 0;
    double mean = 0, variance = 0;
    double true_variance = 0;  // without what the errors of the values explain
};

Spread spread_of(const std::vector<Measures>& each, size_t quantity) {
    Spread spread;
    double errors = 0;
    for (const Measures& measures : each) {
        const Measured& m = measures[quantity];
        if (!std::isfinite(m.value)) continue;
        // Welford's sums.
        const double before = m.value - spread.mean;
        spread.mean += before / ++spread.images;
        spread.variance += before * (m.value - spread.mean);
        errors += m.error * m.error;
    }
    spread.variance /= std::max(1, spread.images);
    spread.true_variance = std::max(0.0, spread.variance - errors / std::max(1, spread.images));
    return spread;
}

}  // namespace

std::vector<int> compared_frames(const std::vector<int>& frames) {
    const size_t count = std::min(frames.size(), kMostImages);
    std::vector<int> some;
    for (size_t k = 0; k < count; ++k) some.push_back(frames[k * frames.size() / count]);
    return some;
}

Disagreement disagreement_of(const Dataset& dataset, const std::vector<int>& frames) {
    const Found found = measure(dataset, compared_frames(frames));
    const Spread exposures = spread_of(found.each, kExposure);
    const auto differ = [&](size_t quantity) {
        return std::sqrt(spread_of(found.each, quantity).true_variance);
    };
    return {exposures.images, differ(kExposure), std::max(differ(kRed), differ(kBlue)), found.by_exif};
}

std::vector<float> first_exposures(const Dataset& dataset, const std::vector<int>& frames) {
    const Found found = measure(dataset, frames);
    const Spread spread = spread_of(found.each, kExposure);
    // The best linear estimate where a part of the variance is error.
    const double trust = spread.variance > 0 ? spread.true_variance / spread.variance : 0;
    std::vector<float> stops;
    for (const Measures& measures : found.each) {
        const double value = measures[kExposure].value;
        stops.push_back(std::isfinite(value) ? float(trust * (value - spread.mean)) : 0.0f);
    }
    return stops;
}

AppearanceChoice choose_appearance(const TrainOptions& options, const Dataset& dataset,
                                   const std::vector<int>& frames) {
    if (options.bands > 1) return {AppearanceModel::none, "--bands cuts the images"};
    if (frames.size() < 2) return {AppearanceModel::none, "there are no two training images"};
    const Disagreement found = disagreement_of(dataset, frames);
    if (found.images < 2) return {AppearanceModel::none, "neither points nor EXIF say how the images differ"};
    const bool learn = found.exposure >= kStopsToLearn || found.color >= kColorToLearn;
    std::string reason = fmt::format("{} images differ by {:.2f} stops", found.images, found.exposure);
    reason +=
        found.by_exif ? ", as their EXIF says" : fmt::format(", and by {:.2f} between colours", found.color);
    return {learn ? AppearanceModel::ppisp : AppearanceModel::none, reason};
}

}  // namespace ewa::train
