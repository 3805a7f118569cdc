// SPDX-License-Identifier: Apache-2.0
// A splat scene in memory: structure of arrays, values exactly as an INRIA PLY stores them.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace ewa {

inline constexpr int kMaxShDegree = 3;

/// Number of SH coefficients a colour channel has at a degree: (degree + 1)^2.
constexpr int sh_coefficients(int degree) { return (degree + 1) * (degree + 1); }

struct Gaussians {
    int sh_degree = 0;                    // 0..3
    std::vector<float> means;             // 3 n, world units
    std::vector<float> quaternions;       // 4 n, w x y z, of any non-zero norm
    std::vector<float> log_scales;        // 3 n, natural logarithm of the standard deviations in world units
    std::vector<float> opacity_logits;    // n
    std::vector<float> sh;                // n * (degree + 1)^2 * 3: coefficient after coefficient, RGB inner

    size_t size() const { return opacity_logits.size(); }
    size_t sh_stride() const { return size_t(sh_coefficients(sh_degree)) * 3; }
    void resize(size_t n) {
        means.resize(3 * n);
        quaternions.resize(4 * n);
        log_scales.resize(3 * n);
        opacity_logits.resize(n);
        sh.resize(n * sh_stride());
    }
};

/// The highest degree that has a coefficient other than zero; what the scene needs, not what the file has room for.
int sh_degree_present(const Gaussians& gaussians);

/// Whether every stored value of splat i is finite and its quaternion is not zero. Others are never drawn.
bool drawable(const Gaussians& gaussians, size_t i);

}  // namespace ewa
