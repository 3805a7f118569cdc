// SPDX-License-Identifier: Apache-2.0
// Other programs: looked up in PATH, run without a shell, and ended when the caller wishes.
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace ewa::core {

/// Whether PATH has an executable file of this name.
bool has_program(const std::string& name);

struct Program {
    std::vector<std::string> command;      // the name or path of the program, then its arguments
    std::vector<std::string> environment;  // NAME=value, beside those of this process
    std::filesystem::path log;             // standard error is appended; empty: it is this process's
    bool output_to_log = false;  // standard output is appended to the log, as well as given to `output`
};

enum class Ended { done, failed, stopped };

/// Runs a program to its end. Its standard input is empty.
/// - output(text): called with each piece of standard output, as it arrives, and with an empty text at least every
///   tenth of a second. False ends the program (SIGTERM), and the result is then `stopped`.
/// - The program has a process group of its own, so Ctrl-C reaches this process alone.
/// The result is `failed` where the exit status is not 0. Throws RunError if the program cannot be started, or the
/// log cannot be written.
Ended run_program(const Program& program, const std::function<bool(std::string_view text)>& output);

}  // namespace ewa::core
