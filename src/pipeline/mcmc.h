// SPDX-License-Identifier: Apache-2.0
// 3DGS as Markov chain Monte Carlo (Kheradmand et al. 2024) on the device: dead splats move to living ones,
// the number grows by a share, and noise keeps the transparent ones exploring.
#pragma once
#include <cstdint>

#include "gpu/executor.h"
#include "pipeline/frame.h"
#include "pipeline/kernels.h"
#include "pipeline/model.h"

namespace ewa::pipeline {

struct McmcRules {
    double dead_opacity = 0.005;  // at or under it a splat is dead
    double growth = 1.05;         // the number after a refinement over that before, up to max_splats
    uint32_t max_splats = 0;      // hard cap
    double spread = 0;            // standard deviations of the source that it and its copies move apart
    uint64_t seed = 0;
    uint32_t step = 0;
};

struct McmcResult {
    uint32_t before = 0, relocated = 0, after = 0;
};

/// Every dead splat, and every one that is added, becomes a copy of a source drawn with probability in
/// proportion to its opacity (weights of 1 / min(65535, 2^32 / splats)); source and copies share its opacity
/// and scales by eq. 9 and start without moments, where draws of the source's Gaussian, `spread` times as
/// wide, put them. Replaces the model's buffers where anything changes. frame: for its sizes and counts.
/// Where every splat is dead nothing does.
McmcResult refine_mcmc(Kernels& kernels, gpu::Executor& executor, Model& model, const Frame& frame,
                       const McmcRules& rules);

/// Noise on the means: amplitude * gate(opacity) * Sigma * a standard normal vector
/// (shaders/passes/perturb.comp). amplitude: 1 / world units. reach: the longest (world units).
void record_noise(gpu::Recording& recording, Kernels& kernels, const Model& model, const Frame& frame,
                  float amplitude, float reach, uint64_t seed, uint32_t step);

}  // namespace ewa::pipeline
