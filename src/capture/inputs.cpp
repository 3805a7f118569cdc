// SPDX-License-Identifier: Apache-2.0
#include "capture/inputs.h"

#include <algorithm>
#include <array>
#include <memory>

#include "capture/steps.h"
#include "capture/what_is.h"
#include "core/folders.h"
#include "core/packages.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/dataset.h"
#include "ewa/error.h"
#include "ewa/splat_files.h"
#include "folders/run_folder.h"
#include "image/image_files.h"
#include "io/datasets/dataset_folders.h"
#include "io/datasets/image_records.h"
#include "io/datasets/importers/image_finder.h"
#include "io/datasets/importers/importer.h"
#include "io/gltf/mesh.h"
#include "io/splats/zip_files.h"
#include "platform/process.h"

namespace ewa {
namespace {

namespace fs = std::filesystem;
using core::is_file;
using core::is_folder;

std::string extension_of(const fs::path& path) {
    return core::lower(path.extension().string());
}

bool is_video(const fs::path& path) {
    return is_file(path) && capture::is_film(path);
}

}  // namespace

namespace capture {
namespace {

bool is_photo(const fs::path& file) try {
    return capture::is_heif(file) || !image::format_name(file).empty();
} catch (const InputError&) {
    return false;
}

/// What kind of splat file its name says that it is; empty if none. glTF has meshes, too.
std::string splat_kind(const fs::path& file) try {
    const SplatFormat format = format_of_name(file);
    const bool gltf = format == SplatFormat::glb || format == SplatFormat::gltf;
    if (gltf && !io::has_gltf_splats(file)) return {};
    const char* kind = format == SplatFormat::ply ? "a splat file or a point cloud (" : "a splat file (";
    return kind + std::string(name_of(format)) + ")";
} catch (const InputError&) {
    return {};
}

/// Photos as the sensor has them, which have to be developed. Empty where the folder has none.
std::string raw_photos_text(const fs::path& folder) {
    constexpr std::array kRaw{".dng", ".cr2", ".cr3", ".nef", ".arw", ".raf", ".orf", ".rw2", ".pef", ".srw"};
    uint64_t count = 0;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_of_photos(folder)))
        count += std::ranges::find(kRaw, extension_of(entry.path())) != kRaw.end();
    return count == 0 ? std::string()
                      : ": " + core::counted(count, "raw photo") +
                            ", which ewa does not develop; convert to JPEG, as darktable-cli does (" +
                            core::how_to_install(core::Thing::raw) + ")";
}

}  // namespace

fs::path main_folder(fs::path folder) {
    while (!io::is_dataset_folder(folder, false) && io::list_images(folder, false).empty() &&
           !(io::has_photos_folder(folder) && io::is_dataset_folder(folder))) {
        std::vector<fs::path> whole, some;
        for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
            if (!entry.is_directory()) continue;
            const bool cameras = io::is_dataset_folder(entry.path()),
                       photos = !capture::photo_files(entry.path()).empty();
            if (cameras && photos) whole.push_back(entry.path());
            if (cameras || photos) some.push_back(entry.path());
        }
        if (whole.size() != 1) whole = some;
        if (whole.size() != 1) break;
        folder = whole[0];
    }
    return folder;
}

fs::path folder_of_photos(const fs::path& folder) {
    if (is_folder(folder / "images")) return folder / "images";
    for (const char* name : {"photos", "input"}) {
        if (!is_folder(folder / name)) continue;
        const auto lies_there = [&](const fs::path& photo) { return *photo.begin() == name; };
        if (std::ranges::all_of(capture::photo_files(folder), lies_there)) return folder / name;
    }
    return folder;
}

std::vector<fs::path> videos_of(const fs::path& input, std::vector<fs::path>* proxies) {
    if (is_video(input)) return {input};
    if (!is_folder(input) || !capture::photo_files(folder_of_photos(input)).empty()) return {};
    std::vector<fs::path> videos = capture::films_in(input);
    const std::vector<fs::path> copies = capture::take_proxies(videos);
    if (proxies) *proxies = copies;
    for (fs::path& video : videos) video = input / video;
    return videos;
}

void refuse_made(const fs::path& input) {
    const fs::path path = (fs::absolute(input).lexically_normal() / "").parent_path();
    const std::string name = core::one_line(input.string());
    const auto cameras_of = [](const fs::path& run) {
        const fs::path dataset = run / folders::kMadeDataset;
        return io::is_dataset_folder(dataset)
                   ? "its cameras are in " + core::one_line(fs::proximate(dataset).string())
                   : "its config.json names the dataset with its cameras";
    };
    if (folders::is_run(path) && !io::is_dataset_folder(path))
        throw InputError(name + " is a run: " + cameras_of(path));
    const fs::path folder = path.filename();
    if (folders::is_run(path.parent_path()) &&
        (folder == folders::kTestFolder || folder == folders::kPassersByFolder))
        throw InputError(name + " has pictures that a run has made: " + cameras_of(path.parent_path()));
    if (is_file(path / folders::kCaptureFile) && !io::is_dataset_folder(path))
        throw InputError(
            name + " is a dataset that is not finished; the command that began it, repeated, continues");
}

