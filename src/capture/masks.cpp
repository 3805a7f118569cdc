// SPDX-License-Identifier: Apache-2.0
// The masks of photos, found as those of datasets. COLMAP and the training get copies in one form.
#include <algorithm>

#include "capture/steps.h"
#include "core/folders.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "ewa/image.h"
#include "io/datasets/companions.h"
#include "platform/file_facts.h"
#include "scene/mask.h"

namespace ewa::capture {
namespace {

namespace fs = std::filesystem;

/// COLMAP wants the photo's size.
void write_mask(const fs::path& from, const ImageSize& size, const fs::path& to) {
    const Image mask = scene::load_mask(from, size);
    Image out(size.width, size.height, 1);
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x)
            *out.at(x, y) = *mask.at(int(int64_t(x) * mask.width / size.width),
                                     int(int64_t(y) * mask.height / size.height));
    core::make_folder(to.parent_path());
    save_image(to, out);
}

bool is_newer(const fs::path& a, const fs::path& b) {
    std::error_code error;
    return !core::is_file(b) || platform::write_time(a, error) > platform::write_time(b, error);
}

/// A line for the user; empty if there are no masks.
std::string masks_text(size_t masked, size_t photos, const UsedOf& used) {
    std::string text;
    if (masked > 0)
        text = std::to_string(masked) + " of " + core::counted(photos, "photo") +
               (masked == 1 ? " has a mask" : " have masks") +
               ": what is black there is neither searched nor trained";
    else if (used.found > 0)
        text =
            core::counted(used.found, "mask") + " " + std::string(core::is_or_are(used.found)) + " not used";
    return used.why.empty() || text.empty() ? text : text + " (" + used.why + ")";
}

}  // namespace

FoundMasks find_masks(const fs::path& photos, const std::vector<fs::path>& names, const fs::path& project) {
    io::ImageRecords records;
    records.folder = fs::canonical(photos);
    for (const fs::path& name : names) {
        records.images.emplace_back();
        records.images.back().path = records.folder / name;
    }
    io::Companions files(io::Companions::Kind::masks, records,
                         core::is_folder(project) ? fs::canonical(project) : records.folder, 1);
    FoundMasks found;
    for (const io::ImageRecord& photo : records.images) found.files.push_back(files.find(photo));
    if (const fs::path of_all = files.of_all(); !of_all.empty()) std::ranges::fill(found.files, of_all);
    const auto bare = std::ranges::count_if(found.files, [](const fs::path& mask) { return mask.empty(); });
    found.text = masks_text(names.size() - size_t(bare), names.size(), files.used({}));
    return found;
}

std::string copy_masks(const fs::path& photos, const std::vector<fs::path>& names, const fs::path& images,
                       const fs::path& masks, const fs::path& project, const ProgressFunction& progress) {
    const FoundMasks found = find_masks(photos, names, project);
    std::vector<size_t> newer;
    const auto copy_of = [&](size_t i) { return masks / (names[i].string() + ".png"); };
    for (size_t i = 0; i < names.size(); ++i)
        if (!found.files[i].empty() && is_newer(found.files[i], copy_of(i))) newer.push_back(i);
    if (!newer.empty())
        on_all_cores({CapturePhase::photos, "copied", "masks", 0, int(newer.size()), {}}, progress,
                     [&](size_t k) {
                         const size_t i = newer[k];
                         write_mask(found.files[i], read_image_size(images / names[i]), copy_of(i));
                     });
    return found.text;
}

}  // namespace ewa::capture
