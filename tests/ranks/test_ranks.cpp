// SPDX-License-Identifier: Apache-2.0
// What needs no launcher: a process alone, the environment of launchers, and the division of cores.
#include <gtest/gtest.h>

#include <array>
#include <map>

#include "ranks/launcher.h"
#include "ranks/node.h"
#include "ranks/open.h"

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

}  // namespace
