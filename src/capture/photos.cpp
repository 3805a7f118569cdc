// SPDX-License-Identifier: Apache-2.0
// The photos of a folder: which of its files they are, which of them can be read, and which of them share a lens.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <map>

#include "capture/steps.h"
#include "core/folders.h"
#include "core/parallel.h"
#include "core/sandboxed_path.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "ewa/image.h"
#include "image/image_files.h"
#include "io/datasets/importers/image_finder.h"

namespace ewa::capture {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kDecodingBytes = uint64_t(2) << 30;  // that all threads together may hold
constexpr size_t kWholeLens = 10;                       // photos that determine four terms of distortion

bool is_heic(const fs::path& path) {
    const std::string extension = core::lower(path.extension().string());
    return extension == ".heic" || extension == ".heif";
}

/// Whether a folder between `folder` and the file in it was made by ewa. known: the answers so far.
bool below_made(const fs::path& folder, const fs::path& name, std::map<fs::path, bool>& known) {
    const fs::path parent = name.parent_path();
    if (parent.empty()) return false;
    const auto found = known.find(parent);
    if (found != known.end()) return found->second;
    return known[parent] = io::is_made_by_ewa(folder / parent) || below_made(folder, parent, known);
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
            if (image::format_name(folder / name) == "jpeg") continue;
            const ImageSize size = read_image_size(folder / name);
            most = std::max(most, uint64_t(size.width) * uint64_t(size.height) * kPixelBytes);
        } catch (const InputError&) {
            continue;
        }
    return most;
}

}  // namespace

std::vector<fs::path> photo_files(const fs::path& folder) {
    std::vector<fs::path> files = image::images_below(folder);
    std::map<fs::path, bool> made;
    std::erase_if(files, [&](const fs::path& file) { return below_made(folder, file, made); });
    return files;
}

std::vector<fs::path> photos_in(const fs::path& folder) {
    const std::string name = core::one_line(folder.string());
    std::vector<fs::path> files = photo_files(folder);
    if (const auto heic = std::ranges::count_if(files, is_heic); heic > 0)
        throw InputError(
            name + ": " + core::counted(uint64_t(heic), "photo") + " " +
            std::string(core::is_or_are(uint64_t(heic))) +
            " HEIC, which COLMAP cannot read; convert them, for example with "
            "heif-convert IMG.HEIC IMG.jpg (Debian: libheif-examples), and remove the originals");
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
    std::atomic<int> done = 0;
    std::atomic<bool> stopped = false;
    std::future<void> all = std::async(std::launch::async, [&] {
        core::on_all_cores(
            size_t(now.total),
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
    LensGroup single{.photos = {}, .shared = false, .tangential = false};
    for (auto& [key, group] : alike) {
        const bool tangential = group.size() == names.size() || group.size() >= kWholeLens;
        if (group.size() == 1)
            single.photos.push_back(group.front());
        else
            groups.push_back({.photos = std::move(group), .shared = true, .tangential = tangential});
    }
    std::ranges::stable_sort(
        groups, [](const LensGroup& a, const LensGroup& b) { return a.photos.front() < b.photos.front(); });
    std::ranges::sort(single.photos);
    if (!single.photos.empty()) groups.push_back(std::move(single));
    return groups;
}

}  // namespace ewa::capture
