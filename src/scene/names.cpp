// SPDX-License-Identifier: Apache-2.0
#include "scene/names.h"

#include <algorithm>
#include <optional>
#include <string_view>

#include "core/typing.h"
#include "ewa/error.h"

namespace ewa::scene {
namespace {

namespace fs = std::filesystem;

int checked_index(const Dataset& dataset, int index) {
    if (index >= 0 && index < std::ssize(dataset.frames)) return index;
    throw InputError("there is no frame " + std::to_string(index) + ": " + dataset.root.string() + " has " +
                     core::counted(dataset.frames.size(), "frame") + ", numbered from 0 in name order");
}

std::vector<std::string> names_of(const Dataset& dataset) {
    std::vector<std::string> names;
    for (const Frame& frame : dataset.frames) names.push_back(frame.name);
    return names;
}

/// The first and the last frame of an item of the list.
std::pair<int, int> range_of(const Dataset& dataset, const std::string& item, const std::string& list) {
    if (const auto index = core::parse_integer<int>(item)) {
        const int checked = checked_index(dataset, *index);
        return {checked, checked};
    }
    if (const int named = index_of_name(names_of(dataset), item); named >= 0) return {named, named};
    const size_t dash = std::min(item.find('-'), item.size());
    const auto first = core::parse_integer<int>(std::string_view(item).substr(0, dash));
    const auto last =
        core::parse_integer<int>(std::string_view(item).substr(std::min(dash + 1, item.size())));
    if (first && last && *last < *first) throw InputError("the frames " + item + " end before they begin");
    if (first && last) return {checked_index(dataset, *first), checked_index(dataset, *last)};
    std::vector<std::string> names;
    for (const Frame& frame : dataset.frames) {
        names.push_back(frame.name);
        names.push_back(fs::path(frame.name).filename().string());
    }
    throw InputError("'" + list +
                     "' is not all, train, test, a frame's name, or frame indices such as 0,3 or 5-9" +
                     core::did_you_mean(item, names));
}

}  // namespace

int index_of_name(const std::vector<std::string>& names, const std::string& name) {
    int found = -1, count = 0;
    for (int i = 0; i < std::ssize(names); ++i) {
        const fs::path own = names[size_t(i)];
        if (own == name) return i;
        const fs::path bare = fs::path(own).replace_extension();
        if (bare != name && own.filename() != name && bare.filename() != name) continue;
        found = i;
        ++count;
    }
    return count == 1 ? found : -1;
}

std::vector<int> frames_named(const Dataset& dataset, const std::string& list) {
    std::vector<int> frames;
    for (const std::string_view part : core::split_list(list)) {
        const auto [first, last] = range_of(dataset, std::string(part), list);
        for (int index = first; index <= last; ++index)
            if (std::find(frames.begin(), frames.end(), index) == frames.end()) frames.push_back(index);
    }
    return frames;
}

std::string dataset_name(const fs::path& path) {
    std::error_code error;
    fs::path folder = fs::weakly_canonical(path, error);
    if (error) folder = path;
    if (!folder.has_filename()) folder = folder.parent_path();  // after a last slash
    if (folder.has_extension() && !fs::is_directory(folder, error)) folder = folder.parent_path();
    // A COLMAP model's own folder.
    if (core::parse_integer<unsigned>(folder.filename().string()) &&
        folder.parent_path().filename() == "sparse")
        folder = folder.parent_path();
    if (folder.filename() == "sparse") folder = folder.parent_path();
    const std::string name = folder.filename().string();
    return name.empty() || name == "." || name == ".." ? "dataset" : name;
}

}  // namespace ewa::scene
