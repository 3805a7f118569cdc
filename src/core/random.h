// SPDX-License-Identifier: Apache-2.0
// Counter-based random numbers: a pure function of its counter, the same as shaders/lib/random.glsl bit for bit in the
// integers. pcg4d of Jarzynski and Olano 2020, "Hash Functions for GPU Rendering".
#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace ewa::core {

inline std::array<uint32_t, 4> pcg4d(std::array<uint32_t, 4> v) {
    for (uint32_t& x : v) x = x * 1664525u + 1013904223u;
    const auto mix = [&] {
        v[0] += v[1] * v[3];
        v[1] += v[2] * v[0];
        v[2] += v[0] * v[1];
        v[3] += v[1] * v[2];
    };
    mix();
    for (uint32_t& x : v) x ^= x >> 16;
    mix();
    return v;
}

/// In (0, 1), both ends out.
inline std::array<double, 4> uniform4(std::array<uint32_t, 4> counter) {
    const auto bits = pcg4d(counter);
    std::array<double, 4> result{};
    for (int i = 0; i < 4; ++i) result[size_t(i)] = (double(bits[size_t(i)] >> 8) + 0.5) / 16777216.0;
    return result;
}

/// Three independent standard normal numbers (Box and Muller 1958).
inline std::array<double, 3> normal3(std::array<uint32_t, 4> counter) {
    const auto u = uniform4(counter);
    const double r0 = std::sqrt(-2.0 * std::log(u[0])), r1 = std::sqrt(-2.0 * std::log(u[2]));
    const double turn = 2.0 * std::numbers::pi;
    return {r0 * std::cos(turn * u[1]), r0 * std::sin(turn * u[1]), r1 * std::cos(turn * u[3])};
}

}  // namespace ewa::core
