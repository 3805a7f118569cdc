// SPDX-License-Identifier: Apache-2.0
// Scenes for tests of the splat formats, and how far two are apart.
#pragma once
#include <gtest/gtest.h>

#include <cmath>

#include "ewa/gaussians.h"
#include "support/random_scene.h"

namespace ewa::test {

/// Values that every format can hold without clamping; quaternions of any norm.
inline Gaussians storable_splats(uint64_t seed, size_t count, int degree) {
    Random random(seed);
    Gaussians g;
    g.sh_degree = degree;
    g.resize(count);
    for (float& v : g.means) v = float(random.uniform(-5, 5));
    for (float& v : g.quaternions) v = float(random.normal());
    for (float& v : g.log_scales) v = float(random.uniform(-8, 1));
    for (float& v : g.opacity_logits) v = float(random.uniform(-4, 4));
    for (size_t i = 0; i < g.sh.size(); ++i)
        g.sh[i] = float(i % g.sh_stride() < 3 ? random.uniform(-1.5, 1.5) : random.uniform(-0.9, 0.9));
    return g;
}

/// The largest difference of each kind; rotations by their quaternions of length 1, the nearer of both signs.
struct Largest {
    double mean = 0, rotation = 0, scale = 0, opacity = 0, color = 0, sh = 0;
};

inline Largest largest_differences(const Gaussians& a, const Gaussians& b) {
    Largest d;
    EXPECT_EQ(a.size(), b.size());
    EXPECT_EQ(a.sh_degree, b.sh_degree);
    if (a.size() != b.size() || a.sh_degree != b.sh_degree) return d;
    const auto grow = [](double& largest, double x, double y) {
        const double error = std::abs(x - y);
        if (!(error <= largest)) largest = error;
    };
    const auto sigmoid = [](double x) { return 1 / (1 + std::exp(-x)); };
    for (size_t i = 0; i < a.size(); ++i) {
        double lengths[2] = {}, dot = 0;
        for (size_t k = 0; k < 4; ++k) {
            lengths[0] += std::pow(a.quaternions[4 * i + k], 2);
            lengths[1] += std::pow(b.quaternions[4 * i + k], 2);
            dot += double(a.quaternions[4 * i + k]) * b.quaternions[4 * i + k];
        }
        for (size_t k = 0; k < 4; ++k)
            grow(d.rotation, a.quaternions[4 * i + k] / std::sqrt(lengths[0]) * (dot < 0 ? -1 : 1),
                 b.quaternions[4 * i + k] / std::sqrt(lengths[1]));
        for (size_t k = 0; k < 3; ++k) {
            grow(d.mean, a.means[3 * i + k], b.means[3 * i + k]);
            grow(d.scale, a.log_scales[3 * i + k], b.log_scales[3 * i + k]);
        }
        grow(d.opacity, sigmoid(a.opacity_logits[i]), sigmoid(b.opacity_logits[i]));
        for (size_t k = 0; k < a.sh_stride(); ++k)
            grow(k < 3 ? d.color : d.sh, a.sh[a.sh_stride() * i + k], b.sh[a.sh_stride() * i + k]);
    }
    return d;
}

}  // namespace ewa::test
