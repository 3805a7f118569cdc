// SPDX-License-Identifier: Apache-2.0
// A training step over portions of the splats. Each portion lists its splats that the step's views see. A part of a view is drawn
// from the lists of all portions, by one rank, and the sums of its gradients go back to the portions. Then each portion is updated.
// A part of a view is a band of its tile rows, or the whole view.
//
// Between listing and drawing, and between drawing and update, data stay on the device, wait in host memory, or go to another rank.
// The portions alone decide which.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "portions/collect.h"
#include "portions/portions.h"

namespace ewa::portions {

/// A view of a step, and how a rank that draws a part of it computes its loss.
struct StepView {
    pipeline::FrameInputs inputs;    // without a band
    pipeline::FrameRequest request;  // of the whole view, without splats and instances
    /// Records the loss after a part is drawn; FramePasses::inputs has the part's band. Called again if drawing is repeated with
    /// more capacity. Empty: the view is only drawn.
    std::function<void(const pipeline::FramePasses&)> record_loss;
    /// Weight of the view's pixels in its mean squared error. Called after record_loss.
    std::function<double()> weight;
    /// learned: the results of the loss for learned tables, as StepParts::learned words. learn: sets them on a rank that has not
    /// drawn the view.
    std::function<std::vector<uint64_t>()> learned;
    std::function<void(std::span<const uint64_t>)> learn;
};

struct StepSums {
    double loss = 0, psnr = 0;  // means over the views
    uint64_t skipped_nonfinite = 0, dropped_updates = 0, limited_steps = 0;
};

/// The trainer's parts that a step uses.
struct StepParts {
    passes::PassCache& cache;
    gpu::Executor& executor;
    const pipeline::Plan& plan;
    pipeline::FrameBuffers& frame;
    uint32_t& instance_capacity;
    std::function<void()> submitted;  // called after each submission
    size_t learned = 0;               // 64-bit words of a view's StepView::learned
};

class Step {
  public:
    /// bands: number of bands of each view. A view needs at least one tile row for each band.
    Step(Portions& portions, int bands)
        : portions_(portions),
          ranks_(portions.ranks()),
          bands_(uint32_t(bands)),
          lists_(portions.holder().make_lists()) {}

    /// Draws all views and stores the sums of their gradients for update. This and all functions below but free_buffers and traffic
    /// are collective.
    StepSums draw(const StepParts& parts, std::span<const StepView> views);
    /// Updates the splats by the gradients of draw. more: records further work into the submission of each portion's update. sums:
    /// receives the counts of the updates.
    void update(const StepParts& parts, const pipeline::Rates& rates, int sh_degree,
                const std::function<void(const passes::Recorder&, const pipeline::Model&)>& more,
                StepSums& sums);

    /// Draws whole views without a loss: view k by rank k. There are at most as many views as ranks. Returns whether this rank has
    /// drawn a view, whose image planes are then in StepParts::frame.
    bool draw_views(const StepParts& parts, std::span<const StepView> views);

    /// Raises each value of `largest` to the splat's largest blending weight at a pixel of the views. largest: one float per splat,
    /// for each of this rank's portions. views: at most as many as ranks, without a loss.
    void raise_weights(const StepParts& parts, std::span<const StepView> views,
                       std::vector<std::vector<float>>& largest);
    /// Frees the device buffers of a step, but not the portions.
    void free_buffers() { buffers_ = {}; }

    const Traffic& traffic() const { return ranks_.traffic(); }

  private:
    struct ViewPart;
    struct Views;
    static ViewPart part_of(const StepParts& parts, const Views& of, size_t number);
    void reserve(const StepParts& parts, pipeline::FrameRequest request, uint64_t splats);
    void list(const StepParts& parts, const Views& of, size_t first, size_t view_parts);
    Turn turn_of(const std::vector<uint64_t>& listed, size_t first, size_t view_parts, size_t begin) const;
    std::vector<uint64_t> gather_counts(size_t first, size_t view_parts, StepSums& sums);
    void send(const StepParts& parts, const Views& of, const Turn& turn);
    shared::Counts draw_own(const StepParts& parts, const ViewPart& view_part, const Turn& turn,
                            const gpu::Buffer* largest = nullptr);
    std::vector<float> weights_of(const StepParts& parts, const Views& of, const Turn& turn);
    void return_sums(const StepParts& parts, const Turn& turn);
    Turn list_views(const StepParts& parts, const Views& of);
    bool draw_whole(const StepParts& parts, const StepView& view);

    Portions& portions_;
    CountedRanks ranks_;
    uint32_t bands_;
    std::unique_ptr<Lists> lists_;
    StepBuffers buffers_;
    uint32_t lenses_ = 0;  // LENSES_*, of the cameras of the step
};

}  // namespace ewa::portions
