// SPDX-License-Identifier: Apache-2.0
#include "cli/output.h"

#include <unistd.h>
#include <nlohmann/json.hpp>

#include <cerrno>
#include <map>
#include <system_error>

#include "core/atomic_file.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::cli {

namespace fs = std::filesystem;

namespace {

/// As make_folder says it.
[[noreturn]] void no_folder(const fs::path& folder, const std::error_code& error) {
    throw RunError("cannot create the folder " + folder.string() + ": " + error.message());
}

/// The path without links and dots. The file need not exist.
fs::path resolved(const fs::path& path) {
    std::error_code error;
    const fs::path whole = fs::weakly_canonical(fs::absolute(path, error), error);
    return error ? path.lexically_normal() : whole;
}

}  // namespace

void check_writable(const fs::path& file, Folder made) {
    const fs::path folder = file.parent_path();
    std::error_code error;
    if (made == Folder::there || folder.empty() || fs::exists(folder, error)) {
        const core::AtomicFile probe(file);  // removed again: nothing is committed
        return;
    }
    fs::path above = folder;
    while (!above.empty() && !fs::exists(above, error)) above = above.parent_path();
    if (above.empty()) above = ".";
    if (!fs::is_directory(above, error)) no_folder(folder, std::make_error_code(std::errc::not_a_directory));
    if (access(above.c_str(), W_OK | X_OK) != 0)
        no_folder(folder, std::error_code(errno, std::generic_category()));
}

void keep_apart(const NamedFile& written, const std::vector<NamedFile>& others) {
    keep_apart(std::vector{written}, others);
}

void keep_apart(const std::vector<NamedFile>& written, const std::vector<NamedFile>& others) {
    std::map<fs::path, const NamedFile*> there;
    for (const NamedFile& other : others)
        if (!other.path.empty()) there.emplace(resolved(other.path), &other);
    for (const NamedFile& file : written) {
        if (file.path.empty()) continue;
        const auto [taken, is_new] = there.emplace(resolved(file.path), &file);
        if (!is_new)
            throw InputError(core::one_line(file.name + " " + file.path.string() + " is the same file as " +
                                            taken->second->name + "; it would be overwritten"));
    }
}

}  // namespace ewa::cli
