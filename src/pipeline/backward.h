// SPDX-License-Identifier: Apache-2.0
// Inputs of the loss and of the backward passes in FramePasses: learning rates, and terms of the loss.
#pragma once
#include <cstdint>

#include "pipeline/frame_passes.h"
#include "pipeline/motions.h"

namespace ewa::pipeline {

struct Rates {
    float mean = 0, opacity = 0, quaternion = 0, scale = 0, sh0 = 0, sh_rest = 0;
    uint32_t step = 1;      // Adam's, from 1
    uint32_t views = 1;     // views of a step: see batch_rates
    bool nesterov = false;  // Nesterov's momentum: see adam_shares
    uint64_t seed = 0;      // seed of the stochastic rounding of packed moments
    // With plan.regularised: d(loss)/d(opacity) and d(loss)/d(scale along one axis) of every splat.
    float opacity_weight = 0, scale_weight = 0;
};

/// SPEC_MODE of the update: UPDATE_* bits.
uint32_t update_mode(const Plan& plan);

/// Terms of a loss before they are weighted.
struct LossTerms {
    double l1 = 0, l2 = 0, ssim = 0, alpha = 0, depth = 0;
};
LossTerms terms_of(const shared::Counts& counts);
double loss_of(const LossWeights& weights, const LossTerms& terms);
double loss_of(const LossWeights& weights, const shared::Counts& counts);

}  // namespace ewa::pipeline
