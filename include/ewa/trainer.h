// SPDX-License-Identifier: Apache-2.0
// Training step by step. ewa/run.h runs a whole training and writes its files.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ewa/camera_motion.h"
#include "ewa/dataset.h"
#include "ewa/device.h"
#include "ewa/exposure.h"
#include "ewa/gaussians.h"
#include "ewa/ranks.h"
#include "ewa/renderer.h"
#include "ewa/summary.h"
#include "ewa/train_options.h"

namespace ewa {

namespace train {
class StateWriter;
class StateReader;
}  // namespace train

/// The options with concrete values for Strategy::automatic and kAutomaticShDegree.
TrainOptions resolve(TrainOptions options, const Dataset& dataset);

/// The largest number of splats of a training, and why it is that.
struct SplatCap {
    uint32_t splats = 0;
    std::string reason;  // e.g. "100 more for each step"
};

/// TrainOptions::max_splats of a Trainer with the same arguments. docs/training.md has the rule of the automatic one.
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

/// Estimates the memory of a Trainer with the same arguments. Allocates nothing.
MemoryEstimate estimate_memory(const gpu::Device& device, const Dataset& dataset,
                               const std::vector<int>& train_frames, const Gaussians& start,
                               const TrainOptions& options);

/// What a Trainer of these options skips if it has many photos. masks: some training images have pixels that do not count.
std::vector<PlanLine> plan_lines(const Gaussians& start, const TrainOptions& options, bool masks = false);

struct StepReport {
    int step = 0;        // steps done
    double seconds = 0;  // wall time in Trainer::step so far
    double loss = 0;     // of the last step that the device has finished; a GPU may be a step behind
    uint32_t splats = 0;
    uint64_t dropped_updates = 0;    // parameter updates so far that were not finite and were dropped
    uint32_t skipped_nonfinite = 0;  // splats skipped in the last step: a value is not finite
    uint64_t limited_steps = 0;      // updates of a mean, quaternion or scale so far that were shortened
    /// dB, of the image that `loss` is of. In a masked image, pixels count by the square of their weight. NaN if no
    /// pixel counts.
    double psnr = 0;
};

/// Where the time of the steps since the trainer was made or restored went: means, in ms a step.
struct StepTimes {
    int steps = 0;
    double step = 0;               // wall time in Trainer::step
    double refinement = 0;         // of it: adding, moving and removing splats
    std::vector<PassTime> passes;  // on the device, in recording order. On a GPU they are of every 100th step
};

/// One device buffer of a TrainerState.
struct TrainerArray {
    std::string name;  // at most 15 bytes
    std::vector<std::byte> bytes;
};

/// All that later steps depend on, besides dataset, training frames and options.
struct TrainerState {
    StepReport report;
    int sh_degree = 0;  // of the stored coefficients
    /// params, moments1, with 32 bits a moment also moments2, and what the strategy gathers, in the device's layout
    /// (shaders/shared/layouts.h).
    std::vector<TrainerArray> arrays;
};

/// Owns the model and the cached training images on the device. A cached image takes 4 bytes a pixel if its
/// file has at most 256 levels, else 16. Each step is one submission. On a GPU, step() may return before the device is done;
/// all other functions wait for it.
class Trainer {
  public:
    /// train_frames: indices into dataset.frames. start: the first splats, at most options.max_splats unless that is automatic.
    /// Pass an rvalue to spare a copy of them. Throws InputError (no frame, no or too many splats, an image that cannot be read), RunError (memory).
    /// ranks: the processes that train together. Each makes a trainer of the same arguments, and holds a share of the
    /// splats. Rank 0 calls the functions below; all others call follow() alone. The results do not depend on the number
    /// of ranks.
    Trainer(std::shared_ptr<gpu::Device> device, const Dataset& dataset, const std::vector<int>& train_frames,
            Gaussians start, const TrainOptions& options, std::shared_ptr<Ranks> ranks = alone());
    ~Trainer();

    /// For a rank other than 0: does its part of what rank 0 calls, until the trainer of rank 0 ends. Throws what those
    /// functions throw.
    void follow();
    /// Tells ranks that wait for the next call that this one is at work. Call it at least once in the time that the ranks
    /// were opened with.
    void keep_waiting() const;

    /// Does one optimisation step, and changes the number of splats if the schedule says so. Throws InputError
    /// before the step if its image cannot be read, RunError if memory runs out (with the size needed).
    /// After a RunError the trainer is of no more use.
    StepReport step();

    /// The state after the last step. A trainer of the same dataset, frames, options and device that restores
    /// it takes the same steps, byte for byte.
    TrainerState state() const;
    /// Throws InputError if the state does not fit this trainer; the trainer then stays as it was.
    void restore(const TrainerState& state);
    /// The same for checkpoints, in pieces (train/state_stream.h). If reading fails, the trainer is of no more use.
    void save(train::StateWriter& to) const;
    void restore(train::StateReader& from);

    /// The splats, read back from the device. Their order is the trainer's own.
    Gaussians gaussians() const;
    /// Pictures of the splats as they are, without exposures: those that a Renderer of gaussians() draws. Every rank draws
    /// some of them. Throws InputError if the splats are points.
    std::vector<Image> render(std::span<const Camera> cameras) const;
    uint32_t splats() const;
    uint32_t max_splats() const;  // the number that was chosen if TrainOptions::max_splats is automatic
    int steps_done() const;
    StepReport report() const;                         // of the last step, once the device has finished it
    std::vector<Exposure> exposures() const;           // one for each training frame; empty if not learned
    std::vector<CameraMotion> camera_motions() const;  // one for each training frame; empty if not learned
    size_t images_on_disk() const;                     // training images that are not cached
    double extent() const;                             // the length that rates are relative to, world units
    std::vector<PlanLine> plan() const;                // what the run skips
    StepTimes step_times() const;
    std::vector<RankFigures> rank_figures() const;      // of every rank; empty for one that is alone
    std::optional<ChunkFigures> chunk_figures() const;  // empty if all splats stay on the device

  private:
    struct State;

    StepReport take_step();
    void join_state(train::StateWriter* to) const;
    void share_state(train::StateReader* from);
    Gaussians join_gaussians() const;
    std::vector<Image> join_renders(std::span<const Camera> cameras) const;
    std::vector<RankFigures> join_figures() const;

    std::unique_ptr<State> state_;
};

}  // namespace ewa
