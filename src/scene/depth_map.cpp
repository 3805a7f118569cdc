// SPDX-License-Identifier: Apache-2.0
#include "scene/depth_map.h"

#include <algorithm>
#include <cmath>

#include "core/text.h"
#include "ewa/error.h"
#include "scene/camera.h"
#include "scene/lens.h"
#include "scene/readout.h"

namespace ewa {

namespace {

constexpr double kMostDepth = 1e12;   // world units; larger ones are sky
constexpr double kLevels = 65535;     // of an integer map, which load_image divides by this
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

void check_lens_of(const Frame& frame) {
    const bool pinhole = frame.camera.distortion.none() && !frame.camera.readout;
    if (!pinhole || (!frame.distortion.none() && frame.distortion.lens != Lens::brown))
        throw InputError(
            "frame \"" + core::one_line(frame.name) +
            "\": depth maps need a pinhole, or --lens undistort with OpenCV's perspective model");
}

}  // namespace

Image load_depth_map(const Frame& frame) {
    check_lens_of(frame);
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
            // The nearest depth: a mean over the edge of a thing would lie where nothing is.
            const int column = std::clamp(int(at.x * map.width / frame.source.width), 0, map.width - 1);
            const int row = std::clamp(int(at.y * map.height / frame.source.height), 0, map.height - 1);
            const double depth = unit * double(*map.at(column, row));
            *depths.at(x, y) = depth > 0 && depth <= kMostDepth ? float(depth) : 0.0f;
        }
    return depths;
}

void drop_masked(Image& depths, const Image& photo) {
    if (photo.channels != 4) return;
    for (size_t i = 0; i < depths.pixels.size(); ++i)
        if (photo.pixels[4 * i + 3] < kLeastWeight) depths.pixels[i] = 0;
}

}  // namespace ewa
