// SPDX-License-Identifier: Apache-2.0
// Shared parts of the splat formats: conversions of units, quantisation, and the limit on memory.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include "ewa/error.h"
#include "ewa/splat_scene.h"
#include "shared/constants.h"

namespace ewa::io {

inline double sigmoid(double x) {
    return 1 / (1 + std::exp(-x));
}

/// The logit of p clamped to [least, most]. An opacity of 0 or 1 has no finite logit.
inline double logit(double p, double least, double most) {
    if (!std::isnan(p)) p = std::clamp(p, least, most);
    return std::log(p) - std::log1p(-p);
}

/// The logit of an opacity of 0..1 in float32. The largest is half a step below 1.
inline double logit_of_opacity(double opacity) {
    return logit(opacity, 1e-30, 1 - 0x1p-25);
}

inline std::string clamped_opacities_remark(uint64_t count) {
    return std::to_string(count) + " opacities outside of 0..1 are clamped; if most are, they are logits, " +
           "and the program that wrote them is wrong";
}

/// The logit of an opacity of 0..1 that is stored in `levels` + 1 steps. The ends move inwards by a quarter
/// of a step, so they round back to themselves.
inline double logit_of_steps(double p, uint32_t levels) {
    return logit(p, 0.25 / levels, 1 - 0.25 / levels);
}
inline double logit_of_level(uint32_t level, uint32_t levels) {
    return logit_of_steps(double(level) / levels, levels);
}

/// The value rounded and clamped to 0..levels. NaN becomes 0.
inline uint32_t to_level(double value, uint32_t levels) {
    if (!(value > 0)) return 0;
    return uint32_t(std::min(std::floor(value + 0.5), double(levels)));
}

inline uint8_t to_byte(double value) {
    return uint8_t(to_level(value, 255));
}

/// The colour in [0, 1] of SH coefficient 0, and the inverse.
inline double color_of_sh0(double sh0) {
    return sh0 * shared::SH_C0 + shared::COLOR_OFFSET;
}
inline double sh0_of_color(double color) {
    return (color - shared::COLOR_OFFSET) / shared::SH_C0;
}

/// The logarithm of a linear scale. 0 becomes the smallest normal float32, a negative scale NaN.
inline float log_of_scale(double scale) {
    return float(std::log(scale >= 0 ? std::max(scale, double(std::numeric_limits<float>::min())) : NAN));
}

/// The linear scale, limited to the finite range of float32.
inline float scale_of_log(double log_scale) {
    return float(std::min(std::exp(log_scale), double(std::numeric_limits<float>::max())));
}

/// w x y z of length 1. A zero quaternion becomes 1 0 0 0.
inline std::array<double, 4> unit_quaternion(const float* q) {
    const double length = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3]));
    if (!(length > 0) || !std::isfinite(length)) return {1, 0, 0, 0};
    return {q[0] / length, q[1] / length, q[2] / length, q[3] / length};
}

/// The index of the component with the largest magnitude.
inline size_t largest_component(const std::array<double, 4>& q) {
    size_t largest = 0;
    for (size_t i = 1; i < 4; ++i)
        if (std::abs(q[i]) > std::abs(q[largest])) largest = i;
    return largest;
}

/// Expansion limits: memory per byte of the file. Compressed SH coefficients of zero take almost no bytes.
inline constexpr uint64_t kPlainExpansion = 4, kPackedExpansion = 32;

/// Throws InputError if `count` splats of a degree take more memory than `expansion` times the file plus 40
/// MiB. No real scene repeats itself that much. Without this limit, a file of a few kB could claim all
/// memory.
inline void require_memory(const std::string& name, uint64_t file_bytes, uint64_t count, int sh_degree,
                           uint64_t expansion = kPlainExpansion) {
    constexpr uint64_t kAlways = uint64_t(40) << 20;
    const uint64_t each = sizeof(float) * (11 + 3 * uint64_t(sh_coefficients(sh_degree)));
    if (count <= (expansion * file_bytes + kAlways) / each) return;
    throw InputError(name + ": claims " + std::to_string(count) + " splats of SH degree " +
                     std::to_string(sh_degree) + " in " + std::to_string(file_bytes) +
                     " bytes, which would unpack to more than " + std::to_string(expansion) +
                     " times the file and 40 MiB; it is damaged, or its splats repeat each other");
}

/// Calls encode(i, bytes) for each i < count, and write(bytes, size, end) for each piece of these bytes.
template <class Encode, class Write>
void encode_in_pieces(size_t count, size_t bytes_each, const Encode& encode, const Write& write) {
    constexpr size_t kAtOnce = 4096;
    std::vector<std::byte> bytes(std::min(count, kAtOnce) * bytes_each);
    for (size_t begin = 0; begin < count; begin += kAtOnce) {
        const size_t end = std::min(begin + kAtOnce, count);
        for (size_t i = begin; i < end; ++i) encode(i, &bytes[(i - begin) * bytes_each]);
        write(bytes.data(), (end - begin) * bytes_each, end);
    }
}

}  // namespace ewa::io
