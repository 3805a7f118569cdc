// SPDX-License-Identifier: Apache-2.0
// Stable sort by key: what a least-significant-digit radix sort does in several passes.
#pragma once
#include <algorithm>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace ewa::reference {

/// The permutation that sorts: keys[result[0]] <= keys[result[1]] <= ..., equal keys in their old order.
template <class Key>
std::vector<uint32_t> stable_order(std::span<const Key> keys) {
    std::vector<uint32_t> order(keys.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](uint32_t i, uint32_t j) { return keys[i] < keys[j]; });
    return order;
}

}  // namespace ewa::reference
