// SPDX-License-Identifier: Apache-2.0
// The words that people type for the values of an enum.
#pragma once
#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/typing.h"
#include "ewa/error.h"

namespace ewa::core {

/// Pairs of a word and the value that it names. A value's first word is its name; its other words are only read.
template <class T>
using Words = std::vector<std::pair<const char*, T>>;

template <class T>
std::vector<std::string> words_of(const Words<T>& words) {
    std::vector<std::string> all;
    for (const auto& named : words) all.emplace_back(named.first);
    return all;
}

/// The value that a word names. Empty if no value has this word.
template <class T>
std::optional<T> find_value(const Words<T>& words, std::string_view word) {
    const auto found = std::ranges::find_if(words, [&](const auto& named) { return word == named.first; });
    return found == words.end() ? std::nullopt : std::optional(found->second);
}

/// The value of a word, as settle_word reads it. Throws InputError.
template <class T>
T value_of(const Words<T>& words, std::string word) {
    if (const std::string problem = settle_word(word, words_of(words)); !problem.empty())
        throw InputError(problem);
    return *find_value(words, word);
}

/// The name of a value. Empty if the value has none.
template <class T>
const char* word_for(const Words<T>& words, T value) {
    const auto found = std::ranges::find_if(words, [&](const auto& named) { return value == named.second; });
    return found == words.end() ? "" : found->first;
}

}  // namespace ewa::core
