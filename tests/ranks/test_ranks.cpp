// SPDX-License-Identifier: Apache-2.0
// What needs no launcher: a process alone, the environment of launchers, the division of cores, and the cost model.
#include <gtest/gtest.h>

#include <array>
#include <map>

#include "ranks/launcher.h"
#include "ranks/network.h"
#include "ranks/node.h"
#include "ranks/open.h"
#include "ranks/scaling.h"

namespace {

using namespace ewa;
using namespace ewa::ranks;

TEST(Alone, IsTheOnlyRank) {
    const auto ranks = alone();
    EXPECT_EQ(ranks->rank(), 0);
    EXPECT_EQ(ranks->size(), 1);
    const uint64_t own[] = {3, 4};
    EXPECT_EQ(ranks->gather(own), (std::vector<uint64_t>{3, 4}));
}

TEST(Alone, SendsToItself) {
    std::array<std::byte, 3> sent{std::byte(1), std::byte(2), std::byte(3)}, received{};
    std::vector<std::span<const std::byte>> out{sent};
    std::vector<std::span<std::byte>> in{received};
    alone()->exchange(out, in);
    EXPECT_EQ(received, sent);
    in = {sent};
    alone()->exchange(out, in);
    EXPECT_EQ(received, sent);
    out = {{}}, in = {{}};
    alone()->exchange(out, in);
}

TEST(Alone, EndsWithTheStatus) {
    EXPECT_EXIT(alone()->end_all(3), testing::ExitedWithCode(3), "");
}

Launcher launcher_of(const std::map<std::string, const char*>& environment) {
    return find_launcher([&](const std::string& name) {
        const auto found = environment.find(name);
        return found == environment.end() ? nullptr : found->second;
    });
}

TEST(Launchers, OfSeveralProcessesAreFound) {
    EXPECT_FALSE(launcher_of({}).found);
    for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"}) {
        EXPECT_TRUE(launcher_of({{name, "4"}}).found) << name;
        EXPECT_EQ(launcher_of({{name, "4"}}).size, 4) << name;
        for (const char* one : {"1", "0", "", "many", "-3"}) EXPECT_FALSE(launcher_of({{name, one}}).found);
    }
    EXPECT_TRUE(launcher_of({{"PMIX_RANK", "0"}}).found);
    EXPECT_EQ(launcher_of({{"PMIX_RANK", "0"}}).size, 0);
    // mpirun -n 1, and ewa in a batch script of several tasks.
    EXPECT_FALSE(launcher_of({{"PMIX_RANK", "0"}, {"OMPI_COMM_WORLD_SIZE", "1"}}).found);
    EXPECT_FALSE(launcher_of({{"SLURM_NTASKS", "8"}}).found);
}

TEST(Places, ShareTheCoresOfAMachine) {
    const std::vector<Allowed> all = {{7, {0xf}}, {8, {0x1ff}}, {7, {0xf}}, {7, {0xf}}};
    const int local_ranks[] = {0, 0, 1, 2}, local_sizes[] = {3, 1, 3, 3}, cores[] = {1, 9, 1, 1};
    for (int rank = 0; rank < 4; ++rank) {
        const Place place = place_of(all, rank);
        EXPECT_EQ(place.local_rank, local_ranks[rank]);
        EXPECT_EQ(place.local_size, local_sizes[rank]);
        EXPECT_EQ(place.cores, cores[rank]);
    }
    EXPECT_EQ(place_of(std::vector<Allowed>{{1, {0xff}}, {1, {0xff}}}, 1).cores, 4);
    EXPECT_EQ(place_of(std::vector<Allowed>(3, {1, {0x7}}), 2).cores, 1);
}

/// As Slurm does, and mpirun --map-by slot:PE=4.
TEST(Places, KeepTheCoresThatALauncherGave) {
    EXPECT_EQ(place_of(std::vector<Allowed>{{1, {0xf0}}, {1, {0x0f}}}, 0).cores, 4);
    EXPECT_EQ(place_of(std::vector<Allowed>{{1, {0, 0xf0}}, {1, {0xf0, 0}}}, 1).cores, 4);
    EXPECT_EQ(place_of(std::vector<Allowed>{{1, {0x1}}, {1, {0x1}}}, 1).cores, 1);
    EXPECT_EQ(place_of(std::vector<Allowed>{{1, {0x3f}}, {1, {0x30}}}, 0).cores, 5);
}

