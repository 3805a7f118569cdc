// SPDX-License-Identifier: Apache-2.0
#include "io/splats/value_files.h"

#include <algorithm>
#include <fstream>
#include <string>
#include <system_error>

#include "core/atomic_file.h"
#include "core/folders.h"
#include "core/text.h"

namespace ewa::io {

namespace {

bool is_digits(std::string_view text) {
    return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

bool is_numbered(const std::filesystem::path& file, const std::filesystem::path& usual) {
    if (file.lexically_normal().parent_path() != usual.lexically_normal().parent_path()) return false;
    return file.filename() == usual.filename() || without_number(file) == usual.filename().string();
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

std::filesystem::path numbered(const std::filesystem::path& usual, int number) {
    if (number == 1) return usual;
    std::string name = usual.stem().string();
    name.append("-").append(std::to_string(number)).append(usual.extension().string());
    return usual.parent_path() / name;
}

std::string without_number(const std::filesystem::path& file) {
    std::string name = file.stem().string();
    const size_t dash = name.rfind('-');
    if (dash != std::string::npos && dash > 0 && is_digits(std::string_view(name).substr(dash + 1)))
        name.resize(dash);
    return name + file.extension().string();
}

ValueFiles value_files(const std::filesystem::path& naming, const Paths& usual,
                       Paths (*named_by)(const std::filesystem::path&)) {
    ValueFiles files;
    files.usual = usual;
    for (int number = 1; files.written.empty(); ++number) {
        Paths names;
        for (const std::filesystem::path& name : usual) names.push_back(numbered(name, number));
        if (std::ranges::all_of(names, is_free)) files.written = std::move(names);
    }
    if (!written_by_ewa(naming)) return files;
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

NewValues::NewValues(const std::filesystem::path& naming, ValueFiles (*beside)(const std::filesystem::path&))
    : naming_(naming), beside_(beside), before_(beside(naming)) {}

NewValues::~NewValues() = default;

core::AtomicFile& NewValues::add() {
    files_.push_back(std::make_unique<core::AtomicFile>(before_.written[files_.size()]));
    return *files_.back();
}

Paths NewValues::claim() {
    for (int number = 1;; ++number) {
        Paths names;
        for (const std::filesystem::path& name : before_.usual) names.push_back(numbered(name, number));
        if (!std::ranges::all_of(names, is_free)) continue;
        size_t claimed = 0;
        while (claimed < files_.size() && files_[claimed]->claim(names[claimed])) ++claimed;
        if (claimed == files_.size()) return names;
    }
}

void NewValues::replace(std::string_view text) {
    // All files are on disk before any is renamed.
    core::AtomicFile naming(naming_);
    naming.write(text);
    for (const auto& file : files_) file->commit();
    // Who replaces the same file at the same time would remove the same values, and a name is free once they are gone: without a
    // lock, the later one might remove new values of that name.
    const bool replaces = !is_free(naming_);
    const core::FileLock lock(naming_);
    const ValueFiles beside = beside_(naming_);
    naming.commit();
    if (!replaces || lock.is_others()) return;
    std::error_code ignored;  // older values are of no use, and no harm
    for (const std::filesystem::path& file : beside.removed) std::filesystem::remove(file, ignored);
}

bool written_by_ewa(const std::filesystem::path& file) {
    std::string head(1024, '\0');
    std::ifstream stream(file, std::ios::binary);
    stream.read(head.data(), std::streamsize(head.size()));
    head.resize(size_t(stream.gcount()));
    std::erase_if(head, [](char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; });
    constexpr std::string_view kGenerator = R"("generator":"ewa)";
    const size_t at = head.find(kGenerator);
    return at != std::string::npos && is_digits(std::string_view(head).substr(at + kGenerator.size(), 1));
}

}  // namespace ewa::io
