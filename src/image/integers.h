// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>

namespace ewa::image {

inline uint64_t big_endian(const std::byte* bytes, int count) {
    uint64_t value = 0;
    for (int i = 0; i < count; ++i) value = value << 8 | std::to_integer<uint64_t>(bytes[i]);
    return value;
}

inline uint64_t little_endian(const std::byte* bytes, int count) {
    uint64_t value = 0;
    for (int i = count; i-- > 0;) value = value << 8 | std::to_integer<uint64_t>(bytes[i]);
    return value;
}

}  // namespace ewa::image
