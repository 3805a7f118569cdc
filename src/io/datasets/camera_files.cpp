// SPDX-License-Identifier: Apache-2.0
#include "io/datasets/camera_files.h"

#include <algorithm>
#include <iterator>

#include "core/folders.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "io/datasets/importers/image_finder.h"
#include "io/datasets/importers/importer.h"
#include "io/datasets/transforms_files.h"

namespace ewa::io {
namespace {

namespace fs = std::filesystem;
using core::is_file;
using core::is_folder;

void append(ImageRecords& all, ImageRecords more) {
    std::move(more.images.begin(), more.images.end(), std::back_inserter(all.images));
    all.files.insert(all.files.end(), more.files.begin(), more.files.end());
    if (all.points.positions.empty()) all.points = std::move(more.points);
    if (all.dropped.count == 0) all.dropped.first = std::move(more.dropped.first);
    all.dropped.count += more.dropped.count;
    all.notes.insert(all.notes.end(), more.notes.begin(), more.notes.end());
    all.color_depends_on_view = all.color_depends_on_view || more.color_depends_on_view;
}

/// In Blender's scenes, the file name states the split.
int split_of(const fs::path& path) {
    const std::string stem = core::lower(path.stem().string());
    return stem == "transforms_train" ? 1 : stem == "transforms_test" ? 2 : 0;
}

/// The first of the files. transforms_train.json has the held-out images of transforms_test.json, or else of transforms_val.json.
std::optional<ImageRecords> read_transforms_at(const fs::path& root, const std::vector<fs::path>& files,
                                               const DatasetOptions& options) {
    if (files.empty()) return std::nullopt;
    const auto stem = [&](size_t i) {
        return i < files.size() ? core::lower(files[i].stem().string()) : std::string();
    };
    const std::string first = stem(0), second = stem(1);
    const bool both =
        first == "transforms_train" && (second == "transforms_test" || second == "transforms_val");
    ImageRecords all = read_transforms(files[0], split_of(files[0]), options.need_points, root);
    if (both) append(all, read_transforms(files[1], 2, options.need_points, root));
    if (split_of(files[0]) != 0) all.folder = files[0].parent_path() / "images";
    if (second == "transforms_test" ? stem(2) == "transforms_val"
                                    : first == "transforms_test" && second == "transforms_val")
        all.notes.emplace_back(
            "transforms_val.json is not used: transforms_test.json has the held-out images");
    const fs::path place = files[0].lexically_proximate(root);
    if (split_of(files[0]) == 0 && place != "transforms.json")
        all.notes.push_back("the cameras are in " + core::one_line(place.generic_string()));
    return all;
}

/// The first of these models. Empty if there is none.
std::optional<ImageRecords> read_colmap_at(const fs::path& root, const std::vector<ColmapModel>& models) {
    if (models.empty()) return std::nullopt;
    const auto place_of = [&](const ColmapModel& model) {
        return model.folder.lexically_proximate(root).generic_string();
    };
    const auto shown = [&](const ColmapModel& model) {
        return place_of(model) + " with " + core::counted(model.images, "image") +
               (model.extension == ".txt" ? " as text" : "");
    };
    const ImageFinder finder = image_finder(models[0]);
    ImageRecords records = read_colmap(models[0], &finder);
    if (models.size() > 1)
        records.models = {.what = "model",
                          .used = 1,
                          .found = models.size(),
                          .why = shown(models[0]) + ", not " + shown(models[1])};
    else if (!models[0].originals.empty())
        records.notes.push_back("the cameras are in " + core::one_line(place_of(models[0])));
    return records;
}

bool has_images(const std::optional<ImageRecords>& records) {
    return records &&
           std::ranges::any_of(records->images, [](const ImageRecord& image) { return is_file(image.path); });
}

/// The cameras that another program has written; empty if no importer reads the path.
std::optional<ImageRecords> import_model(const fs::path& path, const DatasetOptions& options) {
    std::optional<FoundImporter> found = find_importer(path);
    if (!found) return std::nullopt;
    found->source.with_points = options.need_points;
    ImageRecords records = found->importer->read(found->source);
    records.format = found->importer->format;
    if (const fs::path other = is_file(path) ? fs::path() : other_cameras(path, *found, records.files);
        !other.empty())
        records.notes.push_back(core::one_line(other.filename().string() +
                                               " has cameras, too: name it to use it in place of " +
                                               found->source.file.filename().string()));
    return records;
}

[[noreturn]] void refuse_model(const fs::path& path) {
    const std::string name = core::one_line(path.string()), advice = export_advice(path);
    if (!advice.empty()) throw InputError(name + ": not a dataset: " + advice);
    if (is_file(path))
        throw InputError(name +
                         ": not a dataset; a dataset is a folder, a transforms.json, or a glTF of meshes "
                         "(.gltf, .glb)");
    throw InputError(
        name +
        ": not a dataset; expected cameras and images (.bin or .txt) in sparse/0, sparse or the folder "
        "itself, or transforms.json, transforms_train.json or transforms_test.json, or the cameras of " +
        std::string(kImportedFrom) + "; the folder of a training run has config.json");
}

/// Cameras of other programs in the folder are named.
void note_other_cameras(const fs::path& path, ImageRecords& records) {
    if (records.files.empty()) return;
    const fs::path used = records.files[0];
    const bool is_colmap = records.format == "COLMAP";
    const auto note = [&](const fs::path& other) {
        records.notes.push_back(core::one_line(
            other.lexically_proximate(path).generic_string() +
            " has cameras, too: name it to use it in place of " +
            (is_colmap ? used.parent_path() : used).lexically_proximate(path).generic_string()));
    };
    for (const fs::path& file : transforms_files(path)) {
        if (std::ranges::find(records.files, file) != records.files.end()) continue;
        if (split_of(used) != 0 && core::lower(file.filename().string()) == "transforms_val.json") continue;
        note(file);
        break;
    }
    if (const auto found = find_importer(path); found && (is_colmap || records.format == "transforms"))
        note(found->source.file);
    if (is_colmap) return;
    for (const auto& models : {colmap_models(path), colmap_workspaces(path), colmap_models_below(path)})
        if (!models.empty()) return note(models[0].folder);
}

/// Points that the cameras' file does not name: a PLY that is alone beside the cameras, in a folder above them, or beside dense images.
void add_points_found(const fs::path& path, const DatasetOptions& options, ImageRecords& records) {
    const bool named = std::ranges::any_of(
        records.files, [](const fs::path& file) { return core::lower(file.extension().string()) == ".ply"; });
    if (named || records.files.empty() || records.frame_rate > 0) return;
    const fs::path root = is_file(path) ? path.parent_path() : path;
    std::vector<fs::path> places{records.files[0].parent_path()};
    while (places.back() != root && places.back().has_relative_path())
        places.push_back(places.back().parent_path());
    places.push_back(entry_in(root, "dense"));
    const size_t before = records.files.size();
    for (const fs::path& place : places)
        if (records.files.size() == before)
            add_points_beside(place.empty() ? "." : place, options.need_points, records);
}

ImageRecords read_cameras(const fs::path& path, const DatasetOptions& options) {
    if (is_file(path)) {
        if (auto imported = import_model(path, options)) return std::move(*imported);
        if (core::lower(path.extension().string()) != ".json") refuse_model(path);
        return read_transforms(path, split_of(path), options.need_points);
    }
    if (!is_folder(path))
        throw InputError(core::one_line(path.string()) + ": there is no such file or folder");
    std::optional<ImageRecords> colmap = read_colmap_at(path, colmap_models(path));
    if (has_images(colmap)) return std::move(*colmap);
    // A workspace may have images where the model beside it has none.
    std::optional<ImageRecords> workspace;
    if (colmap) workspace = read_colmap_at(path, colmap_workspaces(path));
    if (colmap) return std::move(has_images(workspace) ? *workspace : *colmap);
    if (auto records = read_transforms_at(path, transforms_files(path), options)) return std::move(*records);
    if (auto records = import_model(path, options)) return std::move(*records);
    if (auto records = read_colmap_at(path, colmap_workspaces(path))) return std::move(*records);
    if (auto records = read_transforms_at(path, transforms_files_below(path), options))
        return std::move(*records);
    if (auto records = read_colmap_at(path, colmap_models_below(path))) return std::move(*records);
    refuse_model(path);
}

}  // namespace

ImageRecords read_model(const fs::path& path, const DatasetOptions& options) {
    ImageRecords records = read_cameras(path, options);
    if (is_folder(path)) note_other_cameras(path, records);
    if (records.format == "COLMAP" || records.format == "transforms")
        add_points_found(path, options, records);
    return records;
}

}  // namespace ewa::io
