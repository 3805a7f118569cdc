// SPDX-License-Identifier: Apache-2.0
// The photos of a folder: which of its files they are, which of them can be read, and which of them share a lens.
#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <chrono>
#include <future>
#include <map>
#include <set>

#include "capture/steps.h"
#include "core/folders.h"
#include "core/packages.h"
#include "core/parallel.h"
#include "core/sandboxed_path.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "ewa/image.h"
#include "folders/run_folder.h"
#include "image/image_files.h"
#include "io/datasets/importers/image_finder.h"

namespace ewa::capture {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kDecodingBytes = uint64_t(2) << 30;  // that all threads together may hold

/// Whether a folder between `folder` and the file in it was made by ewa. known: the answers so far.
bool below_made(const fs::path& folder, const fs::path& name, std::map<fs::path, bool>& known) {
    const fs::path parent = name.parent_path();
    if (parent.empty()) return false;
    const auto found = known.find(parent);
    if (found != known.end()) return found->second;
    return known[parent] = folders::is_made_by_ewa(folder / parent) || below_made(folder, parent, known);
}

/// The words of a name, in lower case.
std::vector<std::string> words_of(const std::string& name) {
    std::vector<std::string> words(1);
    for (const char c : core::lower(name))
        if (std::isalpha(static_cast<unsigned char>(c)) != 0)
            words.back() += c;
        else if (!words.back().empty())
            words.emplace_back();
    if (words.size() > 1 && words.back().empty()) words.pop_back();
    return words;
}

/// Whether the word means pictures that belong to photos.
bool is_companion(const std::string& word) {
    constexpr std::array kWords{"mask",        "masks",        "depth",         "depths", "depthmap",
                                "depthmaps",   "segmentation", "segmentations", "seg",    "confidence",
                                "confidences", "matte",        "mattes",        "normal", "normals",
                                "semantic",    "semantics"};
    return std::ranges::find(kWords, word) != kWords.end();
}

/// Whether the file's folder, or one above it, has such a name.
bool below_companions(const fs::path& file) {
    return std::ranges::any_of(file.parent_path(), [](const fs::path& part) {
        return std::ranges::any_of(words_of(part.string()), is_companion);
    });
}

/// The photo's name of "IMG_1_mask.png" or "mask_IMG_1.png", without the extension. Empty for other names.
std::string photo_of_companion(const fs::path& file) {
    const std::string stem = core::lower(file.stem().string());
    const size_t last = stem.find_last_of("_-.");
    if (last != std::string::npos && (is_companion(stem.substr(last + 1)) || stem.ends_with("alpha")))
        return (file.parent_path() / fs::path(stem.substr(0, last)).stem()).string();
    const size_t first = stem.find_first_of("_-.");
    if (first == std::string::npos || !is_companion(stem.substr(0, first))) return {};
    return (file.parent_path() / stem.substr(first + 1)).string();
}

/// COLMAP takes the names as lines, without the blanks around them.
bool fits_a_line(const std::string& name) {
    return core::trim(name) == name && std::ranges::none_of(name, [](char c) {
               return static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
           });
}

/// Why COLMAP should not get the photo; empty if it should.
std::string fault_of(const fs::path& folder, const fs::path& name) {
    if (!fits_a_line(name.string())) return "its name has a line break, or a blank at an end";
    if (is_heif(name))
        return core::is_file(folder / name) && fs::file_size(folder / name) > 0 ? "" : "the file is empty";
    const std::string fault = image::image_fault(folder / name);
    if (!fault.empty()) return fault;
    const std::string_view format = image::format_name(folder / name);
    if (format == "jpeg" || format == "png" || format == "tiff" || format == "bmp") return {};
    return "COLMAP does not read " + std::string(format);
}

/// The bytes that decoding the largest photo takes. A JPEG is not kept.
uint64_t decoded_bytes(const fs::path& folder, const std::vector<fs::path>& names) {
    constexpr uint64_t kPixelBytes = 16;
    uint64_t most = 1;
    for (const fs::path& name : names) try {
            if (is_heif(name) || image::format_name(folder / name) == "jpeg") continue;
            const ImageSize size = read_image_size(folder / name);
            most = std::max(most, uint64_t(size.width) * uint64_t(size.height) * kPixelBytes);
        } catch (const InputError&) {
            continue;
        }
    return most;
}

}  // namespace

Pictures pictures_in(const fs::path& folder) {
    Pictures pictures;
    std::map<fs::path, bool> made;
    std::set<std::string> stems;
    const auto stem_of = [](const fs::path& file) {
        return (file.parent_path() / core::lower(file.stem().string())).string();
    };
    for (const fs::path& file : image::images_below(folder)) {
        if (below_made(folder, file, made)) continue;
        (below_companions(file) ? pictures.others : pictures.photos).push_back(file);
        if (!is_heif(file)) stems.insert(stem_of(file));
    }
    if (pictures.photos.empty()) std::swap(pictures.photos, pictures.others);
    std::erase_if(pictures.photos, [&](const fs::path& file) {
        // A telephone may leave a JPEG beside each photo.
        const bool of_all = core::lower(file.stem().string()) == "mask" && pictures.photos.size() > 1;
        const bool other = of_all || stems.contains(is_heif(file) ? stem_of(file) : photo_of_companion(file));
        if (other) pictures.others.push_back(file);
        return other;
    });
    return pictures;
}

