// SPDX-License-Identifier: Apache-2.0
// Explains errors in the arguments of a command to the user.
#pragma once
#include <string>

namespace CLI {
class App;
class Error;
}  // namespace CLI

namespace ewa::cli {

/// One line that says what is wrong with the arguments. Unknown words come first, in the order in which they were typed, with a
/// suggestion. command: the parser of the typed command, or `app` if none was typed.
std::string usage_error(const CLI::App& app, const CLI::App& command, const CLI::Error& error, int argc,
                        char** argv);

}  // namespace ewa::cli
