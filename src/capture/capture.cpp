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
#include "core/typing.h"
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
std::vector<fs::path> photos_of(const fs::path& photos, const fs::path& folder) {
    const bool of_run = folder.filename() == "dataset" && is_file(folder.parent_path() / "config.json");
    const fs::path results = fs::weakly_canonical(fs::absolute(of_run ? folder.parent_path() : folder));
    const std::string below = results.lexically_relative(fs::canonical(photos)).string() + "/";
    std::vector<fs::path> names = capture::photos_in(photos);
    std::erase_if(names, [&](const fs::path& name) { return name.string().starts_with(below); });
    return names;
}

/// A line for a file: what distinguishes its content, a space, and its name. The record is JSON, which is UTF-8.
std::string line_of(const fs::path& folder, const fs::path& name) {
    core::Hash hash;
    std::string digits = "unreadable";
    try {
        core::add_file(hash, folder / name);
        digits = core::digits_of(hash);
    } catch (const InputError&) {
        // It has no content to tell from another one.
    }
    return digits + " " + core::one_line(name.string());
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

/// Input and options. The contents are added as "files", and those that COLMAP did not get as "skipped".
Json record_of(const fs::path& input, const CaptureOptions& options, bool video) {
    Json record{{"input", core::one_line(fs::canonical(input).string())},
                {"matching", name_of(options.matching)}};
    if (video) record["frames"] = options.frames;
    return record;
}

/// What became of the photos since a search for their cameras began, or what begins it.
struct Chosen {
    std::vector<fs::path> names;  // that COLMAP gets
    std::set<std::string> gone;   // names of photos whose pictures changed: their views do not count
    std::vector<std::string> remarks;
};

void add_remark(std::vector<std::string>& remarks, const std::vector<std::string>& names, const char* one,
                const char* many) {
    if (names.empty()) return;
    remarks.push_back(core::counted(names.size(), "photo") + (names.size() == 1 ? one : many) +
                      capture::names_text(names));
}

/// Looks at all photos before the search. Those that cannot be used are noted in the record.
Chosen first_choice(const fs::path& folder, const std::vector<fs::path>& found, Json& record,
                    const capture::ProgressFunction& progress) {
    const std::vector<capture::Skipped> skipped = capture::faults_in(folder, found, progress);
    Chosen chosen;
    chosen.names = found;
    record["files"] = Json::array();
    record["skipped"] = Json::array();
    for (const capture::Skipped& photo : skipped) {
        std::erase(chosen.names, photo.name);
        record["skipped"].push_back({{"file", line_of(folder, photo.name)}, {"reason", photo.reason}});
    }
    capture::require_photos(folder, chosen.names.size(), skipped);
    for (const fs::path& name : chosen.names) record["files"].push_back(line_of(folder, name));
    if (!skipped.empty()) chosen.remarks.push_back(capture::skipped_text(skipped));
    return chosen;
}

/// Leaves out what has changed since a search began. before: its record.
Chosen later_choice(const fs::path& folder, const std::vector<fs::path>& found, const Json& before) {
    auto searched = contents_in(before["files"]);
    std::map<std::string, std::string> reasons;  // by line
    for (const Json& photo : before.value("skipped", Json::array()))
        if (photo.is_object()) reasons[photo.value("file", "")] = photo.value("reason", "");
    Chosen chosen;
    std::vector<capture::Skipped> skipped;
    std::vector<std::string> changed, added, missing;
    for (const fs::path& name : found) {
        const std::string line = line_of(folder, name), shown = core::one_line(name.string());
        const auto known = searched.find(shown);
        if (known != searched.end() && line.starts_with(known->second + " ")) {
            chosen.names.push_back(name);
        } else if (known != searched.end()) {
            changed.push_back(shown);
            chosen.gone.insert(name.string());
        } else if (reasons.contains(line)) {
            skipped.push_back({name, core::one_line(reasons[line])});
        } else {
            added.push_back(shown);
        }
        if (known != searched.end()) searched.erase(known);
    }
    for (const auto& [name, content] : searched) missing.push_back(core::one_line(name));
    if (!skipped.empty()) chosen.remarks.push_back(capture::skipped_text(skipped));
    add_remark(chosen.remarks, missing,
               " is missing, and its view is not used: ", " are missing, and their views are not used: ");
    add_remark(chosen.remarks, changed,
               " has changed since the search for its camera, and its view is not used: ",
               " have changed since the search for their cameras, and their views are not used: ");
    add_remark(chosen.remarks, added, " is new, and is not used; another -o DIR searches its camera, too: ",
               " are new, and are not used; another -o DIR searches their cameras, too: ");
    return chosen;
}

/// Whether something has been made of the photos or the video.
bool is_begun(const fs::path& folder, bool video) {
    return is_folder(folder / "sparse/0") ||
           (video ? is_folder(folder / "images") : is_file(folder / "colmap/database.db"));
}

/// Makes sure that the folder is new, or was begun with the same input and options. Returns the record of what was begun;
/// null if nothing was.
Json check_claim(const fs::path& folder, Json record, bool video) {
    const fs::path file = folder / "capture.json";
    const std::string name = core::one_line(folder.string()),
                      ways_out = "; -o DIR takes another folder, or remove " + name;
    if (!is_file(file)) {
        if (!is_folder(folder) || fs::is_empty(folder)) return {};
        throw InputError(name + " is not empty, and no dataset that ewa has made; choose another folder");
    }
    const Json before = core::read_json_file<Json>(file);
    Json options = before;
    for (Json* each : {&options, &record})
        if (each->is_object())
            for (const char* contents : {"files", "skipped"}) each->erase(contents);
    if (options != record)
        throw InputError(name + " is the dataset of another input, or was made with other options" +
                         ways_out);
    return is_begun(folder, video) ? before : Json();
}

/// Throws InputError if the video is not the one that the frames are of. Older records have no files.
void check_same_video(const fs::path& folder, const Json& before, const Json& record) {
    if (!before.is_object() || !before.contains("files") || before["files"] == record["files"]) return;
    const std::string name = core::one_line(folder.string());
    throw InputError("the video has changed since " + name +
                     " was made of it; -o DIR takes another folder, or remove " + name);
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
            " photos could not be placed, and are not used: " + capture::names_text(result.not_placed));
    return result;
}

