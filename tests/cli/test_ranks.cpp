// SPDX-License-Identifier: Apache-2.0
// ewa train on several ranks under mpirun, on four small pictures. Skipped where there is no MPI.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <thread>

#include "cli/expect.h"
#include "cli/faulty.h"
#include "ewa/splat_files.h"

namespace {

using namespace ewa::test;
namespace fs = std::filesystem;
using Names = std::vector<std::string>;

#ifdef EWA_MPIRUN

/// The processes whose arguments contain this text, except mpirun.
std::vector<pid_t> processes_with(const std::string& text) {
    std::vector<pid_t> found;
    for (const auto& entry : fs::directory_iterator("/proc")) {
        const std::string name = entry.path().filename();
        if (name.find_first_not_of("0123456789") != std::string::npos) continue;
        std::ifstream file(entry.path() / "cmdline");
        const std::string line((std::istreambuf_iterator<char>(file)), {});
        if (line.starts_with(EWA_PROGRAM) && line.find(text) != std::string::npos)
            found.push_back(std::stoi(name));
    }
    std::sort(found.begin(), found.end());
    return found;
}

std::string node_name() {
    char name[256] = "";
    gethostname(name, sizeof(name) - 1);
    return name;
}

class TrainRanks : public testing::Test {
  protected:
    void SetUp() override {
        make_dataset(folder / "data");
        make_splats(folder / "s.ply", 120);
    }
    Names arguments_of(const std::string& data, const std::string& out, const Names& more) {
        Names arguments{"train",        data,      "-o",     folder / out, "--init",  folder / "s.ply",
                        "--max-splats", "400",     "--seed", "5",          "--quiet", "--strategy",
                        "mcmc",         "--batch", batch,    "--steps",    steps};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return arguments;
    }
    Outcome alone(const std::string& out, const Names& more = {}) {
        return run_ewa(arguments_of(folder / "data", out, more));
    }
    /// programs: the arguments of each rank's ewa.
    Outcome mpirun(const std::vector<Names>& programs, const Names& options = {},
                   Circumstances circumstances = {}) {
        Names arguments{"-q", "--oversubscribe", "--bind-to", "none"};
        arguments.insert(arguments.end(), options.begin(), options.end());
        for (const Names& program : programs) {
            if (&program != &programs.front()) arguments.push_back(":");
            for (const char* word : {"-n", "1"}) arguments.push_back(word);
            const Names& prefix = prefixes[int(&program - programs.data())];
            arguments.insert(arguments.end(), prefix.begin(), prefix.end());
            arguments.push_back(EWA_PROGRAM);
            arguments.insert(arguments.end(), program.begin(), program.end());
        }
        circumstances.program = EWA_MPIRUN;
        circumstances.environment = {{"OMPI_ALLOW_RUN_AS_ROOT", "1"},
                                     {"OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"}};
        return run_ewa(arguments, circumstances);
    }
    Outcome ranks(size_t count, const std::string& out, const Names& more = {}, const Names& options = {},
                  Circumstances circumstances = {}) {
        const Names program = arguments_of(folder / "data", out, more);
        return mpirun(std::vector<Names>(count, program), options, std::move(circumstances));
    }
    /// Status 2 and these words, and the run has no splats.
    void expect_refused(const Outcome& outcome, const std::vector<std::string>& parts) {
        EXPECT_EQ(outcome.status, 2) << outcome.err;
        for (const std::string& part : parts)
            EXPECT_NE(outcome.err.find(part), std::string::npos) << part << "\n" << outcome.err;
        EXPECT_FALSE(fs::exists(folder / "o/splats.ply"));
    }
    std::string splats(const std::string& out) { return read_file(folder / (out + "/splats.ply")); }
    /// The splats and the checkpoint are those of another run.
    void expect_same(const std::string& out, const std::string& other) {
        EXPECT_TRUE(splats(out) == splats(other));
        EXPECT_TRUE(read_file(folder / (out + "/checkpoint.ewa")) ==
                    read_file(folder / (other + "/checkpoint.ewa")));
    }

