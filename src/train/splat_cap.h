// SPDX-License-Identifier: Apache-2.0
// The numbers of splats that a training may begin with and end with. splat_cap() of ewa/trainer.h has the largest one.
#pragma once
#include <cstddef>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/train_options.h"

namespace ewa::train {

/// Throws InputError if a training cannot start from so many splats.
void check_start(size_t splats, const TrainOptions& options);

/// The number of pixels of all these frames together.
double pixels_of(const Dataset& dataset, const std::vector<int>& frames);

}  // namespace ewa::train
