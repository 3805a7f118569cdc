// SPDX-License-Identifier: Apache-2.0
// Steps of one view and one portion, each one submission. Several may be in flight.
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>

#include "train/training_parts.h"

namespace ewa::train {

class FusedSteps {
  public:
    explicit FusedSteps(TrainingParts& parts) : parts_(parts) {}

    void optimise(int step);
    /// Waits for all steps.
    void finish_all();

  private:
    /// A step that is submitted and not finished.
    struct Flight {
        int step;
        double weight;  // of its image's pixels
    };
    /// A step can be recorded again: all that changes from step to step is a pure function of its number.
    void record(gpu::Recording& recording, int step, size_t index, const portions::StepView& view);
    /// Submits a step. Afterwards at most frames_in_flight steps are in flight.
    void submit(int step);
    /// A GPU compiles the kernels of the next SH degree while it works at this one.
    void compile_next_degree(int step, size_t index, ImageCache& seen);
    /// Waits for the oldest step. If it had too many instances, neither it nor later ones have changed the model: they are
    /// all repeated, one by one, with more capacity.
    void finish_oldest();
    /// Where steps overlap, the queries between the commands would cost time.
    bool is_timed(int step) const;
    uint32_t slot_of(int step) const { return uint32_t(step) % parts_.tools.frames_in_flight(); }
    /// Whether something happens after a step that needs its result.
    bool must_finish(int step) const;

    TrainingParts& parts_;
    std::deque<Flight> in_flight_;
    int compiled_degree_ = -1;  // the highest SH degree whose kernels were asked for
};

}  // namespace ewa::train
