// SPDX-License-Identifier: Apache-2.0
// Faults met in the middle of a training: one clear line, and what was saved is whole and goes on to the
// bytes of an undisturbed run. faults/faults.cpp injects them.
#include <gtest/gtest.h>

#include <csignal>

#include "cli/expect.h"
#include "cli/faulty.h"

namespace {

using namespace ewa::test;
namespace fs = std::filesystem;
using Names = std::vector<std::string>;

class Faults : public testing::Test {
  protected:
    void SetUp() override {
        make_dataset(folder / "data");
        make_splats(folder / "s.ply");
    }
    Outcome train(const std::string& out, const Names& more = {}, const Circumstances& circumstances = {}) {
        Names arguments{"train",  folder / "data",  "-o",      folder / out,
                        "--init", folder / "s.ply", "--quiet", "--resume"};
        const Names defaults{"--steps", "60", "--seed", "4", "--strategy", "none", "--save-every", "5"};
        for (size_t i = 0; i < defaults.size(); i += 2)
            if (std::find(more.begin(), more.end(), defaults[i]) == more.end())
                arguments.insert(arguments.end(), {defaults[i], defaults[i + 1]});
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_ewa(arguments, circumstances);
    }
    /// Once the fault is gone the run goes on, and ends as one that met none.
    void expect_goes_on(const std::string& out, const Names& more = {}) {
        expect_success(train(out, more));
        if (!fs::exists(folder / "whole")) expect_success(train("whole", more));
        EXPECT_EQ(read_file(folder / (out + "/splats.ply")), read_file(folder / "whole/splats.ply"));
        EXPECT_EQ(files_below(folder / out), files_below(folder / "whole"));
    }
    Folder folder;
};

TEST_F(Faults, OutOfDeviceMemory) {
    expect_failure(train("first", {}, with_fault("EWA_FAULT_ALLOCATIONS", "1")), 1, "out of device memory");
    int failed = 0;
    for (const int at : {4, 9, 15, 22, 30, 40, 55, 75, 100}) {
        const Outcome outcome = train("o", {}, with_fault("EWA_FAULT_ALLOCATIONS", std::to_string(at)));
        if (outcome.status == 0) break;
        ++failed;
        expect_failure(outcome, 1, "out of device memory");
        EXPECT_NE(outcome.err.find("MiB"), std::string::npos) << outcome.err;
    }
    EXPECT_GT(failed, 3);
    expect_goes_on("o");
}

TEST_F(Faults, DeviceLost) {
    for (const char* variable : {"EWA_FAULT_SUBMITS", "EWA_FAULT_WAITS"}) {
        SCOPED_TRACE(variable);
        const std::string out = std::string("o") + variable;
        int failed = 0;
        for (const int at : {1, 2, 7, 23, 45}) {
            const Outcome outcome = train(out, {}, with_fault(variable, std::to_string(at)));
            if (outcome.status == 0) break;  // what was left to do took fewer
            ++failed;
            expect_failure(outcome, 1, "lost");
        }
        EXPECT_GT(failed, 2);
        expect_goes_on(out);
    }
    const std::string splats = folder / "s.ply", data = folder / "data";
    const Circumstances lost = with_fault("EWA_FAULT_SUBMITS", "1");
    expect_failure(run_ewa({"render", splats, "--cameras", data, "-o", folder / "r", "--quiet"}, lost), 1,
                   "lost");
    expect_failure(run_ewa({"eval", splats, data, "--split", "all"}, lost), 1, "lost");
    expect_failure(run_ewa({"grad", splats, data, "--frame", "0", "-o", folder / "g.ply"}, lost), 1, "lost");
    EXPECT_FALSE(fs::exists(folder / "g.ply"));
}

TEST_F(Faults, FullDisk) {
    // Whatever file it is that does not fit: config, metrics, checkpoint, splats, pictures, report.
    for (const int bytes : {0, 100, 900, 5000, 20000, 60000, 120000}) {
        const Outcome outcome = train("o", {}, with_fault("EWA_FAULT_BYTES", std::to_string(bytes)));
        if (outcome.status == 0) continue;
        expect_failure(outcome, 1, "No space left");
        EXPECT_NE(outcome.err.find("/o/"), std::string::npos) << outcome.err;
        for (const std::string& file : files_below(folder / "o"))
            EXPECT_EQ(file.find(".tmp"), std::string::npos) << file;
    }
    expect_failure(train("p", {}, with_fault("EWA_FAULT_BYTES", "100")), 1, "No space left");
    expect_goes_on("o");
}

TEST_F(Faults, ReadOnlyFolder) {
    expect_success(train("o"));
    const std::string before = read_file(folder / "o/splats.ply");
    const Circumstances closed = with_fault("EWA_FAULT_READ_ONLY", folder / "o");
    expect_failure(train("o", {}, closed), 1, "Read-only");
    EXPECT_EQ(read_file(folder / "o/splats.ply"), before);
    const std::string splats = folder / "s.ply", data = folder / "data";
    expect_failure(run_ewa({"render", splats, "--cameras", data, "-o", folder / "o", "--quiet"}, closed), 1,
                   "Read-only");
    expect_failure(run_ewa({"convert", splats, folder / "o/s.spz"}, closed), 1, "Read-only");
    expect_failure(run_ewa({"compare", folder / "data/images/0.png", folder / "data/images/1.png",
                            "--heat-map", folder / "o/m.png"},
                           closed),
                   1, "Read-only");
}

TEST_F(Faults, APhotographVanishes) {
    const Names more{"--image-cache", "0", "--save-every", "0"};
    const Circumstances vanishing = held_at(
        20, folder / "held", 0, [&] { fs::rename(folder / "data/images/2.png", folder / "away.png"); });
    expect_failure(train("o", more, vanishing), 2, "2.png");
    ASSERT_TRUE(fs::exists(folder / "o/checkpoint.ewa"));
    fs::rename(folder / "away.png", folder / "data/images/2.png");
    expect_goes_on("o", more);
}

TEST_F(Faults, ASecondTrainerInTheSameFolder) {
    Outcome refused;
    expect_success(train("o", {}, held_at(20, folder / "held", 0, [&] { refused = train("o"); })));
    expect_failure(refused, 1, "another process");
    expect_success(train("whole"));
    EXPECT_EQ(read_file(folder / "o/splats.ply"), read_file(folder / "whole/splats.ply"));
}

TEST_F(Faults, SignalsThatAskToEnd) {
    for (const int signal : {SIGTERM, SIGHUP, SIGINT})
        for (const int submission : {1, 2, 20, 55}) {
            std::string out = std::to_string(signal);
            out.append("_").append(std::to_string(submission));
            SCOPED_TRACE(out);
            ASSERT_EQ(train(out, {}, held_at(submission, folder / "held", signal)).status, 130);
            const auto summary = read_json(folder / (out + "/summary.json"));
            EXPECT_EQ(summary["interrupted"], true);
            EXPECT_LT(summary["steps"], 60);
            expect_goes_on(out);
        }
}

}  // namespace
