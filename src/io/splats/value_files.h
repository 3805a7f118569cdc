// SPDX-License-Identifier: Apache-2.0
// Formats whose values are in files beside the file that names them. New values get other names than the old ones, so
// that the rename of the naming file replaces everything at once.
#pragma once
#include <algorithm>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include "core/text.h"
#include "ewa/error.h"

namespace ewa::io {

using Paths = std::vector<std::filesystem::path>;

/// Whether one of the files is this existing file, also through links.
inline bool contains(const Paths& files, const std::filesystem::path& name) {
    std::error_code none;
    return std::any_of(files.begin(), files.end(),
                       [&](const auto& other) { return std::filesystem::equivalent(other, name, none); });
}

/// The first of the sets of names that is free to write. `used`: the files that the existing naming file names. If
/// it uses none of these names, a file in the way belongs to something else. Then throws InputError: the file, then
/// `refusal`.
inline Paths free_names(const std::vector<Paths>& sets, const Paths& used, const std::string& refusal) {
    const auto uses = [&](const Paths& set) {
        return std::any_of(set.begin(), set.end(), [&](const auto& name) { return contains(used, name); });
    };
    const bool replaces = std::any_of(sets.begin(), sets.end(), uses);
    for (const Paths& set : sets) {
        const auto found = std::find_if(set.begin(), set.end(), [](const auto& name) {
            std::error_code none;
            return std::filesystem::exists(name, none);
        });
        if (found == set.end()) return set;
        if (!replaces) throw InputError(core::one_line(found->string() + refusal));
    }
    const auto unused = std::find_if_not(sets.begin(), sets.end(), uses);
    return unused != sets.end() ? *unused : sets.back();
}

/// Removes the files of all sets but `kept`.
inline void remove_other_names(const std::vector<Paths>& sets, const Paths& kept) {
    std::error_code none;
    for (const Paths& set : sets)
        for (const std::filesystem::path& name : set)
            if (!contains(kept, name)) std::filesystem::remove(name, none);
}

}  // namespace ewa::io
