// SPDX-License-Identifier: Apache-2.0
// What the splat formats store in other units than a Gaussians holds, and bytes made of real numbers.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "shared/constants.h"

namespace ewa::io {

inline double sigmoid(double x) {
    return 1 / (1 + std::exp(-x));
}

/// Of p clamped to [least, most]: an opacity of 0 or 1 has no finite logit.
inline double logit(double p, double least, double most) {
    if (!std::isnan(p)) p = std::clamp(p, least, most);
    return std::log(p) - std::log1p(-p);
}

/// An opacity of 0..1 stored in `levels` + 1 steps. The ends are taken a quarter of a step inwards, which
/// rounds back to them.
inline double logit_of_steps(double p, uint32_t levels) {
    return logit(p, 0.25 / levels, 1 - 0.25 / levels);
}
inline double logit_of_level(uint32_t level, uint32_t levels) {
    return logit_of_steps(double(level) / levels, levels);
}

/// Rounded and clamped to 0..levels; what is not a number is 0.
inline uint32_t to_level(double value, uint32_t levels) {
    if (!(value > 0)) return 0;
    return uint32_t(std::min(std::floor(value + 0.5), double(levels)));
}

inline uint8_t to_byte(double value) {
    return uint8_t(to_level(value, 255));
}

/// The colour in [0, 1] that SH coefficient 0 gives, and back.
inline double color_of_sh0(double sh0) {
    return sh0 * shared::SH_C0 + shared::COLOR_OFFSET;
}
inline double sh0_of_color(double color) {
    return (color - shared::COLOR_OFFSET) / shared::SH_C0;
}

/// The logarithm of a linear scale; 0 becomes the smallest that float32 holds, a negative one not a number.
inline float log_of_scale(double scale) {
    return float(std::log(scale >= 0 ? std::max(scale, double(std::numeric_limits<float>::min())) : NAN));
}

/// A linear scale that float32 holds as a finite number.
inline float scale_of_log(double log_scale) {
    return float(std::min(std::exp(log_scale), double(std::numeric_limits<float>::max())));
}

/// w x y z of length 1; 1 0 0 0 for a zero quaternion.
inline std::array<double, 4> unit_quaternion(const float* q) {
    const double length = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3]));
    if (!(length > 0) || !std::isfinite(length)) return {1, 0, 0, 0};
    return {q[0] / length, q[1] / length, q[2] / length, q[3] / length};
}

/// The component of the largest magnitude.
inline size_t largest_component(const std::array<double, 4>& q) {
    size_t largest = 0;
    for (size_t i = 1; i < 4; ++i)
        if (std::abs(q[i]) > std::abs(q[largest])) largest = i;
    return largest;
}

}  // namespace ewa::io
