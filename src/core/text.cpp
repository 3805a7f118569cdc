// SPDX-License-Identifier: Apache-2.0
#include "core/text.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <memory>
#include <utility>

#include "core/composed.h"

namespace ewa::core {

namespace {
constexpr std::string_view kBlanks = " \t\r\n\v\f";

/// The number of bytes to display unchanged: of a character that neither controls a terminal, nor ends a
/// line, nor changes the direction of text.
size_t shown_bytes(std::string_view text) {
    const auto [c, bytes] = first_character(text);
    const auto in = [c = c](uint32_t low, uint32_t high) { return c >= low && c <= high; };
    const bool control =
        c < 0x20 || in(0x7f, 0x9f) || in(0x200e, 0x200f) || in(0x2028, 0x202e) || in(0x2066, 0x2069);
    return control ? 0 : bytes;
}

}  // namespace

std::pair<uint32_t, size_t> first_character(std::string_view text) {
    const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
    if (byte(0) < 0x80) return {byte(0), 1};
    const size_t bytes = byte(0) >= 0xf0 ? 4 : byte(0) >= 0xe0 ? 3 : 2;
    if (byte(0) < 0xc2 || byte(0) > 0xf4 || text.size() < bytes) return {0, 0};
    uint32_t character = byte(0) & (0x7f >> bytes);
    for (size_t i = 1; i < bytes; ++i) {
        if (byte(i) >> 6 != 2) return {0, 0};
        character = character << 6 | (byte(i) & 0x3f);
    }
    constexpr uint32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};  // with that many bytes
    return {character, character >= kLeast[bytes] && character <= 0x10ffff ? bytes : 0};
}

std::string one_line(std::string_view text) {
    constexpr char kDigits[] = "0123456789abcdef";
    std::string result;
    for (std::string_view rest = trim(text); !rest.empty();) {
        const size_t bytes = shown_bytes(rest);
        if (bytes > 0) {
            result += rest.substr(0, bytes);
        } else if (kBlanks.find(rest[0]) != std::string_view::npos) {
            result += ' ';
        } else {
            const auto byte = static_cast<unsigned char>(rest[0]);
            result += {'\\', 'x', kDigits[byte >> 4], kDigits[byte & 15]};
        }
        rest.remove_prefix(std::max<size_t>(1, bytes));
    }
    return result;
}

std::string_view next_word(std::string_view& rest) {
    const size_t begin = rest.find_first_not_of(kBlanks);
    if (begin == std::string_view::npos) {
        rest = {};
        return {};
    }
    const size_t end = std::min(rest.find_first_of(kBlanks, begin), rest.size());
    const std::string_view word = rest.substr(begin, end - begin);
    rest.remove_prefix(end);
    return word;
}

std::string_view trim(std::string_view text) {
    const size_t begin = text.find_first_not_of(kBlanks);
    if (begin == std::string_view::npos) return {};
    return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

std::string lower(std::string_view text) {
    std::string result(text);
    for (char& c : result)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return result;
}

std::string grouped(uint64_t number) {
    std::string text = std::to_string(number);
    for (auto at = std::ptrdiff_t(text.size()) - 3; at > 0; at -= 3) text.insert(size_t(at), 1, ',');
    return text;
}

std::string grouped(uint64_t number, std::string_view noun) {
    return grouped(number) + " " + std::string(noun) + (number == 1 ? "" : "s");
}

InputError wrong_length(std::string_view array, uint64_t values, std::string_view who_needs,
                        uint64_t needed) {
    return InputError(std::string(array) + " has " + grouped(values) +
                      (values == 1 ? " value; " : " values; ") + std::string(who_needs) + " " +
                      grouped(needed));
}

std::string duration_text(double seconds) {
    if (!(seconds < 3.6e7)) return "very long";
    const long total = std::lround(std::max(0.0, seconds));
    char text[32];
    if (total < 60)
        std::snprintf(text, sizeof text, "%ld s", total);
    else if (total < 3600)
        std::snprintf(text, sizeof text, "%ld min %02ld s", total / 60, total % 60);
    else
        std::snprintf(text, sizeof text, "%ld h %02ld min", total / 3600, total / 60 % 60);
    return text;
}

std::optional<double> parse_number(std::string_view word) {
    if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (end != word.data() + word.size() || error == std::errc::invalid_argument) return std::nullopt;
    if (error == std::errc::result_out_of_range) {
        // from_chars does not set the value here. Too small becomes zero, too large infinite.
        const size_t exponent = word.find_first_of("eE");
        const bool small = exponent != std::string_view::npos
                               ? word.substr(exponent + 1).starts_with('-')
                               : word.find_first_of("123456789") > word.find('.');
        value = small ? 0.0 : std::numeric_limits<double>::infinity();
        if (word.starts_with('-')) value = -value;
    }
    return value;
}

}  // namespace ewa::core
