// SPDX-License-Identifier: Apache-2.0
// The options of a command's parser, from the rows of the table.
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

/// The row of an option of this command, which must exist.
const Option& option_of(const CLI::App& command, std::string_view name);
/// The names on the command line, such as --output,-o.
std::string spelled(const Option& option);
/// Gives an option that is new in a parser what its row says. number: its variable is one.
CLI::Option* as_in_row(CLI::Option* added, const Option& option, bool number = false);

/// Adds the command's option of this name, which sets the variable: a bool of a flag, a number, a text, or a list of them.
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
/// Adds an option of a training run, which sets its member.
CLI::Option* add(CLI::App& command, std::string_view name, RunOptions& variable);
/// Adds an option without a variable. The command reads its values from the result after the parsing.
CLI::Option* add(CLI::App& command, std::string_view name);

/// Puts the options of the help under their subjects. A command with few has one heading. Where rows are in the short help of the
/// command, --help shows these alone, and --help-all shows all. Call it when all options of the command are there.
void arrange_help(CLI::App& command);

/// The options as they are typed, with their dashes.
std::vector<std::string> option_names(const CLI::App& command);

/// The files that the command line names for options with these roles.
struct TypedFiles {
    std::vector<core::NamedFile> written, read;
};
TypedFiles typed_files(const CLI::App& command);

/// Throws InputError for options that exclude each other or need another one, by what was typed: rules.h has these.
void check_typed(const CLI::App& command);

}  // namespace ewa::options
