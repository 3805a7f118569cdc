// SPDX-License-Identifier: Apache-2.0
// The needs of a training, before it begins: splats, device memory, and the work that it skips.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/device.h"
#include "ewa/gaussians.h"
#include "ewa/plan.h"
#include "ewa/train_options.h"

namespace ewa {

/// The options with concrete values for Strategy::automatic, kAutomaticShDegree, kAutomaticHalvings and AppearanceModel::automatic.
/// The choice of the appearance model reads up to 64 training images. Throws InputError: an image that cannot be read, frames that
/// the dataset lacks.
TrainOptions resolve(TrainOptions options, const Dataset& dataset, const std::vector<int>& train_frames);

/// The largest number of splats of a training, and why it is that.
struct SplatCap {
    uint32_t splats = 0;
    std::string reason;  // e.g. "100 more for each step"
};

/// The largest number of splats of a Trainer with the same arguments. docs/training_options.md has the rule of kAutomaticMaxSplats.
/// Throws InputError as Trainer does.
SplatCap splat_cap(const gpu::Device& device, const Dataset& dataset, const std::vector<int>& train_frames,
                   const Gaussians& start, const TrainOptions& options);

/// An estimate of the device memory of a training at its peak, in bytes. docs/performance.md compares it with runs.
struct MemoryEstimate {
    uint32_t splats = 0;  // at the end; with adc at most, since their number depends on the images
    uint64_t model = 0;   // parameters, moments, statistics
    uint64_t frame = 0;   // images, sort buffers, gradient slots; or what a refinement needs beside the model
    uint64_t images = 0;  // cached training images
    uint64_t total() const { return model + frame + images; }
};

/// Estimates the memory of a Trainer with the same arguments. Allocates no device memory. Throws InputError as Trainer does.
MemoryEstimate estimate_memory(const gpu::Device& device, const Dataset& dataset,
                               const std::vector<int>& train_frames, const Gaussians& start,
                               const TrainOptions& options);

/// The work that a Trainer with these options skips if it has many training images. masks: some training images have pixels that do
/// not count. Throws InputError for arrays of a wrong length.
std::vector<PlanLine> plan_lines(const Gaussians& start, const TrainOptions& options, bool masks = false);

}  // namespace ewa
