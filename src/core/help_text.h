// SPDX-License-Identifier: Apache-2.0
// The help text of a command line parser as a terminal of 80 columns shows it.
#pragma once
#include <string>
#include <string_view>

namespace ewa::core {

/// Breaks lines between words at 80 columns, and turns "-o,--output" into "-o, --output". column: where the
/// descriptions of options begin.
std::string help_text(std::string_view text, size_t column);

/// Makes a CLI11 parser and the sub-commands that are added later print their help in this way. A template, so
/// that this module does not need CLI11: Formatter is CLI::Formatter.
template <class Formatter, class App>
void use_help_text(App& app) {
    app.formatter_fn([](const App* shown, const std::string& name, auto mode) {
        constexpr size_t kColumn = 30;
        Formatter formatter;
        formatter.column_width(kColumn);
        return help_text(formatter.make_help(shown, name, mode), kColumn);
    });
}

}  // namespace ewa::core
