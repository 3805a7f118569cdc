// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cmath>
#include <cstdint>

#include "shared/constants.h"

namespace ewa::pipeline {

/// Factors that correct the bias of Adam's two moments at a step, which counts from 1.
inline std::array<float, 2> adam_biases(double step, double beta1 = shared::ADAM_BETA1,
                                        double beta2 = shared::ADAM_BETA2) {
    return {float(1 / (1 - std::pow(beta1, step))), float(1 / (1 - std::pow(beta2, step)))};
}

/// Factors of the first moment and of the gradient in a step of Adam, with the correction of bias. Without Nesterov's momentum, the
/// gradient's factor is 0. With it, both give the moment of the next step if the gradient stays the same (Dozat 2016, algorithm 2).
struct AdamShares {
    float moment = 1, gradient = 0;
};

/// step: number of views so far, from 1. views: number of views in a step; the step's decay is then beta1^views.
inline AdamShares adam_shares(bool nesterov, double step, uint32_t views = 1) {
    if (!nesterov) return {adam_biases(step)[0], 0};
    const double beta = std::pow(shared::ADAM_BETA1, views);
    return {float(beta * adam_biases(step + views)[0]), float((1 - beta) * adam_biases(step)[0])};
}

}  // namespace ewa::pipeline
