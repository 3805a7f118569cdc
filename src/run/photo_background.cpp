// SPDX-License-Identifier: Apache-2.0
#include "run/photo_background.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <utility>

#include "core/parallel.h"
#include "scene/frame_images.h"
#include "train/schedule.h"

namespace ewa::train {
namespace {

constexpr size_t kMostImages = 16;
// Enough that splats become opaque, and so little that its gradients disturb few: docs/experiments/background.md has figures.
constexpr double kNoise = 0.4;
// The mean is rounded, so that the same photos in other sizes have the same background.
constexpr double kLevels = 100;

struct Sum {
    std::array<double, 3> color{};
    double weight = 0;
    bool transparent = false;
};

Sum sum_of(const Frame& frame) {
    const std::shared_ptr<const Image> read = scene::image_of(frame);
    const Image& image = *read;
    const bool has_alpha = image.channels == 4;
    Sum sum;
    for (size_t i = 0; i < image.pixels.size(); i += size_t(image.channels)) {
        const double alpha = has_alpha ? double(image.pixels[i + 3]) : 1;
        if (alpha < 1 && !frame.alpha_weighs()) sum.transparent = true;
        for (size_t c = 0; c < 3; ++c) sum.color[c] += alpha * double(image.pixels[i + c]);
        sum.weight += alpha;
    }
    return sum;
}

/// Nothing if a photo is transparent somewhere, or none has a pixel that counts.
std::optional<std::array<float, 3>> mean_colour(const Dataset& dataset, const std::vector<int>& frames) {
    const size_t count = std::min(kMostImages, frames.size());
    std::vector<const Frame*> read;
    for (size_t k = 0; k < count; ++k)
        read.push_back(&dataset.frames[size_t(frames[k * frames.size() / count])]);
    std::vector<Sum> sums(count);
    core::on_all_cores(
        count, [&](size_t k) { sums[k] = sum_of(*read[k]); }, scene::images_at_once(read));
    Sum all;
    for (const Sum& sum : sums) {
        all.transparent |= sum.transparent;
        all.weight += sum.weight;
        for (size_t c = 0; c < 3; ++c) all.color[c] += sum.color[c];
    }
    if (all.transparent || !(all.weight > 0)) return std::nullopt;
    std::array<float, 3> mean;
    for (size_t c = 0; c < 3; ++c) mean[c] = float(std::round(kLevels * all.color[c] / all.weight) / kLevels);
    return mean;
}

}  // namespace

void choose_background(RunOptions& options, const Dataset& dataset, const std::vector<int>& frames) {
    TrainOptions& train = options.train;
    const bool automatic = std::exchange(options.automatic_background, false);
    const bool chosen = train.sky || train.random_background || !has_opacities(train) ||
                        train.render.background != RenderOptions().background;
    // Where splats are still transparent, the noise would move cameras, and look like what single images show.
    if (!automatic || chosen || train.refine_poses || options.robust) return;
    const auto mean = mean_colour(dataset, frames);
    if (!mean) return;
    train.render.background = *mean;
    if (train.background_noise == 0) train.background_noise = kNoise;
}

}  // namespace ewa::train
