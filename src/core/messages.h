// SPDX-License-Identifier: Apache-2.0
// Text for people: sizes and warnings. Not in text.h, so that ewa-bench needs no spdlog or fmt.
#pragma once
#include <cstdint>
#include <string>

namespace ewa::core {

/// Bytes with three digits in powers of 1000, such as "850 B" or "12.3 MB".
std::string bytes_text(uint64_t bytes);

/// Gives a line to the log handler of ewa/log.h.
void warn(const std::string& text);

/// Sets the log handler of ewa's programs: it prints "warning: text" on standard error. Standard output is for results.
void print_warnings();

}  // namespace ewa::core
