// SPDX-License-Identifier: Apache-2.0
// The streams that a program is started with, and the terminal behind them.
#pragma once
#include <cstddef>

namespace ewa::platform {

/// Call it first in main(). Opens the null file for each of the standard streams that is closed: without this, the next opened file
/// would get its number, and messages would be written into this file. Windows: the arguments become UTF-8, the streams and
/// files keep their bytes, and the console shows UTF-8.
void begin_program(int& argc, char**& argv);

enum class Stream { output, errors };

/// Whether the stream is a terminal.
bool is_terminal(Stream stream);

/// Whether a line on the terminal behind standard output can be redrawn by control sequences.
bool redraws();

/// Whether the terminal behind standard output shows UTF-8. POSIX: as the locale says.
bool shows_unicode();

/// The columns of the terminal on standard output; 0 if it is none.
size_t terminal_columns();

}  // namespace ewa::platform
