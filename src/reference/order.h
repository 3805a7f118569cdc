// SPDX-License-Identifier: Apache-2.0
// Front to back: by view depth, ties by splat index.
//
// The key is z rounded to float32, as the device's is: two splats whose depths differ by less than a float32
// step are a tie on both sides and come in index order.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "reference/projection.h"
#include "reference/sort.h"

namespace ewa::reference {

/// Indices of the visible splats, nearest first.
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

}  // namespace ewa::reference
