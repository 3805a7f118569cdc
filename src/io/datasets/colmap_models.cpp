// SPDX-License-Identifier: Apache-2.0
// Where a dataset has models of COLMAP.
#include <algorithm>
#include <set>
#include <string>
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
        // Undistorted images are the workspace's own. Others may lie where they were.
        const std::string name = core::lower(folder.filename().string());
        if (name == "distorted" || name == "colmap")
            for (ColmapModel& model : models) model.originals = root;
        if (!models.empty()) return by_size(std::move(models));
    }
    return {};
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
    if (!model.originals.empty()) {
        for (const char* name : {"input", "images"}) add(entry_in(model.originals, name), false, true);
        add(model.originals, true, false);
    }
    if (model.folder != model.dataset) add_all(model.folder, false);
    // A path of the model's own folder, or of the sparse/ that it is in, means the images beside that.
    const fs::path sparse = entry_in(model.dataset, "sparse");
    if (model.folder != sparse && model.folder.parent_path() != sparse) {
        const fs::path whole = fs::absolute(model.dataset / "x").lexically_normal().parent_path();
        for (const fs::path& above : {whole.parent_path(), whole.parent_path().parent_path()})
            add_all(above, false);
    }
    // What is missing is said of the usual folder.
    if (places.empty() || places[0].own) places.insert(places.begin(), {model.dataset / "images"});
    return ImageFinder(std::move(places));
}

}  // namespace ewa::io
