// SPDX-License-Identifier: Apache-2.0
#include "mesh/pinholes.h"

#include <algorithm>
#include <cmath>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <numbers>

#include "core/parallel.h"
#include "core/text.h"
#include "ewa/error.h"
#include "scene/lens.h"
#include "scene/native_lens.h"
#include "scene/readout.h"

namespace ewa::mesh {

Pinholes::Pinholes(const Dataset& dataset, bool through_fisheyes) {
    for (const Frame& frame : dataset.frames) {
        Camera camera = frame.camera;
        if (through_fisheyes && frame.distortion.lens == Lens::fisheye &&
            scene::is_native(frame.distortion)) {
            camera = downscale(frame.source, frame.downscale);
            camera.distortion = frame.distortion;
        }
        if (scene::moves(camera))
            throw InputError("a mesh needs cameras at rest, and " + core::one_line(frame.name) +
                             " has a rolling shutter");
        const Distortion distortion = camera.distortion;
        if (distortion.lens == Lens::orthographic)
            throw InputError("a mesh needs lenses that a pinhole can show, and " +
                             core::one_line(frame.name) +
                             " has parallel rays; name other cameras with --cameras");
        if (distortion.lens == Lens::fisheye) {
            fisheyes_.push_back({camera, scene::lens_limit(camera)});
            add_cube(camera, &fisheyes_.back());
        } else if (distortion.lens == Lens::equirectangular) {
            add_cube(camera, nullptr);
        } else {
            camera.distortion = {};
            cameras_.push_back(scene::undistorted_camera(camera, distortion));
        }
        fisheye_of_.resize(cameras_.size(),
                           distortion.lens == Lens::fisheye ? int(fisheyes_.size()) - 1 : -1);
    }
}

bool Pinholes::Fisheye::shows(const Camera& side, double x, double y) const {
    const glm::dvec3 ray((x - side.cx) / side.fx, (y - side.cy) / side.fy, 1);
    const auto pixel = scene::pixel_of(
        camera, limit, glm::normalize(camera.rotation * (glm::transpose(side.rotation) * ray)));
    return pixel && pixel->x >= 0 && pixel->y >= 0 && pixel->x <= camera.width && pixel->y <= camera.height;
}

/// The sides overlap: a side sees nothing between its last pixel's centre and its border.
void Pinholes::add_cube(const Camera& around, const Fisheye* fisheye) {
    constexpr int kOverlap = 2;  // px
    constexpr int kSamples = 64;
    Camera side;
    const int length = std::max(1, int(std::lround(2 * around.fx)));
    side.width = side.height = length + 2 * kOverlap;
    side.fx = side.fy = 0.5 * length;
    side.cx = side.cy = 0.5 * side.width;
    constexpr double kTurns[] = {0, 0.25, 0.5, 0.75};
    const auto shown = [&] {
        if (!fisheye) return true;
        for (int i = 0; i < kSamples * kSamples; ++i)
            if (fisheye->shows(side, (i % kSamples + 0.5) / kSamples * side.width,
                               (i / kSamples + 0.5) / kSamples * side.height))
                return true;
        return false;
    };
    const auto add = [&](double turn, double nod) {
        const double a = 2 * std::numbers::pi * turn, b = 2 * std::numbers::pi * nod;
        const glm::dmat3 about_y(std::cos(a), 0, std::sin(a), 0, 1, 0, -std::sin(a), 0, std::cos(a));
        const glm::dmat3 about_x(1, 0, 0, 0, std::cos(b), -std::sin(b), 0, std::sin(b), std::cos(b));
        side.rotation = about_x * about_y * around.rotation;
        side.translation = about_x * about_y * around.translation;
        if (shown()) cameras_.push_back(side);
    };
    for (const double turn : kTurns) add(turn, 0);
    for (const double nod : {0.25, 0.75}) add(0, nod);
}

void Pinholes::cut(size_t i, Image& image) const {
    if (i >= fisheye_of_.size() || fisheye_of_[i] < 0) return;
    const Fisheye& fisheye = fisheyes_[size_t(fisheye_of_[i])];
    core::on_all_cores(size_t(image.height), [&](size_t y) {
        for (int x = 0; x < image.width; ++x)
            if (!fisheye.shows(cameras_[i], x + 0.5, double(y) + 0.5))
                std::fill_n(image.at(x, int(y)), image.channels, 0.0f);
    });
}

}  // namespace ewa::mesh
