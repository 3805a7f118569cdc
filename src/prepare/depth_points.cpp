// SPDX-License-Identifier: Apache-2.0
#include "prepare/depth_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/matrix.hpp>

#include "core/random.h"
#include "scene/depth_map.h"

namespace ewa::train {
namespace {

std::array<uint8_t, 3> color_of(const float* pixel) {
    std::array<uint8_t, 3> color;
    for (size_t c = 0; c < 3; ++c) color[c] = uint8_t(std::lround(255 * std::clamp(pixel[c], 0.0f, 1.0f)));
    return color;
}

std::vector<int> frames_with_maps(const Dataset& dataset, const std::vector<int>& frames) {
    std::vector<int> mapped;
    for (const int i : frames)
        if (const Frame& f = dataset.frames[size_t(i)]; !f.depth_path.empty() && takes_depth_map(f))
            mapped.push_back(i);
    return mapped;
}

}  // namespace

void add_points(const ImageWithDepths& from, uint32_t count, uint64_t seed, uint32_t index,
                PointCloud& points) {
    const auto& [camera, image, depths] = from;
    std::vector<uint32_t> pixels;
    for (size_t i = 0; i < depths.pixels.size(); ++i)
        if (depths.pixels[i] > 0) pixels.push_back(uint32_t(i));
    const uint32_t taken = uint32_t(std::min<size_t>(count, pixels.size()));
    for (uint32_t k = 0; k < taken; ++k) {
        // One of each stretch of equal length, so that they cover the image evenly.
        const double share = core::uniform4({uint32_t(seed), uint32_t(seed >> 32), index, k})[0];
        const size_t begin = pixels.size() * k / taken, end = pixels.size() * (k + 1) / taken;
        const uint32_t at = pixels[begin + size_t(share * double(end - begin))];
        const int x = int(at % uint32_t(depths.width)), y = int(at / uint32_t(depths.width));
        const double z = double(depths.pixels[at]);
        const glm::dvec3 seen(z * (x + 0.5 - camera.cx) / camera.fx, z * (y + 0.5 - camera.cy) / camera.fy,
                              z);
        points.positions.push_back(camera.position() + glm::transpose(camera.rotation) * seen);
        points.colors.push_back(color_of(image.at(x, y)));
    }
}

bool has_depth_maps(const Dataset& dataset, const std::vector<int>& frames) {
    return !frames_with_maps(dataset, frames).empty();
}

PointCloud points_of_depth_maps(const Dataset& dataset, const std::vector<int>& frames, uint32_t count,
                                uint64_t seed) {
    const std::vector<int> mapped = frames_with_maps(dataset, frames);
    PointCloud points;
    for (size_t k = 0; k < mapped.size(); ++k) {
        const auto part = [&](size_t n) { return uint32_t(uint64_t(count) * n / mapped.size()); };
        const Frame& frame = dataset.frames[size_t(mapped[k])];
        const Image image = load_frame_image(frame);
        Image depths = load_depth_map(frame);
        drop_masked(depths, image);
        add_points({frame.camera, image, depths}, part(k + 1) - part(k), seed, uint32_t(k), points);
    }
    return points;
}

}  // namespace ewa::train
