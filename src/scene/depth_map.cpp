// SPDX-License-Identifier: Apache-2.0
#include "scene/depth_map.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "core/text.h"
#include "ewa/error.h"
#include "scene/camera.h"
#include "scene/lens.h"
#include "scene/native_lens.h"
#include "scene/readout.h"

namespace ewa {

namespace {

constexpr double kMostDepth = 1e12;   // world units; larger ones are sky
constexpr double kLevels = 65535;     // of an integer map, which load_image divides by this
constexpr float kAgreement = 0.1f;    // of neighbours, relative
constexpr float kLeastWeight = 0.5f;  // of a pixel whose depth counts

/// World units of a value of the map.
double unit_of(const Frame& frame) {
    const std::string type = core::lower(frame.depth_path.extension().string());
    const std::string name = core::one_line(frame.depth_path.string());
    if (type == ".exr") return 1;
    if (type != ".png") throw InputError(name + ": is no depth map; .exr and .png files of 16 bits are");
    if (read_image_size(frame.depth_path).eight_bit)
        throw InputError(name + ": the depth map has 8 bits a pixel; 16 bits or an .exr hold depths");
    return kLevels * frame.depth_unit;
}

}  // namespace

bool takes_depth_map(const Frame& frame) {
    const bool pinhole = frame.camera.distortion.none() && !frame.camera.readout;
    return pinhole && (frame.distortion.none() || frame.distortion.lens == Lens::brown);
}

float depth_at(const Image& depth, const glm::vec2& at, float step) {
    if (!(at.x >= 0 && at.y >= 0 && at.x < float(depth.width) && at.y < float(depth.height))) return 0;
    const float nearest = *depth.at(int(at.x), int(at.y));
    const glm::vec2 middle = at - 0.5f;
    if (middle.x < 0 || middle.y < 0 || middle.x > float(depth.width - 1) ||
        middle.y > float(depth.height - 1))
        return nearest;
    const int x = std::min(int(middle.x), depth.width - 2), y = std::min(int(middle.y), depth.height - 2);
    if (x < 0 || y < 0) return nearest;
    const float a = *depth.at(x, y), b = *depth.at(x + 1, y), c = *depth.at(x, y + 1),
                d = *depth.at(x + 1, y + 1);
    const float low = std::min({a, b, c, d}), high = std::max({a, b, c, d});
    if (!(low > 0) || high - low > step) return nearest;
    const float u = middle.x - float(x), v = middle.y - float(y);
    const float mean = (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d);
    return std::isfinite(mean) ? mean : nearest;
}

Image load_depth_map(const Frame& frame) {
    if (!takes_depth_map(frame))
        throw InputError(
            "frame \"" + core::one_line(frame.name) +
            "\": depth maps need a pinhole, or --lens undistort with OpenCV's perspective model");
    const double unit = unit_of(frame);
    Image map = load_image(frame.depth_path);
    if (frame.orientation != 1) map = oriented(map, frame.orientation);
    if (!same_aspect(frame.source.width, frame.source.height, map.width, map.height))
        throw InputError(core::one_line(frame.depth_path.string()) + ": the depth map is " +
                         std::to_string(map.width) + " x " + std::to_string(map.height) +
                         " pixels, its image " + std::to_string(frame.source.width) + " x " +
                         std::to_string(frame.source.height));
    const Camera &camera = frame.camera, &pinhole = frame.pinhole;
    Image depths(camera.width, camera.height, 1);
    for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x) {
            glm::dvec2 at((x + 0.5) * pinhole.width / camera.width,
                          (y + 0.5) * pinhole.height / camera.height);
            if (!frame.distortion.none())
                at = scene::source_pixel(frame.source, frame.distortion, pinhole, at);
            const glm::vec2 place(at.x * map.width / frame.source.width,
                                  at.y * map.height / frame.source.height);
            const glm::vec2 inside =
                glm::clamp(place, glm::vec2(0.5f), glm::vec2(map.width, map.height) - 0.5f);
            const double depth =
                unit * double(depth_at(map, inside, kAgreement * *map.at(int(inside.x), int(inside.y))));
            *depths.at(x, y) = depth > 0 && depth <= kMostDepth ? float(depth) : 0.0f;
        }
    return depths;
}

Image depths_of_points(const Frame& frame, std::span<const glm::dvec3> points) {
    const Camera camera = frame.camera.readout ? scene::at_middle(frame.camera) : frame.camera;
    const double limit = scene::lens_limit(camera);
    const bool by_distance = scene::ordered_by_distance(camera.distortion.lens);
    Image depths(camera.width, camera.height, 1);
    for (const uint32_t i : *frame.seen) {
        if (i >= points.size())
            throw InputError("frame " + frame.name + " has seen point " + std::to_string(i) + " of " +
                             std::to_string(points.size()));
        const glm::dvec3 p = camera.rotation * points[i] + camera.translation;
        const auto pixel = scene::pixel_of(camera, limit, p);
        if (!pixel ||
            !(pixel->x >= 0 && pixel->y >= 0 && pixel->x < camera.width && pixel->y < camera.height))
            continue;
        const double depth = by_distance ? glm::length(p) : p.z;
        float& nearest = *depths.at(int(pixel->x), int(pixel->y));
        if (depth > 0 && depth <= kMostDepth && (nearest == 0 || depth < double(nearest)))
            nearest = float(depth);
    }
    return depths;
}

void drop_masked(Image& depths, const Image& photo) {
    if (photo.channels != 4) return;
    for (size_t i = 0; i < depths.pixels.size(); ++i)
        if (photo.pixels[4 * i + 3] < kLeastWeight) depths.pixels[i] = 0;
}

}  // namespace ewa
