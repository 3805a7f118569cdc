// SPDX-License-Identifier: Apache-2.0
// Training steps of one view by one rank that has all splats on the device in one portion. Each step is one submission. Several
// submissions may be in flight.
//
// Where the kernels' configuration says so, a step is replayed: what differs from step to step is recorded in each step, and the
// other commands only when they change.
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "train/training_parts.h"

namespace ewa::train {

class FusedSteps {
  public:
    explicit FusedSteps(TrainingParts& parts) : parts_(parts), kept_(parts.tools.frames_in_flight()) {}

    void optimise(int step);
    /// Waits for all steps.
    void finish_all();

  private:
    /// A step that is submitted and not finished.
    struct Flight {
        int step;
        double weight;  // of its image's pixels
    };
    /// What the commands of a replayed step depend on, besides the plan.
    struct Shape {
        uint64_t last_buffer =
            0;  // Buffer::last_serial(): no buffer is replaced without another that is made
        uint32_t width = 0, height = 0, lenses = 0, splats = 0, capacity = 0;
        int sh_degree = 0;
        bool wraps = false, frozen = false;
        bool operator==(const Shape&) const = default;
    };
    /// Records a step. A step can be recorded again, since all that changes from step to step is a pure function of its number.
    void record(gpu::Recording& recording, int step, size_t index, const portions::StepView& view);
    /// Whether a step is replayed: its training image takes part in the loss alone, without a mask, a cut or depths, its background
    /// is that of all steps, and nothing is learned besides the splats.
    bool is_replayed(int step, const ImageCache& seen, size_t index) const;
    /// Submits a step, with its other commands as they were recorded before if they are the same.
    void submit_replayed(int step, const gpu::Buffer& photo, const portions::StepView& view);
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
    std::vector<Shape> kept_;   // of the executor's kept recordings, by slot
    int compiled_degree_ = -1;  // the highest SH degree whose kernels were asked for
    int last_degree_ = -1;      // of the step submitted last
};

}  // namespace ewa::train
