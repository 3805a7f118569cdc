// SPDX-License-Identifier: Apache-2.0
#include "core/process.h"

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "support/temp_folder.h"

namespace {

using namespace ewa;
using core::Ended;
using core::Program;

Program shell(const std::string& script) {
    return {.command = {"sh", "-c", script}, .environment = {}, .log = {}};
}

/// A program's end and its standard output.
std::pair<Ended, std::string> run(const Program& program) {
    std::string text;
    const Ended ended = core::run_program(program, [&](std::string_view piece) {
        text += piece;
        return true;
    });
    return {ended, text};
}

TEST(Process, OutputAndStatusComeBack) {
    EXPECT_EQ(run(shell("echo one; echo two")), std::pair(Ended::done, std::string("one\ntwo\n")));
    EXPECT_EQ(run(shell("echo one; exit 3")), std::pair(Ended::failed, std::string("one\n")));
    EXPECT_EQ(run(shell("kill -9 $$")).first, Ended::failed);
    EXPECT_EQ(run(shell("cat; echo end")).second, "end\n");  // standard input is empty
}

TEST(Process, AMillionBytesArriveInOrder) {
    const auto [ended, text] = run(shell("i=0; while [ $i -lt 20000 ]; do echo $i; i=$((i+1)); done"));
    std::string expected;
    for (int i = 0; i < 20000; ++i) expected.append(std::to_string(i)).append("\n");
    EXPECT_EQ(text, expected);
    EXPECT_EQ(ended, Ended::done);
}

TEST(Process, TheEnvironmentIsThatOfThisProcessWithChanges) {
    setenv("EWA_TEST_KEPT", "kept", 1);
    setenv("EWA_TEST_CHANGED", "before", 1);
    Program program = shell("echo $EWA_TEST_KEPT $EWA_TEST_CHANGED $EWA_TEST_NEW");
    program.environment = {"EWA_TEST_CHANGED=after", "EWA_TEST_NEW=new"};
    EXPECT_EQ(run(program).second, "kept after new\n");
}

TEST(Process, TheLogHasErrorsAndIfAskedForTheOutput) {
    const test::TempFolder folder;
    Program program = shell("echo out; echo err >&2");
    program.log = folder / "log.txt";
    EXPECT_EQ(run(program).second, "out\n");
    EXPECT_EQ(test::file_bytes(program.log), "err\n");
    program.output_to_log = true;
    EXPECT_EQ(run(program).second, "out\n");
    const std::string log = test::file_bytes(program.log);
    EXPECT_EQ(log.find("err\n"), 0u);  // of the first run, which stays
    EXPECT_NE(log.find("out\n"), std::string::npos);
}

/// A program that floods or hangs is no reason to.
TEST(Process, LogsAndAnswersAreBounded) {
    const test::TempFolder folder;
    Program program = shell("head -c 20000000 /dev/zero | tr '\\0' x; head -c 20000000 /dev/zero >&2");
    program.log = folder / "log.txt";
    program.output_to_log = true;
    EXPECT_EQ(run(program).second.size(), 20000000u);
    const std::string log = test::file_bytes(program.log);
    EXPECT_LT(log.size(), core::kMostLog + 100);
    EXPECT_TRUE(log.ends_with("[the rest is left out]\n"));
    const core::Answer flood = core::ask_program(shell("yes")),
                       end = core::ask_program(shell("echo yes; exit 3"));
    EXPECT_TRUE(flood.cut);
    EXPECT_EQ(flood.ended, Ended::failed);
    EXPECT_EQ(flood.text.size(), size_t(1) << 20);
    EXPECT_EQ(end.ended, Ended::failed);
    EXPECT_EQ(end.text, "yes\n");
    EXPECT_FALSE(end.cut);
    EXPECT_EQ(core::ask_program(shell("sleep 1000"), [] { return false; }).ended, Ended::stopped);
}

TEST(Process, ErrorsMayBePartOfTheOutput) {
    Program program = shell("echo out; echo err >&2");
    program.joined = true;
    EXPECT_EQ(run(program).second, "out\nerr\n");
    // A program that closes its output goes on, and can be stopped.
    EXPECT_EQ(core::run_program(shell("exec >&- 2>&-; sleep 1000"),
                                [n = 0](std::string_view) mutable { return ++n < 5; }),
              Ended::stopped);
}

/// The program and what it has started end, although neither prints anything and both would take a day.
TEST(Process, StopsWhenAsked) {
    const test::TempFolder folder;
    const auto file = folder / "pid";
    const Ended ended = core::run_program(shell("sleep 100000 & echo $! > " + file.string() + "; wait"),
                                          [&](std::string_view) { return test::file_bytes(file).empty(); });
    EXPECT_EQ(ended, Ended::stopped);
    const pid_t child = std::stoi(test::file_bytes(file));
    for (int i = 0; i < 1000 && kill(child, 0) == 0; ++i) usleep(10000);
    // Where nobody reaps orphans, the child stays as a zombie.
    const std::string state = test::file_bytes("/proc/" + std::to_string(child) + "/stat");
    EXPECT_TRUE(state.empty() || state.find(") Z") != std::string::npos) << state;
}

TEST(Process, WhatIgnoresTheRequestToEndIsKilled) {
    const test::TempFolder folder;
    const auto file = folder / "begun";
    const Program program = shell("trap '' TERM; echo > " + file.string() + "; sleep 1000");
    EXPECT_EQ(core::run_program(program, [&](std::string_view) { return test::file_bytes(file).empty(); }),
              Ended::stopped);
}

TEST(Process, OutputLeftToAnotherProgramIsNotWaitedFor) {
    const auto [ended, text] = run(shell("sleep 1000 & echo $!"));
    EXPECT_EQ(ended, Ended::done);
    EXPECT_EQ(kill(std::stoi(text), SIGKILL), 0);
}

TEST(Process, TheCurrentFolderIsNotInPath) {
    const test::TempFolder folder;
    std::ofstream(folder / "tool") << "#!/bin/sh\n";
    std::filesystem::permissions(folder / "tool", std::filesystem::perms::owner_all);
    const std::string path = std::getenv("PATH");
    const auto before = std::filesystem::current_path();
    std::filesystem::current_path(folder.path());
    setenv("PATH", (":" + path).c_str(), 1);
    EXPECT_THROW(run({.command = {"tool"}, .environment = {}, .log = {}}), RunError);
    EXPECT_EQ(run({.command = {"./tool"}, .environment = {}, .log = {}}).first, Ended::done);
    setenv("PATH", path.c_str(), 1);
    std::filesystem::current_path(before);
}

TEST(Process, WhatCannotStartIsNamed) {
    test::expect_error<RunError>(
        [] { run({.command = {"ewa-no-such-program"}, .environment = {}, .log = {}}); },
        {"cannot start ewa-no-such-program", "No such file"});
    test::expect_error<RunError>(
        [] { run({.command = {"true"}, .environment = {}, .log = "/no/such/folder/log.txt"}); },
        {"/no/such/folder/log.txt: cannot be written"});
}

TEST(Process, ProgramsAreFoundInPath) {
    const test::TempFolder folder;
    const std::string before = std::getenv("PATH");
    setenv("PATH",
           ("/no/such/folder::" + (folder / "first").string() + ":" + (folder / "second").string()).c_str(),
           1);
    for (const char* name : {"first", "second"}) {
        std::filesystem::create_directory(folder / name);
        std::ofstream(folder / name / "tool") << "#!/bin/sh\n";
    }
    EXPECT_EQ(core::find_program("tool"), "");  // no file of this name is executable
    std::filesystem::permissions(folder / "second" / "tool", std::filesystem::perms::owner_all);
    EXPECT_EQ(core::find_program("tool"), folder / "second" / "tool");
    EXPECT_EQ(core::find_program("no-such-tool"), "");
    EXPECT_EQ(core::find_program("CMakeLists.txt"), "");
    setenv("PATH", before.c_str(), 1);
}

}  // namespace
