// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/offers.h"

#include <imgui.h>

#include <cmath>

#include "core/typing.h"
#include "run/forecast.h"
#include "run/option_table.h"
#include "viewer/overlay.h"

namespace ewa::viewer {
namespace {

constexpr const char *kTrainNow = "Train splats:", *kNotNow = "Not now";
constexpr float kOfferPlace = 0.62f;  // share of the area's height, below the middle of the picture
constexpr float kOfferWidth = 14;     // of the buttons, heights of the text

std::string rough_text(double seconds) {
    constexpr double kMinute = 60, kHour = 3600;
    if (seconds < 1.5 * kMinute) return "a minute";
    if (seconds < 1.5 * kHour) return std::to_string(std::lround(seconds / kMinute)) + " min";
    return std::to_string(std::lround(seconds / kHour)) + " h";
}

}  // namespace

std::string usual_time_text(const OpenedScene& scene, std::optional<bool> on_cpu, int steps) {
    if (!on_cpu || !scene.dataset || scene.dataset->frames.empty()) return {};
    const Camera& camera = scene.dataset->frames.front().camera;
    const size_t photos = scene.dataset->frames.size();
    TrainOptions options;
    options.steps = steps;
    const double seconds = train::usual_seconds({.pixels = double(camera.width) * camera.height,
                                                 .photos = photos,
                                                 .splats = uint32_t(scene.gaussians->size()),
                                                 .evaluated = photos / 8},
                                                options, *on_cpu);
    return "about " + rough_text(seconds);
}

std::optional<int> draw_training_offer(const OpenedScene& scene, std::optional<bool> on_cpu,
                                       const Rectangle& area) {
    std::optional<int> chosen;
    if (begin_card("training offer", area, kOfferPlace)) {
        const std::string found =
            "Cameras of " + core::counted(scene.dataset->frames.size(), "photo") + " found. ";
        ImGui::TextUnformatted((found + kTrainNow).c_str());
        const ImVec2 size(kOfferWidth * ImGui::GetTextLineHeight(), 0);
        for (size_t i = 0; i < kQualityNames.size(); ++i) {
            const int steps = train::kQualities[i].second;
            const std::string time = usual_time_text(scene, on_cpu, steps);
            const std::string text = kQualityNames[i] + (time.empty() ? "" : " (" + time + ")");
            if (ImGui::Button((text + "###" + kQualityNames[i]).c_str(), size)) chosen = steps;
        }
        if (ImGui::Button(kNotNow, size)) chosen = 0;
    }
    ImGui::End();
    return chosen;
}

}  // namespace ewa::viewer
