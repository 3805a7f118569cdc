// SPDX-License-Identifier: Apache-2.0
// Functions that make a row of the options' table from a member of RunOptions.
#pragma once
#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>
#include <string>

#include "core/typing.h"
#include "core/words.h"
#include "ewa/error.h"
#include "run/run_option.h"

namespace ewa::train {

template <class T>
using Member = T& (*)(RunOptions&);

inline constexpr bool kDecides = true, kDoesNotDecide = false;

template <class T>
const T& read_member(Member<T> member, const RunOptions& options) {
    return member(const_cast<RunOptions&>(options));
}

template <class T>
T parse_within(const std::string& text, T low, T high) {
    const auto value = core::parse_count<T>(text);
    if (!value || *value < low || *value > high)
        throw InputError(fmt::format("'{}' is not a whole number from {} to {}", text, low, high));
    return *value;
}

/// The row of an option that sets one member of RunOptions. `parse` reads the value from a text.
template <class T, class Parse>
RunOption member_option(const char* name, const char* value, const char* help, bool decides, Member<T> member,
                        const Parse& parse) {
    RunOption option{name, value, help, decides};
    option.get = [=](const RunOptions& options) {
        return nlohmann::ordered_json(read_member(member, options));
    };
    option.set = [=](RunOptions& options, const std::string& text) { member(options) = parse(text); };
    return option;
}

template <class T>
RunOption number(const char* name, const char* value, const char* help, bool decides, Member<T> member, T low,
                 T high) {
    return member_option(name, value, help, decides, member,
                         [=](const std::string& text) { return parse_within(text, low, high); });
}

inline RunOption flag(const char* name, const char* help, Member<bool> member) {
    RunOption option = member_option(name, "", help, kDecides, member, [](const std::string& text) {
        if (text != "true" && text != "false") throw InputError("'" + text + "' is neither true nor false");
        return text == "true";
    });
    option.flag = member;
    return option;
}

/// The row of a flag that earlier versions of ewa did not have: checkpoints without it count as false.
inline RunOption later_flag(const char* name, const char* help, Member<bool> member) {
    RunOption option = flag(name, help, member);
    option.before = "false";
    return option;
}

template <class T>
RunOption choice(const char* name, const char* help, Member<T> member, const core::Words<T>& words) {
    RunOption option{name, "TEXT", help, kDecides};
    option.choices = core::words_of(words);
    option.get = [=, &words](const RunOptions& options) {
        return core::word_for(words, read_member(member, options));
    };
    option.set = [=, &words](RunOptions& options, const std::string& text) {
        member(options) = core::value_of(words, text);
    };
    return option;
}

inline RunOption real(const char* name, const char* value, const char* help, Member<double> member,
                      double low, double high) {
    RunOption option = member_option(name, value, help, kDecides, member, [=](std::string text) {
        const std::string problem = core::settle_number(text, low, high);
        if (!problem.empty()) throw InputError(problem);
        return core::parse_number(text).value();
    });
    option.before = option.get(RunOptions()).dump();
    return option;
}

inline RunOption words(const char* name, const char* value, const char* help, bool decides,
                       Member<std::string> member) {
    return member_option(name, value, help, decides, member, [](const std::string& text) { return text; });
}

}  // namespace ewa::train
