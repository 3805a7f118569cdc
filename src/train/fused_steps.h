// SPDX-License-Identifier: Apache-2.0
// Training steps of one view by one rank that has all splats on the device in one portion. Each step is one submission. Several
// submissions may be in flight.
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
    /// Records a step. A step can be recorded again, since all that changes from step to step is a pure function of its number.
    void record(gpu::Recording& recording, int step, size_t index, const portions::StepView& view);
    /// Submits a step. Afterwards at most frames_in_flight steps are in flight.
    void submit(int step);
    /// On a GPU, compiles the kernels of the next SH degree while the device runs a step of this degree.
    void compile_next_degree(int step, size_t index, ImageCache& seen);
    /// Waits for the oldest step in flight. If it had more (splat, tile) instances than capacity, neither it nor later steps have
    /// changed the model. All of them are then repeated, one by one, with more capacity.
    void finish_oldest();
    /// Whether the passes of a step are timed. If steps overlap, few are, since timestamp queries between commands cost time.
    bool is_timed(int step) const;
    uint32_t slot_of(int step) const { return uint32_t(step) % parts_.tools.frames_in_flight(); }
    /// Whether the schedule does something after this step that needs the step's result, such as a densification.
    bool must_finish(int step) const;

    TrainingParts& parts_;
    std::deque<Flight> in_flight_;
    int compiled_degree_ = -1;  // the highest SH degree whose kernels were asked for
};

}  // namespace ewa::train
