// SPDX-License-Identifier: Apache-2.0
// The background of training images without transparency, in training and renders.
#pragma once
#include <vector>

#include "ewa/run_options.h"

namespace ewa::train {

/// Settles RunOptions::automatic_background: photos without transparency have their mean colour and noise around it. Others keep
/// black without noise. frames: those to train on; at most 16 of their images are read. Throws InputError (an image that cannot
/// be read).
void choose_background(RunOptions& options, const Dataset& dataset, const std::vector<int>& frames);

}  // namespace ewa::train