void require_programs(const fs::path& folder, bool video) {
    if (video && !is_folder(folder / "images")) capture::require_ffmpeg();
    if (!is_folder(folder / "sparse/0")) capture::require_colmap();
}

/// What COLMAP gets of a folder of photos. before: the record of a search that has begun; null: none. Completes `record`.
Chosen choose(const fs::path& photos, const fs::path& folder, const Json& before, Json& record,
              const capture::ProgressFunction& progress) {
    const std::vector<fs::path> found = photos_of(photos, folder);
    if (before.is_null()) return first_choice(photos, found, record, progress);
    if (before.contains("files")) return later_choice(photos, found, before);
    return {found, {}, {}};
}

/// Tells the user before the long work.
void say(const std::vector<std::string>& lines, const capture::ProgressFunction& progress) {
    for (const std::string& line : lines) {
        CaptureProgress now;
        now.note = line;
        if (!progress(now)) throw capture::Stopped();
    }
}

/// Finds the cameras, or removes those of photos that have changed since.
std::vector<std::string> search(const fs::path& folder, bool video, const Chosen& chosen,
                                const CaptureOptions& options, const capture::ProgressFunction& progress) {
    const fs::path model = folder / "sparse/0";
    std::vector<std::string> remarks;
    if (!is_folder(model)) {
        const bool sequence = options.matching == Matching::automatic
                                  ? video || int(chosen.names.size()) > kMostUnordered
                                  : options.matching == Matching::sequence;
        capture::require_photos(folder / "images", chosen.names.size(), {});
        core::make_folder(model.parent_path());
        remarks = capture::place_photos({folder / "images", chosen.names, sequence}, folder / "colmap", model,
                                        progress);
    }
    if (!chosen.gone.empty()) capture::remove_views(model, chosen.gone);
    return remarks;
}

