// SPDX-License-Identifier: Apache-2.0
#include "viewer/byte_image.h"

#include <algorithm>
#include <cmath>

namespace ewa::viewer {
namespace {

/// Rounds as save_image does; NaN becomes zero.
uint8_t to_byte(float v) {
    return v > 0.0f ? uint8_t(std::min(v, 1.0f) * 255.0f + 0.5f) : uint8_t(0);
}

float quantile(std::vector<float>& values, double share) {
    if (values.empty()) return 0;
    const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

std::vector<float> solid_depths(const Rendering& rendering) {
    std::vector<float> depths;
    for (size_t i = 0; i < rendering.depth.pixels.size(); ++i)
        if (rendering.alpha.pixels[i] >= 0.5f) depths.push_back(rendering.depth.pixels[i]);
    return depths;
}

float white_count_of(const Rendering& rendering) {
    std::vector<float> counts;
    for (const float count : rendering.count.pixels)
        if (count > 0) counts.push_back(count);
    return quantile(counts, 0.99);
}

/// rgb(i): the three values of pixel i.
template <class Values>
void fill(ByteImage& picture, Values rgb) {
    for (size_t i = 0; i < picture.rgba.size() / 4; ++i) {
        const std::array<float, 3> values = rgb(i);
        for (size_t c = 0; c < 3; ++c) picture.rgba[4 * i + c] = to_byte(values[c]);
        picture.rgba[4 * i + 3] = 255;
    }
}

ByteImage empty_picture(int width, int height) {
    return {width, height, std::vector<uint8_t>(size_t(width) * size_t(height) * 4), 0};
}

}  // namespace

Drawing drawing_for(Mode mode) {
    if (mode == Mode::depth) return Drawing::depth;
    if (mode == Mode::count) return Drawing::count;
    return mode == Mode::ellipsoids ? Drawing::ellipsoids : Drawing::color;
}

std::array<float, 3> heat(float share) {
    return {std::clamp(3 * share, 0.0f, 1.0f), std::clamp(3 * share - 1, 0.0f, 1.0f),
            std::clamp(3 * share - 2, 0.0f, 1.0f)};
}

ByteImage picture_of(const Rendering& rendering, Mode mode) {
    ByteImage picture = empty_picture(rendering.color.width, rendering.color.height);
    const auto grey = [](float v) { return std::array<float, 3>{v, v, v}; };
    if (mode == Mode::depth) {
        std::vector<float> depths = solid_depths(rendering);
        picture.dark = quantile(depths, 0.02);
        picture.white = quantile(depths, 0.98);
        const float range = picture.white - picture.dark;
        fill(picture, [&](size_t i) {
            const float depth = rendering.depth.pixels[i];
            if (!(depth > 0)) return grey(0);
            if (!(range > 0)) return grey(1);
            return grey(kDarkestDepth +
                        (1 - kDarkestDepth) * std::clamp((depth - picture.dark) / range, 0.0f, 1.0f));
        });
    } else if (mode == Mode::count) {
        picture.white = white_count_of(rendering);
        const float scale = picture.white > 0 ? 1.0f / picture.white : 0.0f;
        fill(picture, [&](size_t i) { return heat(rendering.count.pixels[i] * scale); });
    } else if (mode == Mode::opacity) {
        fill(picture, [&](size_t i) { return grey(rendering.alpha.pixels[i]); });
    } else {
        const float* values = rendering.color.pixels.data();
        fill(picture, [&](size_t i) {
            return std::array<float, 3>{values[3 * i], values[3 * i + 1], values[3 * i + 2]};
        });
    }
    return picture;
}

ByteImage picture_of(const Image& image, const std::array<float, 3>& background) {
    const Image opaque = over_background(image, background);
    ByteImage picture = empty_picture(opaque.width, opaque.height);
    fill(picture, [&](size_t i) {
        const float* values = &opaque.pixels[3 * i];
        return std::array<float, 3>{values[0], values[1], values[2]};
    });
    return picture;
}

}  // namespace ewa::viewer
