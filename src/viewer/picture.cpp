// SPDX-License-Identifier: Apache-2.0
#include "viewer/picture.h"

#include <algorithm>
#include <cmath>

namespace ewa::viewer {
namespace {

uint8_t to_byte(float v) {
    return v > 0.0f ? uint8_t(std::lround(std::min(v, 1.0f) * 255.0f)) : uint8_t(0);
}

float white_depth_of(const Rendering& rendering) {
    std::vector<float> depths;
    for (size_t i = 0; i < rendering.depth.pixels.size(); ++i)
        if (rendering.alpha.pixels[i] >= 0.5f) depths.push_back(rendering.depth.pixels[i]);
    if (depths.empty()) return 0;
    const auto at = depths.begin() + std::ptrdiff_t(0.98 * double(depths.size() - 1));
    std::nth_element(depths.begin(), at, depths.end());
    return *at;
}

}  // namespace

Picture picture_of(const Rendering& rendering, Mode mode, const std::array<float, 3>& background) {
    const Image& color = rendering.color;
    Picture picture{color.width, color.height, std::vector<uint8_t>(size_t(color.width) * color.height * 4)};
    if (mode == Mode::depth) picture.white_depth = white_depth_of(rendering);
    const float depth_scale = picture.white_depth > 0 ? 1.0f / picture.white_depth : 0.0f;
    for (size_t i = 0; i < picture.rgba.size() / 4; ++i) {
        uint8_t* out = &picture.rgba[4 * i];
        const float alpha = rendering.alpha.pixels[i];
        for (size_t c = 0; c < 3; ++c) {
            float value = alpha;
            if (mode == Mode::color) value = color.pixels[3 * i + c] + (1.0f - alpha) * background[c];
            if (mode == Mode::depth) value = rendering.depth.pixels[i] * depth_scale;
            out[c] = to_byte(value);
        }
        out[3] = 255;
    }
    return picture;
}

}  // namespace ewa::viewer
