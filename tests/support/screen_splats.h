// SPDX-License-Identifier: Apache-2.0
// Random 2D Gaussians as the arrays of include/ewa/operators.h, for its tests and those of its reference.
#pragma once
#include <cmath>
#include <cstdint>
#include <vector>

#include "reference/render.h"
#include "reference/screen.h"
#include "support/random_scene.h"

namespace ewa::test {

/// Values are floats, so that device and reference begin with the same.
struct ScreenScene {
    int width = 0, height = 0;
    reference::ScreenValues splats;
    std::vector<double> depths;
    std::vector<int32_t> radii;
    std::vector<uint32_t> order;            // of the reference
    std::vector<double> features_gradient;  // [H, W, D]
    std::vector<double> alphas_gradient;    // [H, W]
};

inline std::vector<float> floats(const std::vector<double>& values) {
    return {values.begin(), values.end()};
}

/// whiteners: shapes are whiteners in place of conics.
inline ScreenScene screen_scene(uint64_t seed, size_t count, SplatKind kind, size_t channels, bool whiteners,
                                int width = 0, int height = 0) {
    const Camera camera = random_camera(seed, width, height);
    const Gaussians gaussians = random_gaussians(seed + 1, count, kind, camera, 0);
    Random random(seed + 2);
    ScreenScene s{camera.width, camera.height, {}, {}, {}, {}, {}, {}};
    s.splats.channels = channels;
    s.splats.whiteners = whiteners;
    const auto push = [](std::vector<double>& to, double value) { to.push_back(double(float(value))); };
    std::vector<reference::Projected> projected;
    for (size_t i = 0; i < count; ++i) {
        reference::Projected p = reference::project(gaussians, i, camera, {});
        p.visible = p.visible && std::isfinite(p.mean2d.x);
        if (!p.visible) p = {.mean2d = {1, 1}, .a = 1, .c = 1, .det = 1, .opacity = 1};
        push(s.splats.means2d, p.mean2d.x);
        push(s.splats.means2d, p.mean2d.y);
        if (whiteners) {
            push(s.splats.conics, std::sqrt(p.c / (2 * p.det)));
            push(s.splats.conics, p.b / p.c);
            push(s.splats.conics, std::sqrt(1 / (2 * p.c)));
        } else {
            push(s.splats.conics, p.c / p.det);
            push(s.splats.conics, -p.b / p.det);
            push(s.splats.conics, p.a / p.det);
        }
        push(s.splats.opacities, p.opacity);
        for (size_t c = 0; c < channels; ++c) push(s.splats.features, random.normal());
        push(s.depths, p.z);
        s.radii.insert(s.radii.end(), 2, p.visible ? 1 : 0);
        p.z = s.depths.back();
        projected.push_back(p);
    }
    for (size_t c = 0; c < channels; ++c) push(s.splats.background, random.normal());
    s.order = reference::depth_order(projected);
    const size_t pixels = size_t(s.width) * size_t(s.height);
    for (size_t i = 0; i < pixels * channels; ++i) push(s.features_gradient, random.normal());
    for (size_t i = 0; i < pixels; ++i) push(s.alphas_gradient, random.normal());
    return s;
}

}  // namespace ewa::test
