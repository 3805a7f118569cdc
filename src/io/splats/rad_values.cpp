// SPDX-License-Identifier: Apache-2.0
#include "io/splats/rad_values.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <glm/gtc/packing.hpp>
#include <limits>
#include <numbers>

#include "io/splats/splat_values.h"

namespace ewa::io {

namespace {

struct EncodingKind {
    std::string_view name;
    size_t bytes;  // of a number, of oct88r8 of all three
};

/// In the order of RadEncoding.
constexpr std::array<EncodingKind, 13> kEncodings = {{{"f32", 4},
                                                      {"f16", 2},
                                                      {"f32_lebytes", 4},
                                                      {"f16_lebytes", 2},
                                                      {"r8", 1},
                                                      {"r8_delta", 1},
                                                      {"s8", 1},
                                                      {"s8_delta", 1},
                                                      {"ln_f16", 2},
                                                      {"ln_0r8", 1},
                                                      {"oct88r8", 3},
                                                      {"u16", 2},
                                                      {"u32", 4}}};

template <class T>
T number_at(const std::byte* bytes, size_t index) {
    T value;
    std::memcpy(&value, bytes + index * sizeof(T), sizeof(T));
    return value;
}

/// A number whose bytes lie `stride` apart.
template <class T>
T spread_number(const std::byte* bytes, size_t stride) {
    std::array<std::byte, sizeof(T)> together{};
    for (size_t k = 0; k < sizeof(T); ++k) together[k] = bytes[k * stride];
    return std::bit_cast<T>(together);
}

std::array<double, 3> unpacked_turn(const std::byte* bytes) {
    double x = double(bytes[0]) / 255 * 2 - 1, y = double(bytes[1]) / 255 * 2 - 1;
    const double z = 1 - std::abs(x) - std::abs(y), fold = std::max(-z, 0.0);
    x += x >= 0 ? -fold : fold;
    y += y >= 0 ? -fold : fold;
    const double half = double(bytes[2]) / 255 * std::numbers::pi / 2;
    const double scale = std::sin(half) / std::sqrt(x * x + y * y + z * z);
    return {x * scale, y * scale, z * scale};
}

}  // namespace

std::string_view name_of(RadEncoding encoding) {
    return kEncodings[size_t(encoding)].name;
}

std::optional<RadEncoding> rad_encoding(std::string_view name) {
    const auto found = std::ranges::find(kEncodings, name, &EncodingKind::name);
    if (found == kEncodings.end()) return std::nullopt;
    return RadEncoding(found - kEncodings.begin());
}

bool needs_min(RadEncoding encoding) {
    return encoding == RadEncoding::r8 || encoding == RadEncoding::r8_delta ||
           encoding == RadEncoding::ln_0r8;
}

bool needs_max(RadEncoding encoding) {
    return needs_min(encoding) || encoding == RadEncoding::s8 || encoding == RadEncoding::s8_delta;
}

uint64_t rad_bytes(RadEncoding encoding, uint64_t count, uint64_t numbers) {
    const uint64_t each = kEncodings[size_t(encoding)].bytes;
    return count * (encoding == RadEncoding::oct88r8 ? each : each * numbers);
}

std::vector<float> decode_rad(RadEncoding encoding, std::span<const std::byte> bytes, size_t count,
                              size_t numbers, double min, double max) {
    const size_t all = count * numbers;
    std::vector<float> values(all);
    if (encoding == RadEncoding::oct88r8) {
        for (size_t i = 0; i < count; ++i) {
            const std::array<double, 3> turn = unpacked_turn(&bytes[3 * i]);
            for (size_t k = 0; k < 3; ++k) values[k * count + i] = float(turn[k]);
        }
        return values;
    }
    uint8_t before = 0;
    for (size_t at = 0; at < all; ++at) {
        if (at % count == 0) before = 0;
        switch (encoding) {
            case RadEncoding::f32:
                values[at] = number_at<float>(bytes.data(), at);
                break;
            case RadEncoding::f16:
            case RadEncoding::ln_f16:
                values[at] = glm::unpackHalf1x16(number_at<uint16_t>(bytes.data(), at));
                break;
            case RadEncoding::f32_lebytes:
                values[at] = spread_number<float>(&bytes[at], all);
                break;
            case RadEncoding::f16_lebytes:
                values[at] = glm::unpackHalf1x16(spread_number<uint16_t>(&bytes[at], all));
                break;
            case RadEncoding::r8:
            case RadEncoding::r8_delta:
                before = uint8_t(uint8_t(bytes[at]) + (encoding == RadEncoding::r8 ? 0 : before));
                values[at] = float(min + before / 255.0 * (max - min));
                break;
            case RadEncoding::s8:
            case RadEncoding::s8_delta:
                before = uint8_t(uint8_t(bytes[at]) + (encoding == RadEncoding::s8 ? 0 : before));
                values[at] = float(int8_t(before) / 127.0 * max);
                break;
            case RadEncoding::ln_0r8:
                values[at] = bytes[at] == std::byte(0)
                                 ? -std::numeric_limits<float>::infinity()
                                 : float(min + (uint8_t(bytes[at]) - 1) / 254.0 * (max - min));
                break;
            case RadEncoding::oct88r8:
            case RadEncoding::u16:
            case RadEncoding::u32:
                break;
        }
    }
    return values;
}

std::vector<uint32_t> decode_rad_integers(RadEncoding encoding, std::span<const std::byte> bytes) {
    std::vector<uint32_t> values(bytes.size() / kEncodings[size_t(encoding)].bytes);
    for (size_t i = 0; i < values.size(); ++i)
        values[i] = encoding == RadEncoding::u16 ? number_at<uint16_t>(bytes.data(), i)
                                                 : number_at<uint32_t>(bytes.data(), i);
    return values;
}

std::array<uint8_t, 3> packed_turn(std::array<double, 4> wxyz) {
    if (wxyz[0] < 0)  // -q is the same rotation
        for (double& v : wxyz) v = -v;
    double x = wxyz[1], y = wxyz[2];
    const double sum = std::abs(x) + std::abs(y) + std::abs(wxyz[3]);
    constexpr double kNoTurn = 1e-9;
    if (sum < kNoTurn) return {255, 128, 0};
    x /= sum;
    y /= sum;
    if (wxyz[3] < 0) {  // the lower half of the octahedron is folded outwards
        const double upper = x;
        x = (1 - std::abs(y)) * (upper >= 0 ? 1 : -1);
        y = (1 - std::abs(upper)) * (y >= 0 ? 1 : -1);
    }
    const double half = std::acos(std::min(wxyz[0], 1.0));
    return {to_byte((x + 1) / 2 * 255), to_byte((y + 1) / 2 * 255),
            to_byte(half / (std::numbers::pi / 2) * 255)};
}

}  // namespace ewa::io
