// SPDX-License-Identifier: Apache-2.0
// When a run does what: pure functions.
#include "train/schedule.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include "ewa/error.h"
#include "ewa/training_needs.h"
#include "train/exclusions.h"
#include "train/image_cache.h"

namespace ewa::train {
namespace {

std::string refusal(const TrainOptions& options, int ranks) {
    try {
        check_exclusions(options, ranks);
    } catch (const InputError& error) {
        return error.what();
    }
    return {};
}

/// The rows of the methods of drawing that cannot be divided, and all others.
std::vector<Exclusion> rows_of_division() {
    std::vector<Exclusion> rows;
    const auto add = [&](const RenderOptions& render, bool (*used)(const TrainOptions&)) {
        const scene::Method& method = scene::method_of(render);
        rows.push_back({method.option, used, {true, true, true, true}, method.no_division.why});
    };
    add({.points = true}, [](const TrainOptions& options) { return options.render.points; });
    add({.integrator = Integrator::fast_ray},
        [](const TrainOptions& options) { return options.render.integrator == Integrator::fast_ray; });
    rows.insert(rows.end(), kExclusions.begin(), kExclusions.end());
    return rows;
}

/// Each row with what it excludes, one at a time, and the document that shows the rows.
TEST(Exclusions, AreThoseOfTheDocument) {
    std::ifstream file(EWA_SOURCE_DIR "/docs/scale.md");
    const std::string all{std::istreambuf_iterator<char>(file), {}};
    const size_t begin = all.find("## Exclusions\n");
    ASSERT_NE(begin, std::string::npos);
    const std::string section = all.substr(begin, all.find("\n## ", begin + 1) - begin);
    const std::vector<Exclusion> rows = rows_of_division();
    EXPECT_EQ(std::ranges::count(section, '\n') - 5, std::ptrdiff_t(rows.size()) + 1) << section;
    for (const Exclusion& row : rows) {
        std::string others;
        for (size_t by = 0; by < divisions; ++by) {
            TrainOptions options;
            options.render.points = row.option == "--points";
            options.refine_poses = row.option == "--refine-poses";
            if (row.option == "--integrator") options.render.integrator = Integrator::fast_ray;
            options.sky = row.option == "--background sky";
            if (row.option == "--appearance") options.appearance = AppearanceModel::ppisp;
            if (row.option == "--loss depth") options.loss.depth = 0.1;
            if (row.option == "--loss sfm-depth") options.loss.sfm_depth = 0.1;
            EXPECT_TRUE(row.used(options));
            EXPECT_EQ(refusal(options, 1), "");
            if (by == by_batch) options.batch = 2;
            if (by == by_bands) options.bands = 2;
            if (by == by_memory) options.device_memory_bytes = 1;
            const std::string text = refusal(options, by == by_ranks ? 2 : 1);
            EXPECT_EQ(!text.empty(), row.excludes[by]) << text;
            if (!row.excludes[by]) continue;
            const std::string name(kDivisions[by]), option(row.option), reason(row.reason);
            EXPECT_EQ(text, name + " and " + option + " exclude each other: " + reason);
            others += (others.empty() ? "" : ", ") + (by == by_ranks ? name : "`" + name + "`");
        }
        const std::string line =
            "| `" + std::string(row.option) + "` | " + others + " | " + std::string(row.reason) + " |\n";
        EXPECT_NE(section.find(line), std::string::npos) << line;
    }
}

TEST(FrameOfStep, VisitsEachImageOnceAnEpochInAnOrderOfItsOwn) {
    for (const size_t count : {size_t(1), size_t(2), size_t(7), size_t(48)}) {
        std::vector<std::vector<size_t>> epochs;
        for (int epoch = 0; epoch < 5; ++epoch) {
            std::vector<size_t> order;
            for (size_t i = 0; i < count; ++i) {
                order.push_back(frame_of_step(int(size_t(epoch) * count + i) + 1, count, 42));
                ASSERT_LT(order.back(), count);
            }
            EXPECT_EQ(std::set<size_t>(order.begin(), order.end()).size(), count);
            epochs.push_back(order);
        }
        if (count < 7) continue;
        for (size_t a = 0; a < 5; ++a)
            for (size_t b = 0; b < a; ++b) EXPECT_NE(epochs[a], epochs[b]);
    }
}

TEST(FrameOfStep, IsAFunctionOfTheSeed) {
    const auto order = [](uint64_t seed) {
        std::vector<size_t> out;
        for (int step = 1; step <= 48; ++step) out.push_back(frame_of_step(step, 48, seed));
        return out;
    };
    EXPECT_EQ(order(1), order(1));
    EXPECT_NE(order(1), order(2));
    EXPECT_NE(order(1), order(1 + (1ull << 32)));
}

TEST(Schedule, AFullRunIsThatOf3DGS) {
    const TrainOptions options;
    const Schedule s = schedule_for(options);
    EXPECT_EQ(s.refine_start, 500);
    EXPECT_EQ(s.refine_stop, 15000);
    EXPECT_EQ(s.refine_every, 100);
    EXPECT_EQ(s.opacity_reset_every, 3000);
    EXPECT_FALSE(s.densifies(500));
    EXPECT_TRUE(s.densifies(600));
    EXPECT_FALSE(s.densifies(601));
    EXPECT_TRUE(s.densifies(14900));
    EXPECT_FALSE(s.densifies(15000));
    EXPECT_FALSE(s.resets_opacity(2999));
    EXPECT_TRUE(s.resets_opacity(3000));
    EXPECT_TRUE(s.resets_opacity(12000));
    EXPECT_FALSE(s.resets_opacity(15000));
    EXPECT_FALSE(s.was_reset(3000));  // it comes after that step
    EXPECT_TRUE(s.was_reset(3001));
    EXPECT_EQ(s.degree(1), 0);
    EXPECT_EQ(s.degree(1000), 0);
    EXPECT_EQ(s.degree(1001), 1);
    EXPECT_EQ(s.degree(3001), 3);
    EXPECT_EQ(s.degree(30000), 3);
}

TEST(Schedule, SplatsAreRemovedOnceAndTheirNumberThenStays) {
    TrainOptions options;
    options.final_splats = 0;
    options.refine_stop = options.relocate_stop = 30000;
    EXPECT_TRUE(schedule_for(options).densifies(29900));
    const Schedule whole = schedule_for(options);
    for (int step = 1; step <= options.steps; ++step) ASSERT_FALSE(whole.prunes(step));
    options.final_splats = 1000;
    const Schedule s = schedule_for(options);
    EXPECT_TRUE(s.prunes(22500));
    EXPECT_FALSE(s.prunes(22499));
    EXPECT_FALSE(s.prunes(22501));
    EXPECT_TRUE(s.densifies(22400) && s.relocates(22400) && s.resets_opacity(21000));
    EXPECT_FALSE(s.densifies(22600) || s.relocates(22600) || s.resets_opacity(24000));
    for (const int steps : {1, 2, 7}) {
        options.steps = steps;
        int removals = 0;
        for (int step = 1; step <= steps; ++step) removals += schedule_for(options).prunes(step);
        EXPECT_EQ(removals, 1) << steps;
    }
}

/// Others keep all splats, unless options say how many.
TEST(Schedule, AnAutomaticNumberOfFinalSplatsIsForShortRunsOfMcmc) {
    TrainOptions options;
    options.steps = 29999;
    EXPECT_EQ(resolve(options, {}, {}).final_splats, kAutomaticFinalSplats);
    TrainOptions longer = options, capped = options, other = options, along_rays = options;
    longer.steps = 30000;
    capped.max_splats = 1000;
    other.strategy = Strategy::adc;
    along_rays.render.integrator = Integrator::ray;
    for (TrainOptions each : {longer, capped, other, along_rays}) {
        EXPECT_EQ(resolve(each, {}, {}).final_splats, 0u);
        each.final_splats = 7;
        EXPECT_EQ(resolve(each, {}, {}).final_splats, 7u);
    }
}

TEST(Schedule, AShortRunKeepsTheProportionsDownToItsFloors) {
    TrainOptions options;
    options.steps = 3000;
    const Schedule tenth = schedule_for(options);
    EXPECT_EQ(tenth.refine_stop, 1500);
    EXPECT_EQ(tenth.refine_every, 50);
    EXPECT_EQ(tenth.refine_start, 100);
    EXPECT_EQ(tenth.opacity_reset_every, 1000);
    EXPECT_EQ(tenth.sh_degree_every, 100);
    options.steps = 10;
    const Schedule tiny = schedule_for(options);
    for (int step = 1; step <= 10; ++step) {
        EXPECT_FALSE(tiny.densifies(step));
        EXPECT_FALSE(tiny.resets_opacity(step));
    }
    options.steps = 60000;  // a longer run does not stretch them
    EXPECT_EQ(schedule_for(options).refine_stop, 15000);
    options.opacity_reset_every = 0;
    EXPECT_FALSE(schedule_for(options).resets_opacity(3000));
    EXPECT_FALSE(schedule_for(options).was_reset(30000));
    options.sh_degree = 1;
    EXPECT_EQ(schedule_for(options).degree(30000), 1);
}

TEST(Schedule, PointsAreNotResetAndHaveNoMcmc) {
    TrainOptions options;
    options.render.points = true;
    options.strategy = Strategy::automatic;
    const TrainOptions resolved = resolve(options, {}, {});
    EXPECT_EQ(resolved.strategy, Strategy::adc);
    const train::Schedule schedule = train::schedule_for(resolved);
    for (int step = 1; step <= options.steps; ++step) ASSERT_FALSE(schedule.resets_opacity(step));
    options.render.points = false;
    EXPECT_EQ(resolve(options, {}, {}).strategy, Strategy::mcmc);
}

TEST(Schedule, SplatsAreBoundedByTheirDistanceInShortRuns) {
    TrainOptions options;
    options.strategy = Strategy::adc;
    options.steps = 1000;
    EXPECT_TRUE(schedule_for(options).bounded);
    options.steps = 1001;
    EXPECT_FALSE(schedule_for(options).bounded);
    options.steps = 250;
    EXPECT_TRUE(schedule_for(options).bounded);
    options.render.integrator = Integrator::fast_ray;  // no linearisation
    EXPECT_FALSE(schedule_for(options).bounded);
    options.render.integrator = Integrator::splat;
    options.render.points = true;
    EXPECT_FALSE(schedule_for(options).bounded);
}

TEST(Schedule, RelocationsStopWhereMcmcsCodeStopsThem) {
    TrainOptions options;
    options.final_splats = 0;
    const Schedule full = schedule_for(options);
    EXPECT_FALSE(full.relocates(500));
    EXPECT_TRUE(full.relocates(600));
    EXPECT_FALSE(full.relocates(650));
    EXPECT_TRUE(full.relocates(24900));
    EXPECT_FALSE(full.relocates(25000));
    options.steps = 3000;
    const Schedule tenth = schedule_for(options);
    EXPECT_EQ(tenth.relocate_every, 25);
    EXPECT_EQ(full.growth, 1.05);
    EXPECT_NEAR(tenth.growth, std::pow(1.05, 2.5), 1e-12);  // every 25 steps, not every 10
    EXPECT_EQ(full.copy_spread, 0);
    EXPECT_NEAR(tenth.copy_spread, 0.9, 1e-12);
    EXPECT_TRUE(tenth.relocates(125));
    EXPECT_FALSE(tenth.relocates(130));
    EXPECT_TRUE(tenth.relocates(2475));
    EXPECT_FALSE(tenth.relocates(2500));
}

TEST(Schedule, ShortRunsLearnFaster) {
    TrainOptions options;
    for (const Strategy strategy : {Strategy::adc, Strategy::mcmc}) {
        options.strategy = strategy;
        options.steps = 30000;
        for (const int step : {1, 15000, 30000}) {
            EXPECT_EQ(schedule_for(options).gain(step), 1);
            EXPECT_EQ(schedule_for(options).opacity_gain(step), 1);
        }
        options.steps = 300;
        const Schedule s = schedule_for(options);
        const double power = strategy == Strategy::adc ? 1.2 : 1;  // times the half
        EXPECT_NEAR(s.gain(0), std::pow(10, power), 1e-12);
        EXPECT_NEAR(s.gain(300), std::pow(10, 0.5 * power), 1e-12);
        EXPECT_NEAR(s.gain(150), std::pow(10, 0.75 * power), 1e-12);
        EXPECT_NEAR(s.opacity_gain(0), std::pow(10, 0.6 * power), 1e-12);
        options.steps = 3;  // 300 times shorter than a full run at most
        EXPECT_NEAR(schedule_for(options).gain(0), std::pow(300, 0.5 * power), 1e-12);
        options.refine_poses = true;
        EXPECT_NEAR(schedule_for(options).gain(0), std::pow(300, 0.25), 1e-12);
        options.refine_poses = false;
        EXPECT_EQ(s.opacity_gain(300), 1);
        // MCMC's noise has the rate of the means without the gain.
        EXPECT_NEAR(s.mean_rate(0, 2), 2 * options.means_rate, 1e-12);
        EXPECT_DOUBLE_EQ(s.mean_rate(300, 2), 2 * options.means_rate_final);
    }
    options.short_run_power = 0;
    EXPECT_EQ(schedule_for(options).gain(1), 1);
    EXPECT_EQ(schedule_for(options).opacity_gain(1), 1);
}

/// Those of adc and none with many photos, and with cameras that stay.
TEST(Schedule, ShortRunsSettle) {
    TrainOptions options;
    options.steps = 1000;
    for (const Strategy strategy : {Strategy::adc, Strategy::none}) {
        options.strategy = strategy;
        const Schedule s = schedule_for(options, 43);
        EXPECT_TRUE(s.nesterov);
        EXPECT_NEAR(s.gain(0), std::pow(30, 0.6), 1e-12);
        EXPECT_NEAR(s.appearance_gain(0), std::pow(30, 0.5), 1e-12);
        EXPECT_EQ(s.fading(1), 1);
        EXPECT_EQ(s.fading(800), 1);
        EXPECT_NEAR(s.fading(900), std::sqrt(0.2), 1e-12);
        EXPECT_NEAR(s.fading(1000), 0.2, 1e-12);
    }
    const auto goes_on = [&](const TrainOptions& changed, size_t photos) {
        const Schedule s = schedule_for(changed, photos);
        return !s.nesterov && s.fading(int(0.95 * changed.steps)) == 1;
    };
    options.steps = 30000;
    EXPECT_TRUE(goes_on(options, 43)) << "not short";
    options.steps = 100;
    EXPECT_TRUE(goes_on(options, 9)) << "few photos";
    EXPECT_FALSE(goes_on(options, 43));
    TrainOptions moving = options, plain = options, mcmc = options;
    moving.refine_poses = true;
    plain.short_run_power = 0;
    mcmc.strategy = Strategy::mcmc;
    for (const TrainOptions& changed : {moving, plain, mcmc}) EXPECT_TRUE(goes_on(changed, 43));
}

/// A run that shows each of a few photos often.
TEST(Schedule, FewPhotosAreNotLearntByHeart) {
    TrainOptions options;
    options.strategy = Strategy::adc;
    options.steps = 1000;
    const Schedule few = schedule_for(options, 9);
    EXPECT_EQ(few.fading(1), 1);
    EXPECT_EQ(few.fading(500), 1);
    EXPECT_NEAR(few.fading(750), std::sqrt(0.1), 1e-12);
    EXPECT_NEAR(few.fading(1000), 0.1, 1e-12);
    EXPECT_EQ(schedule_for(options, 16).fade_start, 500);
    for (const size_t photos : {size_t(17), size_t(43), SIZE_MAX}) {
        EXPECT_FALSE(few_photos(options, photos));
        EXPECT_EQ(schedule_for(options, photos).fading(800), 1);
    }
    EXPECT_TRUE(few_photos(options, 16));
    options.steps = 539;
    EXPECT_EQ(schedule_for(options, 9).fading(539), 1) << "seen less than 60 times";
    options.few_photos = 8;
    EXPECT_FALSE(few_photos(options, 9));
    options.few_photos = 16;
    options.strategy = Strategy::none;
    EXPECT_TRUE(few_photos(options, 9));
    options.render.points = true;
    EXPECT_FALSE(few_photos(options, 9)) << "a sphere has no opacity";
    options.render.points = false;
    options.refine_poses = true;
    EXPECT_FALSE(few_photos(options, 9)) << "splats have to follow the cameras";
    options.refine_poses = false;
    options.strategy = Strategy::mcmc;
    EXPECT_FALSE(few_photos(options, 9)) << "regularised anyway";
    options.strategy = Strategy::adc;
    options.steps = 30000;
    EXPECT_EQ(schedule_for(options, 9).fading(30000), 1);
}

TEST(Schedule, TheResolutionDoublesEachTenthOfTheRun) {
    TrainOptions options;
    EXPECT_EQ(schedule_for(options).halvings_at(1), 0);
    options.halvings = 2;
    options.steps = 2000;
    const Schedule s = schedule_for(options);
    EXPECT_EQ(s.halvings_at(1), 2);
    EXPECT_EQ(s.halvings_at(200), 2);
    EXPECT_EQ(s.halvings_at(201), 1);
    EXPECT_EQ(s.halvings_at(400), 1);
    EXPECT_EQ(s.halvings_at(401), 0);
    EXPECT_EQ(s.halvings_at(2000), 0);
    options.steps = 3;  // a step at each
    EXPECT_EQ(schedule_for(options).halvings_at(1), 2);
    EXPECT_EQ(schedule_for(options).halvings_at(3), 0);
}

/// 17 images of 100x80, which have 2000 pixels once their sides are halved.
Dataset dataset_of_points(size_t points) {
    Dataset dataset;
    dataset.frames.resize(17);
    for (Frame& frame : dataset.frames) frame.camera.width = 100, frame.camera.height = 80;
    dataset.points.positions.resize(points);
    return dataset;
}

TEST(Schedule, ShortRunsOfAdcStartWithImagesOfHalfTheirSize) {
    const Dataset dataset = dataset_of_points(2000);
    std::vector<int> frames(17);
    std::iota(frames.begin(), frames.end(), 0);
    TrainOptions options;
    options.halvings = kAutomaticHalvings;
    options.strategy = Strategy::adc;
    EXPECT_EQ(schedule_for(options).halvings_at(1), 0) << "before resolve";
    const auto coarse = [&](int steps) {
        options.steps = steps;
        const Schedule s = schedule_for(resolve(options, dataset, frames));
        int step = 1;
        while (s.halvings_at(step) > 0) ++step;
        return step - 1;
    };
    EXPECT_EQ(coarse(100), 40);
    EXPECT_EQ(coarse(250), 100);
    EXPECT_EQ(coarse(500), 100);
    EXPECT_EQ(coarse(1000), 100);
    EXPECT_EQ(coarse(1001), 0);
    EXPECT_EQ(coarse(10), 4);
    EXPECT_EQ(coarse(9), 0);

    options.resolution_every = 6000;
    EXPECT_EQ(coarse(500), 100) << "as asked for: a fifth";
    options.resolution_every = 9000;
    EXPECT_EQ(coarse(500), 150) << "as asked for";
    options.resolution_every = TrainOptions().resolution_every;
    options.steps = 500;
    const auto halvings = [&](const TrainOptions& asked, const Dataset& of, const std::vector<int>& train) {
        return resolve(asked, of, train).halvings;
    };
    EXPECT_EQ(halvings(options, dataset, frames), 1);
    EXPECT_EQ(halvings(options, dataset_of_points(2001), frames), 0) << "more points than pixels";
    EXPECT_EQ(halvings(options, dataset_of_points(0), frames), 0) << "no points";
    EXPECT_EQ(halvings(options, dataset, std::vector<int>(frames.begin(), frames.end() - 1)), 0)
        << "few photos";
    options.strategy = Strategy::none;
    EXPECT_EQ(halvings(options, dataset, frames), 0);
    options.strategy = Strategy::mcmc;
    EXPECT_EQ(halvings(options, dataset, frames), 0);
    options.strategy = Strategy::adc;
    options.halvings = 0;
    EXPECT_EQ(halvings(options, dataset, frames), 0) << "as asked for";
}

/// A run of 1000 steps that goes on to 30000: neither its SH degree nor its resolution falls back.
TEST(Schedule, WhatAContinuedRunHasReachedStays) {
    TrainOptions options;
    options.halvings = 2;
    const Schedule plain = schedule_for(options);
    EXPECT_EQ(plain.degree(1001), 1);
    EXPECT_EQ(plain.halvings_at(1001), 2);
    options.least_sh_degree = 2;
    options.most_halvings = 1;
    const Schedule s = schedule_for(options);
    EXPECT_EQ(s.degree(1001), 2);
    EXPECT_EQ(s.degree(3001), 3);
    EXPECT_EQ(s.halvings_at(1001), 1);
    EXPECT_EQ(s.halvings_at(6001), 0);
    EXPECT_EQ(s.mean_rate(1001, 1), plain.mean_rate(1001, 1));
    options.sh_degree = 1;
    EXPECT_EQ(schedule_for(options).degree(1001), 1);
}

TEST(Schedule, TheRateOfTheMeansDecaysExponentially) {
    TrainOptions options;
    options.steps = 1000;
    const Schedule s = schedule_for(options);
    EXPECT_NEAR(s.mean_rate(0, 2), 2 * 1.6e-4, 1e-15);
    EXPECT_NEAR(s.mean_rate(500, 1), 1.6e-5, 1e-15);
    EXPECT_NEAR(s.mean_rate(1000, 1), 1.6e-6, 1e-15);
    EXPECT_NEAR(s.mean_rate(2000, 1), 1.6e-6, 1e-15);
    EXPECT_NEAR(s.mean_rate(300, 1) / s.mean_rate(200, 1), s.mean_rate(900, 1) / s.mean_rate(800, 1), 1e-12);
}

}  // namespace
}  // namespace ewa::train
