// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cmath>

#include "shared/constants.h"

namespace ewa::pipeline {

/// Factors that correct the bias of Adam's two moments at a step, which counts from 1.
inline std::array<float, 2> adam_biases(double step, double beta1 = shared::ADAM_BETA1,
                                        double beta2 = shared::ADAM_BETA2) {
    return {float(1 / (1 - std::pow(beta1, step))), float(1 / (1 - std::pow(beta2, step)))};
}

}  // namespace ewa::pipeline
