// SPDX-License-Identifier: Apache-2.0
// Splats and images in float64: the CPU reference's scene, and gradients with respect to it.
#pragma once
#include <array>
#include <cstddef>
#include <glm/vec3.hpp>
#include <vector>

#include "ewa/gaussians.h"
#include "ewa/image.h"

namespace ewa::reference {

inline constexpr int kMaxCoefficients = sh_coefficients(kMaxShDegree);

/// The layout of Gaussians in double. Holds a scene, or dL/d(stored value) for each stored value.
struct Values {
    int sh_degree = 0;
    std::vector<double> means, quaternions, log_scales, opacity_logits, sh;

    Values() = default;
    Values(const Gaussians& gaussians);  // with means in world coordinates
    size_t size() const { return opacity_logits.size(); }
    size_t sh_stride() const { return size_t(sh_coefficients(sh_degree)) * 3; }
    void resize(size_t n);
};

/// One splat's stored values, or their gradient.
struct Splat {
    glm::dvec3 mean{0};
    std::array<double, 4> quaternion{};  // w x y z
    glm::dvec3 log_scale{0};
    double opacity_logit = 0;
    int sh_degree = 0;
    std::array<glm::dvec3, kMaxCoefficients> sh{};  // RGB per coefficient; zero above sh_degree
};

Values zeros_like(const Values& values);

Splat read_splat(const Gaussians& gaussians, size_t i);
Splat read_splat(const Values& values, size_t i);
/// Coefficients above values.sh_degree are skipped.
void write_splat(Values& values, size_t i, const Splat& splat);

/// An image in double, row-major and interleaved as in Image.
struct Raster {
    int width = 0, height = 0, channels = 0;
    std::vector<double> values;

    Raster() = default;
    Raster(int width_, int height_, int channels_)
        : width(width_), height(height_), channels(channels_), values(size_t(width_) * height_ * channels_) {}
    double* at(int x, int y) { return &values[(size_t(y) * width + x) * channels]; }
    const double* at(int x, int y) const { return &values[(size_t(y) * width + x) * channels]; }
};

/// The RGB of an image with 3 or more channels, or its one channel.
Raster to_double(const Image& image);

}  // namespace ewa::reference
