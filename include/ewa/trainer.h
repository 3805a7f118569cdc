// SPDX-License-Identifier: Apache-2.0
// From photographs to splats.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/device.h"
#include "ewa/exposure.h"
#include "ewa/gaussians.h"
#include "ewa/render_options.h"
#include "ewa/renderer.h"

namespace ewa {

enum class Strategy { none, adc, mcmc };

/// Which of adc and mcmc makes the better pictures in so many steps (docs/training.md has the measurements).
Strategy strategy_for(int steps);

struct TrainOptions {
    int steps = 30000;
    Strategy strategy = Strategy::mcmc;
    uint32_t max_splats = 1000000;  // hard cap
    int sh_degree = 3;
    uint64_t seed = 0;
    bool random_background = false;
    uint64_t image_cache_bytes = uint64_t(4)
                                 << 30;  // decoded photographs held; the others are read again each time
    RenderOptions render;                // background, kernel

    // Learning rates of 3DGS (arguments/__init__.py); means are per unit of scene extent.
    double means_rate = 1.6e-4, means_rate_final = 1.6e-6;
    double sh0_rate = 2.5e-3, sh_rest_rate = 1.25e-4;
    double opacity_rate = 0.025;
    double scale_rate = 5e-3, quaternion_rate = 1e-3;
    /// What the rates of means and of SH above degree 0 are multiplied with in a run of no length; in a full
    /// one they are as above (src/train/schedule.h). Not with mcmc, whose noise goes by the means' rate.
    double short_run_gain = 2;

    bool exposure = false;  // each photograph's exposure is learned too, from the identity
    double exposure_rate = 0.01, exposure_rate_final = 0.001;

    // Adaptive density control, in steps of a 30,000 step run; a shorter run scales them
    // (src/train/schedule.h).
    int refine_start = 500, refine_stop = 15000, refine_every = 100;
    int opacity_reset_every = 3000;
    int sh_degree_every = 1000;
    int halvings = 0;  // of the resolution at the start, each undone resolution_every steps later
    int resolution_every = 3000;
    double grow_gradient = 2e-4;  // mean norm of dL/d(mean in normalised device coordinates)
    bool absolute_gradients =
        false;  // the norm of the pixels' absolute gradients, which do not cancel (AbsGS)
    double grow_gradient_absolute = 8e-4;  // the threshold then (gsplat's)
    bool revised_opacity = false;          // a split's children are together as opaque as their parent
    double split_scale = 0.01;             // larger than this share of the scene extent: split, else clone
    double prune_opacity = 0.005;
    double prune_scale = 0.1;  // share of the scene extent, once opacity has been reset

    // 3DGS-MCMC (Kheradmand et al. 2024, with the values of its code and gsplat's). It shares refine_start
    // and refine_every.
    int relocate_stop = 25000;
    double growth = 1.05;    // of the number of splats a refinement, up to max_splats
    double copy_spread = 1;  // standard deviations that copies start apart in a run of no length; none in a
                             // full one, where noise has the time to part them (src/train/schedule.h)
    double dead_opacity = 0.005;
    double noise_rate = 5e5;       // times the learning rate of the means
    double opacity_weight = 0.01;  // of the mean opacity in the loss
    double scale_weight = 0.01;    // of the mean scale in the loss, in units of the scene extent
};

struct EvalFrame {
    std::string name;
    double psnr = 0, ssim = 0;
};
struct Evaluation {
    double psnr = 0, ssim = 0;  // means over frames
    std::vector<EvalFrame> frames;
    double seconds = 0;
};

/// Renders each frame and compares it with its photograph, both clamped to [0, 1], over the pixels that
/// count. A frame in which none does is left out. exposures: of each of the frames, or none. before_frame: is
/// called before each; what it throws ends the evaluation.
Evaluation evaluate(std::shared_ptr<gpu::Device> device, const Gaussians& gaussians, const Dataset& dataset,
                    const std::vector<int>& frames, const RenderOptions& options,
                    const std::vector<Exposure>& exposures = {},
                    const std::function<void()>& before_frame = {});

/// Device memory that a run is going to take at most, in bytes.
struct MemoryForecast {
    uint32_t splats = 0;       // that it is for
    uint64_t model = 0;        // parameters, moments, statistics; twice where a new generation is written
    uint64_t frame = 0;        // pictures, sorting, gradient slots: at the (splat, tile) pairs of most scenes
    uint64_t photographs = 0;  // as many as image_cache_bytes holds
    uint64_t total() const { return model + frame + photographs; }
};
MemoryForecast forecast_memory(const gpu::Device& device, const Dataset& dataset,
                               const std::vector<int>& train_frames, const Gaussians& start,
                               const TrainOptions& options);

/// What a Trainer of these options skips. masks: some training images have pixels that do not count.
std::vector<PlanLine> plan_lines(const Gaussians& start, const TrainOptions& options, bool masks = false);

struct StepReport {
    int step = 0;        // steps done
    double seconds = 0;  // of training alone
    double loss = 0;     // of the last step
    uint32_t splats = 0;
    uint64_t dropped_updates = 0;    // parameter updates that were not finite, dropped
    uint32_t skipped_nonfinite = 0;  // splats skipped in the last step
    uint64_t limited_steps = 0;      // steps of a mean, quaternion or scale that were shortened
};

/// What the steps to come depend on, besides the dataset, its training frames and the options.
struct TrainerArray {
    std::string name;  // at most 15 bytes
    std::vector<std::byte> bytes;
};
struct TrainerState {
    StepReport report;
    int sh_degree = 0;  // stored
    std::vector<TrainerArray>
        arrays;  // params, moments1, moments2 and what the strategy gathers, as on the device
};

/// Owns the model on the device and the photographs of the training frames, as many as image_cache_bytes
/// holds (a file with 256 levels takes 4 bytes a pixel, another 16). One step is one submission.
class Trainer {
  public:
    Trainer(std::shared_ptr<gpu::Device> device, const Dataset& dataset, const std::vector<int>& train_frames,
            const Gaussians& start, const TrainOptions& options);
    ~Trainer();

    /// One optimisation step, and densification where the schedule has it. Throws RunError when memory runs
    /// out (the text says how much was needed).
    StepReport step();

    /// For a later run to go on from: a trainer of the same dataset, frames, options and device that restores
    /// the state takes the same steps, to the byte, as this one. restore throws InputError where the state is
    /// not that of such a trainer.
    TrainerState state() const;
    void restore(const TrainerState& state);

    Gaussians gaussians() const;  // read back from the device; in the trainer's own order, not the start's
    uint32_t splats() const;
    int steps_done() const;
    std::vector<Exposure> exposures() const;   // of the training frames, where they are learned; else none
    size_t photographs_on_disk() const;        // that the cache has no room for
    std::vector<PlanLine> plan() const;        // what the run skips
    std::vector<PassTime> pass_times() const;  // medians over the last steps, in recording order

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace ewa
