// SPDX-License-Identifier: Apache-2.0
// Adaptive density control on the device: counts first, then writes the next generation into new buffers.
#pragma once
#include <cstdint>

#include "gpu/executor.h"
#include "passes/pass.h"
#include "pipeline/frame_buffers.h"
#include "pipeline/model.h"

namespace ewa::pipeline {

struct DensifyRules {
    float grow_gradient = 0;  // threshold of the mean gradient norm
    float split_scale = 0;    // world units
    float prune_logit = 0;
    float prune_scale = 0;         // world units; 0: scale does not prune
    bool revised_opacity = false;  // of a split's children: see DensifyPush
    uint64_t seed = 0;
    uint32_t step = 0;
    uint32_t max_splats = 0;  // hard cap: the threshold is raised until the next generation fits
};

struct DensifyResult {
    uint32_t before = 0, after = 0;
};

/// Replaces the model's buffers and zeroes its statistics. frame: provides scratch buffers and counts. If the
/// next generation has no splats, the model stays as it is.
DensifyResult densify(passes::PassCache& cache, gpu::Executor& executor, Model& model,
                      const FrameBuffers& frame, const DensifyRules& rules);

/// Lowers every opacity to at most this logit and zeroes its moments.
void record_reset_opacity(gpu::Recording& recording, passes::PassCache& cache, const Model& model,
                          float logit);

}  // namespace ewa::pipeline
