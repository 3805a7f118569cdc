// SPDX-License-Identifier: Apache-2.0
// `ewa bench` starts ewa-bench, which is beside it.
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>

#include "cli/expect.h"

namespace {

using namespace ewa::test;
namespace fs = std::filesystem;

/// A copy of ewa, with a script in the place of ewa-bench.
class BenchStart : public testing::Test {
  protected:
    BenchStart() {
        fs::create_directory(folder / "bin");
        fs::create_directory(folder / "tmp");
        fs::copy_file(EWA_PROGRAM, folder / "bin/ewa");
    }

    void put_script(const std::string& text) const {
        write_file(folder / "bin/ewa-bench", "#!/bin/sh\n" + text);
        fs::permissions(folder / "bin/ewa-bench", fs::perms::owner_all);
    }

    Outcome bench(std::vector<std::string> arguments, Circumstances circumstances = {}) const {
        arguments.insert(arguments.begin(), "bench");
        circumstances.program = folder / "bin/ewa";
        circumstances.environment = {{"TMPDIR", folder / "tmp"}};
        return run_ewa(arguments, circumstances);
    }

    bool left_nothing() const { return fs::is_empty(folder / "tmp"); }

    Folder folder;
};

TEST_F(BenchStart, ArgumentsAndExitStatusPassThrough) {
    put_script("printf '%s\\n' \"$@\"\nexit 7\n");
    const Outcome outcome =
        bench({"--cases", "sort, capture*", "--check", "--runs", "1k", "--json", "a b.json"});
    EXPECT_EQ(outcome.status, 7);
    EXPECT_EQ(outcome.err, "");
    EXPECT_EQ(outcome.out, "--json=a b.json\n--cases=sort, capture*\n--runs=1000\n--check=true\n");
    EXPECT_EQ(bench({"--list"}).out, "--list=true\n");
}

TEST_F(BenchStart, AnOptionThatIsUnknownStartsNothing) {
    put_script("echo started\n");
    const Outcome outcome = bench({"--stabilty"});
    expect_failure(outcome, 2, "--stability");
    EXPECT_EQ(outcome.out, "");
}

TEST_F(BenchStart, ASplatFileComesAsASceneFileOfItsName) {
    put_script("for last; do :; done\nprintf '%s\\n' \"$@\"\nhead -c 7 \"$last\"\n");
    make_splats(folder / "lamp.spz");
    const Outcome outcome = bench({"--stability", folder / "lamp.spz", "--training-steps", "0"});
    expect_success(outcome);
    EXPECT_TRUE(outcome.out.starts_with("--stability=true\n--training-steps=0\n" + folder / "tmp/ewa-bench-"))
        << outcome.out;
    EXPECT_TRUE(outcome.out.ends_with("/lamp.spz\newascn1")) << outcome.out;
    EXPECT_TRUE(left_nothing());
}

TEST_F(BenchStart, SignalsGoToTheProgram) {
    make_splats(folder / "s.ply");
    for (const int signal : {SIGTERM, SIGINT}) {
        const std::string begun = folder / ("begun" + std::to_string(signal));
        put_script("echo . > '" + begun + "'\nexec sleep 600\n");
        const Outcome outcome =
            bench({"--stability", folder / "s.ply"}, {.await_file = begun, .signal = signal});
        EXPECT_EQ(outcome.status, 128 + signal);
        EXPECT_TRUE(left_nothing());
    }
}

TEST_F(BenchStart, AMissingProgramIsNamed) {
    expect_failure(bench({"--list"}), 1, folder / "bin/ewa-bench");
    make_splats(folder / "s.ply");
    expect_failure(bench({"--stability", folder / "s.ply"}), 1, "scripts/build");
    EXPECT_TRUE(left_nothing());
}

TEST(Bench, ListsWhatTheProgramLists) {
    const Outcome outcome = run_ewa({"bench", "--list"});
    expect_success(outcome);
    EXPECT_EQ(outcome.out, run_ewa({"--list"}, {.program = EWA_BENCH_PROGRAM}).out);
    EXPECT_NE(outcome.out.find("first_step"), std::string::npos) << outcome.out;
}

TEST(Bench, TheStabilityOfASplatFileIsMeasured) {
    const Folder folder;
    make_splats(folder / "lamp.spz");
    const Outcome outcome = run_ewa({"bench", "--stability", folder / "lamp.spz", "--training-steps", "0",
                                     "--json", folder / "o/s.json"});
    EXPECT_EQ(outcome.err, "");
    const nlohmann::json results = read_json(folder / "o/s.json");
    ASSERT_EQ(results.at("cases").size(), 1u);
    EXPECT_EQ(results.at("cases")[0].at("name"), "lamp.spz");
    EXPECT_EQ(results.at("cases")[0].at("splats"), 50);
    EXPECT_EQ(outcome.status, results.at("cases")[0].at("good") == true ? 0 : 1) << outcome.out;
}

}  // namespace
