// SPDX-License-Identifier: Apache-2.0
#include "viewer/byte_image.h"

#include <algorithm>
#include <iterator>

#include "scene/statistics.h"

namespace ewa::viewer {
namespace {

/// Rounds as save_image does; NaN becomes zero.
uint8_t to_byte(float v) {
    return v > 0.0f ? uint8_t(std::min(v, 1.0f) * 255.0f + 0.5f) : uint8_t(0);
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

void fill(ByteImage& picture, const Image& rgb) {
    fill(picture, [values = rgb.pixels.data()](size_t i) {
        return std::array<float, 3>{values[3 * i], values[3 * i + 1], values[3 * i + 2]};
    });
}

ByteImage empty_picture(int width, int height) {
    return {width, height, std::vector<uint8_t>(size_t(width) * size_t(height) * 4), 0};
}

}  // namespace

std::array<float, 3> heat(float share) {
    return {std::clamp(3 * share, 0.0f, 1.0f), std::clamp(3 * share - 1, 0.0f, 1.0f),
            std::clamp(3 * share - 2, 0.0f, 1.0f)};
}

ByteImage picture_of(const Rendering& rendering, Mode mode) {
    ByteImage picture = empty_picture(rendering.alpha.width, rendering.alpha.height);
    const auto grey = [](float v) { return std::array<float, 3>{v, v, v}; };
    if (mode == Mode::depth || mode == Mode::median_depth) {
        const Image& seen = mode == Mode::depth ? rendering.depth : rendering.median_depth;
        std::vector<float> depths;
        for (size_t i = 0; i < seen.pixels.size(); ++i)
            if (rendering.alpha.pixels[i] >= 0.5f && seen.pixels[i] > 0) depths.push_back(seen.pixels[i]);
        picture.dark = scene::quantile(depths, 0.02);
        picture.white = scene::quantile(depths, 0.98);
        const float range = picture.white - picture.dark;
        fill(picture, [&](size_t i) {
            const float depth = seen.pixels[i];
            if (!(depth > 0)) return grey(0);
            if (!(range > 0)) return grey(1);
            return grey(kDarkestDepth +
                        (1 - kDarkestDepth) * std::clamp((depth - picture.dark) / range, 0.0f, 1.0f));
        });
    } else if (mode == Mode::count) {
        std::vector<float> counts;
        std::copy_if(rendering.count.pixels.begin(), rendering.count.pixels.end(), std::back_inserter(counts),
                     [](float count) { return count > 0; });
        picture.white = scene::quantile(counts, 0.99);
        const float scale = picture.white > 0 ? 1.0f / picture.white : 0.0f;
        fill(picture, [&](size_t i) { return heat(rendering.count.pixels[i] * scale); });
    } else if (mode == Mode::normal) {
        fill(picture, [n = rendering.normal.pixels.data()](size_t i) {
            std::array<float, 3> rgb{n[3 * i], n[3 * i + 1], n[3 * i + 2]};
            if (rgb == std::array<float, 3>{}) return rgb;
            for (float& v : rgb) v = 0.5f + 0.5f * v;
            return rgb;
        });
    } else if (mode == Mode::opacity) {
        fill(picture, [&](size_t i) { return grey(rendering.alpha.pixels[i]); });
    } else {
        fill(picture, rendering.color);
    }
    return picture;
}

ByteImage picture_of(const Image& image, const std::array<float, 3>& background) {
    const Image opaque = over_background(image, background);
    ByteImage picture = empty_picture(opaque.width, opaque.height);
    fill(picture, opaque);
    return picture;
}

}  // namespace ewa::viewer
