// SPDX-License-Identifier: Apache-2.0
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "core/text.h"
#include "run/option_table.h"
#include "viewer/editor/modal.h"
#include "viewer/editor/offers.h"
#include "viewer/panel.h"
#include "viewer/panel_rows.h"

namespace ewa::viewer {
namespace {

constexpr size_t kMostPoints = 400;  // of a plotted curve
constexpr int kMostSteps = 10'000'000;

/// At most kMostPoints values: means over groups of neighbours.
std::vector<float> curve(const std::vector<float>& values) {
    if (values.size() <= kMostPoints) return values;
    std::vector<float> means(kMostPoints);
    for (size_t i = 0; i < kMostPoints; ++i) {
        const size_t from = i * values.size() / kMostPoints, to = (i + 1) * values.size() / kMostPoints;
        means[i] = std::accumulate(values.begin() + std::ptrdiff_t(from), values.begin() + std::ptrdiff_t(to),
                                   0.0f) /
                   float(to - from);
    }
    return means;
}

/// The last value and the curve, as far as there are values.
void plot(const char* name, const std::vector<float>& values, const char* format) {
    if (values.empty()) return;
    ImGui::Text(format, double(values.back()));
    const std::vector<float> points = curve(values);
    if (points.size() < 2) return;
    const auto [least, most] = std::minmax_element(points.begin(), points.end());
    const float margin = std::max(1e-6f, 0.05f * (*most - *least));
    ImGui::PushID(name);
    ImGui::PlotLines("", points.data(), int(points.size()), 0, nullptr, *least - margin, *most + margin,
                     ImVec2(ImGui::GetContentRegionAvail().x, ImGui::GetTextLineHeight() * 2));
    ImGui::PopID();
}

/// Whether all steps are done. A copied folder does not tell by the times of its files that its run has ended.
bool has_trained(const live::Update& run) {
    const live::Status& status = run.status;
    return status.steps > 0 && status.step >= status.steps &&
           (status.state == live::State::done || !run.connected);
}

void show_progress(const live::Update& run) {
    const live::Status& status = run.status;
    std::array<char, 96> text{};
    if (status.steps == 0) {
        std::snprintf(text.data(), text.size(), "%s",
                      run.problem.empty() ? "waiting for the first step ..." : "no training is reached");
    } else {
        const char* state = status.state == live::State::paused ? "paused"
                            : status.state == live::State::done ? "interrupted"
                                                                : "training";
        std::snprintf(text.data(), text.size(), "%s: step %d of %d, %.0f s", state, status.step, status.steps,
                      status.seconds);
    }
    ImGui::TextUnformatted(text.data());
    const float share = status.steps > 0 ? float(status.step) / float(status.steps) : 0;
    ImGui::ProgressBar(share, ImVec2(ImGui::GetContentRegionAvail().x, 0.4f * ImGui::GetTextLineHeight()),
                       "");
    const double left = live::seconds_left(status);
    if (!std::isnan(left)) ImGui::TextUnformatted(("about " + core::duration_text(left) + " left").c_str());
}

/// Which step the picture is of.
void show_step(const OpenedScene& scene, const live::Update& run) {
    if (scene.points)
        ImGui::TextDisabled("picture: points, of step 0");
    else if (run.splats_step >= 0)
        ImGui::TextDisabled("picture: splats of step %d", run.splats_step);
    else if (scene.gaussians->size() > 0)
        ImGui::TextDisabled("picture: the last saved splats");
}

void show_curves(const live::Status& status) {
    std::vector<float> loss, train, psnr;
    for (const report::MetricsLine& line : status.metrics) {
        if (std::isfinite(line.loss)) loss.push_back(float(line.loss));
        if (line.train_psnr && std::isfinite(*line.train_psnr)) train.push_back(float(*line.train_psnr));
        if (line.test_psnr && std::isfinite(*line.test_psnr)) psnr.push_back(float(*line.test_psnr));
    }
    plot("loss", loss, "loss %.4f");
    plot("training PSNR", train, "training PSNR %.2f dB");
    plot("held-out PSNR", psnr, "held-out PSNR %.2f dB");
}

void choose_training(const WindowParts& parts) {
    int& chosen = parts.state.settings.train_steps;
    std::vector<std::string> texts;
    std::string present = core::grouped(uint64_t(chosen), "step");
    for (size_t i = 0; i < kQualityNames.size(); ++i) {
        const int steps = train::kQualities[i].second;
        const std::string time = usual_time_text(parts.state.scene, parts.state.on_cpu, steps);
        texts.push_back(kQualityNames[i] + (time.empty() ? "" : ", " + time));
        if (steps == chosen) present = texts.back();
    }
    ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x);
    if (ImGui::BeginCombo("##quality", present.c_str())) {
        for (size_t i = 0; i < texts.size(); ++i)
            if (ImGui::Selectable(texts[i].c_str(), texts[i] == present))
                chosen = train::kQualities[i].second;
        ImGui::EndCombo();
    }
    if (accent_button("Train splats", ImGui::GetContentRegionAvail().x)) parts.session.train();
    label_field("Steps");
    if (ImGui::InputInt("##steps", &chosen, 0)) chosen = std::clamp(chosen, 1, kMostSteps);
}

void draw_commands(const live::Update& run, LiveRun& live_run) {
    const bool paused = run.status.state == live::State::paused;
    ImGui::BeginDisabled(run.status.state == live::State::done || !run.connected || !run.status.commands);
    if (ImGui::Button(paused ? "Resume###pause" : "Pause###pause"))
        live_run.command(paused ? "resume" : "pause");
    ImGui::SameLine();
    if (ImGui::Button("Save now")) live_run.command("save");
    ImGui::EndDisabled();
}

std::string remark_of(const WindowParts& parts, const live::Update& run) {
    if (!run.problem.empty()) return run.problem;
    if (has_trained(run)) return how_to_share(parts.session.live_run.folder());
    if (run.status.state == live::State::done) return "";
    if (run.connected) return run.status.commands ? "" : "watching; --token lets you pause and save";
    if (parts.state.scene.points)
        return "no splats are saved yet; --serve or --save-every lets the picture move";
    return "watching the files of the run; ewa train --serve shows more";
}

}  // namespace

void draw_training(const WindowParts& parts) {
    LiveRun& live_run = parts.session.live_run;
    if (!live_run.update()) return choose_training(parts);
    const live::Update& run = *live_run.update();
    if (has_trained(run)) {
        ImGui::TextUnformatted(("trained: " + core::grouped(uint64_t(run.status.steps)) +
                                (run.status.steps == 1 ? " step" : " steps"))
                                   .c_str());
    } else {
        show_progress(run);
        draw_commands(run, live_run);
        show_step(parts.state.scene, run);
    }
    draw_text_box("training remark", remark_of(parts, run), 0, 3);
    show_curves(run.status);
}

}  // namespace ewa::viewer
