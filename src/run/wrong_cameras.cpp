// SPDX-License-Identifier: Apache-2.0
#include "run/wrong_cameras.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "core/text.h"
#include "scene/statistics.h"

namespace ewa::train {
namespace {

// dB. Exposures and parts that few photos show move views by up to about 4 dB; cameras that fit the splats are 2 dB better.
constexpr double kFarBelowOthers = 5, kFarBelowTraining = 8, kExplained = 2;
constexpr size_t kLeastViews = 3, kMostChecked = 3;

std::string list_of(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : "; ") + name;
    return text;
}

}  // namespace

std::vector<ViewFigure> far_below(std::vector<ViewFigure> views, double train_psnr) {
    if (views.size() < kLeastViews) return {};
    std::vector<double> values;
    for (const ViewFigure& view : views) values.push_back(view.psnr);
    const double most =
        std::min(scene::quantile(values, 0.5) - kFarBelowOthers, train_psnr - kFarBelowTraining);
    std::erase_if(views, [&](const ViewFigure& view) { return !(view.psnr < most); });
    std::ranges::stable_sort(views, {}, &ViewFigure::psnr);
    if (views.size() > kMostChecked) views.resize(kMostChecked);
    return views;
}

std::string wrong_cameras_text(const std::vector<DoubtfulView>& views, double usual) {
    std::vector<std::string> wrong, open;
    for (const DoubtfulView& view : views)
        if (view.moved_psnr >= view.psnr + kExplained)
            wrong.push_back(fmt::format(
                "{}: {:.1f} dB, and {:.1f} dB with its camera turned by {:.1f} degrees and "
                "moved by {:.1f} % of the scene's extent",
                core::one_line(view.name), view.psnr, view.moved_psnr, view.degrees, 100 * view.share));
        else
            open.push_back(fmt::format("{} ({:.1f} dB)", core::one_line(view.name), view.psnr));
    std::string text;
    if (!wrong.empty()) text = "some cameras are probably wrong: " + list_of(wrong);
    if (!wrong.empty() && !open.empty()) text += ". ";
    if (!open.empty())
        text += fmt::format(
            "some cameras may be wrong, or no training image shows what these held-out views do: {}. "
            "The median view has {:.1f} dB",
            list_of(open), usual);
    return text;
}

}  // namespace ewa::train
