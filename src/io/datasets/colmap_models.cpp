// SPDX-License-Identifier: Apache-2.0
// Where a dataset has models of COLMAP.
#include <algorithm>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/file_reader.h"
#include "core/folders.h"
#include "core/text.h"
#include "ewa/error.h"
#include "io/datasets/image_records.h"
#include "io/datasets/importers/image_finder.h"

namespace ewa::io {

namespace {

namespace fs = std::filesystem;
using core::is_folder;

/// The folders of the folder whose names are numbers, as COLMAP's mapper names models, in their order.
std::vector<fs::path> numbered_in(const fs::path& folder) {
    std::vector<std::pair<uint32_t, fs::path>> found;
    std::error_code error;
    for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
        if (const auto number = core::parse_integer<uint32_t>(at->path().filename().string());
            number && is_folder(at->path()))
            found.emplace_back(*number, at->path());
    std::ranges::sort(found);
    std::vector<fs::path> folders;
    for (auto& each : found) folders.push_back(std::move(each.second));
    return folders;
}

/// The models in sparse/0 and so on, sparse, the folder itself, and folders of it that are numbers.
std::vector<ColmapModel> models_in(const fs::path& folder) {
    const fs::path sparse = entry_in(folder, "sparse");
    std::vector<fs::path> places = numbered_in(sparse);
    places.push_back(sparse);
    places.push_back(folder);
    std::ranges::copy(numbered_in(folder), std::back_inserter(places));
    std::vector<ColmapModel> models;
    for (const fs::path& place : places)
        for (const char* extension : {".bin", ".txt"})
            if (core::is_file(entry_in(place, std::string("cameras") + extension)) &&
                core::is_file(entry_in(place, std::string("images") + extension)))
                models.push_back({.folder = place, .dataset = folder, .extension = extension});
    return models;
}

/// The model with the most images first. Binary and text files of as many images in a folder are one model.
std::vector<ColmapModel> by_size(std::vector<ColmapModel> models) {
    if (models.size() < 2) return models;
    for (ColmapModel& model : models) model.images = count_images(model);
    for (size_t i = models.size(); i-- > 1;)
        if (models[i].folder == models[i - 1].folder && models[i].images == models[i - 1].images)
            models.erase(models.begin() + std::ptrdiff_t(i));
    std::ranges::stable_sort(models, std::greater(), &ColmapModel::images);
    return models;
}

bool is_number(const fs::path& folder) {
    return core::parse_integer<uint32_t>(folder.filename().string()).has_value();
}

/// Whether programs give folders of models and of their workspaces such a name.
bool is_part_of_workspace(const fs::path& folder) {
    constexpr std::string_view kWords[] = {"sparse",    "dense", "colmap", "glomap",
                                           "distorted", "model", "sfm",    "calibration",
                                           "geo",       "text",  "txt",    "aligned"};
    const std::string name = core::lower(folder.filename().string());
    return is_number(folder) || std::ranges::any_of(kWords, [&](std::string_view word) {
               return name.find(word) != std::string::npos;
           });
}

/// The models of the folders below. Those of a folder that has some are not searched.
std::vector<ColmapModel> models_below(const fs::path& root) {
    std::vector<ColmapModel> models;
    visit_folders_below(root, [&](const fs::path& folder) {
        std::vector<ColmapModel> found = models_in(folder);
        for (ColmapModel& model : found) model.originals = root;
        std::ranges::move(found, std::back_inserter(models));
        return found.empty();
    });
    return models;
}

}  // namespace

std::vector<ColmapModel> colmap_models(const fs::path& root) {
    return by_size(models_in(root));
}

ColmapModel colmap_model_in(const fs::path& folder) {
    return {.folder = folder, .extension = core::is_file(folder / "cameras.bin") ? ".bin" : ".txt"};
}

std::vector<ColmapModel> colmap_workspaces(const fs::path& root) {
    const fs::path dense = entry_in(root, "dense");
    std::vector<fs::path> folders = numbered_in(dense);
    folders.push_back(dense);
    for (const char* name : {"undistorted", "distorted", "colmap"}) folders.push_back(entry_in(root, name));
    for (const fs::path& folder : folders) {
        if (!is_folder(folder)) continue;
        std::vector<ColmapModel> models = models_in(folder);
        for (ColmapModel& model : models) model.originals = root;
        if (!models.empty()) return by_size(std::move(models));
    }
    return {};
}

std::vector<ColmapModel> colmap_models_below(const fs::path& root) {
    std::vector<ColmapModel> models = models_below(root);
    // Folders with photos of their own are datasets, one of which the user has to name.
    std::set<fs::path> datasets;
    for (const ColmapModel& model : models)
        if (has_photos_folder(model.dataset))
            datasets.insert(is_number(model.dataset) ? model.dataset.parent_path() : model.dataset);
    if (datasets.size() > 1) return {};
    return by_size(std::move(models));
}

ImageFinder image_finder(const ColmapModel& model) {
    std::vector<ImageFinder::Place> places;
    std::set<fs::path> known;
    const auto add = [&](const fs::path& folder, bool own, bool below) {
        if (is_folder(folder) && known.insert(folder).second) places.push_back({folder, own, below});
    };
    const auto add_all = [&](const fs::path& base, bool below) {
        for (const char* name : {"images", "input"}) add(entry_in(base, name), false, true);
        add(base, true, below);
    };
    add_all(model.dataset, true);
    // Undistorted images are the workspace's own. Others may lie where they were.
    for (fs::path folder = model.dataset;
         !model.originals.empty() && folder != model.originals && folder.has_relative_path();) {
        folder = folder.parent_path();
        for (const char* name : {"input", "images"}) add(entry_in(folder, name), false, true);
        add(folder, true, folder == model.originals);
    }
    if (model.folder != model.dataset) add_all(model.folder, false);
    // The path of a workspace's folder means the images beside it, too.
    fs::path whole = fs::absolute(model.dataset / "x").lexically_normal().parent_path();
    for (int level = 0; level < 2 && is_part_of_workspace(whole) && has_outside(whole); ++level) {
        whole = whole.parent_path();
        add_all(whole, false);
    }
    // What is missing is said of the usual folder.
    if (places.empty() || places[0].own) places.insert(places.begin(), {model.dataset / "images"});
    ImageFinder finder(std::move(places));
    // A workspace's images are those of its own model.
    const fs::path& root = model.originals.empty() ? model.dataset : model.originals;
    if (colmap_workspaces(root).empty()) finder.add_last(root);
    return finder;
}

}  // namespace ewa::io
