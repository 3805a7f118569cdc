// SPDX-License-Identifier: Apache-2.0
#include "viewer/layout.h"

#include <algorithm>
#include <cmath>

namespace ewa::viewer {
namespace {

constexpr Size kLeastWindow{1100, 880};  // where the desktop has room
constexpr double kLeastPanel = 18;       // in heights of the text
constexpr double kShare = 0.92;          // of the desktop: the window's frame takes some

}  // namespace

Rectangle fitted(Size shape, const Rectangle& space) {
    if (shape.width <= 0 || shape.height <= 0 || shape == space.size()) return space;
    const double scale = std::min(double(space.width) / shape.width, double(space.height) / shape.height);
    const int width = std::clamp(int(std::lround(shape.width * scale)), 1, std::max(1, space.width));
    const int height = std::clamp(int(std::lround(shape.height * scale)), 1, std::max(1, space.height));
    return {space.x + (space.width - width) / 2, space.y + (space.height - height) / 2, width, height};
}

double monitor_scale(Size pixels, Size millimetres) {
    constexpr double kDense = 140, kUsualHeight = 1080, kSteps = 4;
    const double inches = millimetres.width / 25.4;
    if (inches > 0 && pixels.width / inches <= kDense) return 1;
    return std::max(1.0, std::round(kSteps * pixels.height / kUsualHeight) / kSteps);
}

int panel_width(int window, double text_height) {
    const double usual = kPanelWidth * text_height, most = kMostPanel * window;
    return int(most >= kLeastPanel * text_height ? std::min(usual, most) : usual);
}

Rectangle free_area(Size window, int panel) {
    const int width = std::max(1, window.width), height = std::max(1, window.height);
    if (panel <= 0 || panel > kMostPanel * width) return {0, 0, width, height};
    return {panel, 0, width - panel, height};
}

Arrangement arrange(Comparison comparison, const Rectangle& area, Size image) {
    if (comparison != Comparison::beside) return {area, fitted(image, area)};
    const int half_width = std::max(1, area.width / 2), half_height = std::max(1, area.height / 2);
    const Rectangle left{area.x, area.y, half_width, area.height};
    const Rectangle right{area.x + half_width, area.y, std::max(1, area.width - half_width), area.height};
    const Rectangle top{area.x, area.y, area.width, half_height};
    const Rectangle bottom{area.x, area.y + half_height, area.width, std::max(1, area.height - half_height)};
    const bool stacked = fitted(image, bottom).width > fitted(image, right).width;
    return stacked ? Arrangement{top, fitted(image, bottom)} : Arrangement{left, fitted(image, right)};
}

Size window_size(Size picture, int panel, Size desktop, double scale) {
    const double most_width = desktop.width > 0 ? kShare * desktop.width : 1e9;
    const double most_height = desktop.height > 0 ? kShare * desktop.height : 1e9;
    const double height = std::min(kLeastWindow.height * scale, most_height);
    const double width = std::clamp(panel + height * picture.width / std::max(1, picture.height),
                                    kLeastWindow.width * scale, kUsualSize.width * scale + panel);
    return {std::max(1, int(std::lround(std::min(width, most_width)))),
            std::max(1, int(std::lround(height)))};
}

Image part_of(const Image& image, const Rectangle& part) {
    const int left = std::clamp(part.x, 0, image.width - 1), top = std::clamp(part.y, 0, image.height - 1);
    const int right = std::clamp(part.x + part.width, left + 1, image.width),
              bottom = std::clamp(part.y + part.height, top + 1, image.height);
    Image result(right - left, bottom - top, image.channels);
    for (int y = top; y < bottom; ++y)
        std::copy_n(image.at(left, y), size_t(result.width) * size_t(image.channels), result.at(0, y - top));
    return result;
}

BarSizes bar_sizes(double text_height) {
    constexpr double kTopBar = 2.6, kStrip = 2.6, kStatusLine = 1.7;  // in heights of the text
    const auto pixels = [&](double heights) { return int(std::lround(heights * text_height)); };
    return {pixels(kTopBar), pixels(kStrip), pixels(kStatusLine)};
}

}  // namespace ewa::viewer
