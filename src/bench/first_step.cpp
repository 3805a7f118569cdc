// SPDX-License-Identifier: Apache-2.0
// The time from the start of a process to the end of its first training step. Drivers keep shader caches per
// process, so a new process is needed.
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>

#include "bench/device_runs.h"
#include "bench/measure.h"
#include "core/folders.h"
#include "ewa/error.h"

extern char** environ;

namespace ewa::bench {
namespace {

constexpr int kRuns = 3;

int64_t now_nanoseconds() {
    using namespace std::chrono;
    return duration_cast<nanoseconds>(steady_clock::now().time_since_epoch()).count();
}

/// The environment of this process with the shader caches of Mesa and NVIDIA in a folder.
std::vector<std::string> environment_with_cache(const std::string& folder) {
    std::vector<std::string> result;
    for (char** entry = environ; *entry; ++entry) {
        const std::string text = *entry;
        if (!text.starts_with("MESA_SHADER_CACHE") && !text.starts_with("__GL_SHADER_DISK_CACHE"))
            result.push_back(text);
    }
    result.push_back("MESA_SHADER_CACHE_DIR=" + folder);
    result.push_back("__GL_SHADER_DISK_CACHE=1");
    result.push_back("__GL_SHADER_DISK_CACHE_PATH=" + folder);
    return result;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
    std::vector<char*> result;
    for (std::string& text : texts) result.push_back(text.data());
    result.push_back(nullptr);
    return result;
}

/// The standard output of a command. Throws RunError unless it exits with status 0.
std::string output_of(std::vector<std::string> command, std::vector<std::string> environment) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) throw RunError("cannot create a pipe");
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    pid_t child = 0;
    const int failed = posix_spawn(&child, command[0].c_str(), &actions, nullptr, pointers(command).data(),
                                   pointers(environment).data());
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    std::string text;
    char piece[256];
    for (ssize_t n = 0; !failed && (n = read(ends[0], piece, sizeof(piece))) > 0;)
        text.append(piece, size_t(n));
    close(ends[0]);
    int status = 0;
    if (failed || waitpid(child, &status, 0) != child || status != 0)
        throw RunError("the process of the first step failed: " + command[0]);
    return text;
}

double start_to_first_step(const std::vector<std::string>& command, const std::string& cache) {
    const int64_t start = now_nanoseconds();
    const int64_t end = std::strtoll(output_of(command, environment_with_cache(cache)).c_str(), nullptr, 10);
    if (end <= start) throw RunError("the process of the first step did not print a time");
    return double(end - start) * 1e-6;
}

}  // namespace

int run_first_step(const std::string& device) {
    for (const Case& one : all_cases()) {
        if (one.kind != Kind::first_step) continue;
        // The constructor runs the step.
        const FrameRun run(open_device({.selector = device}), make_scene(one), true);
        std::printf("%lld\n", static_cast<long long>(now_nanoseconds()));
    }
    return 0;
}

CaseResult measure_first_step(const Case& one, const MeasureOptions& options) {
    std::vector<double> cold, warm;
    for (int run = 0; run < (options.runs > 0 ? std::min(options.runs, kRuns) : kRuns); ++run) {
        const core::TemporaryFolder cache("ewa-bench-");
        cold.push_back(start_to_first_step(options.first_step_command, cache.path().string()));
        warm.push_back(start_to_first_step(options.first_step_command, cache.path().string()));
    }
    CaseResult result;
    result.one = one;
    result.passes = {{"shader cache cold", {spread_of(cold), {}}, 0, {}},
                     {"shader cache warm", {spread_of(warm), {}}, 0, {}}};
    result.total = result.passes[1].time;
    return result;
}

}  // namespace ewa::bench
