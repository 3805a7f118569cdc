// SPDX-License-Identifier: Apache-2.0
// The short help of commands with many options.
#pragma once

namespace CLI {
class App;
}

namespace ewa::cli {

/// Lets --help of a command with many options show only those that are used often, briefly, and adds --help-all for all of
/// them. Leaves other commands. Call it when all options of the command are there.
void use_short_help(CLI::App& command);

}  // namespace ewa::cli
