// SPDX-License-Identifier: Apache-2.0
#include "prepare/blurred_images.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <string>

#include "core/parallel.h"
#include "core/typing.h"
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

std::string skip_blurred(const Dataset& dataset, Split& split) {
    constexpr size_t kNamed = 8;
    const std::vector<int> blurred = blurred_frames(dataset, split.train);
    if (blurred.empty()) return {};
    std::string names;
    for (size_t k = 0; k < std::min(kNamed, blurred.size()); ++k)
        names += (k == 0 ? ": " : ", ") + dataset.frames[size_t(blurred[k])].name;
    if (blurred.size() > kNamed) names += fmt::format(" and {} more", blurred.size() - kNamed);
    std::erase_if(split.train, [&](int i) { return std::ranges::find(blurred, i) != blurred.end(); });
    return fmt::format("{} {} blurred and skipped{}", core::counted(blurred.size(), "training image"),
                       core::is_or_are(blurred.size()), names);
}

}  // namespace ewa::train
