// SPDX-License-Identifier: Apache-2.0
// Manual pages and shell completion, from the option parser itself.
#pragma once
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace ewa::cli {

/// A manual page in the macros of man(7), as troff reads it: of the program where `command` is null, else of
/// one of its commands; a program may have none.
std::string manual_page(const CLI::App& program, const CLI::App* command);

/// Completion of commands, options and values out of a set; sourced by bash, zsh (after bashcompinit) or
/// fish.
std::string bash_completion(const CLI::App& program);
std::string fish_completion(const CLI::App& program);

/// Commands that a user sees.
std::vector<const CLI::App*> shown_commands(const CLI::App& program);

/// The hidden `ewa manual DIR` and `ewa-view --manual DIR` write all of a program's below DIR, where an
/// installation has them below share/.
void write_manual(const CLI::App& program, const std::string& folder);

}  // namespace ewa::cli
