// SPDX-License-Identifier: Apache-2.0
#include "core/text.h"

#include <cmath>
#include <limits>

namespace ewa::core {

namespace {
constexpr std::string_view kBlanks = " \t\r\n\v\f";
}

std::string one_line(std::string_view text) {
    std::string result(trim(text));
    for (char& c : result)
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
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

std::optional<double> parse_number(std::string_view word) {
    if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (end != word.data() + word.size() || error == std::errc::invalid_argument) return std::nullopt;
    if (error == std::errc::result_out_of_range) {
        // from_chars leaves the value alone; what is too small to hold is zero, what is too large infinite.
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
