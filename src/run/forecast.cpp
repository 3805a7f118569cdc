// SPDX-License-Identifier: Apache-2.0
#include "run/forecast.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace ewa::train {
namespace {

// Seconds of a step on lavapipe with two cores, on a slow day: fox_270 and fox_540, 14,000 to 300,000 splats.
constexpr double kPerPixel = 0.2e-6, kPerSplat = 0.65e-6, kPerSplatOfMcmc = 1.05e-6;
// adc adds about this many splats at a refinement, times the pixels of an image and the square root of their number.
constexpr double kAdded = 0.0092;
constexpr double kAddedToDense = 0.2;  // of that, if the first splats are dense
constexpr double kDense = 0.4;         // first splats for a pixel of an image
constexpr double kEvaluation = 0.75;   // of a step, for each evaluated view
constexpr int kUntimed = 3;            // first steps, in which kernels are compiled
constexpr int kEnoughSteps = 30, kFewSteps = 5;
constexpr double kEnoughSeconds = 0.5;
constexpr double kForgotten = 0.99;      // factor of what is known, for each step
constexpr double kSplatsPerPixel = 0.6;  // at most, times the square root of the photos
constexpr double kOnGpu = 0.02;          // of the time on a CPU
constexpr size_t kRefinements = 4;       // the last ones, whose mean the next ones add

}  // namespace

Forecast::Forecast(const ForecastScene& scene, const TrainOptions& options)
    : scene_(scene),
      options_(options),
      schedule_(schedule_for(options, scene.photos)),
      splats_(scene.splats) {}

void Forecast::add(int step, double seconds, uint32_t splats) {
    if (first_ < 0) first_ = step;
    const int steps = step - step_;
    if (step > first_ + kUntimed && steps > 0) {
        const double factor = std::pow(kForgotten, steps);
        timed_ = factor * timed_ + seconds - seconds_;
        timed_cost_ = factor * timed_cost_ + steps * cost(schedule_, options_.strategy, step, splats_);
        steps_timed_ += steps;
        seconds_timed_ += seconds - seconds_;
    }
    if (step_ > 0) added_now_ += double(splats) - double(splats_);
    if (std::exchange(refined_, false)) {  // a step's report may come before its refinement
        if (added_.size() == kRefinements) added_.erase(added_.begin());
        added_.push_back(added_now_);
        added_now_ = 0;
    }
    for (int done = step_ + 1; step_ > 0 && done <= step; ++done)
        refined_ = refined_ || (options_.strategy == Strategy::adc && schedule_.densifies(done));
    step_ = step;
    seconds_ = seconds;
    splats_ = splats;
}

bool Forecast::known() const {
    return steps_timed_ >= kEnoughSteps || (steps_timed_ >= kFewSteps && seconds_timed_ >= kEnoughSeconds);
}

double Forecast::cost(const Schedule& schedule, Strategy strategy, int step, double splats) const {
    const double pixels = scene_.pixels / double(1 << 2 * schedule.halvings_at(step));
    return kPerPixel * pixels + (strategy == Strategy::mcmc ? kPerSplatOfMcmc : kPerSplat) * splats;
}

double Forecast::added_by_adc() const {
    const double dense = scene_.splats > kDense * scene_.pixels ? kAddedToDense : 1;
    const double expected = kAdded * dense * scene_.pixels * std::sqrt(double(scene_.photos));
    if (added_.empty()) return expected;
    const double seen = std::accumulate(added_.begin(), added_.end(), 0.0) / double(added_.size());
    const double weight = double(added_.size()) / kRefinements;
    return std::max(0.0, weight * seen + (1 - weight) * expected);
}

/// The cost of the steps after `step`, and of the evaluation.
double Forecast::cost_from(const TrainOptions& options, int step, double splats, uint32_t most) const {
    const Schedule schedule = schedule_for(options, scene_.photos);
    const bool mcmc = options.strategy == Strategy::mcmc, adc = options.strategy == Strategy::adc;
    const int every = mcmc ? schedule.relocate_every : schedule.refine_every;
    // After this step, all steps cost the same.
    const int steady = std::max(options.strategy == Strategy::none ? 0
                                : mcmc                             ? schedule.relocate_stop
                                                                   : schedule.refine_stop,
                                schedule.halvings * schedule.resolution_every);
    const uint32_t left = options.final_splats == kAutomaticFinalSplats
                              ? std::max(scene_.splats, most / 3 * 2)
                              : options.final_splats;
    const double added = adc ? added_by_adc() : 0;
    double sum = 0;
    while (step < options.steps) {
        const int next =
            step > steady
                ? options.steps
                : std::min(options.steps, step + every - std::max(0, step - schedule.refine_start) % every);
        sum += (next - step) * cost(schedule, options.strategy, step + 1, splats);
        step = next;
        if (mcmc && schedule.relocates(step)) splats = std::max(splats, std::floor(schedule.growth * splats));
        if (adc && schedule.densifies(step)) splats += added;
        splats = std::min(splats, std::max<double>(most, scene_.splats));
        if (!schedule.may_refine(step)) splats = std::min<double>(splats, left);
    }
    return sum +
           kEvaluation * double(scene_.evaluated) * cost(schedule, options.strategy, options.steps, splats);
}

double Forecast::left() const {
    return timed_ / timed_cost_ * cost_from(options_, step_, splats_, scene_.max_splats);
}

double Forecast::of_steps(int steps) const {
    TrainOptions options = options_;
    options.steps = steps;
    options.strategy = strategy_for(steps);
    const uint64_t most =
        std::min<uint64_t>(scene_.max_splats, scene_.splats + uint64_t(100) * uint64_t(steps));
    return timed_ / timed_cost_ * cost_from(options, 0, scene_.splats, uint32_t(most));
}

double Forecast::on_reference() const {
    return cost_from(options_, 0, scene_.splats, scene_.max_splats);
}

double usual_seconds(ForecastScene scene, TrainOptions options, bool on_cpu) {
    if (options.strategy == Strategy::automatic) options.strategy = strategy_for(options.steps);
    const double most = kSplatsPerPixel * scene.pixels * std::sqrt(double(scene.photos));
    const double asked = options.max_splats == kAutomaticMaxSplats ? 1e9 : double(options.max_splats);
    scene.max_splats = uint32_t(std::min(most, asked));
    scene.splats = std::min(scene.splats, scene.max_splats);
    return (on_cpu ? 1 : kOnGpu) * Forecast(scene, options).on_reference();
}

}  // namespace ewa::train
