// SPDX-License-Identifier: Apache-2.0
#include "pipeline/photo.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace ewa::pipeline {
namespace {

template <class Value, class Convert>
gpu::Buffer upload_texels(gpu::Device& device, const Image& image, gpu::Texel texel, Value opaque,
                          Convert convert) {
    const size_t pixels = size_t(image.width) * size_t(image.height), channels = size_t(image.channels);
    std::vector<Value> texels(4 * pixels, opaque);
    for (size_t i = 0; i < pixels; ++i)
        for (size_t c = 0; c < channels; ++c) texels[4 * i + c] = convert(image.pixels[i * channels + c]);
    gpu::Buffer buffer(device, "photo", texels.size() * sizeof(Value), texel);
    buffer.upload(std::span<const Value>(texels));
    return buffer;
}

}  // namespace

gpu::Buffer upload_photo(gpu::Device& device, const Image& image, bool round_to_8_bit) {
    const auto level = [](float value) { return std::round(std::clamp(value, 0.0f, 1.0f) * 255.0f); };
    bool eight_bit = true;
    if (!round_to_8_bit)
        for (const float value : image.pixels)
            eight_bit = eight_bit && value >= 0 && value <= 1 && level(value) / 255.0f == value;
    if (eight_bit)
        return upload_texels<uint8_t>(device, image, gpu::Texel::rgba8, 255,
                                      [&](float value) { return uint8_t(level(value)); });
    return upload_texels<float>(device, image, gpu::Texel::rgba32f, 1.0f, [](float value) { return value; });
}

uint64_t photo_bytes(int width, int height, bool round_to_8_bit) {
    return uint64_t(width) * uint64_t(height) * 4 * (round_to_8_bit ? sizeof(uint8_t) : sizeof(float));
}

}  // namespace ewa::pipeline
