// SPDX-License-Identifier: Apache-2.0
// The options of a training.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "ewa/appearance.h"
#include "ewa/loss_weights.h"
#include "ewa/render_options.h"

namespace ewa {

/// How the number of splats changes during training.
enum class Strategy {
    none,      // the number stays
    adc,       // adaptive density control of 3DGS: splats are cloned, split and pruned
    mcmc,      // 3DGS-MCMC: dead splats are relocated, and the number grows to max_splats
    automatic  // strategy_for(steps); adc if an option of adc is set
};

/// The strategy, adc or mcmc, that gives better images after this many steps (docs/experiments/growth.md).
Strategy strategy_for(int steps);

/// TrainOptions::sh_degree: 3, or 0 if the dataset says that no colour depends on the view.
inline constexpr int kAutomaticShDegree = -1;

/// `TrainOptions::halvings`: 1 in short runs of adc with many training images, for their first hundred steps, else 0
/// (docs/training_options.md#resolution). This automatic choice also replaces a resolution_every that has its default.
inline constexpr int kAutomaticHalvings = -1;

/// TrainOptions::max_splats: splat_cap() of ewa/training_needs.h chooses it.
inline constexpr uint32_t kAutomaticMaxSplats = 0;

/// TrainOptions::final_splats: two thirds of max_splats, but no fewer than the first splats, in a run of mcmc that has fewer than 30,000
/// steps and an automatic max_splats. All others keep all splats (docs/experiments/growth.md#fewer-splats-at-the-end).
inline constexpr uint32_t kAutomaticFinalSplats = UINT32_MAX;

/// Options of a Trainer. Learning rates are those of Adam. Lengths are in world units. "Scene extent" is
/// scene_extent() of ewa/dataset.h, or the median distance of the start's splats if all cameras coincide.
struct TrainOptions {
    int steps = 30000;  // number of views to train on; an optimisation step takes `batch` of them
    /// Views of an optimisation step, at least 1. Their gradients are averaged. Rates and Adam's decays follow the square root rule of
    /// Grendel (Zhao et al. 2024, section 3.3): rates times sqrt(batch), decays to the power of batch.
    int batch = 1;
    /// Bands of tile rows that each view is cut into, at least 1, so that several ranks can draw one view. An image needs
    /// a row of tiles for each.
    int bands = 1;
    Strategy strategy = Strategy::mcmc;
    uint32_t max_splats = kAutomaticMaxSplats;  // hard limit
    /// The most splats in the last quarter of the run: those with the largest weight at any pixel of a training image. 0: all.
    uint32_t final_splats = kAutomaticFinalSplats;
    int sh_degree = 3;               // 0 to 3, or kAutomaticShDegree
    uint64_t seed = 0;               // the same seed on the same device gives the same bytes
    bool random_background = false;  // a new background colour each step
    /// Each step adds random numbers to the background, one for each channel, from an interval of this width around 0. Transparent
    /// pixels then cost loss, so training makes images opaque. Not with random_background or sky.
    double background_noise = 0;
    /// Learns a SkyMap in place of the background. Not with refine_poses.
    bool sky = false;
    double sky_rate = 0.02, sky_rate_final = 0.002;
    /// Device memory for decoded training images, in bytes. Images beyond it are read again for each step.
    uint64_t image_cache_bytes = uint64_t(4) << 30;
    /// The most device memory of a training, in bytes. 0: no limit. Splats that do not fit stay in host memory and are on the
    /// device while a step uses them. The limit does not change the result's bytes.
    uint64_t device_memory_bytes = 0;
    /// Bits of each of Adam's two moments, 16 or 32. With 16 a splat needs a third less memory.
    int moment_bits = 16;
    RenderOptions render{};  // of training and evaluation
    LossWeights loss{};

    // Learning rates of 3DGS (arguments/__init__.py). Those of the means are per unit of scene extent.
    double means_rate = 1.6e-4, means_rate_final = 1.6e-6;
    double sh0_rate = 2.5e-3, sh_rest_rate = 1.25e-4;
    double opacity_rate = 0.025;
    double scale_rate = 5e-3, quaternion_rate = 1e-3;
    /// A run of fewer than 30,000 steps has higher rates. Their factor is (30,000 / steps)^short_run_power at the start. At
    /// the end it is the square root of that (src/train/schedule.h). 0: the rates of a full run.
    double short_run_power = 0.5;

    /// With at most so many training images, adc and none are regularised, unless poses are refined. The rates of such a run fade
    /// if it has fewer than 30,000 steps and uses each image 60 times or more.
    int few_photos = 16;

    /// Learns the appearance of each training image (docs/training_options.md).
    AppearanceModel appearance = AppearanceModel::none;
    double exposure_rate = 0.01, exposure_rate_final = 0.001;  // of affine
    double appearance_rate = 0.002;                            // of ppisp and grid, per step of a full run
    /// Starts ppisp from exposures that points or EXIF give. A trainer that is restored needs none.
    bool measure_exposures = true;

    // Cameras.
    bool refine_poses =
        false;  // learns a rotation and a translation for each training camera, which start at 0
    bool refine_focal = false;  // with refine_poses: also a factor of its focal lengths, which starts at 1
    double pose_rate = 5e-3, pose_rate_final = 5e-5;  // radians by which a step moves the points of the image

    /// A box in world coordinates: x, y, z of its low corner, then of its high one. Only splats whose mean is in it are cloned, split
    /// or copied. Not with Strategy::none.
    std::optional<std::array<double, 6>> region{};

    // Adaptive density control. Steps are those of a 30,000 step run; a shorter run scales them
    // (src/train/schedule.h).
    int refine_start = 500, refine_stop = 15000, refine_every = 100;
    int opacity_reset_every = 3000;  // 0: never
    int sh_degree_every = 1000;      // the SH degree rises by one this often
    /// Times that the images are halved in size at the start; or kAutomaticHalvings.
    int halvings = 0;
    int resolution_every = 3000;  // the steps after which width and height double
    /// For a run that continues one of another number of steps, and keeps the SH degree and resolution that it reached.
    int least_sh_degree = 0, most_halvings = 64;
    /// An automatic max_splats of a run that continues another is at least this.
    uint32_t least_max_splats = 0;
    double grow_gradient = 2e-4;  // mean norm of dL/d(mean in normalised device coordinates)
    /// Uses the sum of the pixels' absolute gradients, which do not cancel (AbsGS), and their own threshold.
    bool absolute_gradients = false;
    double grow_gradient_absolute = 8e-4;  // threshold with absolute_gradients, as in gsplat
    double split_scale = 0.01;             // larger splats are split, others cloned; share of scene extent
    double prune_opacity = 0.005;
    double prune_scale = 0.1;  // share of scene extent; used after the first opacity reset

    // 3DGS-MCMC (Kheradmand et al. 2024), with the values of its code and of gsplat. It shares refine_start
    // and refine_every.
    int relocate_stop = 25000;
    double growth = 1.05;  // factor of the number of splats at each refinement, up to max_splats.
    /// Distance of a copy from its source, in standard deviations, in the limit of a run of 0 steps. It falls linearly to 0 for runs
    /// of 30,000 steps, in which noise has time to separate copies (src/train/schedule.h).
    double copy_spread = 1;
    double dead_opacity = 0.005;
    double noise_rate = 5e5;  // times the means' learning rate
    // Regularisers, also of adc and none with few photos.
    double opacity_weight = 0.01;  // weight of the mean opacity
    double scale_weight = 0.01;    // weight of the mean scale, in units of scene extent
};

}  // namespace ewa
