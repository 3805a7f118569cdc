// SPDX-License-Identifier: Apache-2.0
// A splat scene in memory, as a structure of arrays. Values are exactly as in an INRIA PLY.
#pragma once
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

namespace ewa {

inline constexpr int kMaxShDegree = 3;

/// The number of SH coefficients of a colour channel: (degree + 1)^2.
constexpr int sh_coefficients(int degree) {
    return (degree + 1) * (degree + 1);
}

/// n splats. The comment of each array gives its length, which check() tests.
struct Gaussians {
    int sh_degree = 0;  // 0..3
    /// World units. Zero unless the scene is far from the world's origin, see set_world_means.
    glm::dvec3 origin{0.0};
    std::vector<float> means;           // 3 n, world units, relative to `origin`
    std::vector<float> quaternions;     // 4 n, w x y z, any non-zero norm
    std::vector<float> log_scales;      // 3 n, natural logarithm of the standard deviations in world units
    std::vector<float> opacity_logits;  // n
    bool density =
        false;  // opacity_logits are parameters of Footprint::density, which fit_opacities converts
    std::vector<float> sh;  // n * (degree + 1)^2 * 3: coefficient after coefficient, RGB inner

    size_t size() const { return opacity_logits.size(); }
    /// The position of splat i in the world.
    glm::dvec3 world_mean(size_t i) const {
        return origin + glm::dvec3(means[3 * i], means[3 * i + 1], means[3 * i + 2]);
    }
    /// The number of SH values of a splat.
    size_t sh_stride() const { return size_t(sh_coefficients(sh_degree)) * 3; }
    /// Sets the length of each array for n splats. New values are 0.
    void resize(size_t n) {
        means.resize(3 * n);
        quaternions.resize(4 * n);
        log_scales.resize(3 * n);
        opacity_logits.resize(n);
        sh.resize(n * sh_stride());
    }
};

/// Throws InputError unless sh_degree is 0 to kMaxShDegree and each array has its length. Every function of libewa that takes
/// Gaussians calls this check and throws its errors.
void check(const Gaussians& gaussians);

/// The highest degree with a non-zero coefficient: the degree that the scene needs, which may be below
/// sh_degree.
int sh_degree_present(const Gaussians& gaussians);

/// Sets the means to these world positions, and the origin with them. The origin is zero if the scene is
/// within 1,000 units, or 64 times its size, of the world's origin. Otherwise, as in a georeferenced capture,
/// it is the middle of the positions in whole units. The middle ignores the outermost tenth and positions
/// that are not finite. Throws InputError unless there is one position for each splat.
void set_world_means(Gaussians& gaussians, const std::vector<glm::dvec3>& positions);

/// Calls set_world_means with the scene's own positions. Rounding to float32 may move the positions.
void settle_origin(Gaussians& gaussians);

/// Whether splat i < size can be visible: its quaternion is not zero, and its values are finite. Two exceptions are drawable: an
/// infinite opacity logit (opacity 0 or 1), and a log scale of minus infinity (a flat splat).
bool drawable(const Gaussians& gaussians, size_t i);

}  // namespace ewa
