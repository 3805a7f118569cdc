// SPDX-License-Identifier: Apache-2.0
// When a run does what: pure functions of the step and the options.
//
// The intervals of TrainOptions are those of a 30,000 step run. A shorter run keeps their proportions as far
// as sense allows: a densification needs statistics over many views, and an opacity reset needs a few hundred
// steps to heal, so both have a floor below which they do not shrink.
//
// 3DGS-MCMC puts copies onto their source and leaves it to the noise to part them. That takes thousands of
// steps: two copies that are more opaque than the noise's gate feel the same gradient and stay one. A shorter
// run therefore starts copies apart, the more the shorter it is.
//
// The learning rates of 3DGS are those of 30,000 steps. In a short run means do not reach their places and
// view-dependent colour does not unfold, so both learn faster there, the more the shorter the run is.
#pragma once
#include <cstdint>

#include "ewa/trainer.h"
#include "pipeline/plan.h"

namespace ewa::train {

struct Schedule {
    int steps = 0;
    int refine_start = 0, refine_stop = 0, refine_every = 0;  // steps
    int relocate_stop = 0, relocate_every = 0;                // steps, of MCMC
    double growth = 1;            // of MCMC, a refinement: as fast, by the share of the run, as in a full run
    double copy_spread = 0;       // of MCMC
    int opacity_reset_every = 0;  // 0: never
    int sh_degree_every = 0;
    int sh_degree = 0;  // the highest
    int halvings = 0, resolution_every = 0;
    double means_rate = 0, means_rate_final = 0;  // per unit of scene extent
    double sh_rest_rate = 0;                      // of SH above degree 0
    double exposures_rate = 0, exposures_rate_final = 0;

    /// Densify after this step (steps count from 1)?
    bool densifies(int step) const;
    /// MCMC: relocate and grow after this step?
    bool relocates(int step) const;
    bool resets_opacity(int step) const;
    /// Has an opacity reset happened at or before this step? Only then does size prune.
    bool was_reset(int step) const;
    /// SH degree evaluated in this step.
    int degree(int step) const;
    /// How many times the photographs' sides are halved in this step (OpenSplat's resolution schedule).
    int halvings_at(int step) const;
    /// Learning rate of the means: exponential from means_rate to means_rate_final over the run (Plenoxels'
    /// decay, as 3DGS uses it), times the scene extent.
    double mean_rate(int step, double extent) const;
    /// Learning rate of the exposures, with the same decay.
    double exposure_rate(int step) const;
};

/// Bytes of the photographs' cache that those of so many halvings may take: what is left of it by the smaller
/// ones, each of which gets a quarter of the next larger one's share.
uint64_t cache_share(const TrainOptions& options, int halvings);

Schedule schedule_for(const TrainOptions& options);

/// The plan that a run asks for. masks: some training images have pixels that do not count.
pipeline::PlanRequest plan_request(const Gaussians& start, const TrainOptions& options, bool masks);

}  // namespace ewa::train
