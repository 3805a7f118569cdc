// SPDX-License-Identifier: Apache-2.0
// From photos or a video to a dataset: which input it is, what is done already, and what did not work.
#include "ewa/capture.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <set>

#include "capture/steps.h"
#include "core/folders.h"
#include "core/json.h"
#include "core/text.h"
#include "ewa/dataset.h"
#include "ewa/error.h"
#include "image/image_files.h"
#include "io/datasets/image_records.h"

namespace ewa {
namespace {

namespace fs = std::filesystem;
using core::is_file;
using core::is_folder;
using Json = nlohmann::ordered_json;

constexpr int kMostUnordered = 200;  // photos; all pairs of more take hours on a CPU
constexpr size_t kNamed = 8;         // photos that a remark names
constexpr size_t kLeastPhotos = 3;

std::string extension_of(const fs::path& path) {
    return core::lower(path.extension().string());
}

bool is_video(const fs::path& path) {
    constexpr std::array kVideos{".mp4", ".mov", ".m4v", ".mkv", ".webm", ".avi", ".mts", ".3gp"};
    return is_file(path) && std::find(kVideos.begin(), kVideos.end(), extension_of(path)) != kVideos.end();
}

/// Whether load_dataset finds cameras in the folder.
bool has_cameras(const fs::path& folder) {
    if (io::find_colmap_model(folder)) return true;
    for (const char* file : {"transforms.json", "transforms_train.json", "transforms_test.json"})
        if (is_file(folder / file)) return true;
    return false;
}

bool is_heic(const fs::path& path) {
    const std::string extension = extension_of(path);
    return extension == ".heic" || extension == ".heif";
}

/// The photos are in the folder, or in its images/.
fs::path folder_of_photos(const fs::path& folder) {
    return is_folder(folder / "images") ? folder / "images" : folder;
}

const char* name_of(Matching matching) {
    return matching == Matching::sequence    ? "sequence"
           : matching == Matching::unordered ? "unordered"
                                             : "auto";
}

Json record_of(const fs::path& input, const CaptureOptions& options, bool video) {
    Json record{{"input", fs::canonical(input).string()}, {"matching", name_of(options.matching)}};
    if (video) record["frames"] = options.frames;
    return record;
}

/// Makes sure that the folder is new, or was begun with the same input and options.
void claim(const fs::path& folder, const Json& record) {
    const fs::path file = folder / "capture.json";
    const std::string name = core::one_line(folder.string());
    if (is_file(file)) {
        if (core::read_json_file<Json>(file) == record) return;
        throw InputError(name +
                         " is the dataset of another input, or was made with other options; choose another "
                         "folder, or remove it");
    }
    if (is_folder(folder) && !fs::is_empty(folder))
        throw InputError(name + " is not empty, and no dataset that ewa has made; choose another folder");
    core::make_folder(folder);
    core::write_json(file, record);
}

std::string names_text(const std::vector<std::string>& names) {
    std::string text;
    for (size_t i = 0; i < std::min(names.size(), kNamed); ++i) {
        if (i > 0) text += ", ";
        text += names[i];
    }
    if (names.size() > kNamed)
        text.append(" and ").append(std::to_string(names.size() - kNamed)).append(" more");
    return text;
}

Capture result_of(const fs::path& folder, const std::vector<fs::path>& names) {
    const Dataset dataset = load_dataset(folder, {.need_images = false, .need_points = false});
    std::set<std::string> placed;
    for (const Frame& frame : dataset.frames) placed.insert(frame.name);
    Capture result;
    result.images = int(names.size());
    for (const fs::path& name : names)
        if (!placed.contains(name.string())) result.not_placed.push_back(core::one_line(name.string()));
    result.placed = result.images - int(result.not_placed.size());
    if (!result.not_placed.empty())
        result.remarks.push_back(
            std::to_string(result.not_placed.size()) + " of " + std::to_string(result.images) +
            " photos could not be placed, and are not used: " + names_text(result.not_placed));
    return result;
}

Capture make(const fs::path& input, const fs::path& folder, const CaptureOptions& options,
             const capture::ProgressFunction& progress) {
    const bool video = is_video(input);
    const fs::path images = folder / "images", work = folder / "colmap", model = folder / "sparse/0";
    if (!video) capture::photos_in(folder_of_photos(input));  // its errors come before the folder is made
    claim(folder, record_of(input, options, video));
    const core::FolderLock lock(folder);
    core::make_folder(work);
    if (!fs::exists(fs::symlink_status(images))) {
        if (video)
            capture::extract_frames(input, images, options.frames, work / "log.txt", progress);
        else
            fs::create_directory_symlink(fs::canonical(folder_of_photos(input)), images);
    }
    const std::vector<fs::path> names = capture::photos_in(images);
    const bool sequence = options.matching == Matching::automatic
                              ? video || int(names.size()) > kMostUnordered
                              : options.matching == Matching::sequence;
    std::vector<std::string> remarks;
    if (!is_folder(model)) {
        core::make_folder(model.parent_path());
        remarks = capture::place_photos({images, names, sequence}, work, model, progress);
    }
    Capture result = result_of(folder, names);
    result.remarks.insert(result.remarks.begin(), remarks.begin(), remarks.end());
    return result;
}

}  // namespace

std::vector<fs::path> capture::photos_in(const fs::path& folder) {
    const std::string name = core::one_line(folder.string());
    const std::vector<fs::path> files = image::images_below(folder);
    const auto heic = std::count_if(files.begin(), files.end(), is_heic);
    if (heic > 0)
        throw InputError(
            name + ": " + std::to_string(heic) +
            " photos are HEIC, which COLMAP cannot read; convert them, for example with "
            "heif-convert IMG.HEIC IMG.jpg (Debian: libheif-examples), and remove the originals");
    std::vector<fs::path> photos;
    for (const fs::path& file : files) {
        const std::string_view format = image::format_name(folder / file);
        if (format == "jpeg" || format == "png" || format == "tiff" || format == "bmp")
            photos.push_back(file);
    }
    if (photos.size() < kLeastPhotos)
        throw InputError(
            name + " has " + std::to_string(photos.size()) +
            " photos (JPEG, PNG, TIFF or BMP); cameras need at least 3, and good splats 30 or more");
    return photos;
}

bool is_capture(const fs::path& path) {
    if (is_video(path)) return true;
    return is_folder(path) && !has_cameras(path) && !image::images_below(folder_of_photos(path)).empty();
}

Capture make_dataset(const fs::path& input, const fs::path& folder, const CaptureOptions& options,
                     const std::function<bool(const CaptureProgress&)>& progress) {
    if (!is_capture(input))
        throw InputError(core::one_line(input.string()) + (fs::exists(input)
                                                               ? ": neither a video nor a folder with photos"
                                                               : ": there is no such file or folder"));
    try {
        return make(input, folder, options, progress);
    } catch (const capture::Stopped&) {
        Capture result;
        result.interrupted = true;
        return result;
    } catch (const fs::filesystem_error& error) {
        throw RunError(core::one_line(error.path1().string()) + ": " + error.code().message());
    }
}

}  // namespace ewa
