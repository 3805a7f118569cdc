// SPDX-License-Identifier: Apache-2.0
#include "io/splats/part_folders.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <system_error>

#include "core/atomic_file.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::io {

namespace {

namespace fs = std::filesystem;

bool is_real(const fs::path& path, fs::file_type type) {
    std::error_code error;
    return fs::symlink_status(path, error).type() == type;
}

/// Whether a string of the JSON begins with the folder's name.
bool names_folder(const fs::path& file, const std::string& folder) {
    constexpr size_t kPiece = size_t(1) << 20;
    std::ifstream stream(file, std::ios::binary);
    const std::string starts[] = {"\"" + folder, "\"./" + folder, "\".\\/" + folder};
    std::string text, piece(kPiece, '\0');
    while (stream.read(piece.data(), std::streamsize(kPiece)) || stream.gcount() > 0) {
        text.append(piece, 0, size_t(stream.gcount()));
        for (const std::string& start : starts)
            for (const char* end : {"/", "\\/"})
                if (text.find(start + end) != std::string::npos) return true;
        text.erase(0, text.size() - std::min(text.size(), folder.size() + 8));
    }
    return false;
}

/// Those of the folders that a .json above them names.
std::set<std::string> named_folders(const fs::path& above, const std::set<std::string>& folders) {
    std::set<std::string> named;
    std::error_code error;
    if (folders.empty()) return named;
    for (const auto& entry : fs::directory_iterator(above, error))
        if (core::lower(entry.path().extension().string()) == ".json" && core::is_file(entry.path()))
            for (const std::string& folder : folders)
                if (names_folder(entry.path(), folder)) named.insert(folder);
    return named;
}

/// Images have no mark of their own; that of their meta.json counts.
bool is_own(const fs::path& part) {
    return written_by_ewa(part.extension() == ".webp" ? part.parent_path() / "meta.json" : part);
}

}  // namespace

bool is_pair_of_numbers(std::string_view text) {
    const size_t middle = text.find('_');
    const auto is_number = [](std::string_view digits) {
        return !digits.empty() && digits.find_first_not_of("0123456789") == std::string_view::npos;
    };
    return middle != std::string_view::npos && is_number(text.substr(0, middle)) &&
           is_number(text.substr(middle + 1));
}

PartFolders::PartFolders(const fs::path& naming, const PartKind& kind)
    : naming_(naming), above_(naming.has_parent_path() ? naming.parent_path() : "."), kind_(kind) {
    core::make_folder(above_);
}

PartFolders::~PartFolders() {
    for (const std::string& name : names_) clear(above_ / name);
}

std::string PartFolders::add(const std::string& usual) {
    for (int number = 1;; ++number) {
        const fs::path folder = above_ / numbered(usual, number);
        std::error_code error;
        if (!fs::create_directory(folder, error)) {
            if (!error || error == std::errc::file_exists) continue;
            throw RunError("cannot make the folder " + core::one_line(folder.string()) + ": " +
                           error.message());
        }
        names_.push_back(folder.filename().string());
        if (!lock_) lock_ = std::make_unique<core::FolderLock>(folder);
        core::write_text_file(folder / kUnfinished, names_.front() + "\n");
        return names_.back();
    }
}

void PartFolders::replace(std::string_view text) {
    Paths before;
    // As for values: a folder's name is free once another process has removed the folder.
    std::error_code absent;
    const bool replaces = fs::exists(naming_, absent);
    const core::FileLock lock(naming_);
    if (replaces && !lock.is_others() && written_by_ewa(naming_)) before = kind_.named_by(naming_);
    core::write_text_file(naming_, text);
    std::erase_if(before, [&](const fs::path& part) {
        const fs::path folder = part.parent_path();
        const std::string name = folder.filename().string();
        return !kind_.is_folder(name) || is_new(name) || !kind_.is_part(part) || !is_own(part) ||
               folder.lexically_normal().parent_path() != naming_.lexically_normal().parent_path();
    });
    remove_others(before);
    // Where another process has replaced the naming file since, nobody needs the new folders.
    if (!names_folder(naming_, names_.front())) return;
    std::error_code ignored;
    for (const std::string& name : names_) fs::remove(above_ / name / kUnfinished, ignored);
    names_.clear();
}

bool PartFolders::is_new(const std::string& name) const {
    return std::ranges::count(names_, name) > 0;
}

void PartFolders::remove_others(const Paths& before) const {
    std::set<std::string> folders, abandoned;
    for (const fs::path& part : before) folders.insert(part.parent_path().filename().string());
    // A lock that can be had says that the process is gone: what it has put in place is seen below.
    std::map<std::string, std::unique_ptr<core::FolderLock>> locks;
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(above_, ignored)) {
        const fs::path mark = entry.path() / kUnfinished;
        const std::string name = entry.path().filename().string();
        if (!kind_.is_folder(name) || is_new(name) || !is_real(entry.path(), fs::file_type::directory) ||
            !is_real(mark, fs::file_type::regular))
            continue;
        std::string first;
        std::getline(std::ifstream(mark), first);
        try {
            auto& lock = locks[first];
            if (!lock && kind_.is_folder(first)) lock = std::make_unique<core::FolderLock>(above_ / first);
            abandoned.insert(name);
        } catch (const RunError&) {  // another process writes it
        }
    }
    folders.insert(abandoned.begin(), abandoned.end());
    const std::set<std::string> named = named_folders(above_, folders);
    for (const fs::path& part : before)
        if (!named.contains(part.parent_path().filename().string())) fs::remove(part, ignored);
    for (const std::string& name : folders) {
        if (!abandoned.contains(name)) {
            fs::remove(above_ / name, ignored);  // works once it is empty
        } else if (named.contains(name)) {
            fs::remove(above_ / name / kUnfinished, ignored);
        } else {
            clear(above_ / name);
        }
    }
}

/// Removes what ewa writes into the folder, and the folder if nothing else is in it.
void PartFolders::clear(const fs::path& folder) const {
    std::error_code ignored;
    core::remove_abandoned_files(folder);
    Paths parts;
    for (const auto& entry : fs::directory_iterator(folder, ignored))
        if (kind_.is_part(entry.path())) parts.push_back(entry.path());
    parts.push_back(folder / kUnfinished);
    for (const fs::path& part : parts) fs::remove(part, ignored);
    fs::remove(folder, ignored);  // works once it is empty
}

}  // namespace ewa::io
