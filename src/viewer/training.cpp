// SPDX-License-Identifier: Apache-2.0
#include "viewer/training.h"

#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>

#include "ewa/error.h"

extern char** environ;

namespace ewa::viewer {
namespace fs = std::filesystem;

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
