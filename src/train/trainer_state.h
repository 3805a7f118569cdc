// SPDX-License-Identifier: Apache-2.0
// What a trainer holds, and its steps.
#pragma once
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "ewa/trainer.h"
#include "gpu/executor.h"
#include "pipeline/backward.h"
#include "pipeline/frame_buffers.h"
#include "pipeline/strategy.h"
#include "portions/portions.h"
#include "portions/step.h"
#include "train/image_cache.h"
#include "train/schedule.h"

namespace ewa {
namespace train {

/// What rank 0 asks the others to take part in.
enum class Call : uint64_t { end, wait, step, state, restore, gaussians, render, figures };

}  // namespace train

struct Trainer::State {
    std::shared_ptr<gpu::Device> device;
    std::shared_ptr<Ranks> ranks;
    TrainOptions options;
    train::Schedule schedule;
    double extent;
    passes::PassCache cache;
    gpu::Executor executor;
    train::ImageCache images;
    const pipeline::Plan plan;
    portions::Portions portions;
    portions::Step several;  // steps of several pictures or portions
    pipeline::FrameBuffers frame;
    std::vector<train::ImageCache> smaller;  // by downsample level, from 1; freed after its last step
    pipeline::Exposures exposures;
    pipeline::Motions motions;
    uint32_t instance_capacity;
    /// A step that is submitted and not finished.
    struct Flight {
        int step;
        double weight;  // of its image's pixels
    };
    std::deque<Flight> in_flight;
    StepReport report;
    StepTimes times;  // sums, over `timed_steps` steps for the passes
    int timed_steps = 0;
    uint64_t most_own_bytes = 0;  // of the state that this rank has held after a step

    State(std::shared_ptr<gpu::Device> d, const Dataset& dataset, const std::vector<int>& frames,
          const Gaussians& ready, double length, const TrainOptions& o, std::shared_ptr<Ranks> r,
          int portions_of_rank);

    /// Whether a step has one picture of one portion: one kernel then gathers its gradients and moves the splats.
    bool fused() const { return portions.alone() && options.batch == 1 && options.bands == 1; }

    /// Rank 0 begins what all ranks do together.
    void call(train::Call what) const;
    /// The other ranks receive what rank 0 begins.
    train::Call next_call() const;
    pipeline::Rates rates(int step) const;
    pipeline::Noise noise(int step) const;

    /// The training images at this step's resolution. Frees those of lower resolutions: resolutions only rise.
    train::ImageCache& images_at(int step);

    /// What a step needs of the frame's buffers.
    pipeline::FrameRequest request_of(const pipeline::CameraUse& camera) const;
    /// How often the step's image has been seen then.
    uint32_t visit_of(int step) const { return uint32_t(size_t(step - 1) / images.count() + 1); }

    /// All that changes from step to step is a pure function of the step's number: a step can be repeated.
    void record_fused(gpu::Recording& recording, int step, size_t index, const portions::StepView& view);

    /// Submits a step. Afterwards at most frames_in_flight steps are in flight.
    void submit(int step);

    /// Where steps overlap, the queries between the commands would cost time.
    bool is_timed(int step) const;
    uint32_t slot_of(int step) const { return uint32_t(step) % cache.config().frames_in_flight; }

    /// Waits for the oldest step. If it had too many instances, neither it nor later ones have changed the model: they are
    /// all repeated, one by one, with more capacity.
    void finish_oldest();
    void add_pass_times();
    void finish_all();

    /// Whether something happens after a step that needs its result.
    bool must_finish(int step) const;
    portions::StepView view_of(int step, train::ImageCache& seen, int sh_degree);

    /// An optimisation step. Each of its views is a step of the schedule.
    void optimise(int first, int last);
    void optimise_several(int first, int last);
    portions::StepParts step_parts();

    /// The picture through the camera of this rank's number; without pixels if there is none. Collective.
    Image render_own(std::span<const Camera> cameras);
    void follow_up(int step);
    void control_density(int step);

    /// refine: changes the numbers of the portions' splats.
    void refine(const std::function<void(const pipeline::Phase&)>& refine);
};

}  // namespace ewa
