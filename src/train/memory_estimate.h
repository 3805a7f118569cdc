// SPDX-License-Identifier: Apache-2.0
// The device memory of a training, before it begins.
#pragma once
#include <memory>
#include <vector>

#include "ewa/training_needs.h"
#include "passes/kernel_config.h"

namespace ewa::train {

/// Estimates the memory of one training with different largest numbers of splats.
class MemoryEstimator {
  public:
    /// options: with resolved strategy and SH degree. The references must outlive the estimator.
    MemoryEstimator(const passes::KernelConfig& config, const Dataset& dataset,
                    const std::vector<int>& frames, const Gaussians& start, const TrainOptions& options);
    ~MemoryEstimator();

    MemoryEstimate up_to(uint32_t max_splats);

  private:
    struct Sample;

    uint64_t pairs(uint32_t splats, uint32_t list_side);

    passes::KernelConfig config_;
    const Dataset& dataset_;
    const std::vector<int>& frames_;
    const Gaussians& start_;
    const TrainOptions& options_;
    std::unique_ptr<const Sample> sample_;  // of views and first splats; made for the first estimate
};

}  // namespace ewa::train
