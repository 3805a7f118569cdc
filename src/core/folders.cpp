// SPDX-License-Identifier: Apache-2.0
#include "core/folders.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <system_error>

#include "core/text.h"
#include "ewa/error.h"

namespace ewa::core {

bool is_file(const std::filesystem::path& path) {
    std::error_code ignored;
    return std::filesystem::is_regular_file(path, ignored);
}

bool is_folder(const std::filesystem::path& path) {
    std::error_code ignored;
    return std::filesystem::is_directory(path, ignored);
}

bool is_of_desktop(const std::filesystem::path& inside) {
    for (const std::filesystem::path& part : inside)
        if (const std::string name = part.string();
            (name.starts_with('.') && name != "." && name != "..") || name == "__MACOSX" || name == "@eaDir")
            return true;
    return inside.filename() == "Thumbs.db" || inside.filename() == "desktop.ini";
}

std::string with_home(const std::string& word) {
    const char* home = std::getenv("HOME");
    const size_t equals = word.find('=');
    const size_t begin = word.starts_with("--") && equals != std::string::npos ? equals + 1 : 0;
    const bool names_home = word.compare(begin, 2, "~/") == 0 || word.substr(begin) == "~";
    if (!home || *home == 0 || !names_home) return word;
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
    descriptor_ = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor_ < 0 || flock(descriptor_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
    close(descriptor_);
    throw RunError(one_line(folder.string()) +
                   ": another process uses this folder; wait for it, or give another --output");
}

FolderLock::~FolderLock() {
    if (descriptor_ >= 0) close(descriptor_);
}

TemporaryFolder::TemporaryFolder(const std::string& prefix) {
    std::string name = (std::filesystem::temp_directory_path() / (prefix + "XXXXXX")).string();
    if (!mkdtemp(name.data())) throw RunError(name + ": cannot be created: " + std::strerror(errno));
    path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

}  // namespace ewa::core
