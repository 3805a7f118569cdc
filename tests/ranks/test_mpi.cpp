// SPDX-License-Identifier: Apache-2.0
// Several processes under mpirun: worker/worker.cpp is what each of them does. Skipped where there is no MPI.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>

#include "support/temp_folder.h"

namespace {

#ifdef EWA_MPI_MODULE
namespace fs = std::filesystem;

struct Outcome {
    int status = -1;
    std::string out, err;
};

Outcome run(const std::string& command) {
    const ewa::test::TempFolder folder;
    const std::string out = folder / "out", err = folder / "err";
    std::string line = command;
    line.append(" > ").append(out).append(" 2> ").append(err).append(" < /dev/null");
    const int ended = std::system(line.c_str());
    return {WIFEXITED(ended) ? WEXITSTATUS(ended) : -1, ewa::test::file_bytes(out),
            ewa::test::file_bytes(err)};
}

/// Ranks on this machine, which may have more of them than cores, and whose other networks may not lead back to it.
Outcome mpirun(int ranks, const std::string& what, const std::string& options = "") {
    return run("OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 " EWA_MPIRUN
               " --oversubscribe --bind-to none --mca btl_tcp_if_include lo " +
               options + " -n " + std::to_string(ranks) + " " EWA_RANKS_WORKER " " + what);
}

void expect_success(const Outcome& outcome) {
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
}

void expect_end(const Outcome& outcome, int status, const std::string& text) {
    EXPECT_EQ(outcome.status, status) << outcome.err;
    EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
}

const std::string kTcp = "--mca btl self,tcp";

TEST(Mpi, GathersAndExchangesPartsOfAnySize) {
    for (const int ranks : {1, 2, 3, 4}) expect_success(mpirun(ranks, "talk"));
}

TEST(Mpi, ExchangesLongPartsInPieces) {
    expect_success(mpirun(3, "talk 64"));
}

TEST(Mpi, WorksOverTcp) {
    expect_success(mpirun(3, "talk 1000", kTcp));
}

TEST(Mpi, NamesRanksAndNodes) {
    const Outcome outcome = mpirun(2, "name");
    expect_success(outcome);
    EXPECT_NE(outcome.out.find("rank 0 ("), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("rank 1 ("), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find(") of 2\n"), std::string::npos) << outcome.out;
}

TEST(Mpi, NoticesPartsThatDoNotFit) {
    expect_end(mpirun(2, "uneven"), 1, " sent 8 bytes in place of 16");
}

/// All in far less than the worker's minute.
TEST(Mpi, EndsAllWithARankThatEnds) {
    expect_end(mpirun(3, "kill"), 128 + SIGKILL, "process rank 1 ");
    expect_end(mpirun(3, "kill", kTcp), 128 + SIGKILL, "process rank 1 ");
    expect_end(mpirun(3, "throw"), 2, "rank 1 has other images\n");
    expect_end(mpirun(3, "end"), 3, "told before the end");
}

TEST(Mpi, NamesARankThatFallsSilent) {
    for (const std::string& options : {std::string(), kTcp}) {
        const Outcome outcome = mpirun(4, "stop 1000 1000", options);
        expect_end(outcome, 1, "RunError: rank 1 (");
        expect_end(outcome, 1, ") has not answered for 1 s\n");
        // The other ranks wait for it as well, and leave it to the first of them to say so.
        EXPECT_EQ(outcome.err.find("RunError", outcome.err.find("RunError") + 1), std::string::npos)
            << outcome.err;
    }
}

/// The worker in a folder of its own, where it looks for its module.
class MpiModule : public testing::Test {
  protected:
    void SetUp() override {
        fs::create_directories(folder_ / "bin/modules");
        fs::copy_file(EWA_RANKS_WORKER, program_);
    }
    Outcome run_with(const std::string& environment) const {
        return run(environment + " " + program_.string() + " name");
    }

    ewa::test::TempFolder folder_;
    const fs::path program_ = folder_ / "bin/worker", module_ = folder_ / "bin/modules/libewa_mpi.so";
};

TEST_F(MpiModule, IsNotNeededWithoutALauncher) {
    EXPECT_EQ(run_with("").out, "rank 0 of 1\n");
    EXPECT_EQ(run_with("OMPI_COMM_WORLD_SIZE=1").out, "rank 0 of 1\n");
}

TEST_F(MpiModule, IsNamedWhereItIsMissing) {
    const Outcome outcome = run_with("OMPI_COMM_WORLD_SIZE=2");
    expect_end(outcome, 1,
               "RunError: libewa_mpi.so, which lets the processes of a launcher train together, cannot be "
               "loaded: it is ");
    expect_end(outcome, 1, "neither in ");
    expect_end(outcome, 1,
               "; install ewa's module and Open MPI (apt install openmpi-bin), or start ewa without mpirun");
    EXPECT_EQ(outcome.err.find('\n'), outcome.err.size() - 1) << outcome.err;
}

TEST_F(MpiModule, OfAnotherLayoutIsRefused) {
    std::string bytes = ewa::test::file_bytes(EWA_MPI_MODULE);
    const std::string entry = "ewa_mpi_layout_";
    for (size_t at = bytes.find(entry); at != std::string::npos; at = bytes.find(entry, at + 1))
        bytes[at + entry.size()] = '0';
    folder_.write("bin/modules/libewa_mpi.so", bytes);
    expect_end(run_with("PMI_SIZE=2"), 1, "it belongs to another build of ewa");
}

/// As under the mpirun of another MPI: each process would train alone, into the same folder.
TEST_F(MpiModule, ThatDoesNotSeeTheOtherProcessesIsRefused) {
    fs::copy_file(EWA_MPI_MODULE, module_);
    const Outcome outcome = run_with("OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 PMI_SIZE=4");
    expect_end(outcome, 1, "the launcher started 4 processes, and MPI knows 1 of them");
}
#endif

}  // namespace