void refuse(const fs::path& path, const char* otherwise) {
    const std::string name = core::one_line(path.string());
    std::error_code ignored;
    if (!fs::exists(path, ignored)) throw InputError(name + ": there is no such file or folder");
    if (is_file(path)) {
        if (is_photo(path)) throw InputError(name + " is a single picture; name the folder of the photos");
        if (const std::string kind = splat_kind(path); !kind.empty())
            throw InputError(name + " is " + kind + ", not a folder of photos, a video or a dataset");
    }
    if (is_folder(path))
        if (const std::string raw = raw_photos_text(path); !raw.empty()) throw InputError(name + raw);
    throw InputError(name + ": " + otherwise);
}

}  // namespace capture

using capture::folder_of_photos;
using capture::main_folder;
using capture::refuse;
using capture::refuse_made;
using capture::videos_of;

bool is_archive(const fs::path& path) {
    // A recording of Record3D is an archive under another name.
    return (extension_of(path) == ".zip" || extension_of(path) == ".r3d") && io::is_zip(path);
}

bool archive_has_cameras(const fs::path& archive) {
    const io::ZipFiles zip(archive);
    return std::ranges::any_of(zip.entries(), [&](const io::ZipFiles::Entry& entry) {
        const std::string name = entry.name.filename().string();
        return name == "cameras.bin" || name == "cameras.txt" || name == "transforms.json" ||
               name == "transforms_train.json" || name == "transforms_test.json" ||
               io::is_imported(entry.name, [&] { return zip.head(entry, io::kHeadBytes); });
    });
}

fs::path unpack_archive(const fs::path& archive, const fs::path& folder) {
    io::ZipFiles(archive).unpack(folder, [](int) { return true; });
    return main_folder(folder);
}

std::shared_ptr<const void> read_archive(const fs::path& archive,
                                         const std::function<void(const fs::path& folder)>& read) {
    if (!archive_has_cameras(archive))
        throw InputError(core::one_line(archive.string()) +
                         ": an archive without cameras; ewa cameras searches those of the photos in it");
    // A process that is forked from this one leaves the folder to it.
    const std::shared_ptr<const core::TemporaryFolder> folder(
        new core::TemporaryFolder("ewa-zip-"),
        [owner = platform::process_id()](const core::TemporaryFolder* made) {
            if (platform::process_id() == owner) delete made;
        });
    try {
        read(unpack_archive(archive, folder->path()));
    } catch (const InputError& error) {
        // The folder is no more when the user reads this.
        throw InputError(io::named_in_archive(error.what(), folder->path(), archive));
    }
    return folder;
}

bool is_capture(const fs::path& path) {
    if (is_video(path) || is_archive(path)) return true;
    return is_folder(path) && !io::is_dataset_folder(path) &&
           (!capture::photo_files(folder_of_photos(path)).empty() || !capture::films_in(path).empty());
}

bool has_videos(const fs::path& path) {
    return !videos_of(path).empty();
}

CaptureContents capture_contents(const fs::path& path) {
    if (const std::vector<fs::path> videos = videos_of(path); !videos.empty())
        return {core::counted(videos.size(), "video"), {}};
    const fs::path folder = folder_of_photos(path);
    const std::vector<fs::path> photos = capture::photos_in(folder);
    return {core::counted(photos.size(), "photo"), capture::find_masks(folder, photos, path).text};
}

ImageSize smallest_image(const fs::path& input) {
    ImageSize smallest;
    const auto keep = [&](const ImageSize& size) {
        const bool smaller = std::min(size.width, size.height) < std::min(smallest.width, smallest.height);
        if (size.width > 0 && (smaller || smallest.width == 0)) smallest = size;
    };
    for (const fs::path& video : videos_of(input)) try {
            keep(capture::video_size(video));
        } catch (const InputError&) {
            if (video == input) throw;  // the others may do
        }
    if (!is_folder(input) || smallest.width > 0) return smallest;
    const fs::path folder = folder_of_photos(input);
    for (const fs::path& name : capture::photo_files(folder)) try {
            keep(read_image_size(folder / name));
        } catch (const InputError&) {
            continue;  // make_dataset says so
        }
    return smallest;
}

fs::path dataset_of_images(const fs::path& folder) try {
    if (!is_folder(folder) || io::is_dataset_folder(folder)) return {};
    const fs::path images = fs::canonical(folder), dataset = images.parent_path();
    if (!io::is_dataset_folder(dataset)) return {};
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
        // As it was typed: an absolute path from elsewhere would become a row of ../
        const std::string name =
            core::one_line((path.is_absolute() ? dataset : fs::proximate(dataset)).string());
        throw InputError(name + " has the cameras of " + core::one_line(path.string()) + ": ewa train " +
                         name + "; to search them again, ewa cameras " + core::one_line(path.string()) +
                         " -o DIR");
    }
    if (is_folder(path)) refuse_made(path);
    const What what = what_is(path);
    if (is_searched(what) || what == What::dataset) return;
    if (const std::string advice = io::export_advice(path); !advice.empty())
        throw InputError(core::one_line(path.string()) + ": not a dataset: " + advice);
    refuse(path,
           is_folder(path)
               ? "neither photos, nor a video, nor a dataset; a dataset has cameras and images (.bin or "
                 ".txt) in sparse/0, sparse or the folder itself, or transforms.json, "
                 "transforms_train.json or transforms_test.json; the folder of a training run has "
                 "config.json"
               : "neither a video nor a dataset; a dataset is a folder, a zip of one, a transforms.json, or "
                 "a glTF of "
                 "meshes (.gltf, .glb)");
}

}  // namespace ewa
