// SPDX-License-Identifier: Apache-2.0
// Small pieces of text that the commands share.
#pragma once
#include <cstdint>
#include <string>

namespace ewa::cli {

/// As a POSIX shell reads it back as one word.
std::string shell_quoted(const std::string& word);

/// "850 B", "12.3 MB" (powers of 1000).
std::string bytes_text(uint64_t bytes);

/// "12 s", "3 min 05 s", "2 h 10 min".
std::string duration_text(double seconds);

}  // namespace ewa::cli
