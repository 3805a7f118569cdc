// SPDX-License-Identifier: Apache-2.0
// Parses values of options as people type them: counts such as 7k, colours by name, words of a set. Suggests corrections.
// No function needs a library, so that the parsers of all programs can share them.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "core/text.h"

namespace ewa::core {

/// The number of letters to insert, delete, replace or swap with their neighbour until one word is the other.
/// Upper and lower case are the same (ASCII).
size_t edit_distance(std::string_view a, std::string_view b);

/// The known word that `word` was probably meant to be; empty if none is near. Leading dashes do not count, and
/// neither does what follows an equals sign.
std::string closest(std::string_view word, const std::vector<std::string>& known);

/// "; did you mean KNOWN?", or nothing if no known word is near.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& known);

/// One line on arguments that a program does not know, in the order in which they were typed. argv: the program's
/// arguments. unknown: some of them. known: the options there are, as "--name". Suggests one for the first
/// unknown option.
std::string unexpected_arguments(int argc, const char* const* argv, std::vector<std::string> unknown,
                                 const std::vector<std::string>& known);

/// The digits of an exact whole number of 0 or more. It may have a decimal fraction, an exponent, or a last letter
/// k (thousand) or M (million): "1.5k" is 1500. Empty for other text, and for numbers that are not whole.
std::optional<std::string> whole_digits(std::string_view text);

/// A whole number as whole_digits reads it, or a negative one, if it fits T.
template <class T>
std::optional<T> parse_count(std::string_view text) {
    return parse_integer<T>(whole_digits(text).value_or(std::string(text)));
}

/// The parts of the text between separators, without blanks around them. A text without one is one part.
std::vector<std::string_view> split_list(std::string_view text, char separator = ',');

/// The finite numbers of a list with commas between them. Empty for other text.
std::optional<std::vector<double>> parse_list(std::string_view text);

/// A number as a message shows it: without needless digits.
std::string shown_number(double number);

/// Checks that the text is a number from low to high. Returns an empty text, or what is wrong. If T is an integer type, the
/// number must be whole, and `text` is replaced by its plain digits.
template <class T>
std::string settle_number(std::string& text, T low, T high) {
    if constexpr (std::is_integral_v<T>) {
        const auto value = parse_count<T>(text);
        if (value && *value >= low && *value <= high) {
            text = std::to_string(*value);
            return {};
        }
        return "'" + text + "' is not a whole number from " + std::to_string(low) + " to " +
               std::to_string(high);
    } else {
        const auto value = parse_number(text);
        if (value && *value >= double(low) && *value <= double(high)) return {};
        return "'" + text + "' is not a number from " + shown_number(double(low)) + " to " +
               shown_number(double(high));
    }
}

/// Checks that the text is one of the words. Returns an empty text, or what is wrong. Replaces "colour" by "color" and
/// "grey" by "gray", or the reverse, if one of the words has that spelling.
std::string settle_word(std::string& text, const std::vector<std::string>& words);

/// sRGB in [0, 1] from "r,g,b" with each in 0..1, "#rgb", "#rrggbb", or the name of a colour of CSS's basic set
/// (also orange). Commas or blanks separate the numbers. Empty for other text.
std::optional<std::array<float, 3>> parse_colour(std::string_view text);

/// A box from "x,y,z,X,Y,Z", finite numbers with the lower corner first. Empty for other text.
std::optional<std::array<double, 6>> parse_box(std::string_view text);

/// The error text for a box that parse_box does not read.
std::string not_a_box(std::string_view text);

/// The error text for a colour that parse_colour does not read.
std::string not_a_colour(std::string_view text);

/// "1 image", "2 images".
std::string counted(uint64_t count, std::string_view noun);
/// "is" or "are".
std::string_view is_or_are(uint64_t count);

/// A library's message without the name of its exception in brackets before it.
std::string_view plain_reason(std::string_view message);

}  // namespace ewa::core
