// SPDX-License-Identifier: Apache-2.0
// The window on a training that goes on.
#include "viewer/session.h"

namespace ewa::test {
namespace {

class Training : public SessionTest {
  protected:
    /// Until the pictures of the same camera change.
    bool changes(Session& session) {
        const Image first = screenshot(session);
        return soon([&] { return largest_difference(screenshot(session), first) > 0.02f; });
    }
    const std::string run_ = folder_ / "run";
};

TEST_F(Training, OfAnotherProcessIsSeenAsItGoes) {
    const pid_t trainer = fork();
    if (trainer == 0) {
        execl(EWA_PROGRAM, EWA_PROGRAM, "train", cameras_.c_str(), "-o", run_.c_str(), "--init",
              splats_.c_str(), "--steps", "1000000", "--strategy", "none", "--serve", "0", "--quiet",
              nullptr);
        _exit(127);
    }
    ASSERT_TRUE(soon([&] { return std::filesystem::exists(run_ + "/live.json"); }));
    Session session(shots_, {run_, "--size", "96x64"});
    ASSERT_TRUE(session.found());
    EXPECT_TRUE(changes(session)) << "the picture stays as it is";
    kill(trainer, SIGINT);
    int status = 0;
    waitpid(trainer, &status, 0);
    EXPECT_EQ(WEXITSTATUS(status), 130);
    EXPECT_FALSE(std::filesystem::exists(run_ + "/live.json"));
    act(session, {"key 2", "key 1"});
    EXPECT_NE(session.screenshot(), "") << "it does not answer once the training has gone";
    expect_silent(session.quit());
}

TEST_F(Training, OfItsOwnGoesOnUntilItsEnd) {
    Session session(shots_, {"--train", cameras_, "-o", run_, "--init", splats_, "--steps", "30", "--quiet",
                             "--size", "96x64"});
    ASSERT_TRUE(session.found());
    ASSERT_TRUE(session.awaited(run_ + "/summary.json")) << "the training has not ended";
    EXPECT_EQ(read_json(run_ + "/summary.json")["steps"], 30);
    EXPECT_TRUE(soon([&] { return range_of(screenshot(session)) > 0.2f; }));
    expect_silent(session.quit());
}

TEST_F(Training, OfItsOwnIsSavedWhenTheWindowIsClosed) {
    Session session(shots_,
                    {"--train", cameras_, "-o", run_, "--init", splats_, "--steps", "1000000", "--quiet"});
    ASSERT_TRUE(session.found());
    ASSERT_TRUE(session.awaited(run_ + "/live.json"));
    EXPECT_TRUE(changes(session)) << "the training does not go on";
    expect_silent(session.quit());
    ASSERT_TRUE(std::filesystem::exists(run_ + "/summary.json")) << "nothing was saved";
    EXPECT_TRUE(std::filesystem::exists(run_ + "/checkpoint.ewa"));
    EXPECT_EQ(read_json(run_ + "/summary.json")["interrupted"], true);
}

TEST(WithoutWindow, WrongWaysToATrainingAreOneLine) {
    const Folder folder;
    make_splats(folder / "splats.ply");
    expect_failure(run_view({"--train", folder / "splats.ply"}), 2, "--train needs a dataset");
    expect_failure(run_view({folder / "splats.ply", "--steps", "7"}), 2, "--steps");
    expect_failure(run_view({"--connect", "nowhere"}), 2, "localhost:7000");
    // A run that would be replaced is found before the window opens.
    make_dataset(folder / "data");
    std::filesystem::create_directory(folder / "run");
    make_splats(folder / "run/splats.ply");
    expect_failure(run_view({"--train", folder / "data", "-o", folder / "run"}), 2, "holds splats.ply");
}

}  // namespace
}  // namespace ewa::test
