// SPDX-License-Identifier: Apache-2.0
#include "scene/camera.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/ext/quaternion_double.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>
#include <stdexcept>
#include <string>

#include "ewa/error.h"

namespace ewa {

Camera downscale(const Camera& camera, int factor) {
    if (factor < 1)
        throw InputError("an image is reduced by a factor of 1 or more, not " + std::to_string(factor));
    return resized(camera, std::max(1, camera.width / factor), std::max(1, camera.height / factor));
}

Camera resized(const Camera& camera, int width, int height) {
    Camera result = camera;
    result.width = width;
    result.height = height;
    const double x = double(result.width) / camera.width, y = double(result.height) / camera.height;
    result.fx *= x;
    result.cx *= x;
    result.fy *= y;
    result.cy *= y;
    return result;
}

Camera narrowed(const Camera& camera, int64_t most_width) {
    const int64_t width = camera.width;
    if (width <= most_width) return camera;
    const int64_t height = (2 * camera.height * most_width + width) / (2 * width);
    return resized(camera, int(most_width), int(std::max<int64_t>(1, height)));
}

namespace {

glm::dvec3 catmull_rom(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d,
                       double t) {
    return 0.5 * (2.0 * b + (c - a) * t + (2.0 * a - 5.0 * b + 4.0 * c - d) * (t * t) +
                  (3.0 * b - a - 3.0 * c + d) * (t * t * t));
}

glm::dmat3 between(const glm::dmat3& a, const glm::dmat3& b, double t) {
    const glm::dquat p(a), q(b);
    return glm::dmat3(glm::normalize(glm::slerp(p, q, t)));
}

/// Size and lens between two keys of a path. t: from 0 to 1.
Camera lens_between(const Camera& first, const Camera& from, const Camera& to, double t) {
    Camera camera = first;
    camera.readout.reset();
    const double share = double(camera.width) / from.width, share_to = double(camera.width) / to.width;
    camera.fx = std::pow(from.fx * share, 1 - t) * std::pow(to.fx * share_to, t);
    camera.fy = std::pow(from.fy * share, 1 - t) * std::pow(to.fy * share_to, t);
    return camera;
}

/// The velocity at a key: that of the parabola through it and its neighbours, or of the line to the only neighbour.
glm::dvec3 velocity_at(std::span<const Camera> keys, std::span<const double> times, size_t key) {
    const auto mean = [&](size_t from) {
        return (keys[from + 1].position() - keys[from].position()) / (times[from + 1] - times[from]);
    };
    if (key == 0) return mean(0);
    if (key + 1 == keys.size()) return mean(key - 1);
    const double before = times[key] - times[key - 1], after = times[key + 1] - times[key];
    return (mean(key - 1) * after + mean(key) * before) / (before + after);
}

}  // namespace

Camera along_path(std::span<const Camera> keys, double time) {
    if (keys.empty()) throw std::logic_error("a path without cameras");
    const double last = double(keys.size() - 1);
    time = std::clamp(time, 0.0, last);
    const size_t index = std::min(size_t(time), keys.size() >= 2 ? keys.size() - 2 : 0);
    const double t = time - double(index);
    const Camera& from = keys[index];
    const Camera& to = keys[std::min(index + 1, keys.size() - 1)];

    Camera camera = lens_between(keys.front(), from, to, t);
    if (t == 0) {
        camera.rotation = from.rotation;
        camera.translation = from.translation;
        return camera;
    }
    const glm::dvec3 b = from.position(), c = to.position();
    const glm::dvec3 a = index > 0 ? keys[index - 1].position() : b + (b - c);
    const glm::dvec3 d = index + 2 < keys.size() ? keys[index + 2].position() : c + (c - b);
    camera.rotation = between(from.rotation, to.rotation, t);
    camera.translation = -(camera.rotation * catmull_rom(a, b, c, d, t));
    return camera;
}

Camera along_path(std::span<const Camera> keys, std::span<const double> times, double time, bool smooth) {
    if (keys.size() != times.size()) throw std::logic_error("a path with other times than cameras");
    if (keys.size() < 2) return along_path(keys, 0);
    const size_t later = size_t(std::ranges::upper_bound(times, time) - times.begin());
    const size_t index = std::clamp<size_t>(later, 1, keys.size() - 1) - 1;
    const double span = times[index + 1] - times[index];
    const double t = std::clamp((time - times[index]) / span, 0.0, 1.0);
    Camera camera = lens_between(keys.front(), keys[index], keys[index + 1], t);
    if (t == 0 || t == 1) {
        const Camera& at = keys[index + size_t(t)];
        camera.rotation = at.rotation;
        camera.translation = at.translation;
        return camera;
    }
    const glm::dvec3 from = keys[index].position(), way = keys[index + 1].position() - from;
    glm::dvec3 position = from + way * t;
    if (smooth) {
        // A cubic with these positions and velocities at both ends.
        const glm::dvec3 begins = velocity_at(keys, times, index) * span - way;
        const glm::dvec3 ends = velocity_at(keys, times, index + 1) * span - way;
        position += t * (1 - t) * ((1 - t) * begins - t * ends);
    }
    camera.rotation = between(keys[index].rotation, keys[index + 1].rotation, t);
    camera.translation = -(camera.rotation * position);
    return camera;
}

bool same_aspect(int old_width, int old_height, int width, int height) {
    if (int64_t(width) * old_height == int64_t(height) * old_width) return true;
    const double x = double(width) / old_width, y = double(height) / old_height;
    if (x > 0.9 && x < 1.1) return false;
    const double low = std::max((width - 1.0) / old_width, (height - 1.0) / old_height);
    const double high = std::min((width + 1.0) / old_width, (height + 1.0) / old_height);
    return low < high && x > 0 && y > 0;
}

}  // namespace ewa
