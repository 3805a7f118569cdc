// SPDX-License-Identifier: Apache-2.0
// The numbers of a .rad: its properties and their encodings (rad.h).
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ewa::io {

enum class RadEncoding {
    f32,
    f16,
    f32_lebytes,
    f16_lebytes,
    r8,
    r8_delta,
    s8,
    s8_delta,
    ln_f16,
    ln_0r8,
    oct88r8,
    u16,
    u32
};

std::string_view name_of(RadEncoding encoding);
std::optional<RadEncoding> rad_encoding(std::string_view name);

/// Whether values need the property's min or max.
bool needs_min(RadEncoding encoding);
bool needs_max(RadEncoding encoding);

/// The bytes of `count` splats with so many numbers each.
uint64_t rad_bytes(RadEncoding encoding, uint64_t count, uint64_t numbers);

/// The numbers, plane after plane: number k of splat i is at k * count + i. Logarithms stay logarithms, where a size of 0 is -infinity.
/// oct88r8 gives x y z of the quaternion with w >= 0. bytes: as many as rad_bytes tells.
std::vector<float> decode_rad(RadEncoding encoding, std::span<const std::byte> bytes, size_t count,
                              size_t numbers, double min, double max);

/// The same for u16 and u32.
std::vector<uint32_t> decode_rad_integers(RadEncoding encoding, std::span<const std::byte> bytes);

/// oct88r8 of a quaternion w x y z of length 1.
std::array<uint8_t, 3> packed_turn(std::array<double, 4> wxyz);

}  // namespace ewa::io
