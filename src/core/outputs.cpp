// SPDX-License-Identifier: Apache-2.0
#include "core/outputs.h"

#include <compare>
#include <map>
#include <optional>
#include <set>
#include <system_error>

#include "core/atomic_file.h"
#include "core/text.h"
#include "ewa/error.h"
#include "platform/file.h"
#include "platform/file_facts.h"

namespace ewa::core {
namespace {

namespace fs = std::filesystem;

/// Where a file is, however its path is spelled: the deepest existing part of the path by its FileId, and the
/// names below it. Two hard links to one file are the same place.
struct Place {
    platform::FileId there;
    fs::path rest;
    auto operator<=>(const Place&) const = default;
};

Place place_of(const fs::path& path) {
    std::error_code error;
    fs::path there = fs::weakly_canonical(fs::absolute(path, error), error);
    if (error) there = fs::absolute(path, error).lexically_normal();
    Place place;
    std::optional<platform::FileId> found = platform::file_id(there);
    for (; !found && there.has_relative_path(); found = platform::file_id(there)) {
        place.rest = platform::folded(there.filename() / place.rest);
        there = there.parent_path();
    }
    place.there = found.value_or(platform::FileId());
    return place;
}

void keep_apart(const std::vector<NamedFile>& written, const std::vector<NamedFile>& read) {
    std::map<Place, const NamedFile*> there;
    for (const NamedFile& file : read)
        if (!file.path.empty()) there.emplace(place_of(file.path), &file);
    for (const NamedFile& file : written) {
        if (file.path.empty()) continue;
        const auto [taken, is_new] = there.emplace(place_of(file.path), &file);
        if (!is_new)
            throw InputError(one_line(file.name + " " + file.path.string() + " is the same file as " +
                                      taken->second->name + "; it would be overwritten; name another file"));
    }
}

[[noreturn]] void no_folder(const fs::path& folder, const std::error_code& error) {
    throw RunError("cannot create the folder " + one_line(folder.string()) + ": " + error.message());
}

/// Throws unless make_folder() could create the folder, whose path names nothing yet.
void check_creatable(const fs::path& folder) {
    std::error_code error;
    fs::path above = folder;
    while (!above.empty() && !fs::exists(above, error)) above = above.parent_path();
    if (above.empty()) above = ".";
    if (!fs::is_directory(above, error)) no_folder(folder, std::make_error_code(std::errc::not_a_directory));
    if (const auto refusal = platform::refuses_files(above)) no_folder(folder, refusal);
}

}  // namespace

void check_outputs(const std::vector<NamedFile>& written, const std::vector<NamedFile>& read) {
    keep_apart(written, read);
    std::set<fs::path> folders;
    for (const NamedFile& file : written) {
        if (file.path.empty()) continue;
        const fs::path folder = file.path.parent_path();
        std::error_code error;
        const bool exists = fs::exists(file.path, error), first = folders.insert(folder).second;
        if (!folder.empty() && !fs::exists(folder, error)) {
            if (first) check_creatable(folder);
        } else if (first ||
                   (exists && (!fs::is_regular_file(file.path, error) || fs::is_symlink(file.path, error)))) {
            const AtomicFile probe(file.path);  // removed again: nothing is committed
        }
        if (first) remove_abandoned_files(folder.empty() ? "." : folder);
    }
}

}  // namespace ewa::core
