// SPDX-License-Identifier: Apache-2.0
#include "reference/adam.h"

#include <cassert>
#include <cmath>

#include "shared/constants.h"

namespace ewa::reference {

using namespace shared;

uint64_t adam_step(std::span<double> values, std::span<const double> gradient, AdamState& state, double rate,
                   int step) {
    assert(step >= 1);
    assert(gradient.size() == values.size() && state.m.size() == values.size() &&
           state.v.size() == values.size());
    const double correction1 = 1 - std::pow(ADAM_BETA1, step), correction2 = 1 - std::pow(ADAM_BETA2, step);
    uint64_t dropped = 0;
    for (size_t i = 0; i < values.size(); ++i) {
        const double g = gradient[i];
        const double m = ADAM_BETA1 * state.m[i] + (1 - ADAM_BETA1) * g;
        const double v = ADAM_BETA2 * state.v[i] + (1 - ADAM_BETA2) * g * g;
        const double x = values[i] - rate * (m / correction1) / (std::sqrt(v / correction2) + ADAM_EPSILON);
        if (!(std::isfinite(m) && std::isfinite(v) && std::isfinite(x))) {
            ++dropped;
            continue;
        }
        state.m[i] = m;
        state.v[i] = v;
        values[i] = x;
    }
    return dropped;
}

}  // namespace ewa::reference
