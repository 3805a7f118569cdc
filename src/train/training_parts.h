// SPDX-License-Identifier: Apache-2.0
// What a training consists of. Its steps, its refinements and its states work on it.
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

/// What records and submits a frame.
struct FrameTools {
    passes::PassCache cache;
    gpu::Executor executor;
    pipeline::FrameBuffers frame;
    uint32_t instance_capacity = 0;
    bool limited;  // several portions share the device's memory with the frame

    FrameTools(gpu::Device& device, bool limited_memory)
        : cache(device), executor(device, cache.config().frames_in_flight), limited(limited_memory) {}
    uint32_t frames_in_flight() const { return cache.config().frames_in_flight; }
    /// Makes the capacity that of a first frame of so many splats. The first frame says how many instances there are: with a
    /// limit, a capacity for all splats might not fit.
    void expect(size_t splats) {
        instance_capacity = std::max(instance_capacity, pipeline::first_capacity(limited ? 0 : splats));
    }
    /// Leaves the memory of a limited frame to others. The next step makes another frame.
    void leave_room() {
        if (limited) frame = {};
    }
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

    /// As Training.
    TrainingParts(std::shared_ptr<gpu::Device> on, const Dataset& dataset, const std::vector<int>& frames,
                  const Gaussians& ready, double extent_of_cameras, const TrainOptions& resolved,
                  std::shared_ptr<Ranks> ranks, int portions_of_rank);
    ~TrainingParts();
    TrainingParts(const TrainingParts&) = delete;
    TrainingParts& operator=(const TrainingParts&) = delete;

    /// Whether a step draws one part of a view, of one portion: one kernel then gathers its gradients and moves the splats.
    bool fused() const { return portions.alone() && options.batch == 1 && options.bands == 1; }
    /// The training images at this step's resolution.
    ImageCache& images_at(int step) { return images.at(size_t(schedule.halvings_at(step))); }
    size_t index_of(int step) const { return frame_of_step(step, images.count(), options.seed); }
    /// How often the step's image has been seen then.
    uint32_t visit_of(int step) const { return uint32_t(size_t(step - 1) / images.count() + 1); }
    /// What a step needs of the frame's buffers.
    pipeline::FrameRequest request_of(const pipeline::CameraUse& camera) const;
    /// The sky that is drawn.
    pipeline::SkyUse sky() const { return plan.sky ? learned.sky.use() : pipeline::SkyUse{}; }
    portions::StepParts step_parts();
};

}  // namespace ewa::train
