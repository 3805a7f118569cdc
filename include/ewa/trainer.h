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

#include "ewa/appearance.h"
#include "ewa/camera_motion.h"
#include "ewa/dataset.h"
#include "ewa/device.h"
#include "ewa/gaussians.h"
#include "ewa/ranks.h"
#include "ewa/renderer.h"
#include "ewa/sky_map.h"
#include "ewa/splat_edit_request.h"
#include "ewa/step_report.h"
#include "ewa/summary.h"
#include "ewa/train_options.h"
#include "ewa/training_needs.h"

namespace ewa {

namespace train {
class StateWriter;
class StateReader;
class Training;
}  // namespace train

/// Owns the model and the cached training images on the device. A cached image takes 4 bytes a pixel if its
/// file has at most 256 levels, else 16. Each step is one submission. On a GPU, step() may return before the device is done;
/// all other functions wait for it.
class Trainer {
  public:
    /// train_frames: indices into dataset.frames. start: the first splats, at most options.max_splats unless that is automatic.
    /// Pass an rvalue to spare a copy of them. Throws InputError (no frame or one that the dataset lacks, no or too many
    /// splats, arrays of a wrong length, an image that cannot be read), RunError (memory).
    /// ranks: the processes that train together. Each makes a trainer with the same arguments, and stores a share of the
    /// splats. Rank 0 calls the functions below; all others call only follow(). The results do not depend on the number of ranks.
    Trainer(std::shared_ptr<gpu::Device> device, const Dataset& dataset, const std::vector<int>& train_frames,
            Gaussians start, const TrainOptions& options, std::shared_ptr<Ranks> ranks = alone());
    ~Trainer();

    /// For a rank other than 0: does its part of each function that rank 0 calls, until the trainer of rank 0 ends. Throws as
    /// those functions do.
    void follow();
    /// Sends a sign of life to ranks that wait for the next call. Call it at least once within the time limit of the ranks.
    void keep_waiting() const;

    /// Does one optimisation step, and changes the number of splats if the schedule says so. Throws InputError
    /// before the step if its image cannot be read, RunError if memory runs out (with the size needed).
    /// After a RunError the trainer cannot be used any more.
    StepReport step();

    /// The state after the last step. A trainer of the same dataset, frames, options and device that restores
    /// it takes the same steps, byte for byte.
    TrainerState state() const;
    /// Sets the state. Throws InputError if it does not fit this trainer, which then keeps its own.
    void restore(const TrainerState& state);
    /// state() and restore() in pieces, for checkpoints (train/state_stream.h). If reading fails, the trainer cannot be used any more.
    void save(train::StateWriter& to) const;
    void restore(train::StateReader& from);

    /// Edits the splats after the last step. The others keep their values, Adam's moments and statistics. Takes host memory for a
    /// state(). A trainer that restores the state() after an edit takes the same steps. Throws InputError, before any change,
    /// for an index that is too large, or if too few splats would be left.
    EditCounts edit(const SplatEdit& edit);
    uint32_t frozen_splats() const;
    /// Whether each splat of gaussians() is frozen. Empty if none is.
    std::vector<bool> frozen() const;

    /// The splats, read back from the device, in the dataset's world frame. Their order is the trainer's own.
    Gaussians gaussians() const;
    /// Renders without learned appearances, as a Renderer of gaussians() draws them: RGB, one for each camera. Every rank draws some
    /// of them. Throws InputError if the splats are points.
    std::vector<Image> render(std::span<const Camera> cameras) const;
    uint32_t splats() const;
    uint32_t max_splats() const;    // the number that was chosen if TrainOptions::max_splats is automatic
    uint32_t final_splats() const;  // the same of TrainOptions::final_splats; 0: all splats stay
    int steps_done() const;
    StepReport report() const;                         // of the last step, once the device has finished it
    std::vector<Exposure> exposures() const;           // one for each training frame; empty if not learned
    std::vector<Appearance> appearances() const;       // learned, of any model; one for each training frame
    std::vector<CameraMotion> camera_motions() const;  // one for each training frame; empty if not learned
    std::shared_ptr<const SkyMap> sky() const;         // null if not learned
    size_t images_on_disk() const;                     // training images that are not cached
    double extent() const;                             // the length that rates are relative to, world units
    std::vector<PlanLine> plan() const;                // the work that the run skips
    StepTimes step_times() const;
    std::vector<RankFigures> rank_figures() const;      // of every rank; empty for one that is alone
    std::optional<ChunkFigures> chunk_figures() const;  // empty if all splats stay on the device

  private:
    std::unique_ptr<train::Training> training_;
};

}  // namespace ewa
