// SPDX-License-Identifier: Apache-2.0
// The streams that a program is started with, and the terminal behind them.
#pragma once
#include <string>
#include <string_view>

namespace ewa::core {

/// The columns of the terminal on standard output. 80 if standard output is no terminal.
size_t terminal_columns();
/// terminal_columns(), clamped to 40..120.
size_t terminal_width();

/// The help text of a command line parser. Breaks lines between words at `width` columns, and turns "-o,--output"
/// into "-o, --output". column: where the descriptions of options begin.
std::string wrapped_help(std::string_view text, size_t column, size_t width);

/// Writes the text to standard output. Returns false and sets errno if not all of it could be written.
bool print_whole(std::string_view text);

}  // namespace ewa::core
