// SPDX-License-Identifier: Apache-2.0
// The weights of the loss as people type them: l1=0.8,ssim=0.2.
#pragma once
#include <string>

#include "ewa/loss_weights.h"

namespace ewa::train {

/// Terms of colour that the text does not name have the weight 0, if it names one of them. Throws InputError.
LossWeights parse_loss(const std::string& text);

/// The weights as parse_loss reads them.
std::string loss_text(const LossWeights& weights);

}  // namespace ewa::train