std::vector<fs::path> photo_files(const fs::path& folder) {
    return pictures_in(folder).photos;
}

std::vector<fs::path> films_in(const fs::path& folder) try {
    std::vector<fs::path> films;
    std::map<fs::path, bool> made;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
        const fs::path inside = core::inside(entry.path(), folder);
        if (entry.is_regular_file() && is_film(inside) && !core::is_of_desktop(inside) &&
            !below_made(folder, inside, made))
            films.push_back(inside);
    }
    std::ranges::sort(films);
    return films;
} catch (const fs::filesystem_error& error) {
    throw InputError(
        core::one_line(folder.string() + ": the folder cannot be read: " + error.code().message()));
}

std::vector<fs::path> photos_in(const fs::path& folder) {
    const std::string name = core::one_line(folder.string());
    std::vector<fs::path> files = photo_files(folder);
    if (const auto heif = std::ranges::count_if(files, is_heif); heif > 0 && !converts_heif())
        throw InputError(name + ": " + core::counted(uint64_t(heif), "photo") + " " +
                         std::string(core::is_or_are(uint64_t(heif))) +
                         " HEIC or AVIF, and no program here reads them (" +
                         core::how_to_install(core::Thing::heif) + ")");
    for (const fs::path& file : files)
        if (!core::links_stay_inside(folder, file))
            throw InputError(core::one_line((folder / file).string()) +
                             " is a link out of its folder; copy the photos with cp -rL " + name + " COPY");
    return files;
}

void require_photos(const fs::path& folder, size_t count, const std::vector<Skipped>& skipped) {
    if (count >= kLeastPhotos) return;
    std::string text =
        core::one_line(folder.string()) + " has " + std::to_string(count) +
        " photos (JPEG, PNG, TIFF or BMP); cameras need at least 3, and good splats 30 or more";
    if (!skipped.empty()) text += "; " + skipped_text(skipped);
    throw InputError(text);
}

void on_all_cores(CaptureProgress now, const ProgressFunction& progress,
                  const std::function<void(size_t)>& work, size_t most) {
    if (!progress(now)) throw Stopped();
    std::atomic<int> done = now.done;
    std::atomic<bool> stopped = false;
    std::future<void> all = std::async(std::launch::async, [&] {
        core::on_all_cores(
            size_t(now.total - now.done),
            [&](size_t i) {
                if (stopped) return;
                work(i);
                ++done;
            },
            most);
    });
    while (all.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready) {
        now.done = done;
        if (!stopped && !progress(now)) stopped = true;
    }
    all.get();
    now.done = done;
    if (stopped || !progress(now)) throw Stopped();
}

std::vector<Skipped> faults_in(const fs::path& folder, const std::vector<fs::path>& names,
                               const ProgressFunction& progress) {
    std::vector<std::string> faults(names.size());
    const size_t room = std::max<size_t>(1, kDecodingBytes / decoded_bytes(folder, names));
    on_all_cores(
        {CapturePhase::photos, "looked at", "photos", 0, int(names.size()), {}}, progress,
        [&](size_t i) { faults[i] = fault_of(folder, names[i]); }, room);
    std::vector<Skipped> skipped;
    for (size_t i = 0; i < names.size(); ++i)
        if (!faults[i].empty()) skipped.push_back({names[i], faults[i]});
    return skipped;
}

std::string skipped_text(const std::vector<Skipped>& skipped) {
    std::vector<std::string> names;
    for (const Skipped& photo : skipped)
        names.push_back(core::one_line(photo.name.string()) + " (" + photo.reason + ")");
    return core::counted(skipped.size(), "photo") + " cannot be used: " + names_text(names);
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

std::vector<LensGroup> lenses_of(const fs::path& folder, const std::vector<fs::path>& names) {
    std::map<std::string, std::vector<fs::path>> alike;
    for (const fs::path& name : names) {
        const ImageSize size = read_image_size(folder / name);
        alike[std::to_string(size.width) + "x" + std::to_string(size.height) +
              image::shot_of(folder / name).lens]
            .push_back(name);
    }
    std::vector<LensGroup> groups;
    LensGroup single{.photos = {}, .shared = false};
    for (auto& [key, group] : alike) {
        if (group.size() == 1)
            single.photos.push_back(group.front());
        else
            groups.push_back({.photos = std::move(group), .shared = true});
    }
    std::ranges::stable_sort(
        groups, [](const LensGroup& a, const LensGroup& b) { return a.photos.front() < b.photos.front(); });
    std::ranges::sort(single.photos);
    if (!single.photos.empty()) groups.push_back(std::move(single));
    return groups;
}

}  // namespace ewa::capture
