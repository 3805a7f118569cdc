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

/// The most splats that the number of pixels of these frames justifies.
size_t cap_by_pixels(const Dataset& dataset, const std::vector<int>& frames);

/// The size in bytes of the image cache if a training keeps its splats in several portions.
uint64_t limited_cache(const TrainOptions& options);

/// Computes what a training needs: numbers of splats, device memory and portions.
class Needs {
  public:
    /// options: with resolved strategy and SH degree. The references must outlive this object.
    Needs(const gpu::Device& device, const Dataset& dataset, const std::vector<int>& frames,
          const Gaussians& start, const TrainOptions& options);

    /// The largest number of splats.
    SplatCap cap();
    /// About how many of the first splats the device's memory can train: all of them, or fewer.
    size_t fitting_start();
    /// TrainOptions::final_splats, if the largest number is max_splats. 0 if there are as many to start from.
    uint32_t final_splats(uint32_t max_splats) const;
    MemoryEstimate memory(uint32_t max_splats) { return estimator_.up_to(max_splats); }
    /// The number of portions into which each of `ranks` ranks divides its splats. It is 1 if all splats fit in
    /// TrainOptions::device_memory_bytes. The number follows from max_splats, so portions are never divided again.
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
