// SPDX-License-Identifier: Apache-2.0
// A training step of several views. Each rank holds a share of the splats. A rank projects its share for every view and
// sends the visible splats to the rank that draws the view. That one sends their gradients back.
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "ewa/ranks.h"
#include "pipeline/views.h"

namespace ewa::train {

/// A view of a step, and how the rank that draws it computes its loss.
struct BatchView {
    pipeline::FrameInputs inputs;
    pipeline::FrameRequest request;  // of its picture, without splats and instances
    /// Records the loss after the picture. Called once for every attempt to draw. Empty: the view is only a picture.
    std::function<void(gpu::Recording&)> record_loss;
    /// dB, from the counts of the picture.
    std::function<double(const shared::Counts&)> psnr;
};

struct BatchReport {
    double loss = 0, psnr = 0;  // means over the views
    uint64_t skipped_nonfinite = 0, dropped_updates = 0, limited_steps = 0;
};

/// The trainer's parts that a step uses.
struct BatchParts {
    passes::PassCache& cache;
    gpu::Executor& executor;
    const pipeline::Plan& plan;
    pipeline::Model& model;
    pipeline::FrameBuffers& frame;
    uint32_t& instance_capacity;
    std::function<void()> submitted;  // called after each submission
};

/// What this rank has exchanged with others so far.
struct Traffic {
    uint64_t sent_bytes = 0;
    double exchange = 0, waiting = 0;  // ms
};

class Batch {
  public:
    explicit Batch(std::shared_ptr<Ranks> ranks) : ranks_(std::move(ranks)) {}

    /// Draws all views and leaves the sums of their gradients. Collective, as all that follows.
    BatchReport draw(const BatchParts& parts, std::span<const BatchView> views);
    /// Moves the model. first: number of its first splat, among those of all ranks. more: what else the submission does.
    /// Adds to the report.
    void update(const BatchParts& parts, const pipeline::Rates& rates, uint32_t first, int sh_degree,
                const std::function<void(gpu::Recording&)>& more, BatchReport& report);

    /// Draws pictures: view k by rank k. There are at most as many views as ranks. Returns whether this rank has drawn one,
    /// which the frame then holds.
    bool draw_pictures(const BatchParts& parts, std::span<const BatchView> views);

    const Traffic& traffic() const { return traffic_; }

  private:
    struct Round;
    std::vector<uint64_t> gather(std::span<const uint64_t> own);
    void exchange(std::span<const std::span<const std::byte>> out, std::span<const std::span<std::byte>> in);
    void reserve(const BatchParts& parts, pipeline::FrameRequest request, uint64_t listed);
    void make_room_for_own(const BatchParts& parts, uint64_t listed);
    void list(const BatchParts& parts, std::span<const BatchView> views, Round& round);
    void tell_counts(Round& round, BatchReport& report);
    void send_records(const BatchParts& parts, const Round& round);
    void return_sums(const BatchParts& parts, const Round& round);
    void exchange_lists(const BatchParts& parts, std::span<const BatchView> views, Round& round,
                        BatchReport& report);
    shared::Counts draw_own(const BatchParts& parts, const BatchView& view, const Round& round);

    std::shared_ptr<Ranks> ranks_;
    pipeline::ViewBuffers buffers_;
    gpu::Buffer own_sums_;  // of the view that this rank draws, with several ranks
    uint32_t places_ = 0;   // in the lists of the step's views
    Traffic traffic_;
};

}  // namespace ewa::train
