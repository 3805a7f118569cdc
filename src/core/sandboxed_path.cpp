// SPDX-License-Identifier: Apache-2.0
#include "core/sandboxed_path.h"

#include <algorithm>
#include <string>

#include "platform/file.h"

namespace ewa::core {

namespace fs = std::filesystem;

namespace {

/// Whether a part of the name is a link. This is faster than following links, and most names have none.
bool meets_link(const fs::path& folder, const fs::path& name) {
    fs::path at = folder;
    std::error_code none;
    return std::any_of(name.begin(), name.end(), [&](const fs::path& part) {
        at /= part;
        return fs::is_symlink(at, none);
    });
}

}  // namespace

std::optional<fs::path> name_inside(std::string_view name) {
    std::string slashes(name);
    std::replace(slashes.begin(), slashes.end(), '\\', '/');
    const bool drive = slashes.size() > 1 && slashes[1] == ':';
    const fs::path path = fs::path(slashes).lexically_normal().generic_string();
    if (slashes.find('\0') != std::string::npos || drive || path.has_root_path()) return std::nullopt;
    if (!platform::can_name_files(path)) return std::nullopt;
    if (path.empty() || !path.has_filename() || path == "." || *path.begin() == "..") return std::nullopt;
    return path;
}

bool links_stay_inside(const fs::path& folder, const fs::path& name) {
    if (!meets_link(folder, name)) return true;
    std::error_code error;
    const fs::path root = fs::canonical(folder.empty() ? "." : folder, error);
    if (error) return false;
    const fs::path target = fs::weakly_canonical(folder / name, error);
    if (error) return false;
    const fs::path relative = target.lexically_relative(root);
    return !relative.empty() && *relative.begin() != "..";
}

bool links_stay_with_images(const fs::path& folder, const fs::path& name) {
    if (links_stay_inside(folder, name)) return true;
    const fs::path first = *name.begin(), rest = name.lexically_relative(first);
    return rest != "." && links_stay_inside(folder / first, rest);
}

}  // namespace ewa::core
