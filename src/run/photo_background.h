// SPDX-License-Identifier: Apache-2.0
// The background of training images without transparency, in training and renders.
#pragma once
#include <vector>

#include "ewa/run_options.h"

namespace ewa::train {

/// Replaces RunOptions::automatic_background by concrete options. Images without transparency get their mean colour as background,
/// with noise. Other images keep black without noise. frames: the training frames; at most 16 of their images are read. Throws
/// InputError (an image that cannot be read).
void choose_background(RunOptions& options, const Dataset& dataset, const std::vector<int>& frames);

}  // namespace ewa::train
