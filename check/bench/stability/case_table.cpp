// SPDX-License-Identifier: Apache-2.0
#include "bench/stability/case_table.h"

#include <algorithm>
#include <cmath>
#include <glm/matrix.hpp>
#include <utility>

#include "core/random.h"

namespace ewa::bench {
namespace {

constexpr uint32_t kSeed = 0x73746966u;

}  // namespace

std::array<double, 4> numbers_of(uint32_t i, uint32_t stream) {
    return core::uniform4({i, stream, kSeed, 0});
}

double between(double u, double low, double high) {
    return low + (high - low) * u;
}

glm::dmat3 turned(double angle_x, double angle_y) {
    const double cx = std::cos(angle_x), sx = std::sin(angle_x), cy = std::cos(angle_y),
                 sy = std::sin(angle_y);
    return glm::dmat3(1, 0, 0, 0, cx, sx, 0, -sx, cx) * glm::dmat3(cy, 0, -sy, 0, 1, 0, sy, 0, cy);
}

Camera usual_camera() {
    const glm::dmat3 rotation = turned(0.4, -0.7);
    return {64, 48, 70, 66, 31.3, 24.8, rotation, -(rotation * glm::dvec3(0.7, -0.4, 0.2))};
}

Sketch usual_sketch(uint32_t i, const Camera& camera, double z) {
    const auto a = numbers_of(i, 1), b = numbers_of(i, 2), c = numbers_of(i, 3);
    Sketch s;
    s.view = {(between(a[0], -0.05, 1.05) * camera.width - camera.cx) / camera.fx * z,
              (between(a[1], -0.05, 1.05) * camera.height - camera.cy) / camera.fy * z, z};
    const double pixels = between(a[2], 0.02, 0.12) * std::max(camera.width, camera.height);
    for (int k = 0; k < 3; ++k)
        s.scale[k] = pixels * z / camera.fx * std::exp(between(b[size_t(k)], -0.6, 0.6));
    const auto n = core::normal3({i, 4, kSeed, 0});
    s.quaternion = {between(c[0], -1, 1), n[0], n[1], n[2]};
    s.logit = between(c[1], -2, 3);
    return s;
}

double usual_depth(uint32_t i) {
    return between(numbers_of(i, 5)[0], 2, 8);
}

Builder::Builder(const Camera& camera, int sh_degree) : camera_(camera) {
    out_.sh_degree = sh_degree;
}

void Builder::add(const Sketch& sketch) {
    const uint32_t i = uint32_t(out_.size());
    const glm::dvec3 mean = glm::transpose(camera_.rotation) * sketch.view + camera_.position();
    for (int k = 0; k < 3; ++k) {
        out_.means.push_back(float(mean[k]));
        out_.log_scales.push_back(float(std::log(sketch.scale[k])));
    }
    for (const double q : sketch.quaternion) out_.quaternions.push_back(float(q));
    out_.opacity_logits.push_back(float(sketch.logit));
    for (size_t k = 0; k < out_.sh_stride(); ++k) {
        const double u = numbers_of(i, 16 + uint32_t(k))[0];
        out_.sh.push_back(float(k < 3 ? between(u, -1.5, 1.7) : between(u, -0.3, 0.3)));
    }
}

void Builder::add_usual(uint32_t count, const Change& change, double depth) {
    for (uint32_t i = 0; i < count; ++i) {
        Sketch sketch = usual_sketch(i, camera_, depth * usual_depth(i));
        if (change) change(sketch, i);
        add(sketch);
    }
}

void Table::add(std::string name, std::string what, Gaussians gaussians, const Camera& camera,
                Footprint kernel) {
    cases.push_back({std::move(name),
                     std::move(what),
                     std::move(gaussians),
                     camera,
                     {.background = {0.2f, 0.5f, 0.8f}, .kernel = kernel}});
}

}  // namespace ewa::bench
