// SPDX-License-Identifier: Apache-2.0
// What the tests of the whole chain share: random scenes, and a picture's errors.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "ewa/render_options.h"
#include "reference/render.h"
#include "support/random_scene.h"

namespace ewa::test {

/// What is drawn, with the gradient of its loss against `target`.
struct ChainScene {
    Camera camera;
    Gaussians gaussians;
    Image target;
    RenderOptions options;
};

inline ChainScene chain_scene(uint64_t seed, SplatKind kind, size_t splats, int width, int height,
                              int sh_degree, Footprint kernel) {
    const Camera camera = random_camera(seed, width, height);
    return {camera, random_gaussians(seed + 1, splats, kind, camera, sh_degree),
            random_target(seed + 2, width, height),
            RenderOptions{.background = {0.2f, 0.5f, 0.8f}, .kernel = kernel}};
}

struct ImageErrors {
    double worst = 0;
    size_t over = 0, pixels = 0;  // pixels over the bound, and all
};

/// excluded: per pixel, or empty.
inline ImageErrors image_errors(const Image& actual, const reference::Raster& expected, double bound,
                                const std::vector<uint8_t>& excluded = {}) {
    ImageErrors errors;
    errors.pixels = size_t(actual.width) * size_t(actual.height);
    for (int y = 0; y < actual.height; ++y)
        for (int x = 0; x < actual.width; ++x) {
            if (!excluded.empty() && excluded[size_t(y) * size_t(actual.width) + size_t(x)]) continue;
            double error = 0;
            for (int c = 0; c < actual.channels; ++c) {
                const double e = std::abs(double(actual.at(x, y)[c]) - expected.at(x, y)[c]);
                error = std::isfinite(e) ? std::max(error, e) : INFINITY;
            }
            errors.worst = std::max(errors.worst, error);
            if (!(error <= bound)) ++errors.over;
        }
    return errors;
}

}  // namespace ewa::test
