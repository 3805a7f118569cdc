// SPDX-License-Identifier: Apache-2.0
// A training step of several views. Each rank holds a share of the splats. A rank projects its share for every view and
// sends the visible splats to the rank that draws the view. That one sends their gradients back. Views may be cut into bands
// of tile rows, and ranks then draw bands.
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "ewa/ranks.h"
#include "pipeline/views.h"

namespace ewa::train {

/// A view of a step, and how a rank that draws a picture of it computes its loss.
struct BatchView {
    pipeline::FrameInputs inputs;    // without a band
    pipeline::FrameRequest request;  // of the whole view, without splats and instances
    /// Records the loss after the picture. inputs: with the picture's band. Called once for every attempt to draw.
    /// Empty: the view is only a picture.
    std::function<void(gpu::Recording&, const pipeline::FrameInputs& inputs)> record_loss;
    /// Weight of the view's pixels in its mean squared error. Called after record_loss.
    std::function<double()> weight;
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
    /// bands: of each view. A view needs a tile row for each.
    Batch(std::shared_ptr<Ranks> ranks, int bands) : ranks_(std::move(ranks)), bands_(uint32_t(bands)) {}

    /// Draws all views and leaves the sums of their gradients. Collective, as all that follows.
    BatchReport draw(const BatchParts& parts, std::span<const BatchView> views);
    /// Moves the model. first: number of its first splat, among those of all ranks. more: what else the submission does.
    /// Adds to the report.
    void update(const BatchParts& parts, const pipeline::Rates& rates, uint32_t first, int sh_degree,
                const std::function<void(gpu::Recording&)>& more, BatchReport& report);

    /// Draws pictures of whole views: view k by rank k. There are at most as many views as ranks. Returns whether this rank has drawn one,
    /// which the frame then holds.
    bool draw_pictures(const BatchParts& parts, std::span<const BatchView> views);

    const Traffic& traffic() const { return traffic_; }

  private:
    struct Round;
    struct Picture;
    static Picture picture_of(const BatchParts& parts, std::span<const BatchView> views, const Round& round,
                              size_t rank);
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
    shared::Counts draw_own(const BatchParts& parts, const Picture& picture, const Round& round);

    std::shared_ptr<Ranks> ranks_;
    uint32_t bands_;
    pipeline::ViewBuffers buffers_;
    gpu::Buffer own_sums_;  // of the picture that this rank draws, with several ranks
    uint32_t places_ = 0;   // in the lists of the step's pictures
    Traffic traffic_;
};

}  // namespace ewa::train
