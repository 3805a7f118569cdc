// SPDX-License-Identifier: Apache-2.0
// Signals that ask a program to end: once, again and again while it saves, and at moments when it has nothing
// to save.
#include <fcntl.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "cli/faults_test.h"

namespace {

using namespace ewa::test;
namespace fs = std::filesystem;
using Signals = FaultsTest;

/// Signal after signal, at each submission, and opening, writing, renaming and removal of a file, from the
/// `first` on.
Circumstances storm(int first, int signal) {
    return with_fault("EWA_FAULT_SIGNAL", std::to_string(first) + "," + std::to_string(signal));
}

TEST_F(Signals, AskATrainingToEnd) {
    for (const int signal : {SIGTERM, SIGHUP, SIGINT, SIGUSR1, SIGXCPU})
        for (const int submission : signal == SIGTERM ? std::vector{1, 2, 20, 55} : std::vector{20}) {
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

TEST_F(Signals, AHangupEndsNothingUnderNohup) {
    Circumstances held = held_at(20, folder / "held", SIGHUP);
    held.nohup = true;
    expect_success(train("o", {}, held));
    EXPECT_EQ(read_json(folder / "o/summary.json")["steps"], 60);
}

TEST_F(Signals, ThatComeAgainAskForNothingElse) {
    for (const int signal : {SIGTERM, SIGINT}) {
        SCOPED_TRACE(signal);
        const std::string twice = "twice" + std::to_string(signal), many = "many" + std::to_string(signal);
        // As from timeout(1), which signals the program and then its group.
        Circumstances again = held_at(20, folder / "held", signal);
        again.times = 2;
        for (const auto& [out, circumstances] : {std::pair{twice, again}, {many, storm(40, signal)}}) {
            const Outcome outcome = train(out, {"--save-every", "0"}, circumstances);
            ASSERT_EQ(outcome.status, 130);
            EXPECT_EQ(outcome.err, "") << "no terminal has to be told anything";
            EXPECT_EQ(read_json(folder / (out + "/summary.json"))["interrupted"], true);
            EXPECT_TRUE(fs::exists(folder / (out + "/checkpoint.ewa")));
            EXPECT_TRUE(fs::exists(folder / (out + "/splats.ply")));
            expect_no_traces(out);
            expect_goes_on(out);
        }
    }
}

/// Between the last step and the end the training is saved; what is left is to say how good it is.
TEST_F(Signals, EndTheEvaluationOfAFinishedTraining) {
    expect_success(train("o"));
    const std::string splats = read_file(folder / "o/splats.ply");
    // Config, splats and checkpoint are three files, each opened, written and renamed: the next is a picture.
    int cut_short = 0;
    for (const int moment : {12, 16, 20, 24, 28}) {
        const int status = train("o", {}, storm(moment, SIGTERM)).status;
        if (status == 0) break;
        ASSERT_TRUE(status == 130) << status;
        ++cut_short;
        EXPECT_EQ(read_json(folder / "o/summary.json")["interrupted"], true);
        EXPECT_EQ(read_json(folder / "o/summary.json")["steps"], 60);
        EXPECT_EQ(read_file(folder / "o/splats.ply"), splats);
        expect_no_traces("o");
    }
    EXPECT_GT(cut_short, 1);
    const Outcome told = run_ewa({"train", folder / "o", "--resume"}, storm(16, SIGTERM));
    EXPECT_EQ(told.status, 130);
    EXPECT_NE(told.out.find("trained 60 steps"), std::string::npos) << told.out;
    EXPECT_NE(told.out.find("the evaluation was interrupted; to complete it: ewa train"), std::string::npos)
        << told.out;
    expect_goes_on("o");
}

TEST_F(Signals, EndARenderingBetweenPictures) {
    const auto render = [&](const Circumstances& circumstances) {
        return run_ewa(
                   {"render", folder / "s.ply", "--cameras", folder / "data", "-o", folder / "r", "--quiet"},
                   circumstances)
            .status;
    };
    ASSERT_EQ(render(storm(12, SIGTERM)), 130);
    expect_no_traces("r");
    const auto some = files_below(folder / "r");
    EXPECT_LT(some.size(), 4u);
    EXPECT_EQ(render({}), 0);
    EXPECT_EQ(files_below(folder / "r").size(), 4u);
}

TEST_F(Signals, EndRenderingADatasetBetweenViews) {
    const auto render = [&](const std::string& out, const Circumstances& circumstances) {
        return run_ewa({"dataset", std::string(EWA_SOURCE_DIR) + "/scenes/plaster.gltf", "-o", folder / out,
                        "--views", "4", "--size", "24x16", "--samples", "2", "--points", "200", "--quiet"},
                       circumstances)
            .status;
    };
    ASSERT_EQ(render("d", storm(12, SIGINT)), 130);
    EXPECT_FALSE(fs::exists(folder / "d/transforms.json"));
    expect_no_traces("d");
    ASSERT_EQ(render("d", {}), 0);
    ASSERT_EQ(render("whole", {}), 0);
    EXPECT_EQ(files_below(folder / "d"), files_below(folder / "whole"));
    for (const std::string& file : files_below(folder / "d"))
        EXPECT_EQ(read_file(folder / ("d/" + file)), read_file(folder / ("whole/" + file))) << file;
}

/// A command without anything to save ends at once, and its file is the old one or the new.
TEST_F(Signals, LeaveNoHalfWrittenFile) {
    fs::create_directory(folder / "c");
    int ended = 0;
    for (int moment = 1; moment < 40; ++moment) {
        write_file(folder / "c/o.ply", "old");
        const int status =
            run_ewa({"convert", folder / "s.ply", folder / "c/o.ply"}, storm(moment, SIGTERM)).status;
        EXPECT_EQ(files_below(folder / "c"), Names{"o.ply"}) << moment;
        if (status == 0) break;
        EXPECT_EQ(status, 128 + SIGTERM);
        EXPECT_EQ(read_file(folder / "c/o.ply"), "old");
        ++ended;
    }
    EXPECT_GE(ended, 3) << "to open, write and rename are three moments";
    EXPECT_GT(read_file(folder / "c/o.ply").size(), 1000u);
}

/// A terminal of its own for standard error. Reads on the side, or what fills it would hold the program.
class Terminal {
  public:
    Terminal() : master_(posix_openpt(O_RDWR | O_NOCTTY)) {
        if (master_ < 0 || grantpt(master_) != 0 || unlockpt(master_) != 0)
            throw std::runtime_error("no terminal to be had");
        path_ = ptsname(master_);
        slave_ = open(path_.c_str(), O_RDWR | O_NOCTTY);  // or what was said goes with the program
        if (slave_ < 0) throw std::runtime_error(path_ + " cannot be opened");
        reader_ = std::thread([this] {
            std::array<char, 4096> bytes;
            for (ssize_t n = 0; (n = read(master_, bytes.data(), bytes.size())) > 0;)
                said_.append(bytes.data(), size_t(n));
        });
    }
    Terminal(const Terminal&) = delete;
    Terminal& operator=(const Terminal&) = delete;
    ~Terminal() {
        said();
        close(master_);
    }
    const std::string& path() const { return path_; }
    /// What is written waits, as after Ctrl-S: until asked to stop, or, lest the program never gets as far,
    /// for a minute.
    std::jthread stand_still() {
        tcflow(slave_, TCOOFF);
        return std::jthread([this](const std::stop_token& enough) {
            std::mutex mutex;
            std::unique_lock lock(mutex);
            std::condition_variable_any().wait_for(lock, enough, std::chrono::minutes(1),
                                                   [] { return false; });
            tcflow(slave_, TCOON);
        });
    }
    /// All that was said on it, at the end of its use.
    const std::string& said() {
        if (reader_.joinable()) {
            close(slave_);  // the last who has it open: the reader ends
            reader_.join();
        }
        return said_;
    }

  private:
    int master_ = -1, slave_ = -1;
    std::string path_, said_;
    std::thread reader_;
};

/// What still ends at once, and how somebody at a terminal learns of it: from whichever thread is the first
/// to be signalled, while others are, and once.
TEST_F(Signals, CtrlBackslashEndsAtOnceAndATerminalSaysSo) {
    Terminal terminal;
    Circumstances held = held_at(20, folder / "held", SIGINT);
    held.times = 3;
    held.err_path = terminal.path();
    {
        std::jthread still = terminal.stand_still();
        held.then = [&still, then = held.then] {
            still.request_stop();
            then();
        };
        EXPECT_EQ(train("o", {}, held).status, 130);
    }
    const std::string& said = terminal.said();
    EXPECT_NE(said.find("Ctrl-\\ ends at once"), std::string::npos) << said;
    EXPECT_EQ(said.find("Ctrl-\\"), said.rfind("Ctrl-\\")) << "once is enough";

    EXPECT_EQ(train("p", {}, held_at(20, folder / "held", SIGQUIT)).status, 128 + SIGQUIT);
    expect_goes_on("p");
}

}  // namespace