TEST(Places, OfAProcessAloneHaveAllItsCores) {
    const Place place = find_place(*alone());
    EXPECT_EQ(place.local_rank, 0);
    EXPECT_EQ(place.local_size, 1);
    cpu_set_t cores;
    CPU_ZERO(&cores);
    ASSERT_EQ(sched_getaffinity(0, sizeof cores, &cores), 0);
    EXPECT_EQ(place.cores, CPU_COUNT(&cores));
}

TEST(Places, LimitLavapipeUnlessTheUserDoes) {
    unsetenv("LP_NUM_THREADS");
    limit_lavapipe(3);
    EXPECT_STREQ(getenv("LP_NUM_THREADS"), "3");
    limit_lavapipe(5);
    EXPECT_STREQ(getenv("LP_NUM_THREADS"), "3");
    unsetenv("LP_NUM_THREADS");
}

TEST(Network, OfOneRankIsMeasuredToo) {
    const Network network = measure_network(*alone(), {1000, 100000});
    EXPECT_EQ(network.ranks, 1);
    ASSERT_EQ(network.transfers.size(), 2u);
    EXPECT_EQ(network.transfers[0].bytes, 1000u);
    EXPECT_GE(network.transfers[1].milliseconds, 0);
}

// 1 ms a message, 1 MB a ms.
const Network kNetwork{3, 2, {{1000, 3}, {1000000, 4}, {3000000, 6}}};

TEST(Scaling, OfOneRankIsTheView) {
    const StepCost cost = predict_step({.splats = 1e6, .visible = 0.5, .milliseconds = 50}, kNetwork, 1);
    EXPECT_EQ(cost.sent_bytes, 0);
    EXPECT_EQ(cost.step_ms, 50);
    EXPECT_EQ(cost.views_per_second, 20);
    EXPECT_EQ(cost.efficiency, 1);
}

TEST(Scaling, FollowsFromBytesAndMessages) {
    // A quarter of a million visible splats, two thirds of them for other ranks.
    const ViewCost view{.splats = 1e6, .visible = 0.375, .milliseconds = 50};
    const StepCost cost = predict_step(view, kNetwork, 3);
    EXPECT_DOUBLE_EQ(cost.sent_bytes, 250000 * (48 + 36));
    // Out 12 MB and back 9 MB at 1 MB a ms after the first 3, and four gathers.
    EXPECT_NEAR(cost.exchange_ms, (6 + 9) + (6 + 6) + 4 * 2, 1e-9);
    EXPECT_NEAR(cost.step_ms, 85, 1e-9);
    EXPECT_NEAR(cost.efficiency, 50 / 85.0, 1e-9);
    EXPECT_NEAR(cost.views_per_second, 3000 / 85.0, 1e-9);
    ViewCost absolute = view;
    absolute.absolute_gradients = true;
    EXPECT_NEAR(predict_step(absolute, kNetwork, 3).exchange_ms, 35 + 2, 1e-9);
}

TEST(Scaling, AStepWaitsForTheSlowestOfItsViews) {
    const ViewCost view{.milliseconds = 25, .views = {40, 10, 30, 20}};
    EXPECT_DOUBLE_EQ(predict_step(view, kNetwork, 1).slowest_ms, 25);
    // The slowest of two is 10, 20, 30 or 40 ms in 1, 3, 5 and 7 cases of 16.
    const StepCost two = predict_step(view, kNetwork, 2);
    EXPECT_DOUBLE_EQ(two.slowest_ms, 31.25);
    EXPECT_DOUBLE_EQ(two.step_ms, 31.25 + two.exchange_ms);
    EXPECT_DOUBLE_EQ(two.efficiency, 25 / two.step_ms);
    EXPECT_NEAR(predict_step(view, kNetwork, 1000).slowest_ms, 40, 1e-9);
}

TEST(Scaling, CountsAMessageForEachFurtherRank) {
    ViewCost view{.splats = 1e6, .visible = 0, .milliseconds = 50};
    EXPECT_NEAR(predict_step(view, kNetwork, 3).exchange_ms, 2 * 2 + 4 * 2, 1e-9);
    EXPECT_NEAR(predict_step(view, kNetwork, 64).exchange_ms, 2 * 63 + 4 * 63, 1e-9);
    view.splats = 1e4, view.visible = 1;  // between the sizes that were measured
    const double away = 1e4 * 3 / 4;
    const auto measured = [](double bytes) { return 3 + (bytes - 1000) / 999000; };
    EXPECT_NEAR(predict_step(view, kNetwork, 4).exchange_ms,
                measured(away * 48) + 1 + measured(away * 36) + 1 + 4 * 3, 1e-9);
}

}  // namespace
