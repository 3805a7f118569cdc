// SPDX-License-Identifier: Apache-2.0
// How long a training takes, against times of real runs on lavapipe with two cores.
#include "run/forecast.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace {

using namespace ewa;
using train::Forecast;
using train::ForecastScene;

const ForecastScene kFox{
    .pixels = 270 * 480, .photos = 43, .splats = 13778, .evaluated = 47, .max_splats = 213778};

struct At {
    int step;
    double seconds;
    uint32_t splats;
};

/// The figures after a step, between those of the run. adc changes its splats every 50 steps.
At at_step(const std::vector<At>& run, int step) {
    const auto after = std::find_if(run.begin(), run.end(), [&](const At& at) { return at.step >= step; });
    const At before = after == run.begin() ? At{0, 0, run.front().splats} : *(after - 1);
    const double share = double(step - before.step) / (after->step - before.step);
    return {step, before.seconds + share * (after->seconds - before.seconds),
            uint32_t(before.splats + share * (double(after->splats) - before.splats))};
}

/// The forecast of the whole run after `steps` steps of a run with these figures.
double whole_after(int steps, const std::vector<At>& run, const ForecastScene& scene,
                   const TrainOptions& options) {
    Forecast forecast(scene, options);
    const int every = options.strategy == Strategy::adc ? 50 : 1;
    for (int step = 1; step <= steps; ++step)
        forecast.add(step, at_step(run, step).seconds,
                     at_step(run, std::max(1, step / every * every)).splats);
    EXPECT_TRUE(forecast.known());
    return at_step(run, steps).seconds + forecast.left();
}

TEST(Forecast, OfAdcCountsSplatsToCome) {
    // fox_270, --quality low: 214 s with its evaluation.
    const std::vector<At> run = {{80, 3.4, 13778},    {160, 6.9, 18192},     {240, 10.9, 25818},
                                 {320, 15.6, 44229},  {400, 20.9, 62831},    {480, 28, 71921},
                                 {560, 37, 89458},    {640, 44.5, 97273},    {800, 61, 125981},
                                 {960, 79.2, 142944}, {1200, 115.4, 142944}, {2000, 210.5, 142944}};
    TrainOptions options;
    options.steps = 2000;
    options.strategy = Strategy::adc;
    for (const int step : {20, 100, 300, 600, 1200})
        EXPECT_NEAR(whole_after(step, run, kFox, options) / 214, 1, 0.35) << step;
}

TEST(Forecast, OfMcmcFollowsItsSchedule) {
    TrainOptions options;
    options.steps = 7000;
    options.strategy = Strategy::mcmc;
    ForecastScene scene = kFox;
    scene.max_splats = 500000;
    const train::Schedule schedule = train::schedule_for(options);
    // A device that takes twice the time of the model for everything.
    std::vector<At> run;
    double seconds = 0, splats = scene.splats;
    for (int step = 1; step <= options.steps; ++step) {
        seconds += 2 * (0.2e-6 * scene.pixels + 1.05e-6 * splats);
        if (schedule.relocates(step)) splats = std::min(500000.0, std::floor(schedule.growth * splats));
        if (schedule.prunes(step)) splats = std::min(splats, 500000.0 * 2 / 3);
        run.push_back({step, seconds, uint32_t(splats)});
    }
    const double evaluation = 47 * 0.75 * 2 * (0.2e-6 * scene.pixels + 1.05e-6 * splats);
    for (const int step : {40, 500, 5000})
        EXPECT_NEAR(whole_after(step, run, scene, options), seconds + evaluation, 0.02 * seconds) << step;
    // The pace of its first steps says a tenth of that.
    EXPECT_GT(seconds, 8 * options.steps * run.front().seconds);
}

/// An automatic cap is that of the pixels: the run is not one without splats.
TEST(Forecast, OfAnAutomaticCapCountsItsSplats) {
    TrainOptions automatic, one;
    one.max_splats = 1;
    EXPECT_GT(usual_seconds(kFox, automatic, true), 2 * usual_seconds(kFox, one, true));
}

TEST(Forecast, OfAShorterRunUsesTheMeasuredSpeed) {
    TrainOptions options;
    options.steps = 30000;
    options.strategy = Strategy::mcmc;
    Forecast slow(kFox, options), fast(kFox, options);
    for (int step = 1; step <= 60; ++step) {
        slow.add(step, 0.2 * step, kFox.splats);
        fast.add(step, 0.02 * step, kFox.splats);
    }
    EXPECT_NEAR(slow.of_steps(2000) / fast.of_steps(2000), 10, 0.01);
    EXPECT_LT(fast.of_steps(2000), fast.left() / 10);
}

/// If each visited every step, all together would take longer than CTest waits.
TEST(Forecast, OfAnyNumberOfStepsIsQuick) {
    TrainOptions options;
    options.steps = 1000000000;
    options.strategy = Strategy::mcmc;
    Forecast forecast(kFox, options);
    for (int step = 1000; step <= 1100; ++step) forecast.add(step, 0.05 * step, kFox.splats);  // resumed
    for (int i = 0; i < 200; ++i) EXPECT_GT(forecast.left(), 1e6);
}

TEST(Forecast, WaitsForTimedSteps) {
    TrainOptions options;
    options.strategy = Strategy::none;
    Forecast forecast(kFox, options);
    for (int step = 1; step <= 4; ++step) forecast.add(step, 0.6 * step, kFox.splats);
    EXPECT_FALSE(forecast.known());  // kernels were compiled
    for (int step = 5; step <= 9; ++step) forecast.add(step, 0.6 * step, kFox.splats);
    EXPECT_TRUE(forecast.known());
}

}  // namespace
