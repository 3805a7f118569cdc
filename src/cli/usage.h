// SPDX-License-Identifier: Apache-2.0
// Errors in the arguments of a command in plain words.
#pragma once
#include <string>

namespace CLI {
class App;
class Error;
}  // namespace CLI

namespace ewa::cli {

/// What is wrong with the arguments, in one line: unknown words, in the order in which they were typed and with a
/// suggestion, come before all else. command: the command that was given, or `app` without one.
std::string usage_error(const CLI::App& app, const CLI::App& command, const CLI::Error& error, int argc,
                        char** argv);

}  // namespace ewa::cli
