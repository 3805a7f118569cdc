// SPDX-License-Identifier: Apache-2.0
// The options of a command in groups, and errors in its arguments in plain words.
#pragma once
#include <string>

namespace CLI {
class App;
class Error;
}  // namespace CLI

namespace ewa::cli {

/// Gives the options of a command with many options one heading for each subject in its help: data, quality,
/// output and device. Options of a group of their own keep it.
void group_by_subject(CLI::App& command);

/// What is wrong with the arguments, in one line: unknown words, in the order in which they were typed and with a
/// suggestion, come before all else. command: the command that was given, or `app` without one.
std::string usage_error(const CLI::App& app, const CLI::App& command, const CLI::Error& error, int argc,
                        char** argv);

}  // namespace ewa::cli
