// SPDX-License-Identifier: Apache-2.0
#include "viewer/training.h"

#include "core/process.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::viewer {
namespace fs = std::filesystem;

namespace {

std::vector<std::string> command_of(const std::vector<std::string>& arguments, const fs::path& output) {
    const fs::path program = core::own_program().parent_path() / "ewa";
    std::vector<std::string> words{program.string(), "train"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    words.insert(words.end(), {"--serve", "0", "-o", output.string()});
    return words;
}

}  // namespace

TrainProcess::TrainProcess(const std::vector<std::string>& arguments, const fs::path& output) {
    const std::vector<std::string> words = command_of(arguments, output);
    if (const auto error = child_.start(words, {}, {platform::kOwn, platform::kOwn, platform::kOwn},
                                        platform::ProcessGroup::shared, platform::Orphan::continues))
        throw RunError("cannot start " + words[0] + ": " + error.message());
}

bool TrainProcess::accepts(const std::vector<std::string>& arguments, const fs::path& output) {
    core::Program program;
    program.command = command_of(arguments, output);
    program.command.push_back("--check-options");
    return core::run_program(program, [](std::string_view) { return true; }) == core::Ended::done;
}

TrainProcess::~TrainProcess() {
    if (status()) return;
    child_.ask_to_end();
    child_.wait();
}

std::optional<int> TrainProcess::status() {
    if (!status_ && child_.has_ended()) status_ = child_.wait().code();
    return status_;
}

std::string how_to_share(const fs::path& folder) {
    if (folder.empty()) return "";
    const std::string name = core::one_line(folder.lexically_normal().string());
    const bool quoted = name.find_first_of(" '\"$&()") != std::string::npos;
    return "to share it: ewa convert " + (quoted ? '"' + name + '"' : name) +
           " scene.html makes a page for any browser";
}

void LiveRun::watch(const live::WhatToWatch& what, TrainProcess* trainer) {
    watcher_.reset();  // the old watcher stops before the update is replaced
    trainer_ = trainer;
    folder_ = what.folder;
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

void LiveRun::edit(const std::string& body) {
    if (watcher_) watcher_->edit(body);
}

std::optional<int> LiveRun::failure() const {
    if (!trainer_ || update_.status.state == live::State::done) return std::nullopt;
    const std::optional<int> status = trainer_->status();
    return status && *status != 0 ? status : std::nullopt;
}

}  // namespace ewa::viewer
