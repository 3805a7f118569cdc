// SPDX-License-Identifier: Apache-2.0
// From photos or a video to a dataset: what is done already, and what did not work.
#include "ewa/capture.h"

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "capture/found_colmap.h"
#include "capture/inputs.h"
#include "capture/steps.h"
#include "capture/times.h"
#include "core/folders.h"
#include "core/json.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/dataset.h"
#include "ewa/error.h"
#include "folders/run_folder.h"
#include "io/datasets/dataset_folders.h"
#include "io/splats/place.h"
#include "io/splats/zip_files.h"
#include "platform/file.h"

namespace ewa {
namespace {

namespace fs = std::filesystem;
using capture::folder_of_photos;
using capture::main_folder;
using capture::refuse;
using capture::refuse_made;
using capture::videos_of;
using core::is_file;
using core::is_folder;
using Json = nlohmann::ordered_json;

constexpr size_t kMostByLook = 1000;  // photos; even their looks take minutes to compare if there are more

const char* name_of(Matching matching) {
    return matching == Matching::sequence    ? "sequence"
           : matching == Matching::unordered ? "unordered"
                                             : "auto";
}

/// The photos of the input. Those that a training in a folder of the photos has rendered do not count.
std::vector<fs::path> photos_of(const fs::path& photos, const fs::path& folder) {
    const bool of_run =
        folder.filename() == folders::kMadeDataset && is_file(folder.parent_path() / folders::kConfigFile);
    const fs::path results = fs::weakly_canonical(fs::absolute(of_run ? folder.parent_path() : folder));
    const std::string below = core::inside(results, fs::canonical(photos)).string() + "/";
    std::vector<fs::path> names = capture::photos_in(photos);
    std::erase_if(names, [&](const fs::path& name) { return name.string().starts_with(below); });
    return names;
}

/// Input and options. The contents are added as "files", and those that COLMAP did not get as "skipped".
Json record_of(const fs::path& input, const CaptureOptions& options, bool video) {
    Json record{{"input", core::one_line(fs::canonical(input).string())},
                {"matching", name_of(options.matching)}};
    if (video) record["frames"] = options.frames;
    if (!options.level) record["level"] = "off";  // older records say nothing
    return record;
}

/// Whether something has been made of the photos or the video.
bool is_begun(const fs::path& folder, bool video) {
    return is_folder(folder / "sparse/0") ||
           (video ? is_folder(folder / "images") : is_file(folder / "colmap/database.db"));
}

/// Makes sure that the folder is new, or was begun with the same input and options. Returns the record of what was begun;
/// null if nothing was.
Json check_claim(const fs::path& folder, Json record, bool video) {
    const fs::path file = folder / folders::kCaptureFile;
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
            for (const char* contents : {"files", "skipped", "archive"}) each->erase(contents);
    // A world that is there stays as it is.
    if (is_folder(folder / "sparse/0"))
        for (Json* each : {&options, &record})
            if (each->is_object()) each->erase("level");
    if (options != record)
        throw InputError(name + " is the dataset of another input, or was made with other options" +
                         ways_out);
    return is_begun(folder, video) ? before : Json();
}

/// Throws InputError if the videos or the archive are not those that the folder was made of. Older records do not say it.
void check_same_file(const fs::path& folder, const Json& before, const Json& record,
                     const std::string& what) {
    const char* key = what == "video" ? "files" : "archive";
    if (!before.is_object() || !before.contains(key) || before[key] == record[key]) return;
    const std::string name = core::one_line(folder.string());
    throw InputError("the " + what + " has changed since " + name +
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

/// What COLMAP gets of a folder of photos. before: the record of a search that has begun; null: none. Completes `record`.
capture::Chosen choose(const fs::path& photos, const fs::path& folder, const Json& before, Json& record,
                       const capture::ProgressFunction& progress) {
    const std::vector<fs::path> found = photos_of(photos, folder);
    if (before.is_null()) return capture::first_choice(photos, found, record, progress);
    if (before.contains("files")) return capture::later_choice(photos, found, before);
    return {found, {}, {}};
}

capture::Pairing pairing_of(Matching matching, size_t photos) {
    switch (matching) {
        case Matching::sequence:
            return capture::Pairing::in_sequence;
        case Matching::unordered:
            return capture::Pairing::all;
        case Matching::automatic:
            break;
    }
    return photos > kMostByLook ? capture::Pairing::in_sequence : capture::Pairing::by_look;
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
Capture search(const fs::path& folder, const capture::Chosen& chosen, const CaptureOptions& options,
               const capture::ProgressFunction& progress) {
    const fs::path model = folder / "sparse/0";
    capture::Found found;
    if (!is_folder(model)) {
        capture::require_photos(folder / "images", chosen.names.size(), {});
        core::make_folder(model.parent_path());
        const fs::path masks = is_folder(folder / "masks") ? folder / "masks" : fs::path();
        found = capture::place_photos(
            {folder / "images", chosen.names, pairing_of(options.matching, chosen.names.size()), masks,
             options.level, options.python},
            folder / "colmap", model, folder / io::kPlaceFile, progress);
    }
    if (!chosen.gone.empty()) capture::remove_views(model, chosen.gone);
    Capture result = result_of(folder, chosen.names);
    result.remarks.insert(result.remarks.begin(), found.remarks.begin(), found.remarks.end());
    result.axes = std::move(found.axes);
    return result;
}

/// A dataset that is being made: its folder, and what its record says.
struct Making {
    fs::path input, folder;
    CaptureOptions options;
    const capture::ProgressFunction& progress;
    Json record, before;           // before: of what has begun; null: nothing has
    std::vector<fs::path> videos;  // none: the input is photos or an archive
    std::vector<fs::path> proxies = {};
    std::unique_ptr<core::FolderLock> lock = nullptr;

    /// After all errors of the input: they leave no folder.
    void begin() {
        if (!lock) {
            core::make_folder(folder);
            lock = std::make_unique<core::FolderLock>(folder);
        }
        if (before.is_null()) core::write_json(folder / folders::kCaptureFile, record);
    }
    void require_programs() const {
        if (!videos.empty() && !is_folder(folder / "images")) capture::require_ffmpeg();
        if (!is_folder(folder / "sparse/0")) capture::require_colmap(options.python);
    }
};

Capture make_of_video(Making& now) {
    const fs::path images = now.folder / "images", work = now.folder / "colmap";
    const fs::path above = is_folder(now.input) ? now.input : now.input.parent_path();
    now.record["files"] = Json::array();
    for (const fs::path& video : now.videos)
        now.record["files"].push_back(capture::line_of(above, core::inside(video, above)));
    check_same_file(now.folder, now.before, now.record, "video");
    now.require_programs();
    now.begin();
    core::make_folder(work);
    if (const size_t count = now.proxies.size(); count > 0)
        say({std::to_string(count) + (count == 1 ? " proxy is" : " proxies are") +
             " not used, by the name a small copy of a film: " + core::one_line(now.proxies[0].string())},
            now.progress);
    if (!fs::exists(fs::symlink_status(images)))
        say(capture::extract_frames(now.videos, images, now.options.frames, work / "log.txt", now.progress),
            now.progress);
    const capture::Chosen chosen{capture::photos_in(images), {}, {}};
    return search(now.folder, chosen, now.options, now.progress);
}

/// What the folder has beside photos, which are all that is searched.
std::vector<std::string> remarks_on_others(const fs::path& photos) {
    std::vector<std::string> remarks;
    const auto add = [&](const std::vector<fs::path>& files, const char* noun, const char* reason) {
        if (files.empty()) return;
        std::string text = core::counted(files.size(), noun) + " " +
                           std::string(core::is_or_are(files.size())) + reason +
                           core::one_line(files.front().string());
        if (files.size() > 1) text += " and " + std::to_string(files.size() - 1) + " more";
        remarks.push_back(text);
    };
    const capture::Pictures pictures = capture::pictures_in(photos);
    add(pictures.others, "picture", " not searched, by the name a mask, a depth map or a copy: ");
    std::vector<fs::path> films = capture::films_in(photos);
    std::erase_if(films, [&](const fs::path& film) {  // the moving part of a photo
        return std::ranges::any_of(pictures.photos, [&](const fs::path& photo) {
            return photo.parent_path() / photo.stem() == film.parent_path() / film.stem();
        });
    });
    add(films, "video", " not used beside photos: ");
    return remarks;
}

/// Converts what COLMAP does not read. The names become those of images/.
void convert(Making& now, const fs::path& photos, const fs::path& link, capture::Chosen& chosen) {
    const fs::path images = now.folder / "images";
    const fs::path target = link.empty() ? fs::absolute(photos) : link;  // empty: on another disk of Windows
    if (!fs::exists(fs::symlink_status(images))) {
        if (std::ranges::any_of(chosen.names, capture::is_heif))
            capture::convert_photos(photos, chosen.names, images, now.folder / "colmap/log.txt",
                                    now.progress);
        else if (const auto error = platform::link_folder(target, images, platform::Elsewhere::copied))
            throw fs::filesystem_error("cannot create directory symlink", target, images, error);
    }
    std::vector<capture::Skipped> skipped;
    std::set<std::string> gone;
    for (const std::string& name : chosen.gone) gone.insert(capture::converted_name(name).string());
    chosen.gone = gone;
    for (fs::path& name : chosen.names)
        if (capture::is_heif(name)) {
            const fs::path original = name;
            name = capture::converted_name(name);
            if (!is_file(images / name)) skipped.push_back({original, "it cannot be converted"});
        }
    std::erase_if(chosen.names, [&](const fs::path& name) { return !is_file(images / name); });
    if (!skipped.empty()) say({capture::skipped_text(skipped)}, now.progress);
}

/// link: what images/ refers to.
Capture make_of_photos(Making& now, const fs::path& photos, const fs::path& link) {
    capture::Chosen chosen = choose(photos, now.folder, now.before, now.record, now.progress);
    now.require_programs();
    if (now.before.is_null()) say(remarks_on_others(photos), now.progress);
    say(chosen.remarks, now.progress);
    now.begin();
    core::make_folder(now.folder / "colmap");
    convert(now, photos, link, chosen);
    const std::string masks = capture::copy_masks(photos, chosen.names, now.folder / "images",
                                                  now.folder / "masks", now.input, now.progress);
    if (!masks.empty()) say({masks}, now.progress);
    return search(now.folder, chosen, now.options, now.progress);
}

/// Moves the dataset of an archive into the folder that unpacked/ is in.
void move_up(const fs::path& root, const fs::path& folder) {
    std::vector<fs::path> names;
    for (const fs::directory_entry& entry : fs::directory_iterator(root))
        names.push_back(entry.path().filename());
    // The cameras last: an interrupted move continues as long as they exist.
    const auto last = [&](const fs::path& name) {
        return !is_folder(root / name) || name == "sparse" || name == "opensfm" || name == "keyframes";
    };
    std::stable_partition(names.begin(), names.end(), [&](const fs::path& name) { return !last(name); });
    for (const fs::path& name : names) fs::rename(root / name, folder / name);
    fs::remove_all(folder / "unpacked");
}

Capture make_of_archive(Making& now) {
    const fs::path unpacked = now.folder / "unpacked", partial = now.folder / "unpacked.partial";
    now.record["archive"] = Json::array({capture::line_of(now.input.parent_path(), now.input.filename())});
    const bool cameras = archive_has_cameras(now.input);
    if (!cameras) now.require_programs();
    if (is_file(now.folder / folders::kCaptureFile))
        check_same_file(now.folder, core::read_json_file<Json>(now.folder / folders::kCaptureFile),
                        now.record, "archive");
    if (!is_folder(unpacked) && !io::is_dataset_folder(now.folder)) {
        now.begin();
        fs::remove_all(partial);
        const io::ZipFiles zip(now.input);
        const int total = int(zip.entries().size());
        if (!zip.unpack(partial, [&](int done) {
                return now.progress({CapturePhase::photos, "unpacked", "files", done, total, {}});
            }))
            throw capture::Stopped();
        fs::rename(partial, unpacked);
    }
    if (!cameras) {
        const fs::path photos = folder_of_photos(main_folder(unpacked));
        return make_of_photos(now, photos, fs::relative(photos, now.folder));
    }
    if (is_folder(unpacked)) {
        const fs::path root = main_folder(unpacked);
        if (!io::is_dataset_folder(root) && !io::is_dataset_folder(now.folder))
            throw InputError(core::one_line(now.input.string()) +
                             " has cameras in one of several folders; unzip it, and name the folder");
        move_up(root, now.folder);
    }
    Capture result;
    result.images = result.placed =
        int(load_dataset(now.folder, {.need_images = false, .need_points = false}).frames.size());
    return result;
}

Capture make(const fs::path& input, const fs::path& folder, const CaptureOptions& options,
             const capture::ProgressFunction& progress) {
    std::vector<fs::path> proxies;
    const std::vector<fs::path> videos = videos_of(input, &proxies);
    const bool video = !videos.empty();
    Making now{input, folder, options, progress, record_of(input, options, video), {}, videos, proxies};
    now.before = check_claim(folder, now.record, video);
    if (video) return make_of_video(now);
    if (is_archive(input)) return make_of_archive(now);
    // A search that has begun keeps its folder.
    const fs::path images = folder / "images";
    const fs::path photos =
        fs::is_symlink(images) && is_folder(images) ? fs::canonical(images) : folder_of_photos(input);
    return make_of_photos(now, photos, fs::canonical(photos));
}

}  // namespace

Capture make_dataset(const fs::path& input, const fs::path& folder, const CaptureOptions& options,
                     const std::function<bool(const CaptureProgress&)>& progress) {
    if (is_folder(input) && io::is_dataset_folder(input))
        throw InputError(core::one_line(input.string()) +
                         " is a dataset: its images have cameras; ewa train " +
                         core::one_line(input.string()) + " trains on them");
    if (is_folder(input)) refuse_made(input);
    if (!is_capture(input)) refuse(input, "neither a video nor a folder with photos");
    capture::Times times(options.matching);
    const auto timed = [&](CaptureProgress now) {
        times.complete(now);
        return progress(now);
    };
    try {
        return make(input, folder, options, timed);
    } catch (const capture::Stopped&) {
        Capture result;
        result.interrupted = true;
        return result;
    } catch (const fs::filesystem_error& error) {
        throw RunError(core::one_line(error.path1().string()) + ": " + error.code().message());
    }
}

}  // namespace ewa