Capture make(const fs::path& input, const fs::path& folder, const CaptureOptions& options,
             const capture::ProgressFunction& progress) {
    const bool video = is_video(input);
    const fs::path images = folder / "images", work = folder / "colmap";
    // All errors of the input come before the folder is made.
    Json record = record_of(input, options, video);
    const Json before = check_claim(folder, record, video);
    Chosen chosen;
    if (video)
        record["files"] = Json::array({line_of(input.parent_path(), input.filename())});
    else
        chosen = choose(folder_of_photos(input), folder, before, record, progress);
    if (video) check_same_video(folder, before, record);
    require_programs(folder, video);
    say(chosen.remarks, progress);
    core::make_folder(folder);
    const core::FolderLock lock(folder);
    if (before.is_null()) core::write_json(folder / "capture.json", record);
    core::make_folder(work);
    if (!fs::exists(fs::symlink_status(images))) {
        if (video)
            capture::extract_frames(input, images, options.frames, work / "log.txt", progress);
        else
            fs::create_directory_symlink(fs::canonical(folder_of_photos(input)), images);
    }
    if (video) chosen.names = capture::photos_in(images);
    const std::vector<std::string> remarks = search(folder, video, chosen, options, progress);
    Capture result = result_of(folder, chosen.names);
    result.remarks.insert(result.remarks.begin(), remarks.begin(), remarks.end());
    return result;
}

bool is_photo(const fs::path& file) try {
    const std::string extension = extension_of(file);
    return extension == ".heic" || extension == ".heif" || !image::format_name(file).empty();
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

bool is_capture(const fs::path& path) {
    if (is_video(path)) return true;
    return is_folder(path) && !has_cameras(path) && !capture::photo_files(folder_of_photos(path)).empty();
}

ImageSize smallest_image(const fs::path& input) {
    if (is_video(input)) return capture::video_size(input);
    ImageSize smallest;
    const fs::path folder = folder_of_photos(input);
    for (const fs::path& name : capture::photo_files(folder)) try {
            const ImageSize size = read_image_size(folder / name);
            const bool smaller =
                std::min(size.width, size.height) < std::min(smallest.width, smallest.height);
            if (smaller || smallest.width == 0) smallest = size;
        } catch (const InputError&) {
            continue;  // make_dataset says so
        }
    return smallest;
}

fs::path dataset_of_images(const fs::path& folder) try {
    if (!is_folder(folder)) return {};
    const fs::path images = fs::canonical(folder), dataset = images.parent_path();
    if (!has_cameras(dataset)) return {};
    const Dataset known = load_dataset(dataset, {.need_images = false, .need_points = false});
    const bool same = std::ranges::any_of(known.frames, [&](const Frame& frame) {
        return frame.image_exists && fs::weakly_canonical(frame.image_path).parent_path() == images;
    });
    // As the user would name it.
    return same ? (fs::absolute(folder).lexically_normal() / "").parent_path().parent_path() : fs::path();
} catch (const InputError&) {
    return {};
}

void check_training_input(const fs::path& path) {
    if (const fs::path dataset = dataset_of_images(path); !dataset.empty()) {
        const std::string name = core::one_line(fs::proximate(dataset).string());
        throw InputError(name + " has the cameras of " + core::one_line(path.string()) + ": ewa train " +
                         name + "; to search them anew, ewa cameras " + core::one_line(path.string()) +
                         " -o DIR");
    }
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
    if (is_folder(input) && has_cameras(input))
        throw InputError(core::one_line(input.string()) +
                         " is a dataset: its images have cameras; ewa train " +
                         core::one_line(input.string()) + " trains on them");
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
