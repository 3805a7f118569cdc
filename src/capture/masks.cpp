// SPDX-License-Identifier: Apache-2.0
// The masks of photos, which lie among them or beside their folder. COLMAP and the training get copies in one form.
#include <algorithm>
#include <atomic>
#include <map>

#include "capture/steps.h"
#include "core/folders.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/image.h"
#include "image/image_files.h"

namespace ewa::capture {
namespace {

namespace fs = std::filesystem;

/// The name of the photo that a mask belongs to: "img_1" of IMG_1.png, IMG_1.jpg.png or IMG_1_mask.png.
std::string photo_name(const fs::path& mask) {
    std::string name = core::lower(mask.stem().string());
    const auto strip = [&](std::initializer_list<std::string_view> ends) {
        for (const std::string_view end : ends)
            if (name.size() > end.size() && name.ends_with(end)) {
                name.resize(name.size() - end.size());
                return;
            }
    };
    for (int i = 0; i < 2; ++i) {
        strip({".jpg", ".jpeg", ".png", ".tif", ".tiff", ".bmp", ".heic", ".heif"});
        strip({"_mask", "-mask", ".mask", "_masks", "_seg", "_segmentation", "_matte"});
    }
    return name;
}

bool is_mask(const fs::path& file) {
    const std::string name = core::lower(file.string());
    return std::ranges::any_of(std::initializer_list<const char*>{"mask", "seg", "matte"},
                               [&](const char* word) { return name.find(word) != std::string::npos; });
}

/// How many folders above the files are the same, from the nearest.
size_t common_folders(const fs::path& a, const fs::path& b) {
    const fs::path x = a.parent_path(), y = b.parent_path();
    const std::vector<fs::path> p(x.begin(), x.end()), q(y.begin(), y.end());
    return size_t(std::mismatch(p.rbegin(), p.rend(), q.rbegin(), q.rend()).first - p.rbegin());
}

/// Files of masks by the names of their photos.
using Masks = std::map<std::string, std::vector<fs::path>>;

Masks masks_of(const fs::path& photos) {
    Masks masks;
    const auto add = [&](const fs::path& file) { masks[photo_name(file)].push_back(file); };
    for (const fs::path& file : pictures_in(photos).others)
        if (is_mask(file)) add(photos / file);
    const fs::path beside = fs::canonical(photos).parent_path();
    for (const char* name : {"masks", "mask"})
        if (core::is_folder(beside / name))
            for (const fs::path& file : image::images_below(beside / name)) add(beside / name / file);
    return masks;
}

/// Values of 0 and 1 become 0 and 255. COLMAP wants the photo's size.
void write_mask(const fs::path& from, const ImageSize& size, const fs::path& to) {
    const Image mask = load_image(from);
    float most = 0;
    for (const float value : mask.pixels) most = std::max(most, value);
    constexpr float kLeast = 1.5f / 255;
    const float scale = most > 0 && most < kLeast ? 1 / most : 1;
    Image out(size.width, size.height, 1);
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x)
            *out.at(x, y) = scale * *mask.at(int(int64_t(x) * mask.width / size.width),
                                             int(int64_t(y) * mask.height / size.height));
    core::make_folder(to.parent_path());
    save_image(to, out);
}

bool is_newer(const fs::path& a, const fs::path& b) {
    std::error_code error;
    return !core::is_file(b) || fs::last_write_time(a, error) > fs::last_write_time(b, error);
}

}  // namespace

size_t copy_masks(const fs::path& photos, const std::vector<fs::path>& names, const fs::path& images,
                  const fs::path& masks, const ProgressFunction& progress) {
    const Masks known = masks_of(photos);
    struct Copy {
        fs::path from, photo, to;
    };
    std::vector<Copy> copies;
    size_t used = 0;
    for (const fs::path& name : names) {
        const auto found = known.find(core::lower(name.stem().string()));
        if (found == known.end()) continue;
        const fs::path& mask = *std::ranges::max_element(
            found->second, {}, [&](const fs::path& file) { return common_folders(file, name); });
        fs::path to = masks / name;
        to += ".png";
        ++used;
        if (is_newer(mask, to)) copies.push_back({mask, images / name, to});
    }
    if (!copies.empty())
        on_all_cores(
            {CapturePhase::photos, "copied", "masks", 0, int(copies.size()), {}}, progress,
            [&](size_t i) { write_mask(copies[i].from, read_image_size(copies[i].photo), copies[i].to); });
    return used;
}

}  // namespace ewa::capture
