// SPDX-License-Identifier: Apache-2.0
#include "cli/contact_sheet.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "ewa/error.h"
#include "scene/camera.h"

namespace ewa::cli {
namespace {

constexpr int kCellWidth = 320, kGap = 8;     // px
constexpr int kLowest = 120, kHighest = 480;  // of a cell, px
constexpr float kPaper = 0.12f;
constexpr int64_t kLongestSide = 65535,
                  kMostPixels = 134'000'000;  // as of a render; JPEG has no longer sides

}  // namespace

Camera thumbnail_of(const Camera& camera) {
    const double scale = 2.0 * std::min(double(kCellWidth) / camera.width, double(kHighest) / camera.height);
    if (scale >= 1) return camera;
    return resized(camera, std::max(1, int(std::lround(scale * camera.width))),
                   std::max(1, int(std::lround(scale * camera.height))));
}

ContactSheet::ContactSheet(const std::vector<Camera>& views) {
    double aspect = 0;
    for (const Camera& view : views) aspect += double(view.height) / view.width / double(views.size());
    cell_height_ = std::clamp(int(std::lround(kCellWidth * aspect)), kLowest, kHighest);
    const int count = int(views.size());
    columns_ = std::clamp(int(std::lround(std::sqrt(1.5 * count * cell_height_ / kCellWidth))), 1, count);
    const int rows = (count + columns_ - 1) / columns_;
    const int64_t width = kGap + int64_t(columns_) * (kCellWidth + kGap),
                  height = kGap + int64_t(rows) * (cell_height_ + kGap);
    if (width > kLongestSide || height > kLongestSide || width * height > kMostPixels)
        throw InputError(
            fmt::format("--contact-sheet: {} views take {}x{} px, more than {} million; choose fewer", count,
                        width, height, kMostPixels / 1'000'000));
    sheet_ = Image(int(width), int(height), 3);
    std::ranges::fill(sheet_.pixels, kPaper);
}

void ContactSheet::add(const Image& image) {
    const double scale =
        std::min({1.0, double(kCellWidth) / image.width, double(cell_height_) / image.height});
    const Image small = reduced(image, std::max(1, int(std::lround(scale * image.width))),
                                std::max(1, int(std::lround(scale * image.height))));
    const int column = int(added_) % columns_, row = int(added_) / columns_;
    const int left = kGap + column * (kCellWidth + kGap) + (kCellWidth - small.width) / 2;
    const int top = kGap + row * (cell_height_ + kGap) + (cell_height_ - small.height) / 2;
    for (int y = 0; y < small.height; ++y)
        for (int x = 0; x < small.width; ++x)
            for (int c = 0; c < 3; ++c)
                sheet_.at(left + x, top + y)[c] = small.at(x, y)[small.channels < 3 ? 0 : c];
    ++added_;
}

}  // namespace ewa::cli
