// SPDX-License-Identifier: Apache-2.0
// Faults met in the middle of a training: one clear line, and what was saved is whole and goes on to the
// bytes of an undisturbed run. faults/faults.cpp injects them.
#include <sys/stat.h>

#include <map>
#include <set>

#include "cli/faults_test.h"

namespace {

using namespace ewa::test;
namespace fs = std::filesystem;
using Faults = FaultsTest;

/// Which file it is that a name stands for: a file that takes another's place has its own number.
std::map<std::string, uint64_t> inodes(const std::string& folder) {
    std::map<std::string, uint64_t> numbers;
    for (const std::string& file : files_below(folder)) {
        struct stat facts {};
        stat((folder + "/" + file).c_str(), &facts);
        numbers[file] = facts.st_ino;
    }
    return numbers;
}

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
    expect_failure(train("o", {}, with_fault("EWA_FAULT_BLOCKS", "1")), 1, "out of device memory");
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
}

/// What the other commands that draw do when the device fails them at the N-th of what `variable` counts,
/// for each N: one line, no file but whole ones, and afterwards the same command succeeds.
class DeviceFaults : public FaultsTest {
  protected:
    void expect_each_fails_cleanly(const std::string& variable, const std::string& text) {
        const std::string splats = folder / "s.ply", data = folder / "data";
        fs::create_directory(folder / "o");
        const Names commands[] = {
            {"render", splats, "--cameras", data, "-o", folder / "o/r", "--quiet"},
            {"eval", splats, data, "--split", "all", "--json", folder / "o/e.json"},
            {"grad", splats, data, "--frame", "0", "-o", folder / "o/g.ply"},
            {"dataset", std::string(EWA_SOURCE_DIR) + "/scenes/plaster.gltf", "-o", folder / "o/d", "--views",
             "3", "--size", "24x16", "--samples", "2", "--points", "50", "--quiet"}};
        for (const Names& command : commands) {
            SCOPED_TRACE(command[0]);
            // Those that write many files have written some before the fault.
            const bool many = command[0] == "render" || command[0] == "dataset";
            EXPECT_EQ(many ? run_ewa(command).status : 0, 0);
            const std::string undisturbed = everything_below("o");
            start_anew("o");
            int failed = 0;
            for (const int at : {1, 7}) {
                SCOPED_TRACE(at);
                const Outcome outcome = run_ewa(command, with_fault(variable, std::to_string(at)));
                if (outcome.status == 0) break;  // it took fewer
                ++failed;
                expect_failure(outcome, 1, text);
                expect_no_traces("o");
                for (const char* last : {"e.json", "g.ply", "d/transforms.json"})
                    EXPECT_FALSE(fs::exists(folder / ("o/" + std::string(last))));
            }
            EXPECT_GE(failed, 1);
            EXPECT_EQ(run_ewa(command).status, 0);
            EXPECT_TRUE(!many || everything_below("o") == undisturbed);
            start_anew("o");
        }
    }
    void start_anew(const std::string& name) {
        fs::remove_all(folder / name);
        fs::create_directory(folder / name);
    }
    std::string everything_below(const std::string& name) {
        std::string all;
        for (const std::string& file : files_below(folder / name))
            all += file + "\n" + read_file(folder / (name + "/" + file));
        return all;
    }
};

TEST_F(DeviceFaults, OutOfMemory) {
    expect_each_fails_cleanly("EWA_FAULT_ALLOCATIONS", "out of device memory");
}
TEST_F(DeviceFaults, LostWhereWorkIsGivenToIt) {
    expect_each_fails_cleanly("EWA_FAULT_SUBMITS", "lost");
}
TEST_F(DeviceFaults, LostWhereWorkIsWaitedFor) {
    expect_each_fails_cleanly("EWA_FAULT_WAITS", "lost");
}

TEST_F(Faults, FullDisk) {
    // Whatever file it is that does not fit: config, metrics, checkpoint, splats, pictures, report.
    for (const int bytes : {0, 100, 900, 5000, 20000, 60000, 120000}) {
        const Outcome outcome = train("o", {}, with_fault("EWA_FAULT_BYTES", std::to_string(bytes)));
        if (outcome.status == 0) continue;
        expect_failure(outcome, 1, "No space left");
        EXPECT_NE(outcome.err.find("/o/"), std::string::npos) << outcome.err;
        const bool known = outcome.err.find("free some space, then --resume") != std::string::npos;
        EXPECT_EQ(fs::exists(folder / "o/checkpoint.ewa"), known) << outcome.err;
        expect_no_traces("o");
    }
    expect_failure(train("p", {}, with_fault("EWA_FAULT_BYTES", "100")), 1, "No space left");
    expect_goes_on("o");
    // With --serve there is a file more, which comes after the settings and is not to stay.
    const auto limit = std::to_string(fs::file_size(folder / "o/config.json") + 5);
    const Outcome served = train("s", {"--serve", "0"}, with_fault("EWA_FAULT_BYTES", limit));
    expect_failure(served, 1, "s/live.json: cannot be written: No space left");
    EXPECT_EQ(files_below(folder / "s"), (Names{"config.json", "metrics.jsonl"}));
}

/// A quota, or a disk across a network, may report only then that it is full.
class LateFaults : public FaultsTest, public testing::WithParamInterface<const char*> {};

TEST_P(LateFaults, KeepWhatWasThere) {
    expect_success(train("o"));  // once more, it has nothing to do but to write its files anew
    std::set<std::string> refused;
    for (int at = 1; at < 20; ++at) {
        SCOPED_TRACE(at);
        const auto before = inodes(folder / "o");
        const Outcome outcome = train("o", {}, with_fault(GetParam(), std::to_string(at)));
        if (outcome.status == 0) break;
        expect_failure(outcome, 1, "Disk quota exceeded");
        const size_t begin = outcome.err.find("/o/");
        ASSERT_NE(begin, std::string::npos) << outcome.err;
        const std::string file =
            outcome.err.substr(begin + 3, outcome.err.find(": cannot", begin) - begin - 3);
        refused.insert(file);
        const auto after = inodes(folder / "o");
        EXPECT_EQ(after.contains(file), before.contains(file)) << file;
        if (after.contains(file)) {
            EXPECT_EQ(after.at(file), before.at(file)) << file << " is another";
        }
        expect_no_traces("o");
    }
    for (const char* file :
         {"config.json", "splats.ply", "times.json", "checkpoint.ewa", "summary.json", "report.html"})
        EXPECT_TRUE(refused.contains(file)) << file;
    expect_goes_on("o");

    write_file(folder / "c.ply", "old");
    expect_failure(run_ewa({"convert", folder / "s.ply", folder / "c.ply"}, with_fault(GetParam(), "1")), 1,
                   "c.ply: cannot be written to disk: Disk quota exceeded");
    EXPECT_EQ(read_file(folder / "c.ply"), "old");
}

INSTANTIATE_TEST_SUITE_P(Faults, LateFaults, testing::Values("EWA_FAULT_FSYNC", "EWA_FAULT_CLOSE"),
                         [](const auto& tested) { return std::string(tested.param).substr(10); });

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

TEST_F(Faults, AnImageVanishes) {
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
    expect_failure(refused, 1, "another process uses this folder");
    expect_success(train("whole"));
    EXPECT_EQ(read_file(folder / "o/splats.ply"), read_file(folder / "whole/splats.ply"));
}

}  // namespace
