// SPDX-License-Identifier: Apache-2.0
// Text for people: sizes and warnings. Not in text.h, so that ewa-bench needs no spdlog or fmt.
#pragma once
#include <cstdint>
#include <string>

namespace ewa::core {

/// Bytes with three digits in powers of 1000, such as "850 B" or "12.3 MB".
std::string bytes_text(uint64_t bytes);

/// Prints a line on standard error through the spdlog logger named "ewa", whose level can silence it.
/// Standard output is reserved for results.
void warn(const std::string& text);

}  // namespace ewa::core
