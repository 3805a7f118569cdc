// SPDX-License-Identifier: Apache-2.0
#include "io/splats/value_files.h"

#include <algorithm>
#include <string>
#include <system_error>

#include "core/text.h"

namespace ewa::io {

namespace {

/// a.bin, a-2.bin, a-3.bin and so on.
std::filesystem::path numbered(const std::filesystem::path& usual, int number) {
    if (number == 1) return usual;
    std::string name = usual.stem().string();
    name.append("-").append(std::to_string(number)).append(usual.extension().string());
    return usual.parent_path() / name;
}

bool is_numbered(const std::filesystem::path& file, const std::filesystem::path& usual) {
    const std::string name = file.filename().string(), stem = usual.stem().string(),
                      end = usual.extension().string();
    if (file.lexically_normal().parent_path() != usual.lexically_normal().parent_path()) return false;
    if (name.size() < stem.size() + end.size() || !name.starts_with(stem) || !name.ends_with(end))
        return false;
    const std::string number = name.substr(stem.size(), name.size() - stem.size() - end.size());
    return number.empty() || (number.size() > 1 && number[0] == '-' &&
                              number.find_first_not_of("0123456789", 1) == std::string::npos);
}

/// Also a link that leads nowhere has a name.
bool is_free(const std::filesystem::path& name) {
    std::error_code error;
    return std::filesystem::symlink_status(name, error).type() == std::filesystem::file_type::not_found;
}

bool is_same(const std::filesystem::path& a, const std::filesystem::path& b) {
    std::error_code error;
    return std::filesystem::equivalent(a, b, error);
}

/// What the other files of the same kind in the folder name.
Paths named_by_others(const std::filesystem::path& naming, Paths (*named_by)(const std::filesystem::path&)) {
    Paths all;
    std::error_code error;
    const std::filesystem::path folder = naming.parent_path();
    const std::string kind = core::lower(naming.extension().string());
    for (const auto& entry : std::filesystem::directory_iterator(folder.empty() ? "." : folder, error)) {
        if (core::lower(entry.path().extension().string()) != kind || is_same(entry.path(), naming)) continue;
        const Paths named = named_by(entry.path());
        all.insert(all.end(), named.begin(), named.end());
    }
    return all;
}

}  // namespace

ValueFiles value_files(const std::filesystem::path& naming, const Paths& usual,
                       Paths (*named_by)(const std::filesystem::path&)) {
    ValueFiles files;
    for (int number = 1; files.written.empty(); ++number) {
        Paths names;
        for (const std::filesystem::path& name : usual) names.push_back(numbered(name, number));
        if (std::ranges::all_of(names, is_free)) files.written = std::move(names);
    }
    for (const std::filesystem::path& file : named_by(naming))
        if (std::ranges::any_of(usual, [&](const auto& name) { return is_numbered(file, name); }))
            files.removed.push_back(file);
    if (files.removed.empty()) return files;
    const Paths others = named_by_others(naming, named_by);
    std::erase_if(files.removed, [&](const auto& file) {
        return std::ranges::any_of(others, [&](const auto& other) { return is_same(other, file); });
    });
    return files;
}

void remove_values(const ValueFiles& files) {
    std::error_code ignored;
    for (const std::filesystem::path& file : files.removed) std::filesystem::remove(file, ignored);
}

}  // namespace ewa::io
