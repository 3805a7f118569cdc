// SPDX-License-Identifier: Apache-2.0
// Text: parsing of words and numbers, safe display of foreign text, and help text.
#pragma once
#include <cctype>
#include <charconv>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "ewa/error.h"

namespace ewa::core {

/// The text in a form that is safe to display, on one line. White space becomes spaces. Other control
/// characters, characters that change the direction of text, and bytes that are not UTF-8 become hexadecimal,
/// as \x1b. All errors and all names for a terminal must pass through this.
std::string one_line(std::string_view text);

/// Removes the first word from `rest` and returns it. White space separates words. Empty at the end.
std::string_view next_word(std::string_view& rest);

/// The text without leading and trailing white space.
std::string_view trim(std::string_view text);

/// The text in lower case (ASCII only).
std::string lower(std::string_view text);

/// The number with commas: "40,715".
std::string grouped(uint64_t number);
/// "1 splat", "40,715 splats".
std::string grouped(uint64_t number, std::string_view noun);

/// The error for a caller's array of a wrong length: "means has 3 values; 40,715 splats need 122,145".
InputError wrong_length(std::string_view array, uint64_t values, std::string_view who_needs, uint64_t needed);

/// Seconds as "12 s", "3 min 05 s" or "2 h 10 min".
std::string duration_text(double seconds);

/// The whole word as a number, including "nan" and "inf". Independent of the locale.
std::optional<double> parse_number(std::string_view word);

/// The whole word as an integer that fits T.
template <class T>
std::optional<T> parse_integer(std::string_view word) {
    T value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
    return value;
}

/// The help text of a command line parser for this terminal: wrapped_help() of core/terminal.h at its width.
/// column: where the descriptions of options begin.
std::string help_text(std::string_view text, size_t column);

/// The text up to its first full stop that a blank follows, without that stop.
std::string first_sentence(std::string_view text);

/// The options that a short help shows, by their long names or those of positionals. A text replaces the first sentence
/// of the option's own; empty: none.
using ShortHelp = std::map<std::string, std::string>;

/// Makes a CLI11 parser and the sub-commands that are added later print their help in this way, with defaults in
/// brackets. A template, so that this module does not need CLI11: Formatter is CLI::Formatter.
/// brief: the options that --help shows; --help-all shows all of them. Empty: --help shows all.
template <class Formatter, class App>
void use_help_text(App& app, ShortHelp brief = {}) {
    app.formatter_fn([brief = std::move(brief)](const App* shown, const std::string& name, auto mode) {
        using Option = std::remove_pointer_t<typename decltype(shown->get_options({}))::value_type>;
        struct Plain : Formatter {
            const ShortHelp* brief = nullptr;
            std::string name_of(const Option* option) const {
                return option->get_lnames().empty() ? option->get_name() : option->get_lnames().front();
            }
            std::string make_group(std::string group, bool positional,
                                   std::vector<const Option*> options) const override {
                if (brief)
                    std::erase_if(options, [&](auto* option) { return !brief->contains(name_of(option)); });
                return options.empty() ? "" : Formatter::make_group(std::move(group), positional, options);
            }
            std::string make_option_desc(const Option* option) const override {
                std::string whole = Formatter::make_option_desc(option);
                if (!brief) return whole;
                const std::string& text = brief->at(name_of(option));
                return text.empty() ? first_sentence(whole) : text;
            }
            std::string make_option_opts(const Option* option) const override {
                std::string text = option->get_type_size() == 0 ? "" : option->get_type_name();
                // Options of a few words have these in place of a type.
                const size_t colon = text.rfind(':');
                const auto next = static_cast<unsigned char>(colon + 1 < text.size() ? text[colon + 1] : 0);
                if (std::islower(next) || std::isdigit(next)) text.erase(0, colon + 1);
                if (text == "TEXT" && option->get_positional()) text.clear();
                if (!text.empty()) text.insert(0, " ");
                if (!option->get_default_str().empty()) text += " [" + option->get_default_str() + "]";
                return text;
            }
        };
        constexpr size_t kColumn = 30;
        Plain formatter;
        formatter.column_width(kColumn);
        std::string rest;
        if (!brief.empty() && mode != decltype(mode)::All) {
            formatter.brief = &brief;
            rest = "\n" + name + " --help-all has the other options, and says more about these.\n";
        }
        return help_text(formatter.make_help(shown, name, mode) + rest, kColumn);
    });
}

}  // namespace ewa::core
