// SPDX-License-Identifier: Apache-2.0
// The numbers of splats that a training may begin with and end with, and the portions that fit in its memory.
#pragma once
#include <cstddef>
#include <vector>

#include "ewa/training_needs.h"
#include "train/memory_estimate.h"

namespace ewa::train {

/// Throws InputError if a training cannot start from so many splats.
void check_start(size_t splats, const TrainOptions& options);

/// The number of pixels of all these frames together.
double pixels_of(const Dataset& dataset, const std::vector<int>& frames);

/// The number of splats for which these frames have detail.
size_t cap_by_pixels(const Dataset& dataset, const std::vector<int>& frames);

/// The bytes of the image cache of a training in several portions.
uint64_t limited_cache(const TrainOptions& options);

/// What a training needs. Each figure is computed when it is asked for, from one sample of the first splats.
class Needs {
  public:
    /// options: with concrete strategy and SH degree. What is passed must outlive this.
    Needs(const gpu::Device& device, const Dataset& dataset, const std::vector<int>& frames,
          const Gaussians& start, const TrainOptions& options);

    /// The largest number of splats.
    SplatCap cap();
    /// About how many of the first splats fit in the device's memory; all of them if they do.
    size_t fitting_start();
    MemoryEstimate memory(uint32_t max_splats) { return estimator_.up_to(max_splats); }
    /// Into how many portions each of `ranks` ranks divides its splats: 1 if the training fits in
    /// TrainOptions::device_memory_bytes. Such a training keeps within the limit too. The number comes from the splats at
    /// the end, so portions never have to be divided again.
    int portions(uint32_t max_splats, int ranks);

  private:
    uint32_t fitting(uint32_t most);

    const gpu::Device& device_;
    const Dataset& dataset_;
    const std::vector<int>& frames_;
    const TrainOptions& options_;
    size_t start_;  // splats
    MemoryEstimator estimator_;
};

}  // namespace ewa::train
