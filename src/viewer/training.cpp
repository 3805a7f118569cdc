// SPDX-License-Identifier: Apache-2.0
#include "viewer/training.h"

#include <imgui.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <thread>

#include "ewa/error.h"

extern char** environ;

namespace ewa::viewer {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostPoints = 400;  // of a plotted curve

/// At most kMostPoints values: means over groups of neighbours.
std::vector<float> curve(const std::vector<float>& values) {
    if (values.size() <= kMostPoints) return values;
    std::vector<float> means(kMostPoints);
    for (size_t i = 0; i < kMostPoints; ++i) {
        const size_t from = i * values.size() / kMostPoints, to = (i + 1) * values.size() / kMostPoints;
        float sum = 0;
        for (size_t k = from; k < to; ++k) sum += values[k];
        means[i] = sum / float(to - from);
    }
    return means;
}

void plot(const char* name, const std::vector<float>& values, const char* format) {
    if (values.size() < 2) return;
    const std::vector<float> points = curve(values);
    char text[64];
    std::snprintf(text, sizeof(text), format, double(values.back()));
    const auto [least, most] = std::minmax_element(points.begin(), points.end());
    const float margin = std::max(1e-6f, 0.05f * (*most - *least));
    const float line = ImGui::GetTextLineHeight();
    ImGui::TextUnformatted(name);
    ImGui::SameLine();
    ImGui::TextUnformatted(text);
    ImGui::PushID(name);
    ImGui::PlotLines("", points.data(), int(points.size()), 0, nullptr, *least - margin, *most + margin,
                     ImVec2(line * 17, line * 4));
    ImGui::PopID();
}

const char* name_of(live::State state) {
    if (state == live::State::paused) return "paused";
    return state == live::State::done ? "done" : "training";
}

}  // namespace

std::optional<std::string> draw_training(const live::Update& run) {
    const live::Status& status = run.status;
    std::optional<std::string> command;
    if (status.step == 0 && run.problem.empty()) {
        ImGui::TextUnformatted("waiting for the first step ...");
        return command;
    }
    ImGui::Text("%s: step %d of %d, %.0f s", name_of(status.state), status.step, status.steps,
                status.seconds);
    if (status.steps > 0)
        ImGui::ProgressBar(float(status.step) / float(status.steps),
                           ImVec2(ImGui::GetTextLineHeight() * 17, 0));
    if (run.splats_step >= 0 && status.state != live::State::done)
        ImGui::Text("splats of step %d", run.splats_step);
    std::vector<float> loss, psnr;
    for (const report::MetricsLine& line : status.metrics) {
        if (std::isfinite(line.loss)) loss.push_back(float(line.loss));
        if (line.test_psnr && std::isfinite(*line.test_psnr)) psnr.push_back(float(*line.test_psnr));
    }
    plot("loss", loss, "%.4f");
    plot("held-out PSNR", psnr, "%.2f dB");
    if (psnr.size() == 1) ImGui::Text("held-out PSNR %.2f dB", double(psnr.front()));
    if (run.connected && status.commands && status.state != live::State::done) {
        const bool paused = status.state == live::State::paused;
        if (ImGui::Button(paused ? "Resume" : "Pause")) command = paused ? "resume" : "pause";
        ImGui::SameLine();
        if (ImGui::Button("Save now")) command = "save";
    } else if (run.connected && status.state != live::State::done) {
        ImGui::TextDisabled("watching; --token lets you pause and save");
    } else if (status.state != live::State::done) {
        ImGui::TextDisabled("watching the files of the run");
    }
    if (!run.problem.empty()) ImGui::TextWrapped("%s", run.problem.c_str());
    return command;
}

TrainProcess::TrainProcess(const std::vector<std::string>& arguments, const fs::path& output) {
    std::error_code error;
    const fs::path program = fs::read_symlink("/proc/self/exe", error).parent_path() / "ewa";
    std::vector<std::string> words{program.string(), "train"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    words.insert(words.end(), {"--serve", "0", "-o", output.string()});
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    const int reason = posix_spawn(&child_, program.c_str(), nullptr, nullptr, argv.data(), environ);
    if (reason != 0) throw RunError("cannot start " + program.string() + ": " + std::strerror(reason));
}

TrainProcess::~TrainProcess() {
    if (status()) return;
    kill(child_, SIGTERM);
    int ended = 0;
    waitpid(child_, &ended, 0);
}

std::optional<int> TrainProcess::status() {
    int ended = 0;
    if (!status_ && waitpid(child_, &ended, WNOHANG) == child_)
        status_ = WIFEXITED(ended) ? WEXITSTATUS(ended) : 128 + WTERMSIG(ended);
    return status_;
}

void LiveRun::watch(const live::WhatToWatch& what) {
    watcher_.reset();  // the old watcher stops before the update is replaced
    update_ = {};
    watcher_ = std::make_unique<live::Watcher>(what, wake_);
}

LiveRun::News LiveRun::take() {
    if (!watcher_ || watcher_->number() == update_.number) return {};
    const auto before = update_.splats;
    update_ = watcher_->update();
    const bool fresh = update_.splats != before && update_.splats && update_.splats->size() > 0;
    return {true, fresh ? update_.splats : nullptr};
}

void LiveRun::command(const std::string& command) {
    if (watcher_) watcher_->command(command);
}

std::optional<int> LiveRun::failure() const {
    if (!trainer_ || update_.status.state == live::State::done) return std::nullopt;
    const std::optional<int> status = trainer_->status();
    return status && *status != 0 ? status : std::nullopt;
}

}  // namespace ewa::viewer
