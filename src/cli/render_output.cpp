// SPDX-License-Identifier: Apache-2.0
#include "cli/render_output.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "cli/render_picture.h"
#include "core/folders.h"

namespace ewa::cli {
namespace {

/// Divides by the largest value and returns it: the value of white in a PNG.
float normalize(Image& image) {
    float largest = 0;
    for (const float v : image.pixels) largest = std::max(largest, v);
    if (largest > 0)
        for (float& v : image.pixels) v /= largest;
    return largest;
}

/// From -1 to 1 to what a file of 8 bits holds; no surface is black.
void encode_normals(Image& normals) {
    for (size_t i = 0; i < normals.pixels.size(); i += 3) {
        float* n = &normals.pixels[i];
        if (n[0] == 0 && n[1] == 0 && n[2] == 0) continue;
        for (int c = 0; c < 3; ++c) n[c] = 0.5f + 0.5f * n[c];
    }
}

/// The image to save. remark: a fact that the file itself does not hold.
Image chosen_image(Rendering&& rendering, const ImageKind& kind, std::string& remark) {
    const bool exr = kind.format == "exr";
    if (kind.mode == "alpha") return std::move(rendering.alpha);
    if (kind.mode == "color") {
        if (exr) return with_alpha(rendering.color, rendering.alpha);
        return kind.transparent ? transparent_image(rendering) : std::move(rendering.color);
    }
    if (kind.mode == "normal") {
        if (!exr) encode_normals(rendering.normal);
        return std::move(rendering.normal);
    }
    Image& depth = kind.mode == "depth" ? rendering.depth : rendering.median_depth;
    if (!exr) remark = fmt::format("white is depth {:.6g}", normalize(depth));
    return std::move(depth);
}

}  // namespace

Drawing drawing_of(const std::string& mode) {
    if (mode == "depth") return Drawing::depth;
    if (mode == "median-depth") return Drawing::median_depth;
    if (mode == "normal") return Drawing::normal;
    return Drawing::color;
}

void save_render(const std::filesystem::path& file, Rendering&& rendering, const ImageKind& kind,
                 bool panorama, Progress& progress) {
    std::string remark;
    const Image image = chosen_image(std::move(rendering), kind, remark);
    core::make_folder(file.parent_path());
    if (panorama)
        save_panorama(file, image);
    else
        save_image(file, image);
    if (!remark.empty()) progress.note(file.string() + ": " + remark);
}

}  // namespace ewa::cli
