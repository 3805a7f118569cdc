// SPDX-License-Identifier: Apache-2.0
// How long a training takes: from the times of its steps so far, and from the number of splats that its schedule leads to.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "ewa/trainer.h"
#include "train/schedule.h"

namespace ewa::train {

/// Properties of a training that decide its time, besides the device.
struct ForecastScene {
    double pixels = 0;        // mean number of pixels of a training image
    size_t photos = 0;        // to train on
    uint32_t splats = 0;      // to start from
    size_t evaluated = 0;     // views that are rendered at the end
    uint32_t max_splats = 0;  // of the run
};

/// A step costs a part for the pixels and a part for each splat. Their ratio is that of lavapipe; the device's speed comes from
/// the steps so far. mcmc's number of splats follows from its schedule. adc's grows by about the same number at each
/// refinement; docs/performance.md compares these times with runs.
class Forecast {
  public:
    /// options: with concrete strategy and SH degree.
    Forecast(const ForecastScene& scene, const TrainOptions& options);

    /// Adds the time of a step. step: number of steps done. seconds: total time of the steps so far. splats: number after the step.
    void add(int step, double seconds, uint32_t splats);
    /// Whether enough steps are timed.
    bool known() const;
    /// Seconds that the rest of the run takes, evaluation included. Needs known().
    double left() const;
    /// Seconds that a whole run with this number of steps from the same splats takes, with ewa's choice of the strategy.
    double of_steps(int steps) const;
    /// Seconds of such a run with the same options on the machine of docs/performance.md on a slow day.
    double on_reference() const;

  private:
    double cost(const Schedule& schedule, Strategy strategy, int step, double splats) const;
    double cost_from(const TrainOptions& options, int step, double splats, uint32_t most) const;
    double added_by_adc() const;

    ForecastScene scene_;
    TrainOptions options_;
    Schedule schedule_;
    int first_ = -1, step_ = 0;
    double seconds_ = 0;
    uint32_t splats_ = 0;
    double timed_ = 0, timed_cost_ = 0;  // seconds and cost of the steps, weighted to recent ones
    int steps_timed_ = 0;
    double seconds_timed_ = 0;
    bool refined_ = false;       // adc has refined after the last step
    double added_now_ = 0;       // splats since the refinement before
    std::vector<double> added_;  // by the last refinements of adc
};

/// Seconds of a whole run on a usual device of the same kind, before any step is timed. scene: without max_splats.
double usual_seconds(ForecastScene scene, TrainOptions options, bool on_cpu);

}  // namespace ewa::train
