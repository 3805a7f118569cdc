// SPDX-License-Identifier: Apache-2.0
// Adam (Kingma and Ba 2015, algorithm 1) in the form of PyTorch and 3DGS:
//   m <- BETA1 m + (1 - BETA1) g,  v <- BETA2 v + (1 - BETA2) g^2
//   x <- x - rate (m / (1 - BETA1^t)) / (sqrt(v / (1 - BETA2^t)) + EPSILON),  t = 1, 2, ...
// A value without a gradient in this step, because its splat is not visible, is updated with g = 0, as in
// 3DGS.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

namespace ewa::reference {

struct AdamState {
    std::vector<double> m, v;  // per value, initially zero
    explicit AdamState(size_t n = 0) : m(n, 0.0), v(n, 0.0) {}
};

/// `step` counts from 1. A value whose new m, v or x is not finite keeps all three. Returns the number of
/// such values.
uint64_t adam_step(std::span<double> values, std::span<const double> gradient, AdamState& state, double rate,
                   int step);

}  // namespace ewa::reference
