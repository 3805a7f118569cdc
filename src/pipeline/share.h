// SPDX-License-Identifier: Apache-2.0
// How the splats of a run are divided among its ranks: rank q holds the q-th part of the one order, in whole blocks of
// PARAM_BLOCK splats. The arrays of all ranks one after another are those of a run that is alone.
#pragma once
#include "gpu/executor.h"
#include "pipeline/frame_buffers.h"
#include "pipeline/model.h"

namespace ewa::pipeline {

struct Range {
    uint32_t first = 0, splats = 0;
};
Range range_of(uint32_t all, int rank, int ranks);

/// Splats `first` to first + count.
Gaussians slice_of(const Gaussians& all, size_t first, size_t count);

/// Throws RunError if some rank would have no splats.
void check_share(uint32_t all, int ranks);

/// The sum of a number over all ranks.
uint64_t sum_over(Ranks& ranks, uint64_t own);

/// Moves splats between ranks until each has its range again, after their numbers have changed. Collective. The device must
/// be idle. Throws what check_share throws.
void level(gpu::Device& device, Model& model);

/// Draws of McmcPush that this rank's splats are the sources of, for the ranks of the targets. Collective.
/// sources: of all draws, the source's index in this model or NOT_LISTED. hits: of each splat of this model.
struct ForeignSources {
    gpu::Buffer sources;  // of this rank's targets: index in this model, or behind its splats
    gpu::Buffer hits;     // also of the splats behind
};
/// dead: splats of this rank that get a copy. added: new splats of all ranks, which the last rank gets. Sources of other
/// ranks are appended to model.params.
ForeignSources fetch_sources(gpu::Device& device, Model& model, gpu::Buffer sources, gpu::Buffer hits,
                             uint32_t dead, uint32_t added);

}  // namespace ewa::pipeline
