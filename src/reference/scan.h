// SPDX-License-Identifier: Apache-2.0
// Exclusive prefix sum: out[i] = in[0] + ... + in[i - 1], with the total as one more element at the end.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

namespace ewa::reference {

inline std::vector<uint64_t> exclusive_scan(std::span<const uint32_t> counts) {
    std::vector<uint64_t> sums(counts.size() + 1, 0);
    for (size_t i = 0; i < counts.size(); ++i) sums[i + 1] = sums[i] + counts[i];
    return sums;
}

}  // namespace ewa::reference
