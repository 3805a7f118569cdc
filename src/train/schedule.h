// SPDX-License-Identifier: Apache-2.0
// When a training does what: pure functions of the step and the options.
//
// The intervals of TrainOptions are those of a 30,000 step run. A shorter run shortens them in proportion, down to
// a lower limit. A densification needs statistics over many views, and an opacity reset needs a few hundred steps
// to recover from.
//
// In 3DGS-MCMC, clones start at the source's position and separate only through noise. That takes thousands of
// steps, and opaque clones never separate: they get the same gradient. A shorter run therefore starts clones apart,
// the more the shorter it is.
//
// The learning rates of 3DGS are those of 30,000 steps. A step of Adam moves a parameter by about its rate, whatever the
// gradient is. So parameters of a short run do not come as far as they have to. A shorter run has higher rates: see gain. High rates
// keep the splats in motion. So the rates of adc and none fall at the end of such a run: see fading.
//
// With few photos, splats learn views that no other photo confirms, and held-out views get worse while the photos get better.
// Regularisers then keep splats small and transparent, and the rates of a run that shows each photo often fade: see
// few_photos.
#pragma once
#include <cstdint>

#include "ewa/gaussians.h"
#include "ewa/train_options.h"
#include "pipeline/plan.h"

namespace ewa::train {

struct Schedule {
    int steps = 0;
    int refine_start = 0, refine_stop = 0, refine_every = 0;  // steps
    int relocate_stop = 0, relocate_every = 0;                // steps, of MCMC
    double growth = 1;       // of MCMC at each refinement, so that the whole run grows as much as a full run
    double copy_spread = 0;  // of MCMC
    bool even_splits = false;     // of adc: clones and splits leave the render about unchanged
    bool bounded = false;         // of adc: prunes splats larger than their distance to all cameras
    int opacity_reset_every = 0;  // 0: never
    int prune_step = 0;  // with TrainOptions::final_splats: the step after which splats are removed; 0: never
    int sh_degree_every = 0;
    int sh_degree = 0;  // the highest
    int halvings = 0, resolution_every = 0;
    int least_degree = 0, most_halvings = 64;     // that a continued run has reached
    double means_rate = 0, means_rate_final = 0;  // per unit of scene extent, of a full run
    double shortness = 1;                         // 30,000 over the steps, from 1 to 300
    double power =
        0;  // TrainOptions::short_run_power, half of it with refine_poses, higher where rates settle
    double appearance_power = 0;  // the same without the last rule
    int fade_start = 0;           // the step after which the rates fade; 0: they do not
    double last_rate = 1;         // factor of the splats' rates at the last step
    bool nesterov = false;        // of the splats' Adam
    double exposures_rate = 0, exposures_rate_final = 0;
    double poses_rate = 0, poses_rate_final = 0;
    double skies_rate = 0, skies_rate_final = 0;
    double appearances_rate = 0, cameras_rate = 0;  // of PPISP or grids of photos, and of PPISP of cameras
    double appearance_warm_up = 0;                  // share of the steps

    /// Densify after this step (steps count from 1)?
    bool densifies(int step) const;
    /// MCMC: relocate and grow after this step?
    bool relocates(int step) const;
    bool resets_opacity(int step) const;
    /// Remove splats down to TrainOptions::final_splats after this step? From then on their number stays.
    bool prunes(int step) const { return step == prune_step; }
    bool may_refine(int step) const { return prune_step == 0 || step < prune_step; }
    /// Has an opacity reset happened at or before this step? Only then does size prune.
    bool was_reset(int step) const;
    /// SH degree evaluated in this step.
    int degree(int step) const;
    /// How many times the training images' width and height are halved in this step (OpenSplat's resolution schedule).
    int halvings_at(int step) const;
    /// Factor of the splats' learning rates in this step: shortness^power at the first step, falling exponentially to its
    /// square root at the last.
    double gain(int step) const;
    /// Factor of the learning rates of appearances in this step: as gain, with appearance_power in place of power.
    double appearance_gain(int step) const;
    /// Factor of the opacities' learning rate in this step, lower than gain: shortness^(0.6 power), falling to 1 at the last step.
    double opacity_gain(int step) const;
    /// Another factor of all the splats' learning rates: 1 up to fade_start, then falling exponentially to
    /// last_rate.
    double fading(int step) const;
    /// Learning rate of the means without gain: exponential from means_rate to means_rate_final over the run (Plenoxels'
    /// decay, as 3DGS uses it), times the scene extent.
    double mean_rate(int step, double extent) const;
    /// Learning rates of the exposures and of the sky, with the exponential decay of mean_rate.
    double exposure_rate(int step) const;
    double sky_rate(int step) const;
    /// Learning rate of a photo's PPISP or grid, and of a camera's PPISP: both rise from a hundredth and fall exponentially
    /// to a hundredth, with appearance_gain.
    double appearance_rate(int step) const;
    double camera_rate(int step) const;
    /// Learning rate of the cameras' motions: rises from 0, then decays exponentially as mean_rate does.
    double pose_rate(int step) const;
};

/// The part of TrainOptions::image_cache_bytes for images whose width and height are halved `halvings` times. Each level gets a
/// quarter of the level above it, and the full resolution gets the rest.
uint64_t cache_share(const TrainOptions& options, int halvings);

/// Whether the method of drawing gives splats an opacity, so that their edges fade. Solid spheres have none.
bool has_opacities(const TrainOptions& options);

/// Whether the run removes splats down to TrainOptions::final_splats. options: kAutomaticFinalSplats with resolved strategy.
bool thins_at_end(const TrainOptions& options);

/// Whether adc or none has so few training photos that the run is regularised, and may fade. False for a run that refines poses,
/// since its splats have to follow the cameras. photos: number of training images.
bool few_photos(const TrainOptions& options, size_t photos);

/// The schedule of a training. photos: number of training images; default: many.
Schedule schedule_for(const TrainOptions& options, size_t photos = SIZE_MAX);

/// Throws InputError if options exclude each other, or exclude several ranks.
void check_training(const TrainOptions& options, int ranks = 1);

/// The request for the plan of a run's training frames. masks: some training images have pixels that do not count. photos: for
/// training. cut: some training images are cut out by their alpha.
pipeline::PlanRequest plan_request(const Gaussians& start, const TrainOptions& options, bool masks,
                                   size_t photos = SIZE_MAX, bool cut = false);

}  // namespace ewa::train
