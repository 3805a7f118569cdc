// SPDX-License-Identifier: Apache-2.0
#include "pipeline/frame_inputs.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <vector>

#include "ewa/error.h"
#include "scene/native_lens.h"
#include "scene/readout.h"

namespace ewa::pipeline {
namespace {

void split(double value, float& high, float& low) {
    high = float(value);
    low = float(value - double(high));
}

void check(const Camera& camera) {
    bool good = camera.width > 0 && camera.height > 0 && camera.fx > 0 && camera.fy > 0 &&
                std::isfinite(camera.fx) && std::isfinite(camera.fy) && std::isfinite(camera.cx) &&
                std::isfinite(camera.cy);
    for (int i = 0; i < 3; ++i) {
        good = good && std::isfinite(camera.translation[i]);
        for (int j = 0; j < 3; ++j) good = good && std::isfinite(camera.rotation[i][j]);
    }
    if (!good)
        throw InputError(
            "a camera with a value that is not finite, or a size or focal length not above zero");
    if (!scene::is_native(camera.distortion))
        throw InputError("splats cannot be rendered through this lens; undistort its images");
    scene::check_readout(camera);
}

uint32_t lens_of(const Distortion& lens) {
    switch (lens.lens) {
        case Lens::fisheye:
            return shared::LENS_FISHEYE;
        case Lens::equirectangular:
            return shared::LENS_EQUIRECTANGULAR;
        case Lens::orthographic:
            return shared::LENS_ORTHOGRAPHIC;
        default:
            return shared::LENS_BROWN;
    }
}

void set_readout(const Camera& camera, shared::CameraBlock& block) {
    if (!camera.readout) return;
    const scene::ReadoutMotion motion = scene::middle_motion(camera);
    for (int i = 0; i < 3; ++i) {
        block.readout_turn[i] = float(motion.turn[i]);
        block.readout_shift[i] = float(motion.shift[i]);
    }
    for (int i = 0; i < 2; ++i) block.readout_slope[i] = float(motion.slope[i]);
    block.readout_first = float(motion.first);
}

/// The nearest of 255 levels; halves round up.
uint8_t level(float value) {
    const float scaled = std::clamp(value, 0.0f, 1.0f) * 255.0f;
    const auto whole = int(scaled);
    return uint8_t(whole + int(scaled - float(whole) >= 0.5f));
}

template <class Value, class Convert>
std::vector<Value> texels_of(const Image& image, Value opaque, Convert convert) {
    const size_t pixels = size_t(image.width) * size_t(image.height), channels = size_t(image.channels);
    std::vector<Value> texels(4 * pixels, opaque);
    for (size_t i = 0; i < pixels; ++i)
        for (size_t c = 0; c < channels; ++c) texels[4 * i + c] = convert(image.pixels[i * channels + c]);
    return texels;
}

template <class Value>
gpu::Buffer upload_texels(gpu::Device& device, const std::vector<Value>& texels, gpu::Texel texel) {
    gpu::Buffer buffer(device, "photo", texels.size() * sizeof(Value), texel);
    buffer.upload(std::span<const Value>(texels));
    return buffer;
}

template <class Block>
void set_lens_of(const Camera& camera, Block& block) {
    const Distortion& d = camera.distortion;
    const double terms[] = {d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6, d.s1, d.s2, d.s3, d.s4};
    for (size_t i = 0; i < std::size(terms); ++i) split(terms[i], block.lens_hi[i], block.lens_lo[i]);
    block.lens_limit = float(std::min(scene::lens_limit(camera), double(std::numeric_limits<float>::max())));
    block.lens = lens_of(d);
    const scene::TangentBounds bounds = scene::tangent_bounds(camera);
    for (int i = 0; i < 2; ++i) {
        block.tan_min[i] = float(bounds.low[i]);
        block.tan_max[i] = float(bounds.high[i]);
    }
}

}  // namespace

void set_lens(const Camera& camera, shared::ViewBlock& block) {
    set_lens_of(camera, block);
}

shared::CameraBlock camera_block(const Camera& camera, const passes::KernelConfig& config,
                                 const glm::dvec3& origin) {
    check(camera);
    shared::CameraBlock block{};
    const Camera middle = scene::at_middle(camera);
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
            split(middle.rotation[column][row], block.rotation_hi[3 * row + column],
                  block.rotation_lo[3 * row + column]);
    const glm::dvec3 position = middle.position() - origin;
    for (int i = 0; i < 3; ++i) split(position[i], block.position_hi[i], block.position_lo[i]);
    const double focal[2] = {camera.fx, camera.fy}, center[2] = {camera.cx, camera.cy};
    const int size[2] = {camera.width, camera.height};
    const uint32_t tile[2] = {config.tile_width, config.tile_height};
    for (int i = 0; i < 2; ++i) {
        split(focal[i], block.focal_hi[i], block.focal_lo[i]);
        split(center[i], block.center_hi[i], block.center_lo[i]);
        block.size[i] = uint32_t(size[i]);
        block.tiles[i] = (uint32_t(size[i]) + tile[i] - 1) / tile[i];
    }
    set_lens_of(camera, block);
    set_readout(camera, block);
    return block;
}

gpu::Buffer upload_camera(gpu::Device& device, const Camera& camera, const passes::KernelConfig& config,
                          const glm::dvec3& origin) {
    const shared::CameraBlock block = camera_block(camera, config, origin);
    gpu::Buffer buffer(device, "camera", sizeof(block), gpu::Texel::none, true);
    buffer.upload(std::span<const shared::CameraBlock>(&block, 1));
    return buffer;
}

CameraUse use_of(const gpu::Buffer& blocks, uint64_t offset, const Camera& camera) {
    return {.buffer = &blocks,
            .offset = offset,
            .width = uint32_t(camera.width),
            .height = uint32_t(camera.height),
            .lenses = scene::moves(camera)        ? shared::LENSES_ROLLING
                      : !camera.distortion.none() ? shared::LENSES_ANY
                                                  : shared::LENSES_PINHOLE,
            .wraps = scene::shows_all_around(camera)};
}

FrameInputs inputs_of(const gpu::Buffer& block, const Camera& camera, const RenderOptions& options) {
    return {.camera = use_of(block, 0, camera),
            .background = options.sky ? std::array<float, 3>{} : options.background,
            .sh_degree = options.sh_degree,
            .samples = uint32_t(std::max(options.samples, 1))};
}

Band band_of(const passes::KernelConfig& config, uint32_t height, uint32_t bands, uint32_t band) {
    const uint32_t tile = config.tile_height, tile_rows = (height + tile - 1) / tile;
    const auto border = [&](uint32_t b) {
        return std::min(uint32_t(uint64_t(tile_rows) * b / bands) * tile, height);
    };
    // A value of SSIM depends on the image up to SSIM_RADIUS rows away. Its gradient goes to those rows of the same band.
    const uint32_t halo = (shared::SSIM_RADIUS + tile - 1) / tile * tile;
    const uint32_t begin = border(band), end = border(band + 1);
    const uint32_t first = begin - std::min(begin, halo), last = std::min(end + halo, height);
    return {.first = first, .rows = last - first, .own_begin = begin - first, .own_end = end - first};
}

bool transparent(const Image& image) {
    bool found = false;
    for (size_t i = 3; image.channels == 4 && i < image.pixels.size(); i += 4)
        found = found || image.pixels[i] < 1;
    return found;
}

PhotoTexels photo_texels(const Image& image, bool round_to_8_bit) {
    bool eight_bit = true;
    if (!round_to_8_bit)
        for (const float value : image.pixels)
            eight_bit = eight_bit && value >= 0 && value <= 1 && float(level(value)) / 255.0f == value;
    if (eight_bit) return texels_of<uint8_t>(image, 255, level);
    return texels_of<float>(image, 1.0f, [](float value) { return value; });
}

gpu::Buffer upload_photo(gpu::Device& device, const PhotoTexels& texels) {
    if (const auto* bytes = std::get_if<std::vector<uint8_t>>(&texels))
        return upload_texels(device, *bytes, gpu::Texel::rgba8);
    return upload_texels(device, std::get<std::vector<float>>(texels), gpu::Texel::rgba32f);
}

gpu::Buffer upload_photo(gpu::Device& device, const Image& image, bool round_to_8_bit) {
    return upload_photo(device, photo_texels(image, round_to_8_bit));
}

uint64_t photo_bytes(int width, int height, bool round_to_8_bit) {
    return uint64_t(width) * uint64_t(height) * 4 * (round_to_8_bit ? sizeof(uint8_t) : sizeof(float));
}

}  // namespace ewa::pipeline
