// SPDX-License-Identifier: Apache-2.0
// Small text helpers shared by the readers of text files.
#pragma once
#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace ewa::core {

/// The text as it may be shown, whatever a file or a path holds: white space as spaces, every other control
/// character (of Unicode too, and what turns the direction of text) and every byte that is no UTF-8 as \x1b,
/// in hexadecimal. Every error, and every name that a terminal sees, goes through this.
std::string one_line(std::string_view text);

/// Cuts the first word (separated by blanks, tabs or carriage returns) off `rest`; empty at the end.
std::string_view next_word(std::string_view& rest);

/// Without leading and trailing white space.
std::string_view trim(std::string_view text);

/// In lower case (ASCII).
std::string lower(std::string_view text);

/// The whole word as a number, "nan" and "inf" included; independent of the locale.
std::optional<double> parse_number(std::string_view word);

/// The whole word as an integer that fits T.
template <class T>
std::optional<T> parse_integer(std::string_view word) {
    T value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
    return value;
}

/// Bytes with three digits in powers of 1000, such as "850 B" or "12.3 MB".
std::string bytes_text(uint64_t bytes);

/// Seconds as "12 s", "3 min 05 s" or "2 h 10 min".
std::string duration_text(double seconds);

}  // namespace ewa::core
