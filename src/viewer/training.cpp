// SPDX-License-Identifier: Apache-2.0
#include "viewer/training.h"

#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>

#include "core/process.h"
#include "core/text.h"
#include "ewa/error.h"

extern char** environ;

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
    std::vector<std::string> words = command_of(arguments, output);
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    const int reason = posix_spawn(&child_, argv[0], nullptr, nullptr, argv.data(), environ);
    if (reason != 0) throw RunError("cannot start " + words[0] + ": " + std::strerror(reason));
}

bool TrainProcess::accepts(const std::vector<std::string>& arguments, const fs::path& output) {
    core::Program program;
    program.command = command_of(arguments, output);
    program.command.push_back("--check-options");
    return core::run_program(program, [](std::string_view) { return true; }) == core::Ended::done;
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
