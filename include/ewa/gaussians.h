// SPDX-License-Identifier: Apache-2.0
// A splat scene in memory: structure of arrays, values exactly as an INRIA PLY stores them.
#pragma once
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

namespace ewa {

inline constexpr int kMaxShDegree = 3;

/// Number of SH coefficients a colour channel has at a degree: (degree + 1)^2.
constexpr int sh_coefficients(int degree) {
    return (degree + 1) * (degree + 1);
}

struct Gaussians {
    int sh_degree = 0;         // 0..3
    glm::dvec3 origin{0.0};    // world; zero but in a scene far from the world's origin, see settle_origin
    std::vector<float> means;  // 3 n, world units, relative to `origin`
    std::vector<float> quaternions;     // 4 n, w x y z, of any non-zero norm
    std::vector<float> log_scales;      // 3 n, natural logarithm of the standard deviations in world units
    std::vector<float> opacity_logits;  // n
    std::vector<float> sh;              // n * (degree + 1)^2 * 3: coefficient after coefficient, RGB inner

    size_t size() const { return opacity_logits.size(); }
    /// Where splat i stands in the world.
    glm::dvec3 world_mean(size_t i) const {
        return origin + glm::dvec3(means[3 * i], means[3 * i + 1], means[3 * i + 2]);
    }
    size_t sh_stride() const { return size_t(sh_coefficients(sh_degree)) * 3; }
    void resize(size_t n) {
        means.resize(3 * n);
        quaternions.resize(4 * n);
        log_scales.resize(3 * n);
        opacity_logits.resize(n);
        sh.resize(n * sh_stride());
    }
};

/// The highest degree that has a coefficient other than zero; what the scene needs, not what the file has
/// room for.
int sh_degree_present(const Gaussians& gaussians);

/// Sets the means to these world positions, and the origin with them: zero up to a
/// distance of 1,000 units, or 64 times the scene's size, from the world's origin; further out (a
/// georeferenced capture) whole units near the middle of the positions, the outermost tenth and what is not
/// finite left aside.
void set_world_means(Gaussians& gaussians, const std::vector<glm::dvec3>& positions);

/// The same of the positions that the scene has: none moves by more than float32 rounds.
void settle_origin(Gaussians& gaussians);

/// Whether every stored value of splat i is finite and its quaternion is not zero. Others are never drawn.
bool drawable(const Gaussians& gaussians, size_t i);

}  // namespace ewa
