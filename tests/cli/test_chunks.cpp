// SPDX-License-Identifier: Apache-2.0
// ewa train --device-memory: a scene that is larger than the device.
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <filesystem>

#include "cli/expect.h"
#include "cli/faulty.h"

namespace fs = std::filesystem;

namespace {

using namespace ewa::test;
using Names = std::vector<std::string>;

class DeviceMemory : public testing::Test {
  protected:
    void SetUp() override {
        make_dataset(folder / "data");
        make_splats(folder / "s.ply", 6000, 3);
    }
    Outcome train(const std::string& out, const Names& more, const Circumstances& circumstances = {}) {
        Names arguments{"train", folder / "data", "-o",   folder / out, "--init", folder / "s.ply", "--steps",
                        "40",    "--max-splats",  "6600", "--quiet"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_ewa(arguments, circumstances);
    }
    Folder folder;
};

const Names kLimit{"--device-memory", "0.003"};

Names with_strategy(const std::string& strategy, Names more = {}) {
    more.insert(more.end(), {"--strategy", strategy});
    return more;
}

TEST_F(DeviceMemory, GivesTheSameBytesWithinTheLimit) {
    for (const std::string strategy : {"adc", "mcmc"}) {
        SCOPED_TRACE(strategy);
        expect_success(train(strategy + "whole", with_strategy(strategy)));
        expect_success(train(strategy + "limited", with_strategy(strategy, kLimit)));
        EXPECT_EQ(read_file(folder / (strategy + "whole/splats.ply")),
                  read_file(folder / (strategy + "limited/splats.ply")));
        const auto whole = read_json(folder / (strategy + "whole/summary.json")),
                   summary = read_json(folder / (strategy + "limited/summary.json"));
        EXPECT_FALSE(whole.contains("chunks"));
        const uint64_t limit = summary["chunks"]["device_memory_bytes"];
        EXPECT_EQ(limit, uint64_t(0.003 * (1 << 30)));
        EXPECT_LE(summary["peak_device_bytes"], limit);  // with the evaluation and the report
        EXPECT_GE(summary["chunks"]["count"], 2);
        EXPECT_GT(summary["chunks"]["streamed_bytes_per_step"], 0);
        EXPECT_GT(summary["chunks"]["state_bytes"], limit / 2);
        EXPECT_EQ(summary["test_psnr"], whole["test_psnr"]);
        EXPECT_NE(read_file(folder / (strategy + "limited/report.html")).find("Larger than the device"),
                  std::string::npos);
    }
}

TEST_F(DeviceMemory, GoesOnAfterCtrlCWithAnotherLimit) {
    ASSERT_EQ(train("o", with_strategy("adc", kLimit), held_at(60, folder / "held", SIGINT)).status, 130);
    const int done = read_json(folder / "o/summary.json")["steps"];
    ASSERT_GT(done, 0);
    ASSERT_LT(done, 40);
    expect_success(train("o", with_strategy("adc", {"--resume"})));
    expect_success(train("whole", with_strategy("adc")));
    EXPECT_EQ(read_file(folder / "o/splats.ply"), read_file(folder / "whole/splats.ply"));
}

TEST_F(DeviceMemory, RefusesWhatItCannotDo) {
    const Outcome tiny = train("o", {"--device-memory", "1e-9"});
    EXPECT_EQ(tiny.status, 2);
    EXPECT_NE(tiny.err.find("0.001 GiB"), std::string::npos) << tiny.err;
    EXPECT_FALSE(fs::exists(folder / "o"));
}

/// At any moment, also while chunks wait for each other.
TEST_F(DeviceMemory, AFaultEndsItWithOneLine) {
    for (const auto& [variable, text] : {std::pair{"EWA_FAULT_SUBMITS", "lost"},
                                         {"EWA_FAULT_WAITS", "lost"},
                                         {"EWA_FAULT_ALLOCATIONS", "memory"}}) {
        int failed = 0;
        for (const int at : {60, 300, 333, 366, 400, 433, 466, 500}) {
            SCOPED_TRACE(std::string(variable) + " " + std::to_string(at));
            const Outcome outcome =
                train("o", with_strategy("mcmc", kLimit), with_fault(variable, std::to_string(at)));
            if (outcome.status == 0) break;
            ++failed;
            expect_failure(outcome, 1, text);
        }
        EXPECT_GT(failed, 4);
    }
}

TEST_F(DeviceMemory, TooLittleIsOneLine) {
    expect_failure(train("o", {"--device-memory", "0.001"}), 1,
                   "--device-memory 0.001 is too little: this needs 0.00");
    expect_failure(train("o", {"--device-memory", "-1"}), 2, "'-1' is not a number from 0 to 65536");
    expect_failure(train("o", {"--device-memory", "1", "--refine-poses"}), 2,
                   "--device-memory and --refine-poses exclude each other");
}

}  // namespace
