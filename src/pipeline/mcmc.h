// SPDX-License-Identifier: Apache-2.0
// 3DGS as Markov chain Monte Carlo (Kheradmand et al. 2024) on the device. Dead splats move to living ones,
// the number of splats grows by a share, and noise lets transparent splats explore.
#pragma once
#include <cstdint>

#include "gpu/executor.h"
#include "passes/pass.h"
#include "pipeline/frame_buffers.h"
#include "pipeline/model.h"

namespace ewa::pipeline {

struct McmcRules {
    double dead_opacity = 0.005;  // a splat at or below it is dead
    double growth = 1.05;         // number of splats after a refinement over that before, up to max_splats
    uint32_t max_splats = 0;      // hard cap
    double spread = 0;            // standard deviations of the source by which it and its copies move apart
    uint64_t seed = 0;
    uint32_t step = 0;
};

struct McmcResult {
    uint32_t before = 0, relocated = 0, after = 0;
};

/// Every dead splat and every added splat becomes a copy of a source. Sources are drawn with probability in
/// proportion to opacity (integer weights in units of 1 / min(65535, 2^32 / splats)). A source and its copies
/// share its opacity and scales by eq. 9 and start with zero moments. With `spread`, each is placed by a draw
/// of the source's Gaussian, `spread` times as wide. Replaces the model's buffers if anything changes. frame:
/// provides sizes and counts. No-op if all splats are dead.
McmcResult refine_mcmc(passes::PassCache& cache, gpu::Executor& executor, Model& model,
                       const FrameBuffers& frame, const McmcRules& rules);

struct Noise {
    float amplitude = 0;   // 1 / world units
    float max_length = 0;  // world units, along each axis of a splat
    uint64_t seed = 0;
    uint32_t step = 0;
};

/// Adds to each mean amplitude * gate(opacity) * Sigma * a standard normal vector
/// (shaders/passes/perturb.comp).
void record_noise(gpu::Recording& recording, passes::PassCache& cache, const Model& model,
                  const FrameBuffers& frame, const Noise& noise);

}  // namespace ewa::pipeline
