// SPDX-License-Identifier: Apache-2.0
#include "io/datasets/importers/image_finder.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "core/folders.h"
#include "core/sandboxed_path.h"
#include "core/text.h"
#include "ewa/error.h"

namespace ewa::io {

namespace {

namespace fs = std::filesystem;

constexpr size_t kMostImages = 200000, kMostFiles = 10 * kMostImages;
constexpr size_t kShownName = 200;

/// Folders beside the images that hold pictures of another kind.
bool is_of_others(const fs::path& folder) {
    const std::string name = core::lower(folder.filename().string());
    return name.starts_with("mask") || name.starts_with("depth") || name.starts_with("confidence") ||
           name.starts_with("images_") || name.starts_with(".");
}

/// How many parts of the paths are the same, from the end.
size_t common_parts(const fs::path& a, const fs::path& b) {
    const std::vector<fs::path> x(a.begin(), a.end()), y(b.begin(), b.end());
    return size_t(std::mismatch(x.rbegin(), x.rend(), y.rbegin(), y.rend()).first - x.rbegin());
}

/// Also of paths that were written on Windows.
std::string with_slashes(std::string name) {
    std::replace(name.begin(), name.end(), '\\', '/');
    return name;
}

}  // namespace

bool is_named_as_image(const fs::path& file) {
    static constexpr std::array kExtensions{".jpg",  ".jpeg", ".png", ".tif", ".tiff",
                                            ".webp", ".bmp",  ".exr", ".ppm", ".pgm"};
    const std::string extension = core::lower(file.extension().string());
    return std::ranges::find(kExtensions, extension) != kExtensions.end();
}

ImageFinder::ImageFinder(const fs::path& dataset, const std::vector<std::string>& folders)
    : place_(dataset), folder_(dataset / "images") {
    for (const std::string& name : folders)
        if (core::is_folder(dataset / name)) {
            place_ = folder_ = dataset / name;
            own_folder_ = false;
            break;
        }
    size_t files = 0;
    std::error_code error;
    constexpr auto kOptions = fs::directory_options::skip_permission_denied;
    for (fs::recursive_directory_iterator at(place_, kOptions, error), end; at != end; at.increment(error)) {
        if (error) break;
        if (++files > kMostFiles || names_.size() > kMostImages)
            throw InputError(core::one_line(place_.string()) + ": holds more than 200000 images");
        if (at->is_directory(error) && is_of_others(at->path())) at.disable_recursion_pending();
        if (is_named_as_image(at->path()) && core::is_file(at->path()))
            names_.push_back(at->path().lexically_relative(place_));
    }
    std::sort(names_.begin(), names_.end());
    for (size_t i = 0; i < names_.size(); ++i) {
        by_name_[core::lower(names_[i].filename().string())].push_back(i);
        by_stem_[core::lower(names_[i].stem().string())].push_back(i);
    }
}

std::vector<size_t> ImageFinder::named(const fs::path& name) const {
    const auto look = [](const auto& map, const fs::path& key) {
        const auto found = map.find(core::lower(key.string()));
        return found == map.end() ? std::vector<size_t>() : found->second;
    };
    std::vector<size_t> found = look(by_name_, name.filename());
    if (found.empty()) found = look(by_stem_, name.filename());
    if (found.empty()) found = look(by_stem_, name.stem());
    return found;
}

ImageFinder::Found ImageFinder::find(const std::string& text, const std::string& where) const {
    const std::string shown = "the image \"" + core::one_line(text.substr(0, kShownName)) + "\" ";
    fs::path name = core::name_inside(with_slashes(text)).value_or(fs::path());
    if (name.empty()) {
        const std::string path = with_slashes(text);
        name = core::name_inside(path.substr(path.rfind('/') + 1)).value_or(fs::path());
    }
    if (name.empty()) throw InputError(where + ": " + shown + "has no file's name");
    std::vector<size_t> found;
    if (!std::binary_search(names_.begin(), names_.end(), name)) found = named(name);
    const auto common = [&](size_t i) { return common_parts(names_[i], name); };
    size_t most = 0;
    for (const size_t i : found) most = std::max(most, common(i));
    std::erase_if(found, [&](size_t i) { return common(i) < most; });
    if (found.size() > 1)
        throw InputError(where + ": " + shown + "is one of " + std::to_string(found.size()) + " images in " +
                         core::one_line(place_.string()) + ", such as " +
                         core::one_line(names_[found[0]].string()) + " and " +
                         core::one_line(names_[found[1]].string()) + "; give the images different names");
    if (found.size() == 1) name = names_[found[0]];
    const bool inside = own_folder_
                            ? core::links_stay_with_images(place_, name)
                            : core::links_stay_with_images(place_.parent_path(), place_.filename() / name);
    if (!inside)
        throw InputError(where + ": " + shown + "is a link out of the dataset's folder; " +
                         core::kLinkAdvice);
    return {place_ / name, name.string()};
}

}  // namespace ewa::io
