// SPDX-License-Identifier: Apache-2.0
// Strategies that change the number of splats, on the device. Each replaces the model's arrays by those of the next
// generation, one after another: at most one array is there twice. frame: provides sizes, counts and scratch buffers of
// a value a splat.
#pragma once
#include <cstdint>

#include "gpu/executor.h"
#include "pipeline/frame_buffers.h"
#include "pipeline/model.h"

namespace ewa::pipeline {

/// Numbers of splats.
struct Refinement {
    uint32_t before = 0, after = 0;
    uint32_t relocated = 0;  // by MCMC
};

/// Of adaptive density control.
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

/// Adaptive density control: counts first, then writes the next generation, and zeroes its statistics. If the
/// next generation has no splats, the model stays as it is.
Refinement densify(passes::PassCache& cache, gpu::Executor& executor, Model& model, const FrameBuffers& frame,
                   const DensifyRules& rules);

/// Lowers every opacity to at most this logit and zeroes its moments.
void record_reset_opacity(gpu::Recording& recording, passes::PassCache& cache, const Model& model,
                          float logit);

/// Of 3DGS as Markov chain Monte Carlo (Kheradmand et al. 2024). Dead splats move to living ones, the number
/// of splats grows by a share, and noise lets transparent splats explore.
struct McmcRules {
    double dead_opacity = 0.005;  // a splat at or below it is dead
    double growth = 1.05;         // number of splats after a refinement over that before, up to max_splats
    uint32_t max_splats = 0;      // hard cap
    double spread = 0;            // standard deviations of the source by which it and its copies move apart
    Footprint kernel = Footprint::peak;
    uint64_t seed = 0;
    uint32_t step = 0;
};

/// Every dead splat and every added splat becomes a copy of a source. Sources are drawn with probability in
/// proportion to opacity (integer weights in units of 1 / min(65535, 2^32 / splats)). A source and its copies
/// share its opacity and scales by eq. 9, or its optical depth with Footprint::density, and start with zero moments. With `spread`, each is placed by a draw
/// of the source's Gaussian, `spread` times as wide. No-op if all splats are dead or nothing changes.
Refinement refine_mcmc(passes::PassCache& cache, gpu::Executor& executor, Model& model,
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
