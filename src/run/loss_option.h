// SPDX-License-Identifier: Apache-2.0
// The weights of the loss as people type them: l1=0.8,ssim=0.2.
#pragma once
#include <string>

#include "ewa/loss_weights.h"

namespace ewa::train {

/// Parses weights of the loss. If the text names a colour term (l1, l2, ssim), colour terms that it does not name get the weight 0.
/// Throws InputError.
LossWeights parse_loss(const std::string& text);

/// The text of weights, in the form that parse_loss reads.
std::string loss_text(const LossWeights& weights);

}  // namespace ewa::train
