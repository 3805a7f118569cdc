// SPDX-License-Identifier: Apache-2.0
// --region: only the splats in a box multiply.
#include <gtest/gtest.h>

#include "ewa/error.h"
#include "ewa/run.h"
#include "ewa/splat_files.h"
#include "ewa/trainer.h"
#include "gpu/test_device.h"
#include "run/region_option.h"
#include "run/run_input.h"
#include "support/thread_ranks.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

constexpr std::array<double, 6> kRightHalf{0.1, -5, -5, 5, 5, 5}, kAll{-99, -99, -99, 99, 99, 99};

struct Counts {
    size_t inside = 0, outside = 0;
};

Counts counts_of(const Gaussians& splats, const std::array<double, 6>& region) {
    TrainOptions options;
    options.region = region;
    Counts counts;
    for (size_t i = 0; i < splats.size(); ++i)
        ++(train::in_region(options, splats.world_mean(i)) ? counts.inside : counts.outside);
    return counts;
}

TrainOptions growing(Strategy strategy) {
    TrainOptions options = quick(100);
    options.strategy = strategy;
    options.max_splats = 150;
    options.grow_gradient = 1e-6;
    options.growth = 1.3;
    // Splats stay where they start, and copies where their source is.
    options.means_rate = options.means_rate_final = 1e-7;
    options.noise_rate = options.copy_spread = 0;
    options.split_scale = 10;
    return options;
}

Gaussians train_whole(const TrainOptions& options, int ranks = 1) {
    const Dataset& dataset = small_capture().dataset;
    Gaussians result;
    run_ranks(ranks, [&](std::shared_ptr<Ranks> group) {
        Trainer trainer(ranks > 1 ? open_test_device(false) : device(), dataset, all_frames(dataset),
                        shaken_start(small_capture(), 0.05, 1, 0), options, group);
        if (group->rank() != 0) return trainer.follow();
        while (trainer.steps_done() < options.steps) trainer.step();
        trainer.keep_waiting();
        result = trainer.gaussians();
    });
    return result;
}

TEST(Region, GetsAllNewSplats) {
    const Counts start = counts_of(shaken_start(small_capture(), 0.05, 1, 0), kRightHalf);
    ASSERT_GT(start.inside, 5u);
    ASSERT_GT(start.outside, 5u);
    for (const Strategy strategy : {Strategy::adc, Strategy::mcmc}) {
        TrainOptions options = growing(strategy);
        const Counts without = counts_of(train_whole(options), kRightHalf);
        options.region = kRightHalf;
        const Counts with = counts_of(train_whole(options), kRightHalf);
        printf("    %zu + %zu splats at first, %zu + %zu without a region, %zu + %zu with it\n", start.inside,
               start.outside, without.inside, without.outside, with.inside, with.outside);
        EXPECT_GT(without.outside, start.outside);
        EXPECT_LE(with.outside, start.outside);
        EXPECT_GT(with.inside, 2 * start.inside);
    }
}

TEST(Region, ThatHoldsEverythingChangesNoByte) {
    for (const Strategy strategy : {Strategy::adc, Strategy::mcmc}) {
        TrainOptions options = growing(strategy);
        const Gaussians without = train_whole(options);
        options.region = kAll;
        const Gaussians with = train_whole(options);
        EXPECT_TRUE(with.means == without.means && with.sh == without.sh);
        options.region = kRightHalf;
        const Gaussians half = train_whole(options), ranks = train_whole(options, 2);
        EXPECT_TRUE(half.means != without.means);
        EXPECT_TRUE(ranks.means == half.means && ranks.sh == half.sh);
    }
}

TEST(Region, LimitsTheFirstSplatsBetweenPoints) {
    RunOptions options;
    options.dense_start = DenseStart::on;
    options.train.max_splats = 70;
    options.train.sh_degree = 0;
    const Dataset& dataset = small_capture().dataset;
    const auto first = [&] { return train::initial_splats(options, dataset, all_frames(dataset)); };
    const Counts points = counts_of(gaussians_from_points(dataset.points, 0), kRightHalf);
    EXPECT_GT(counts_of(first(), kRightHalf).outside, points.outside);
    options.train.region = kRightHalf;
    const Counts limited = counts_of(first(), kRightHalf);
    EXPECT_EQ(limited.outside, points.outside);
    EXPECT_GT(limited.inside, points.inside);
}

TEST(Region, WithoutFirstSplatsOrWithoutGrowthIsAnError) {
    RunOptions options;
    options.dataset = small_capture().folder.path();
    options.train.steps = 5;
    options.train.region = {{50, 50, 50, 60, 60, 60}};
    const TempFolder folder;
    options.output = folder / "run";
    const auto error = [&] {
        try {
            run_training(options);
        } catch (const InputError& e) {
            return std::string(e.what());
        }
        return std::string();
    };
    EXPECT_NE(error().find("--region: none of the first splats is in this box"), std::string::npos)
        << error();
    options.train.region = kAll;
    options.train.strategy = Strategy::none;
    EXPECT_NE(error().find("--region and --strategy none exclude each other"), std::string::npos) << error();
}

}  // namespace
}  // namespace ewa::test
