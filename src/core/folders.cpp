// SPDX-License-Identifier: Apache-2.0
#include "core/folders.h"

#include <chrono>
#include <system_error>
#include <thread>

#include "core/text.h"
#include "ewa/error.h"
#include "platform/folders.h"

namespace ewa::core {

bool is_file(const std::filesystem::path& path) {
    std::error_code ignored;
    return std::filesystem::is_regular_file(path, ignored);
}

bool is_folder(const std::filesystem::path& path) {
    std::error_code ignored;
    return std::filesystem::is_directory(path, ignored);
}

bool is_of_desktop(const std::filesystem::path& name) {
    for (const std::filesystem::path& each : name)
        if (const std::string part = each.string();
            (part.starts_with('.') && part != "." && part != "..") || part == "__MACOSX" || part == "@eaDir")
            return true;
    return name.filename() == "Thumbs.db" || name.filename() == "desktop.ini";
}

std::filesystem::path inside(const std::filesystem::path& path, const std::filesystem::path& folder) {
    return path.lexically_relative(folder).generic_string();
}

std::string with_home(const std::string& word) {
    const std::string home = platform::home_folder().string();
    const size_t equals = word.find('=');
    const size_t begin = word.starts_with("--") && equals != std::string::npos ? equals + 1 : 0;
    const bool names_home = word.compare(begin, 2, "~/") == 0 || word.substr(begin) == "~";
    if (home.empty() || !names_home) return word;
    return word.substr(0, begin) + home + word.substr(begin + 1);
}

void make_folder(const std::filesystem::path& folder) {
    if (folder.empty()) return;
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (!error && !is_folder(folder)) error = std::make_error_code(std::errc::not_a_directory);
    if (error) throw RunError("cannot make the folder " + folder.string() + ": " + error.message());
}

FolderLock::FolderLock(const std::filesystem::path& folder) {
    if (platform::lock_path(folder, held_) == platform::Lock::taken)
        throw RunError(one_line(folder.string()) +
                       ": another process uses this folder; wait for it, or give another --output");
}

FileLock::FileLock(const std::filesystem::path& file) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (platform::lock_path(file, held_) == platform::Lock::taken) {
        is_others_ = std::chrono::steady_clock::now() > end;
        if (is_others_) return;
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
}

TemporaryFolder::TemporaryFolder(const std::string& prefix) {
    if (const auto error = platform::make_temporary_folder(prefix.c_str(), path_))
        throw RunError(path_.string() + ": cannot be created: " + error.message());
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

}  // namespace ewa::core
