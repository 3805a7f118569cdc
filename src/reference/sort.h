// SPDX-License-Identifier: Apache-2.0
// Stable sort, depth order and prefix sum.
#pragma once
#include <algorithm>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "reference/projection.h"

namespace ewa::reference {

/// The permutation that sorts: keys[result[0]] <= keys[result[1]] <= ..., with equal keys in their old order.
template <class Key>
std::vector<uint32_t> stable_order(std::span<const Key> keys) {
    std::vector<uint32_t> order(keys.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](uint32_t i, uint32_t j) { return keys[i] < keys[j]; });
    return order;
}

/// The indices of the visible splats, nearest first, ties by index. The key is the view depth in float32, as
/// on the device. So depths that differ by less than a float32 step are ties on both.
inline std::vector<uint32_t> depth_order(std::span<const Projected> projected) {
    std::vector<uint32_t> visible;
    std::vector<float> keys;
    for (size_t i = 0; i < projected.size(); ++i) {
        if (!projected[i].visible) continue;
        visible.push_back(uint32_t(i));
        keys.push_back(float(projected[i].z));
    }
    std::vector<uint32_t> order;
    for (uint32_t rank : stable_order<float>(keys)) order.push_back(visible[rank]);
    return order;
}

/// The exclusive prefix sum: out[i] = in[0] + ... + in[i - 1]. The last of its in.size() + 1 elements is the
/// total.
inline std::vector<uint64_t> exclusive_scan(std::span<const uint32_t> counts) {
    std::vector<uint64_t> sums(counts.size() + 1, 0);
    for (size_t i = 0; i < counts.size(); ++i) sums[i + 1] = sums[i] + counts[i];
    return sums;
}

}  // namespace ewa::reference
