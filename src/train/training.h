// SPDX-License-Identifier: Apache-2.0
// What a trainer holds, and its steps. All functions that are collective say so: every rank calls them.
#pragma once
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/ranks.h"
#include "ewa/step_report.h"
#include "ewa/summary.h"
#include "ewa/train_options.h"
#include "gpu/executor.h"
#include "pipeline/appearances.h"
#include "pipeline/backward.h"
#include "pipeline/frame_buffers.h"
#include "pipeline/sky.h"
#include "pipeline/strategy.h"
#include "portions/portions.h"
#include "portions/step.h"
#include "train/image_cache.h"
#include "train/schedule.h"
#include "train/state_stream.h"

namespace ewa::train {

/// What records and submits a frame.
struct FrameTools {
    passes::PassCache cache;
    gpu::Executor executor;
    pipeline::FrameBuffers frame;
    uint32_t instance_capacity = 0;

    explicit FrameTools(gpu::Device& device)
        : cache(device), executor(device, cache.config().frames_in_flight) {}
    uint32_t frames_in_flight() const { return cache.config().frames_in_flight; }
};

/// What a training learns besides the splats. All ranks have the same. A table that is not learned is empty.
struct Learned {
    pipeline::Appearances appearances;
    pipeline::Motions motions;
    pipeline::LearnedSky sky;

    std::vector<pipeline::LearnedTable::Array> arrays();  // of a state

    /// What a step learns of a view, for other ranks. photo: its training image. slot: its number in the step.
    size_t words_of_view() const;
    std::vector<uint64_t> words(uint32_t photo, uint32_t slot) const;
    void set(uint32_t photo, uint32_t slot, std::span<const uint64_t> words);
};

/// What the steps have done and how long they took.
struct StepLog {
    StepReport report;
    StepTimes times;  // sums, over `timed_steps` steps for the passes
    int timed_steps = 0;
    uint64_t most_own_bytes = 0;  // of the state that this rank has held after a step

    void add(const portions::StepSums& sums);
    void add_passes(const std::vector<PassTime>& timings);
    StepTimes means() const;
};

/// A ball that has all cameras of the training in it, world units.
struct CameraBall {
    glm::dvec3 middle{0};
    double radius = 0;
};

class Training {
  public:
    /// ready: prepared splats. extent: Trainer::extent. options: with concrete values.
    Training(std::shared_ptr<gpu::Device> device, const Dataset& dataset, const std::vector<int>& frames,
             const Gaussians& ready, double extent, const TrainOptions& options, std::shared_ptr<Ranks> ranks,
             int portions_of_rank);
    ~Training();
    Training(const Training&) = delete;
    Training& operator=(const Training&) = delete;

    gpu::Device& device() const { return *device_; }
    const TrainOptions& options() const { return options_; }
    double extent() const { return extent_; }
    const pipeline::Plan& plan() const { return plan_; }
    portions::Portions& portions() { return portions_; }
    size_t images_on_disk() const { return images_.full().on_disk(); }
    const StepLog& log() const { return log_; }
    Learned& learned() { return learned_; }

    /// An optimisation step, and what the schedule does after it. Collective.
    StepReport step();
    /// Waits for all steps.
    void finish_all();

    /// Rank 0 writes the state or reads it; the others pass null. Collective.
    void save(StateWriter* to);
    void restore(StateReader* from);
    /// Throws InputError if the state is not one of this training.
    void check_fits(StateReader& from);
    /// Collective. Only rank 0 gets a result.
    Gaussians gaussians();
    std::vector<Image> render(std::span<const Camera> cameras);
    std::vector<RankFigures> rank_figures() const;
    std::optional<ChunkFigures> chunk_figures() const;

  private:
    /// A step that is submitted and not finished.
    struct Flight {
        int step;
        double weight;  // of its image's pixels
    };

    /// Whether a step draws one part of a view, of one portion: one kernel then gathers its gradients and moves the splats.
    bool fused() const { return portions_.alone() && options_.batch == 1 && options_.bands == 1; }
    pipeline::Rates rates(int step) const;
    pipeline::Noise noise(int step) const;
    /// The training images at this step's resolution.
    ImageCache& images_at(int step);
    size_t index_of(int step) const { return frame_of_step(step, images_.count(), options_.seed); }
    /// How often the step's image has been seen then.
    uint32_t visit_of(int step) const { return uint32_t(size_t(step - 1) / images_.count() + 1); }
    /// What a step needs of the frame's buffers.
    pipeline::FrameRequest request_of(const pipeline::CameraUse& camera) const;
    /// slot: of the view in the step.
    portions::StepView view_of(int step, ImageCache& seen, int sh_degree, uint32_t slot = 0);
    /// What is learned of all views of a step together. Every rank has their gradients.
    void update_learned(int first, int last);
    void record_update_sky(const passes::Recorder& on, int first, int last, uint32_t capacity);
    /// The sky that is drawn.
    pipeline::SkyUse sky() const { return plan_.sky ? learned_.sky.use() : pipeline::SkyUse{}; }

    /// All that changes from step to step is a pure function of the step's number: a step can be repeated.
    void record_fused(gpu::Recording& recording, int step, size_t index, const portions::StepView& view);
    /// Submits a step. Afterwards at most frames_in_flight steps are in flight.
    void submit(int step);
    /// A GPU compiles the kernels of the next SH degree while it works at this one.
    void compile_next_degree(int step, size_t index, ImageCache& seen);
    /// Waits for the oldest step. If it had too many instances, neither it nor later ones have changed the model: they are
    /// all repeated, one by one, with more capacity.
    void finish_oldest();
    /// Where steps overlap, the queries between the commands would cost time.
    bool is_timed(int step) const;
    uint32_t slot_of(int step) const { return uint32_t(step) % tools_.frames_in_flight(); }
    /// Whether something happens after a step that needs its result.
    bool must_finish(int step) const;

    /// Each of the views is a step of the schedule.
    void optimise(int first, int last);
    void optimise_several(int first, int last);
    portions::StepParts step_parts();
    /// The image through the camera of this rank's number; without pixels if there is none.
    Image render_own(std::span<const Camera> cameras);

    void follow_up(int step);
    void control_density(int step);
    /// Removes splats down to final_splats.
    void prune(int step);
    /// refine: changes the numbers of the portions' splats.
    void refine(const std::function<void(const pipeline::Phase&)>& refine);

    std::shared_ptr<gpu::Device> device_;
    TrainOptions options_;
    Schedule schedule_;
    double extent_;
    CameraBall cameras_;
    FrameTools tools_;
    ImageLevels images_;
    const pipeline::Plan plan_;
    portions::Portions portions_;
    portions::Step several_;  // steps of several parts of views, or portions
    Learned learned_;
    std::deque<Flight> in_flight_;
    StepLog log_;
    int compiled_degree_ = -1;  // the highest SH degree whose kernels were asked for
};

}  // namespace ewa::train
