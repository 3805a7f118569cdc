// SPDX-License-Identifier: Apache-2.0
#include "viewer/comparison.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ewa::viewer {
namespace {

/// Channel c at a position in pixels. Pixel centres are at +0.5; the border is repeated.
float bilinear(const ByteImage& picture, double x, double y, size_t c) {
    const double left = std::clamp(x - 0.5, 0.0, picture.width - 1.0);
    const double top = std::clamp(y - 0.5, 0.0, picture.height - 1.0);
    const int x0 = int(left), y0 = int(top);
    const int x1 = std::min(x0 + 1, picture.width - 1), y1 = std::min(y0 + 1, picture.height - 1);
    const float u = float(left - x0), v = float(top - y0);
    const auto at = [&](int px, int py) {
        return float(picture.rgba[4 * (size_t(py) * size_t(picture.width) + size_t(px)) + c]);
    };
    return (at(x0, y0) * (1 - u) + at(x1, y0) * u) * (1 - v) + (at(x0, y1) * (1 - u) + at(x1, y1) * u) * v;
}

}  // namespace

Rectangle fitted(Size shape, const Rectangle& room) {
    Rectangle result = room;
    if (shape.width <= 0 || shape.height <= 0) return result;
    if (shape != Size{room.width, room.height}) {
        const double scale = std::min(double(room.width) / shape.width, double(room.height) / shape.height);
        result.width = std::clamp(int(std::lround(shape.width * scale)), 1, std::max(1, room.width));
        result.height = std::clamp(int(std::lround(shape.height * scale)), 1, std::max(1, room.height));
    }
    result.x = room.x + (room.width - result.width) / 2;
    result.y = room.y + (room.height - result.height) / 2;
    return result;
}

Arrangement arrange(Comparison comparison, Size window, Size image, int covered) {
    const Rectangle whole{0, 0, window.width, window.height};
    if (comparison != Comparison::beside) return {whole, fitted(image, whole)};
    const int from = covered <= window.width / 3 ? covered : 0;
    const int half = std::max(1, (window.width - from) / 2);
    const Rectangle right{from + half, 0, std::max(1, window.width - from - half), window.height};
    return {{from, 0, half, window.height}, fitted(image, right)};
}

ByteImage difference(const ByteImage& rendering, const ByteImage& image, const Rectangle& place) {
    ByteImage result{rendering.width, rendering.height, std::vector<uint8_t>(rendering.rgba.size()), 0};
    const double scale_x = double(image.width) / std::max(1, place.width);
    const double scale_y = double(image.height) / std::max(1, place.height);
    for (int y = 0; y < result.height; ++y)
        for (int x = 0; x < result.width; ++x) {
            const size_t at = 4 * (size_t(y) * size_t(result.width) + size_t(x));
            result.rgba[at + 3] = 255;
            const int inner_x = x - place.x, inner_y = y - place.y;
            if (inner_x < 0 || inner_y < 0 || inner_x >= place.width || inner_y >= place.height) continue;
            for (size_t c = 0; c < 3; ++c) {
                const float photo = bilinear(image, (inner_x + 0.5) * scale_x, (inner_y + 0.5) * scale_y, c);
                result.rgba[at + c] = uint8_t(std::abs(float(rendering.rgba[at + c]) - photo) + 0.5f);
            }
        }
    return result;
}

void amplify(ByteImage& picture, float gain) {
    for (size_t i = 0; i < picture.rgba.size(); ++i)
        if (i % 4 != 3) picture.rgba[i] = uint8_t(std::min(float(picture.rgba[i]) * gain, 255.0f) + 0.5f);
}

double psnr_of_difference(const ByteImage& difference, const Rectangle& place) {
    double sum = 0;
    size_t count = 0;
    for (int y = std::max(0, place.y); y < std::min(difference.height, place.y + place.height); ++y)
        for (int x = std::max(0, place.x); x < std::min(difference.width, place.x + place.width); ++x)
            for (size_t c = 0; c < 3; ++c) {
                const size_t at = 4 * (size_t(y) * size_t(difference.width) + size_t(x)) + c;
                const double error = double(difference.rgba[at]) / 255;
                sum += error * error;
                ++count;
            }
    if (count == 0) return std::numeric_limits<double>::quiet_NaN();
    return 10 * std::log10(double(count) / sum);
}

}  // namespace ewa::viewer
