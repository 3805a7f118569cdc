// SPDX-License-Identifier: Apache-2.0
// Views that are taken out of a COLMAP model (colmap.github.io/format.html).
#include <algorithm>
#include <cstring>

#include "capture/steps.h"
#include "core/atomic_file.h"
#include "core/file_reader.h"
#include "ewa/error.h"

namespace ewa::capture {
namespace {

namespace fs = std::filesystem;

constexpr size_t kLongestName = 4096;
constexpr uint64_t kPoseBytes = 4 + 7 * 8 + 4;  // image, rotation, translation, camera
constexpr uint64_t kFeatureBytes = 3 * 8, kPointBytes = 8 + 3 * 8 + 3 + 8, kTrackBytes = 8;

std::string bytes_of(core::FileReader& reader, uint64_t count, uint64_t each, const char* what) {
    reader.require_room(count, each, what);
    const size_t size = size_t(count * each);
    return {reinterpret_cast<const char*>(reader.take(size, what)), size};
}

template <class T>
void append_value(std::string& text, T value) {
    text.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

/// images.bin without these names. removed: the numbers of the images that it has lost.
std::string without_names(const fs::path& file, const std::set<std::string>& names,
                          std::set<uint32_t>& removed) {
    core::FileReader reader(file);
    const auto count = reader.read<uint64_t>("the number of images");
    uint64_t kept = 0;
    std::string text;
    for (uint64_t i = 0; i < count; ++i) {
        const std::string pose = bytes_of(reader, 1, kPoseBytes, "an image");
        const std::string name = reader.read_zero_terminated(kLongestName, "an image's name");
        const auto features = reader.read<uint64_t>("the number of an image's features");
        const std::string rest = bytes_of(reader, features, kFeatureBytes, "an image's features");
        uint32_t id = 0;
        std::memcpy(&id, pose.data(), sizeof(id));
        if (names.contains(name)) {
            removed.insert(id);
            continue;
        }
        ++kept;
        text += pose;
        text += name;
        text += '\0';
        append_value(text, features);
        text += rest;
    }
    if (kept == 0 && !removed.empty())
        throw InputError(reader.name() + ": every photo has changed since its camera was found");
    std::string head;
    append_value(head, kept);
    return head + text;
}

/// points3D.bin without these images in the tracks. The points stay.
std::string without_tracks(const fs::path& file, const std::set<uint32_t>& images) {
    core::FileReader reader(file);
    const auto count = reader.read<uint64_t>("the number of points");
    std::string text;
    append_value(text, count);
    for (uint64_t i = 0; i < count; ++i) {
        text += bytes_of(reader, 1, kPointBytes, "a point");
        const auto length = reader.read<uint64_t>("the length of a track");
        const std::string track = bytes_of(reader, length, kTrackBytes, "a track");
        std::string kept;
        for (size_t at = 0; at < track.size(); at += kTrackBytes) {
            uint32_t image = 0;
            std::memcpy(&image, &track[at], sizeof(image));
            if (!images.contains(image)) kept.append(track, at, kTrackBytes);
        }
        append_value(text, uint64_t(kept.size() / kTrackBytes));
        text += kept;
    }
    return text;
}

}  // namespace

void remove_views(const fs::path& model, const std::set<std::string>& names) {
    const fs::path images = model / "images.bin", points = model / "points3D.bin";
    std::set<uint32_t> removed;
    const std::string text = without_names(images, names, removed);
    if (removed.empty()) return;
    core::write_text_file(images, text);
    core::write_text_file(points, without_tracks(points, removed));
}

}  // namespace ewa::capture
