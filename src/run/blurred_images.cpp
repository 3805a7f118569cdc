// SPDX-License-Identifier: Apache-2.0
#include "run/blurred_images.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "image/metric.h"
#include "scene/frame_images.h"
#include "scene/statistics.h"

namespace ewa::train {
namespace {

// How far above the median a blur effect is no accident: standard deviations of a normal distribution, by the median absolute
// deviation, and at least a value that motion over 3 px exceeds.
constexpr double kDeviations = 4, kLeastBlur = 0.05, kPerMad = 1.4826;

}  // namespace

std::vector<int> blurred_frames(const Dataset& dataset, const std::vector<int>& frames) {
    const std::vector<const Frame*> each = scene::frames_at(dataset, frames);
    std::vector<double> effects(frames.size());
    core::on_all_cores(
        frames.size(), [&](size_t k) { effects[k] = image::blur_effect(load_frame_image(*each[k])); },
        scene::images_at_once(each));
    if (effects.empty()) return {};
    std::vector<double> sorted = effects;
    const double median = scene::quantile(sorted, 0.5);
    for (double& effect : sorted) effect = std::abs(effect - median);
    const double limit = median + std::max(kLeastBlur, kDeviations * kPerMad * scene::quantile(sorted, 0.5));
    std::vector<int> blurred;
    for (size_t k = 0; k < frames.size(); ++k)
        if (effects[k] > limit) blurred.push_back(frames[k]);
    return blurred;
}

}  // namespace ewa::train
