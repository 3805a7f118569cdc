// SPDX-License-Identifier: Apache-2.0
// Runs other programs. Finds them in PATH, starts them without a shell, and ends them when the caller wishes.
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "platform/process.h"

namespace ewa::core {

using platform::find_program;

/// The file of the program that runs. Throws RunError if the system does not say.
std::filesystem::path own_program();

/// Starts a program. The caller waits for it. The program is killed if the thread that started it ends.
/// command: the path of the program, or a name for find_program, then its arguments.
/// environment: NAME=value, beside those of this process.
/// Throws RunError if the program cannot be started.
platform::Process start_program(std::vector<std::string> command, const std::vector<std::string>& environment,
                                const platform::Streams& streams,
                                platform::Orphan orphan = platform::Orphan::killed);

struct Program {
    std::vector<std::string> command;      // the name or path of the program, then its arguments
    std::vector<std::string> environment;  // NAME=value, beside those of this process
    /// File to which the program's standard error is appended, up to kMostLog bytes. Empty: standard error is this process's.
    std::filesystem::path log;
    bool output_to_log = false;  // standard output is appended to the log, as well as given to `output`
    bool joined = false;         // standard error is part of the output
};

constexpr size_t kMostLog = size_t(16) << 20;  // bytes that a run of a program adds to its log

enum class Ended { done, failed, stopped };

/// Runs a program to its end. Processes that it started and did not wait for keep running. Its standard input is empty.
/// - output(text): called with each piece of standard output, as it arrives, and with an empty text at least every
///   tenth of a second. False asks the program to end, kills it after three seconds, and the result is then `stopped`.
/// The result is `failed` where the exit status is not 0. Throws RunError if the program cannot be started, or the
/// log cannot be written.
Ended run_program(const Program& program, const std::function<bool(std::string_view text)>& output);

struct Answer {
    Ended ended = Ended::failed;
    std::string text;
    bool cut = false;  // the program was ended
};

/// Runs a program that answers a question on standard output. It is ended, and has failed, where it prints more than a megabyte
/// or takes more than half a minute. go_on: asked at least every tenth of a second; false ends the program (`stopped`).
Answer ask_program(
    const Program& program, const std::function<bool()>& go_on = [] { return true; });

}  // namespace ewa::core
