// SPDX-License-Identifier: Apache-2.0
// What TrainOptions::device_memory_bytes makes of a training.
#pragma once
#include <vector>

#include "ewa/trainer.h"

namespace ewa::train {

/// Into how many portions each of `ranks` ranks divides its splats: 1 if the training fits in its limit. Such a training keeps
/// within the limit too. The number comes from the splats at the end, so portions never have to be divided again.
int portions_for(const gpu::Device& device, const Dataset& dataset, const std::vector<int>& frames,
                 const Gaussians& start, const TrainOptions& options, int ranks = 1);

/// The bytes of the image cache of a training in several portions.
uint64_t limited_cache(const TrainOptions& options);

}  // namespace ewa::train
