// SPDX-License-Identifier: Apache-2.0
#include "core/typing.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <utility>

namespace ewa::core {
namespace {

struct NamedColour {
    std::string_view name;
    uint32_t rgb;
};
// https://www.w3.org/TR/css-color-4/#named-colors
constexpr NamedColour kColours[] = {
    {"black", 0x000000},   {"white", 0xffffff}, {"gray", 0x808080},    {"grey", 0x808080},
    {"silver", 0xc0c0c0},  {"red", 0xff0000},   {"green", 0x008000},   {"blue", 0x0000ff},
    {"yellow", 0xffff00},  {"cyan", 0x00ffff},  {"aqua", 0x00ffff},    {"orange", 0xffa500},
    {"magenta", 0xff00ff}, {"lime", 0x00ff00},  {"fuchsia", 0xff00ff}, {"maroon", 0x800000},
    {"navy", 0x000080},    {"olive", 0x808000}, {"purple", 0x800080},  {"teal", 0x008080}};

std::array<float, 3> of_bytes(uint32_t rgb) {
    return {float(rgb >> 16) / 255, float(rgb >> 8 & 255) / 255, float(rgb & 255) / 255};
}

/// The colour of "#rgb" or "#rrggbb", without the sign.
std::optional<std::array<float, 3>> of_digits(std::string_view digits) {
    uint32_t value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
    if (error != std::errc() || end != digits.data() + digits.size()) return std::nullopt;
    if (digits.size() == 6) return of_bytes(value);
    if (digits.size() != 3) return std::nullopt;
    return of_bytes((value >> 8) * 0x110000 + (value >> 4 & 15) * 0x1100 + (value & 15) * 0x11);
}

std::string_view without_dashes(std::string_view word) {
    word = word.substr(0, word.find('='));
    return word.substr(std::min(word.find_first_not_of('-'), word.size()));
}

/// A letter and its neighbour are one letter in the other order.
bool swapped(std::string_view a, size_t i, std::string_view b, size_t j) {
    return i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j];
}

}  // namespace

size_t edit_distance(std::string_view first, std::string_view second) {
    const std::string a = lower(first), b = lower(second);
    std::vector<size_t> before, last, row(b.size() + 1);
    std::iota(row.begin(), row.end(), size_t(0));
    for (size_t i = 0; i < a.size(); ++i) {
        before = std::exchange(last, row);
        row[0] = i + 1;
        for (size_t j = 0; j < b.size(); ++j) {
            row[j + 1] = std::min({last[j] + (a[i] != b[j]), last[j + 1] + 1, row[j] + 1});
            if (swapped(a, i, b, j)) row[j + 1] = std::min(row[j + 1], before[j - 1] + 1);
        }
    }
    return row.back();
}

std::string closest(std::string_view word, const std::vector<std::string>& known) {
    constexpr size_t kLettersPerMistake = 3, kShortestBeginning = 3;
    const std::string_view typed = without_dashes(word);
    size_t least = std::max<size_t>(1, typed.size() / kLettersPerMistake) + 1;
    std::string found;
    for (const std::string& name : known) {
        const std::string_view bare = without_dashes(name);
        if (bare.size() < 2) continue;  // every letter is near to it
        const size_t distance = edit_distance(typed, bare);
        if (distance >= least) continue;
        least = distance;
        found = name;
    }
    if (!found.empty() || typed.size() < kShortestBeginning) return found;
    const auto whole = std::find_if(known.begin(), known.end(), [&](const std::string& name) {
        return without_dashes(name).starts_with(lower(typed));
    });
    return whole == known.end() ? std::string() : *whole;
}

std::string did_you_mean(std::string_view word, const std::vector<std::string>& known) {
    const std::string near = closest(word, known);
    return near.empty() ? std::string() : "; did you mean " + near + "?";
}

std::string unexpected_arguments(int argc, const char* const* argv, std::vector<std::string> unknown,
                                 const std::vector<std::string>& known) {
    const std::vector<std::string> typed(argv, argv + argc);
    std::vector<std::string> ordered;
    for (const std::string& word : typed)
        if (const auto found = std::find(unknown.begin(), unknown.end(), word); found != unknown.end()) {
            ordered.push_back(word);
            unknown.erase(found);
        }
    ordered.insert(ordered.end(), unknown.begin(), unknown.end());  // of joined short options: not as typed
    std::string text = ordered.size() == 1 ? "unexpected argument:" : "unexpected arguments:";
    for (const std::string& word : ordered) text += " " + word;
    const auto option = std::find_if(ordered.begin(), ordered.end(),
                                     [](const std::string& word) { return word.starts_with('-'); });
    return option == ordered.end() ? text : text + did_you_mean(*option, known);
}

