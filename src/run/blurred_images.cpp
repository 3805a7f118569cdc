// SPDX-License-Identifier: Apache-2.0
#include "run/blurred_images.h"

#include <algorithm>

#include "core/parallel.h"
#include "image/metric.h"
#include "scene/frame_images.h"
#include "scene/statistics.h"

namespace ewa::train {
namespace {

// How far above the median a blur effect is no accident: in standard deviations, and at least a value that motion over 3 px
// exceeds.
constexpr double kDeviations = 4, kLeastBlur = 0.05;

}  // namespace

std::vector<int> blurred_frames(const Dataset& dataset, const std::vector<int>& frames) {
    const std::vector<const Frame*> each = scene::frames_at(dataset, frames);
    std::vector<double> effects(frames.size());
    core::on_all_cores(
        frames.size(), [&](size_t k) { effects[k] = image::blur_effect(load_frame_image(*each[k])); },
        scene::images_at_once(each));
    if (effects.empty()) return {};
    std::vector<double> values = effects;
    const auto [median, deviation] = scene::center_of(values);
    const double limit = median + std::max(kLeastBlur, kDeviations * deviation);
    std::vector<int> blurred;
    for (size_t k = 0; k < frames.size(); ++k)
        if (effects[k] > limit) blurred.push_back(frames[k]);
    return blurred;
}

}  // namespace ewa::train