    Folder folder;
    std::map<int, Names> prefixes;  // of a rank's command
    std::string steps = "120", batch = "2";
};

TEST_F(TrainRanks, EndWithTheBytesOfOneProcess) {
    expect_success(alone("one"));
    expect_success(ranks(2, "two"));
    expect_same("two", "one");
    expect_success(ranks(3, "three", {}, {"--mca", "btl", "self,tcp"}));
    expect_same("three", "one");

    const auto figures = read_json(folder / "three/summary.json")["ranks"];
    ASSERT_EQ(figures.size(), 3u);
    for (size_t rank = 0; rank < 3; ++rank) {
        EXPECT_EQ(figures[rank]["name"].get<std::string>().find("rank " + std::to_string(rank) + " ("), 0u);
        EXPECT_GT(figures[rank]["sent_bytes_per_view"].get<double>(), 0);
    }
    for (const char* figure : {"test_psnr", "test_ssim", "train_psnr"})
        EXPECT_EQ(read_json(folder / "three/summary.json")[figure],
                  read_json(folder / "one/summary.json")[figure])
            << figure;
    EXPECT_NE(read_file(folder / "three/report.html").find("What the ranks exchanged"), std::string::npos);
    EXPECT_FALSE(read_json(folder / "one/summary.json").contains("ranks"));
}

TEST_F(TrainRanks, DrawBandsOfTheViews) {
    steps = "40";
    batch = "4";
    const Names cut{"--bands", "2"};
    expect_success(alone("one", cut));
    expect_success(ranks(8, "eight", cut));
    EXPECT_EQ(splats("eight"), splats("one"));
    EXPECT_EQ(read_json(folder / "eight/config.json")["bands"], 2);
    EXPECT_EQ(read_file(folder / "eight/report.html").find("draw nothing"), std::string::npos);
}

TEST_F(TrainRanks, SayHowManyOfThemDrawNothing) {
    steps = "4";
    expect_success(ranks(3, "o"));
    EXPECT_NE(read_file(folder / "o/report.html")
                  .find("1 of 3 ranks draw nothing: a step has 2 views in 1 band; --batch 3 or --bands 2 "
                        "lets all draw"),
              std::string::npos);
}

TEST_F(TrainRanks, SaveOnASignalToTheLauncher) {
    steps = "4000";
    Circumstances asking;
    asking.await_file = folder / "o/checkpoint.ewa";
    asking.signal = SIGUSR1;
    const Outcome outcome = ranks(2, "o", {"--save-every", "10"}, {}, asking);
    EXPECT_EQ(outcome.status, 130) << outcome.err;
    EXPECT_TRUE(read_json(folder / "o/summary.json")["interrupted"].get<bool>());
    EXPECT_TRUE(processes_with(folder / "o").empty());
}

/// A run that ends by one fault after another, each time goes on from its checkpoint, and ends with the bytes of an
/// undisturbed one.
class RankFaults : public TrainRanks {
  protected:
    void SetUp() override {
        TrainRanks::SetUp();
        expect_success(alone("whole"));
        const Names begin = arguments_of(folder / "data", "o", {});
        ASSERT_EQ(run_ewa(begin, held_at(20, folder / "held", SIGINT)).status, 130);
    }
    /// Ends two ranks by a fault of one of them.
    Outcome fail(int rank, const Names& variables, Circumstances circumstances = {},
                 const char* timeout = "300") {
        const Names program =
            arguments_of(folder / "data", "o", {"--resume", "--save-every", "10", "--rank-timeout", timeout});
        prefixes[rank] = {"/usr/bin/env", std::string("LD_PRELOAD=") + EWA_FAULTS_LIBRARY};
        prefixes[rank].insert(prefixes[rank].end(), variables.begin(), variables.end());
        // mpirun waits a second between SIGTERM and SIGKILL.
        const Outcome outcome =
            mpirun({program, program}, {"--mca", "odls_base_sigkill_timeout", "0"}, std::move(circumstances));
        prefixes.clear();
        await_end();
        return outcome;
    }
    /// mpirun may return before the system has ended all ranks. One that lives has the lock of the run's folder, or its program.
    void await_end() {
        const int directory = open((folder / "o").c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
        const auto patience = std::chrono::steady_clock::now() + std::chrono::minutes(1);
        while (flock(directory, LOCK_EX | LOCK_NB) != 0 || !processes_with(folder / "o").empty()) {
            if (std::chrono::steady_clock::now() > patience) break;
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        EXPECT_TRUE(processes_with(folder / "o").empty());
        close(directory);
    }
    /// The one line of a rank's error.
    void expect_told(const Outcome& outcome, int rank, const std::string& text) {
        EXPECT_EQ(outcome.status, 1) << outcome.err;
        EXPECT_EQ(outcome.err.find("ewa train: rank " + std::to_string(rank) + " ("), 0u) << outcome.err;
        EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
        // Open MPI's event loop may warn of a connection that the failed rank has closed.
        std::istringstream said(outcome.err);
        std::string line;
        int lines = 0;
        while (std::getline(said, line)) lines += !line.empty() && !line.starts_with("[warn] Epoll ");
        EXPECT_EQ(lines, 1) << outcome.err;
    }
    /// Sends a signal to a rank that stands still before its 20th work for the device.
    Outcome fail_by_signal(int rank, int signal) {
        const std::string held = folder / "held";
        Circumstances sending;
        sending.await_file = held;
        sending.then = [&, rank, signal] {
            const pid_t process = process_of(rank);
            ASSERT_GT(process, 0);
            kill(process, signal);
            fs::remove(held);
        };
        return fail(rank, {"EWA_FAULT_HOLD=20:" + held}, sending, signal == SIGSTOP ? "3" : "300");
    }
    pid_t process_of(int rank) {
        for (const pid_t process : processes_with(folder / "o"))
            if (read_file("/proc/" + std::to_string(process) + "/environ")
                    .find("OMPI_COMM_WORLD_RANK=" + std::to_string(rank) + '\0') != std::string::npos)
                return process;
        return 0;
    }
};

TEST_F(RankFaults, EndTheJobAndCostNoBytes) {
    for (const int rank : {0, 1}) {
        SCOPED_TRACE(rank);
        const std::string number = std::to_string(rank);
        EXPECT_EQ(fail_by_signal(rank, SIGKILL).status, 128 + SIGKILL);
        expect_told(fail_by_signal(rank, SIGSTOP), 1 - rank,
                    ": rank " + number + " (" + node_name() + ") has not answered for 3 s");
        expect_told(fail(rank, {"EWA_FAULT_SUBMITS=20"}), rank, "lost");
    }
    expect_told(fail(1, {"EWA_FAULT_ALLOCATIONS=20"}), 1, "out of device memory");
    expect_told(fail(1, {"EWA_FAULT_HEAP=20"}), 1, "out of host memory");

    const std::string checkpoint = read_file(folder / "o/checkpoint.ewa");
    expect_told(fail(0, {"EWA_FAULT_BYTES=12000"}), 0, "checkpoint.ewa: cannot be written: No space left");
    EXPECT_TRUE(read_file(folder / "o/checkpoint.ewa") == checkpoint);

    // The others write nothing.
    expect_success(fail(1, {"EWA_FAULT_BYTES=0"}));
    expect_same("o", "whole");
}

/// Rank 1 takes its own node from the network before its 20th work for the device.
constexpr const char* kCutsNetwork = R"(#!/bin/sh
held=$1 faults=$2
shift 2
[ "$OMPI_COMM_WORLD_RANK" = 1 ] || exec "$@"
(while [ ! -s "$held" ]; do sleep 0.02; done; ip link set eth0 down; rm "$held") &
exec env LD_PRELOAD="$faults" EWA_FAULT_HOLD="20:$held" "$@"
)";

bool has_namespaces() {
    return geteuid() == 0 && std::system(
                                 "command -v tc > /dev/null && ip netns add ewa-try 2> /dev/null && "
                                 "ip netns delete ewa-try") == 0;
}

TEST_F(RankFaults, ANetworkThatIsCutEndsTheJob) {
    if (!has_namespaces()) GTEST_SKIP() << "needs root, iproute2 and network namespaces";
    write_file(folder / "cut", kCutsNetwork);
    fs::permissions(folder / "cut", fs::perms::owner_all);
    Names arguments{
        "--kill-after",     "5",        "60",           std::string(EWA_SOURCE_DIR) + "/scripts/rank-network",
        "--nodes",          "2",        folder / "cut", folder / "held",
        EWA_FAULTS_LIBRARY, EWA_PROGRAM};
    for (const std::string& word :
         arguments_of(folder / "data", "o", {"--resume", "--save-every", "10", "--rank-timeout", "5"}))
        arguments.push_back(word);
    Circumstances circumstances;
    circumstances.program = "/usr/bin/timeout";
    // Once a rank has failed, mpirun waits a quarter of an hour for the lost node. So it has to notice first.
    circumstances.environment = {{"MPIRUN_OPTIONS",
                                  "--mca oob_tcp_keepalive_time 1 --mca oob_tcp_keepalive_intvl 1 "
                                  "--mca oob_tcp_keepalive_probes 1"}};
    const Outcome outcome = run_ewa(arguments, circumstances);
    EXPECT_NE(outcome.status, 0);
    EXPECT_NE(outcome.status, 124) << "it had not ended after a minute";
    EXPECT_TRUE(outcome.err.find("lost communication with a remote daemon") != std::string::npos ||
                outcome.err.find("rank 1 (node2) has not answered for 5 s") != std::string::npos)
        << outcome.err;
    await_end();
    expect_success(alone("o", {"--resume"}));
    expect_same("o", "whole");
}

TEST_F(TrainRanks, AreRefusedWithDifferentInputs) {
    make_dataset(folder / "other", {"0.png", "1.png", "2.png", "9.png"});
    const Names there = arguments_of(folder / "other", "o", {});
    expect_refused(mpirun({arguments_of(folder / "data", "o", {}), there}),
                   {"has another dataset, or other images or cameras in it than rank 0"});
}

TEST_F(TrainRanks, AreRefusedWithOtherOptions) {
    const Names here = arguments_of(folder / "data", "o", {});
    const std::string there = " on rank 1 (" + node_name() + "), and ",
                      first = " on rank 0 (" + node_name() + ")";
    const auto refused = [&](const Names& other, const std::string& expected) {
        expect_refused(mpirun({here, other}), {expected + first});
    };
    refused(arguments_of(folder / "data", "o", {"--sh-degree", "1"}), "--sh-degree is 1" + there + "auto");
    std::ofstream(folder / "other.json") << R"({"dense-start": "on"})";
    refused(arguments_of(folder / "data", "o", {"--config", folder / "other.json"}),
            "--dense-start is on" + there + "auto");
    steps = "60";
    refused(arguments_of(folder / "data", "o", {}), "--steps is 60" + there + "120");
}

TEST_F(TrainRanks, AreRefusedWithOtherFirstSplats) {
    for (const char* node : {"n0", "n1"}) fs::create_directory(folder / node);
    make_splats(folder / "n0/start.ply", 60);
    make_splats(folder / "n1/start.ply", 40);
    Names each = arguments_of(folder / "data", "o", {});
    each[5] = "start.ply";
    prefixes = {{0, {"--wdir", folder / "n0"}}, {1, {"--wdir", folder / "n1"}}};
    expect_refused(mpirun({each, each}),
                   {"has other first splats (--init, or the dataset's points) than rank 0"});
    fs::copy_file(folder / "n0/start.ply", folder / "n1/start.ply", fs::copy_options::overwrite_existing);
    expect_success(mpirun({each, each}));
}

/// Its node may not have the run's folder.
TEST_F(TrainRanks, TakeTheOptionsOfRankZeroWhereItResumes) {
    steps = "60";
    expect_success(ranks(2, "o"));
    Names other = arguments_of(folder / "data", "elsewhere", {"--resume"});
    steps = "120";
    expect_success(mpirun({arguments_of(folder / "data", "o", {"--resume"}), other}));
    EXPECT_FALSE(fs::exists(folder / "elsewhere"));
    steps = "60";
    expect_success(alone("half"));
    steps = "120";
    expect_success(alone("half", {"--resume"}));
    expect_same("o", "half");
}

/// mpirun itself ends a job of which one process ends after another has joined. Here one ends before.
TEST_F(TrainRanks, DoNotWaitForeverForOneThatNeverJoins) {
    const std::string ended = folder / "ended";
    const std::string wait = "until [ -e '" + ended + "' ]; do sleep 0.1; done; sleep 1; exec \"$0\" \"$@\"";
    prefixes = {{0, {"sh", "-c", wait}}, {1, {"sh", "-c", "\"$0\" \"$@\"; touch '" + ended + "'"}}};
    const Outcome outcome =
        mpirun({arguments_of(folder / "data", "o", {"--rank-timeout", "2"}), {"info", folder / "s.ply"}});
    EXPECT_EQ(outcome.status, 1) << outcome.err;
    EXPECT_NE(outcome.err.find("ewa: MPI has not started after 10 s"), std::string::npos) << outcome.err;
}

TEST_F(TrainRanks, SayWhichOneFailed) {
    Names missing = arguments_of(folder / "data", "o", {});
    missing[1] = folder / "nowhere";
    expect_refused(mpirun({arguments_of(folder / "data", "o", {}), missing}),
                   {"ewa train: rank 1 (", "nowhere"});
    expect_refused(ranks(2, "o", {"--refine-poses"}), {"and --refine-poses exclude each other"});
}

#endif

}  // namespace
