// SPDX-License-Identifier: Apache-2.0
// The streams that a program is started with, and the terminal behind them.
#pragma once
#include <string>
#include <string_view>

namespace ewa::core {

/// Opens those of the descriptors 0, 1 and 2 that are closed on /dev/null. Without this, the next file that is
/// opened gets the number, and messages are written into it. Call it first in main().
void open_standard_streams();

/// Columns of the terminal that standard output is. 80 if it is none.
size_t terminal_columns();
/// The same, between 40 and 120.
size_t terminal_width();

/// The help text of a command line parser. Breaks lines between words at `width` columns, and turns "-o,--output"
/// into "-o, --output". column: where the descriptions of options begin.
std::string wrapped_help(std::string_view text, size_t column, size_t width);

/// Writes the text to standard output. False, with errno, if not all of it could be written.
bool print_whole(std::string_view text);

}  // namespace ewa::core
