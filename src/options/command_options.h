// SPDX-License-Identifier: Apache-2.0
// Adds options to the CLI11 parser of a command, from the rows of the options' table (option.h).
#pragma once
#include <CLI/CLI.hpp>

#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "core/outputs.h"
#include "core/typing.h"
#include "ewa/run_options.h"
#include "options/option.h"

namespace ewa::options {

template <class T>
struct NumberOf {
    using type = T;
};
template <class T>
struct NumberOf<std::optional<T>> {
    using type = T;
};

/// The row of the options' table for an option of this command. The row must exist.
const Option& option_of(const CLI::App& command, std::string_view name);
/// The option's names on the command line, such as --output,-o.
std::string spelled(const Option& option);
/// Sets type, choices, default and heading of an option that was just added to a parser, from its row. number: the option sets a
/// number.
CLI::Option* as_in_row(CLI::Option* added, const Option& option, bool number = false);

/// Adds the command's option of this name. Parsing sets the variable: a bool for a flag, a number, a text, or a list of these.
template <class T>
CLI::Option* add(CLI::App& command, std::string_view name, T& variable) {
    const Option& option = option_of(command, name);
    using Number = typename NumberOf<T>::type;
    if constexpr (std::is_same_v<T, bool>) {
        return as_in_row(command.add_flag(spelled(option), variable, option.help), option);
    } else {
        CLI::Option* added = command.add_option(spelled(option), variable, option.help);
        if constexpr (std::is_arithmetic_v<Number>)
            if (option.low < option.high)
                added->transform(CLI::Validator(
                    [low = Number(option.low), high = Number(option.high)](std::string& text) {
                        return core::settle_number(text, low, high);
                    },
                    ""));
        return as_in_row(added, option, std::is_arithmetic_v<Number>);
    }
}
/// Adds an option of a training run. Parsing sets the option's member of `variable`.
CLI::Option* add(CLI::App& command, std::string_view name, RunOptions& variable);
/// Adds an option without a variable. The command reads the option's values from the parser after parsing.
CLI::Option* add(CLI::App& command, std::string_view name);

/// Groups the options in the help under their subjects. A command with few options has one heading. If the command has a short
/// help, --help shows only the options in it, and --help-all shows all. Call this after all options are added.
void arrange_help(CLI::App& command);

/// The names of the command's options as users type them, with their dashes.
std::vector<std::string> option_names(const CLI::App& command);

/// Files that the command line names: written by Role::output, read by Role::input.
struct TypedFiles {
    std::vector<core::NamedFile> written, read;
};
TypedFiles typed_files(const CLI::App& command);

/// Throws InputError if typed options exclude each other, or lack an option that they need. rules.h has the rules.
void check_typed(const CLI::App& command);

}  // namespace ewa::options
