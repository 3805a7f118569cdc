// SPDX-License-Identifier: Apache-2.0
// The parts of a training: splats, images, tables and tools. Steps, refinements, and functions of the state use them.
#pragma once
#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "ewa/dataset.h"
#include "ewa/ranks.h"
#include "ewa/step_report.h"
#include "ewa/train_options.h"
#include "gpu/executor.h"
#include "pipeline/appearances.h"
#include "pipeline/backward.h"
#include "pipeline/frame_buffers.h"
#include "pipeline/sky.h"
#include "portions/portions.h"
#include "portions/step.h"
#include "train/image_cache.h"
#include "train/schedule.h"

namespace ewa::train {

/// The compiled passes, queue and buffers with which a training records and submits frames.
struct FrameTools {
    passes::PassCache cache;
    gpu::Executor executor;
    pipeline::FrameBuffers frame;
    uint32_t instance_capacity = 0;
    bool limited;  // portions of splats and the frame share the limited device memory

    FrameTools(gpu::Device& device, bool limited_memory)
        : cache(device), executor(device, cache.config().frames_in_flight), limited(limited_memory) {}
    uint32_t frames_in_flight() const { return cache.config().frames_in_flight; }
    /// Raises the instance capacity to a first guess for this many splats. With limited memory the guess is that for no splats,
    /// since more might not fit. The first frame then counts the instances.
    void expect(size_t splats) {
        instance_capacity = std::max(instance_capacity, pipeline::first_capacity(limited ? 0 : splats));
    }
    /// With limited memory, frees the frame's buffers for other uses. The next step allocates a frame again.
    void leave_room() {
        if (limited) frame = {};
    }
};

/// The tables that a training learns besides the splats. All ranks have equal tables. A table that is not learned is empty.
struct Learned {
    pipeline::Appearances appearances;
    pipeline::Motions motions;
    pipeline::LearnedSky sky;

    std::vector<pipeline::LearnedTable::Array> arrays();  // the tables' arrays in a checkpoint

    /// The results of one view of a step, which a rank sends to the others. photo: the view's training image. slot: its number in
    /// the step.
    size_t words_of_view() const;
    std::vector<uint64_t> words(uint32_t photo, uint32_t slot) const;
    void set(uint32_t photo, uint32_t slot, std::span<const uint64_t> words);
};

/// Reports and times of the steps so far.
struct StepLog {
    StepReport report;
    StepTimes times;  // sums, over `timed_steps` steps for the passes and `host_steps` for the host
    int timed_steps = 0, host_steps = 0;
    uint64_t most_own_bytes = 0;  // largest state of this rank after a step

    void add(const portions::StepSums& sums);
    void add_passes(const std::vector<PassTime>& timings);
    StepTimes means() const;
};

struct TrainingParts {
    std::shared_ptr<gpu::Device> device;
    TrainOptions options;
    Schedule schedule;
    double extent;
    FrameTools tools;
    ImageLevels images;
    const pipeline::Plan plan;
    portions::Portions portions;
    portions::Step several;  // steps of several parts of views, or portions
    Learned learned;
    StepLog log;
    uint32_t frozen = 0;  // splats of all ranks (train/state_edit.h)

    /// The parts of a training. resolved: options without automatic values. portions_of_rank: number of portions of each rank.
    TrainingParts(std::shared_ptr<gpu::Device> on, const Dataset& dataset, const std::vector<int>& frames,
                  const Gaussians& ready, double extent_of_cameras, const TrainOptions& resolved,
                  std::shared_ptr<Ranks> ranks, int portions_of_rank);
    ~TrainingParts();
    TrainingParts(const TrainingParts&) = delete;
    TrainingParts& operator=(const TrainingParts&) = delete;

    /// Whether a step has one whole view, and one rank with one portion of splats. One kernel then sums the gradients and updates
    /// the splats.
    bool fused() const { return portions.alone() && options.batch == 1 && options.bands == 1; }
    /// The training images at this step's resolution.
    ImageCache& images_at(int step) { return images.at(size_t(schedule.halvings_at(step))); }
    size_t index_of(int step) const { return frame_of_step(step, images.count(), options.seed); }
    /// How many steps have used this step's image, this step included.
    uint32_t visit_of(int step) const { return uint32_t(size_t(step - 1) / images.count() + 1); }
    /// The frame buffers that a step with this camera needs.
    pipeline::FrameRequest request_of(const pipeline::CameraUse& camera) const;
    /// The learned sky, which frames draw behind the splats. Empty if no sky is learned.
    pipeline::SkyUse sky() const { return plan.sky ? learned.sky.use() : pipeline::SkyUse{}; }
    portions::StepParts step_parts();
};

}  // namespace ewa::train