std::optional<std::string> whole_digits(std::string_view text) {
    constexpr int kMostZeros = 20;  // no integer has more
    int zeros = 0;                  // how many to append; negative: decimals
    const std::string_view typed = text;
    if (!text.empty() && (text.back() == 'k' || text.back() == 'K')) zeros = 3;
    if (!text.empty() && (text.back() == 'm' || text.back() == 'M')) zeros = 6;
    if (zeros > 0) text.remove_suffix(1);
    if (const size_t e = text.find_first_of("eE"); e != std::string_view::npos) {
        std::string_view exponent = text.substr(e + 1);
        if (exponent.starts_with('+')) exponent.remove_prefix(1);
        const auto power = parse_integer<int>(exponent);
        if (!power || exponent.starts_with("+-") || typed.size() != text.size()) return std::nullopt;
        if (*power > kMostZeros || *power < -kMostZeros) return std::nullopt;
        zeros = *power;
        text = text.substr(0, e);
    }
    std::string digits(text);
    if (const size_t point = digits.find('.'); point != std::string::npos) {
        zeros -= int(digits.size() - point - 1);
        digits.erase(point, 1);
    }
    if (digits.empty() || digits.find_first_not_of("0123456789") != std::string::npos) return std::nullopt;
    for (; zeros < 0 && digits.size() > 1 && digits.back() == '0'; ++zeros) digits.pop_back();
    if (digits.find_first_not_of('0') == std::string::npos) return "0";
    if (zeros < 0 || zeros > kMostZeros) return std::nullopt;
    return digits + std::string(size_t(zeros), '0');
}

std::string shown_number(double number) {
    char text[32];
    std::snprintf(text, sizeof(text), "%g", number);
    return text;
}

std::string settle_word(std::string& text, const std::vector<std::string>& words) {
    constexpr std::pair<std::string_view, std::string_view> kSpellings[] = {
        {"colour", "color"}, {"color", "colour"}, {"grey", "gray"}, {"gray", "grey"}};
    const auto known = [&](const std::string& word) {
        return std::find(words.begin(), words.end(), word) != words.end();
    };
    if (known(text)) return {};
    for (const auto& [typed, spelled] : kSpellings)
        if (const size_t at = text.find(typed); at != std::string::npos) {
            std::string other = text;
            if (!known(other.replace(at, typed.size(), spelled))) continue;
            text = other;
            return {};
        }
    std::string all;
    for (const std::string& word : words) all += (all.empty() ? "" : ", ") + word;
    return "'" + text + "' is not " + (words.size() > 1 ? "one of " : "") + all + did_you_mean(text, words);
}

std::optional<std::array<float, 3>> parse_colour(std::string_view text) {
    text = trim(text);
    const std::string name = lower(text);
    for (const NamedColour& colour : kColours)
        if (name == colour.name) return of_bytes(colour.rgb);
    if (text.starts_with('#')) return of_digits(text.substr(1));
    std::vector<std::string_view> words;
    if (text.find(',') != std::string_view::npos)
        words = split_list(text);
    else
        while (!trim(text).empty()) words.push_back(next_word(text));
    std::array<float, 3> colour{};
    if (words.size() != colour.size()) return std::nullopt;
    for (size_t c = 0; c < colour.size(); ++c) {
        const char* last = words[c].data() + words[c].size();
        const auto [end, error] = std::from_chars(words[c].data(), last, colour[c]);
        if (error != std::errc() || end != last || !(colour[c] >= 0 && colour[c] <= 1)) return std::nullopt;
    }
    return colour;
}

std::optional<std::array<double, 6>> parse_box(std::string_view text) {
    const auto numbers = parse_list(text);
    std::array<double, 6> box{};
    if (!numbers || numbers->size() != box.size()) return std::nullopt;
    std::ranges::copy(*numbers, box.begin());
    for (size_t k = 3; k < box.size(); ++k)
        if (box[k] < box[k - 3]) return std::nullopt;
    return box;
}

std::vector<std::string_view> split_list(std::string_view text, char separator) {
    std::vector<std::string_view> parts;
    for (size_t begin = 0, end = 0; begin <= text.size(); begin = end + 1) {
        end = std::min(text.find(separator, begin), text.size());
        parts.push_back(trim(text.substr(begin, end - begin)));
    }
    return parts;
}

std::optional<std::vector<double>> parse_list(std::string_view text) {
    std::vector<double> numbers;
    for (const std::string_view part : split_list(text)) {
        const std::optional<double> number = parse_number(part);
        if (!number || !std::isfinite(*number)) return std::nullopt;
        numbers.push_back(*number);
    }
    return numbers;
}

std::string not_a_box(std::string_view text) {
    std::string message(text);
    message.insert(message.begin(), '\'');
    return message + "' is not x,y,z,X,Y,Z with the lower corner first";
}

std::string not_a_colour(std::string_view text) {
    std::vector<std::string> names;
    for (const NamedColour& colour : kColours) names.emplace_back(colour.name);
    return std::string("'").append(text) +
           "' is not a colour: r,g,b with each in 0..1 such as 1,1,1, a name such as white, or #rrggbb" +
           did_you_mean(text, names);
}

std::string counted(uint64_t count, std::string_view noun) {
    return std::to_string(count) + " " + std::string(noun) + (count == 1 ? "" : "s");
}

std::string_view is_or_are(uint64_t count) {
    return count == 1 ? "is" : "are";
}

std::string_view plain_reason(std::string_view message) {
    if (!message.starts_with("[")) return message;
    const size_t end = message.find("] ");
    return end == std::string_view::npos ? message : message.substr(end + 2);
}

}  // namespace ewa::core
