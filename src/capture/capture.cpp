// SPDX-License-Identifier: Apache-2.0
// From photos or a video to a dataset: which input it is, what is done already, and what did not work.
#include "ewa/capture.h"

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "capture/steps.h"
#include "core/folders.h"
#include "core/hash.h"
#include "core/json.h"
#include "core/text.h"
#include "ewa/dataset.h"
#include "ewa/error.h"
#include "ewa/splat_files.h"
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

/// The photos of the input. Those that a training in a folder of the photos has rendered do not count.
std::vector<fs::path> photos_of(const fs::path& input, const fs::path& folder) {
    const fs::path photos = folder_of_photos(input);
    const bool of_run = folder.filename() == "dataset" && is_file(folder.parent_path() / "config.json");
    const fs::path results = fs::weakly_canonical(fs::absolute(of_run ? folder.parent_path() : folder));
    const std::string below = results.lexically_relative(fs::canonical(photos)).string() + "/";
    std::vector<fs::path> names = capture::photos_in(photos);
    std::erase_if(names, [&](const fs::path& name) { return name.string().starts_with(below); });
    return names;
}

/// A line for each file: what distinguishes its content, a space, and its name.
std::vector<std::string> lines_of(const fs::path& folder, const std::vector<fs::path>& names) {
    std::vector<std::string> lines;
    for (const fs::path& name : names) {
        core::Hash hash;
        core::add_file(hash, folder / name);
        lines.push_back(core::digits_of(hash) + " " + name.string());
    }
    return lines;
}

/// files: lines_of the input.
Json record_of(const fs::path& input, const CaptureOptions& options, bool video,
               const std::vector<std::string>& files) {
    Json record{{"input", fs::canonical(input).string()}, {"matching", name_of(options.matching)}};
    if (video) record["frames"] = options.frames;
    record["files"] = files;
    return record;
}

/// By name, what distinguishes the contents.
std::map<std::string, std::string> contents_in(const Json& lines) {
    std::map<std::string, std::string> contents;
    for (const Json& value : lines) {
        const std::string line = value.is_string() ? value.get<std::string>() : "";
        const size_t space = line.find(' ');
        if (space != std::string::npos) contents[line.substr(space + 1)] = line.substr(0, space);
    }
    return contents;
}

/// The first file that differs, in words.
std::string difference(const Json& before, const Json& now) {
    const auto old = contents_in(before), current = contents_in(now);
    for (const auto& [name, content] : current) {
        const auto found = old.find(name);
        if (found == old.end()) return core::one_line(name) + " is new";
        if (found->second != content) return core::one_line(name) + " has another content";
    }
    for (const auto& [name, content] : old)
        if (!current.contains(name)) return core::one_line(name) + " is missing";
    return "their list is damaged";
}

/// Whether something has been made of the photos or the video.
bool is_begun(const fs::path& folder, bool video) {
    return is_folder(folder / "sparse/0") ||
           (video ? is_folder(folder / "images") : is_file(folder / "colmap/database.db"));
}

/// Makes sure that the folder is new, or was begun with the same input and options. Older records have no files.
void check_claim(const fs::path& folder, const Json& record, bool video) {
    const fs::path file = folder / "capture.json";
    const std::string name = core::one_line(folder.string());
    if (!is_file(file)) {
        if (!is_folder(folder) || fs::is_empty(folder)) return;
        throw InputError(name + " is not empty, and no dataset that ewa has made; choose another folder");
    }
    Json before = core::read_json_file<Json>(file), now = record;
    const Json files = before.is_object() ? before.value("files", Json()) : Json();
    if (before.is_object()) before.erase("files");
    now.erase("files");
    if (before != now)
        throw InputError(name +
                         " is the dataset of another input, or was made with other options; choose another "
                         "folder, or remove it");
    if (files.is_null() || files == record["files"] || !is_begun(folder, video)) return;
    throw InputError(std::string(video ? "the video has" : "the photos have") + " changed since " + name +
                     " was made of them (" + difference(files, record["files"]) +
                     "); choose another folder, or remove this one");
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

void require_programs(const fs::path& folder, bool video) {
    if (video && !is_folder(folder / "images")) capture::require_ffmpeg();
    if (!is_folder(folder / "sparse/0")) capture::require_colmap();
}

Capture make(const fs::path& input, const fs::path& folder, const CaptureOptions& options,
             const capture::ProgressFunction& progress) {
    const bool video = is_video(input);
    const fs::path images = folder / "images", work = folder / "colmap", model = folder / "sparse/0";
    // All errors of the input come before the folder is made.
    const std::vector<std::string> files = video
                                               ? lines_of(input.parent_path(), {input.filename()})
                                               : lines_of(folder_of_photos(input), photos_of(input, folder));
    const Json record = record_of(input, options, video, files);
    check_claim(folder, record, video);
    require_programs(folder, video);
    core::make_folder(folder);
    const core::FolderLock lock(folder);
    if (!is_file(folder / "capture.json") || !is_begun(folder, video))
        core::write_json(folder / "capture.json", record);
    core::make_folder(work);
    if (!fs::exists(fs::symlink_status(images))) {
        if (video)
            capture::extract_frames(input, images, options.frames, work / "log.txt", progress);
        else
            fs::create_directory_symlink(fs::canonical(folder_of_photos(input)), images);
    }
    const std::vector<fs::path> names = video ? capture::photos_in(images) : photos_of(input, folder);
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

bool is_photo(const fs::path& file) try {
    return is_heic(file) || !image::format_name(file).empty();
} catch (const InputError&) {
    return false;
}

/// What kind of splat file its name says that it is; empty if none. glTF has meshes, too.
std::string splat_kind(const fs::path& file) try {
    const SplatFormat format = format_of_name(file);
    if (format == SplatFormat::glb || format == SplatFormat::gltf) return {};
    const char* kind = format == SplatFormat::ply ? "a splat file or a point cloud (" : "a splat file (";
    return kind + std::string(name_of(format)) + ")";
} catch (const InputError&) {
    return {};
}

/// Throws what the path is instead of an input; `otherwise` if nothing is known.
[[noreturn]] void refuse(const fs::path& path, const char* otherwise) {
    const std::string name = core::one_line(path.string());
    std::error_code ignored;
    if (!fs::exists(path, ignored)) throw InputError(name + ": there is no such file or folder");
    if (is_file(path)) {
        if (is_photo(path)) throw InputError(name + " is a single picture; name the folder of the photos");
        if (const std::string kind = splat_kind(path); !kind.empty())
            throw InputError(name + " is " + kind + ", not a folder of photos, a video or a dataset");
    }
    throw InputError(name + ": " + otherwise);
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

void check_training_input(const fs::path& path) {
    if (is_capture(path) || (is_folder(path) && has_cameras(path))) return;
    if (is_file(path) && extension_of(path) == ".json") return;
    refuse(path,
           is_folder(path)
               ? "neither photos, nor a video, nor a dataset; a dataset has cameras and images (.bin or "
                 ".txt) in sparse/0, sparse or the folder itself, or transforms.json, "
                 "transforms_train.json or transforms_test.json; the folder of a training run has "
                 "config.json"
               : "neither a video nor a dataset; a dataset is a folder, a transforms.json, or a glTF of "
                 "meshes (.gltf, .glb)");
}

Capture make_dataset(const fs::path& input, const fs::path& folder, const CaptureOptions& options,
                     const std::function<bool(const CaptureProgress&)>& progress) {
    if (!is_capture(input)) refuse(input, "neither a video nor a folder with photos");
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
