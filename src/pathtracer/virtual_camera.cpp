// SPDX-License-Identifier: Apache-2.0
#include "pathtracer/virtual_camera.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <numbers>

#include "core/random.h"
#include "scene/color.h"
#include "scene/native_lens.h"
#include "scene/readout.h"
#include "scene/statistics.h"

namespace ewa::pathtracer {

namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kLowest = 8 * kDegree, kHighest = 65 * kDegree, kAngle = 45 * kDegree;

/// axes: columns right, up, back.
Camera camera_at(const glm::dvec3& position, const glm::dmat3& axes, double focal, int width, int height) {
    Camera camera{width, height, focal, focal, 0.5 * width, 0.5 * height};
    camera.rotation = glm::transpose(glm::dmat3(axes[0], -axes[1], -axes[2]));
    camera.translation = -(camera.rotation * position);
    return camera;
}

/// The smallest distance from the centre with all corners of the box in the image. axes: columns right, up,
/// back.
double distance_for(const scene::Box& box, const glm::dmat3& axes, double tan_x, double tan_y) {
    double distance = 0;
    for (int corner = 0; corner < 8; ++corner) {
        glm::dvec3 offset = box.high - box.center();
        for (int axis = 0; axis < 3; ++axis)
            if (corner >> axis & 1) offset[axis] = -offset[axis];
        const glm::dvec3 p = glm::transpose(axes) * offset;
        distance = std::max({distance, std::abs(p.x) / tan_x + p.z, std::abs(p.y) / tan_y + p.z});
    }
    return distance > 0 ? distance : 1;
}

}  // namespace

std::vector<Camera> dome_cameras(const scene::Box& box, int count, int width, int height) {
    const double focal = 0.5 * std::min(width, height) / std::tan(0.5 * kAngle);
    const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
    std::vector<Camera> cameras;
    for (int i = 0; i < count; ++i) {
        const double share = (i + 0.5) / count;
        const double sine = std::sin(kLowest) + share * (std::sin(kHighest) - std::sin(kLowest));
        const double level = std::sqrt(1 - sine * sine), turn = golden * i;
        const glm::dvec3 back(level * std::sin(turn), sine, level * std::cos(turn));
        const glm::dvec3 right = glm::normalize(glm::cross(glm::dvec3(0, 1, 0), back));
        const glm::dmat3 axes(right, glm::cross(back, right), back);
        const double distance = distance_for(box, axes, 0.5 * width / focal, 0.5 * height / focal);
        cameras.push_back(camera_at(box.center() + distance * back, axes, focal, width, height));
    }
    return cameras;
}

Camera pinhole_of(const scene::FileCamera& camera, int width, int height) {
    return camera_at(camera.position, camera.axes, 0.5 * height / std::tan(0.5 * camera.vertical_angle),
                     width, height);
}

float developed(double value) {
    if (!(value > 0)) return 0;
    return float(scene::srgb_of_linear(std::min(value, 1.0)));
}

void show_sky(Image& radiance, const Camera& camera, const scene::Sky& sky) {
    const double limit = scene::lens_limit(camera);
    for (int y = 0; y < radiance.height; ++y)
        for (int x = 0; x < radiance.width; ++x) {
            const auto ray = scene::world_ray(camera, limit, x + 0.5, y + 0.5);
            if (!ray) continue;
            const float up = float(ray->direction.y);
            const glm::vec3 color = glm::mix(sky.horizon, up >= 0 ? sky.zenith : sky.ground, std::abs(up));
            float* pixel = radiance.at(x, y);
            for (int c = 0; c < 3; ++c) pixel[c] += (1 - pixel[3]) * color[c];
            pixel[3] = 1;
        }
}

Image develop(const Image& radiance, double factor) {
    bool whole = true;
    for (size_t i = 3; i < radiance.pixels.size(); i += 4) whole = whole && radiance.pixels[i] >= 1;
    Image image(radiance.width, radiance.height, whole ? 3 : 4);
    for (size_t i = 0; i < radiance.pixels.size() / 4; ++i) {
        const float* from = &radiance.pixels[4 * i];
        float* to = &image.pixels[size_t(image.channels) * i];
        for (int c = 0; c < 3; ++c)
            to[c] = from[3] > 0 ? developed(double(from[c]) / double(from[3]) * factor) : 0.0f;
        if (!whole) to[3] = from[3];
    }
    return image;
}

double automatic_exposure(const std::vector<Image>& radiances) {
    std::vector<float> values;
    for (const Image& image : radiances)
        for (size_t i = 0; i < image.pixels.size(); i += 4) {
            const float* pixel = &image.pixels[i];
            if (pixel[3] >= 0.5f) values.push_back(std::max({pixel[0], pixel[1], pixel[2]}) / pixel[3]);
        }
    const float bright = scene::quantile(values, 0.95);
    return bright > 0 ? std::round(10 * std::log2(0.8 / double(bright))) / 10 : 0;
}

std::vector<Ppisp> varied_appearances(size_t count, uint64_t seed) {
    constexpr uint32_t kStream = 0x61707065;
    constexpr double kStops = 0.6, kColors = 1.0;  // at most
    // Departures from a neutral camera that photos have: vignette, then response.
    constexpr std::array<double, 9> kCamera{0.02, -0.015, -0.5, -0.2, 0, 0.3, -0.2, 0.1, 0.25};
    const auto words = [&](size_t i, uint32_t k) {
        return core::uniform4({uint32_t(i), k, uint32_t(seed), kStream});
    };
    Ppisp common;
    for (size_t k = 0; k < common.camera.size(); ++k)
        common.camera[k] += float(kCamera[k % 9] * (1 + 0.2 * (2 * words(k, 9)[0] - 1)));
    std::vector<Ppisp> all(count, common);
    for (size_t k = 0; k < common.photo.size(); ++k) {
        double sum = 0;
        for (size_t i = 0; i < count; ++i) {
            all[i].photo[k] = float((k == 0 ? kStops : kColors) * (2 * words(i, uint32_t(k))[0] - 1));
            sum += double(all[i].photo[k]);
        }
        for (Ppisp& each : all) each.photo[k] -= float(sum / double(count));
    }
    return all;
}

}  // namespace ewa::pathtracer
