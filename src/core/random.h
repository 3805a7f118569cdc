// SPDX-License-Identifier: Apache-2.0
// Random numbers as pure functions of a counter. Their integers equal those of shaders/lib/random.glsl.
#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace ewa::core {

/// pcg4d (Jarzynski and Olano 2020, "Hash Functions for GPU Rendering").
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

/// Four uniform numbers in the open interval (0, 1).
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

/// A point of Sobol's first two dimensions, shuffled and Owen-scrambled by hashing (Burley 2020). Every
/// aligned block of 2^m indices is a (0, m, 2)-net. It equals shaders/lib/low_discrepancy.glsl.
inline std::array<double, 2> sobol_pair(uint32_t index, std::array<uint32_t, 3> seed) {
    const auto reversed = [](uint32_t x) {
        x = (x >> 16) | (x << 16);
        x = ((x & 0xff00ff00u) >> 8) | ((x & 0x00ff00ffu) << 8);
        x = ((x & 0xf0f0f0f0u) >> 4) | ((x & 0x0f0f0f0fu) << 4);
        x = ((x & 0xccccccccu) >> 2) | ((x & 0x33333333u) << 2);
        return ((x & 0xaaaaaaaau) >> 1) | ((x & 0x55555555u) << 1);
    };
    const auto laine_karras = [](uint32_t x, uint32_t s) {
        x += s;
        for (const uint32_t factor : {0x6c50b47cu, 0xb82f1e52u, 0xc7afe638u, 0x8d22f6e6u}) x ^= x * factor;
        return x;
    };
    const uint32_t i = reversed(laine_karras(reversed(index), seed[0]));
    uint32_t second = i;  // i(x) -> i(1 + x) as polynomials over GF(2)
    second ^= (second & 0xffff0000u) >> 16;
    second ^= (second & 0xff00ff00u) >> 8;
    second ^= (second & 0xf0f0f0f0u) >> 4;
    second ^= (second & 0xccccccccu) >> 2;
    second ^= (second & 0xaaaaaaaau) >> 1;
    const auto fraction = [&](uint32_t bits) { return (double(reversed(bits) >> 8) + 0.5) / 16777216.0; };
    return {fraction(laine_karras(i, seed[1])), fraction(laine_karras(second, seed[2]))};
}

}  // namespace ewa::core
