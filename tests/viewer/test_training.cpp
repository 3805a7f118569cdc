// SPDX-License-Identifier: Apache-2.0
// The window on a training that goes on.
#include "viewer/font.h"
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
    static Image rows(const Image& image, int from, int to) {
        Image part(image.width, to - from, 3);
        std::copy_n(image.at(0, from), part.pixels.size(), part.pixels.begin());
        return part;
    }
    static Image upper_quarter(const Image& image) { return rows(image, 0, image.height / 4); }
    /// Where a headline begins.
    static Image lower_part(const Image& image) {
        return rows(image, 2 * image.height / 5, image.height * 3 / 5);
    }
    /// A training that goes on until a signal ends it, and may be watched.
    pid_t start_trainer() {
        const pid_t trainer = fork();
        if (trainer == 0) {
            execl(EWA_PROGRAM, EWA_PROGRAM, "train", cameras_.c_str(), "-o", run_.c_str(), "--init",
                  splats_.c_str(), "--steps", "1000000", "--strategy", "none", "--serve", "0", "--quiet",
                  nullptr);
            _exit(127);
        }
        return trainer;
    }
    const std::string run_ = folder_ / "run";
};

TEST_F(Training, OfAnotherProcessIsSeenAsItGoes) {
    const pid_t trainer = start_trainer();
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

TEST_F(Training, OfAnotherProcessRefusesAWrongToken) {
    const pid_t trainer = start_trainer();
    ASSERT_TRUE(soon([&] { return std::filesystem::exists(run_ + "/live.json"); }));
    const std::string port = read_json(run_ + "/live.json")["port"].dump();
    Session session(shots_, {"--connect", "127.0.0.1:" + port, "--token", "wrong", "--size", "300x200"});
    ASSERT_TRUE(session.found());
    EXPECT_TRUE(soon([&] { return !read_file(shots_ + "/err.txt").empty(); }));
    EXPECT_EQ(session.quit().err, "ewa-view: the trainer refuses: this is not the run's token\n");
    kill(trainer, SIGINT);
    int status = 0;
    waitpid(trainer, &status, 0);
    EXPECT_EQ(WEXITSTATUS(status), 130);
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

/// The button stands below the look, at a place that does not change.
TEST_F(Training, StartsByAButtonInAFolderOfItsOwn) {
    if (viewer::find_font().empty()) GTEST_SKIP() << "the button has another place without a vector font";
    const std::string earlier = shots_ + "/out/views";
    std::filesystem::create_directories(earlier);
    make_splats(earlier + "/splats.ply");
    const std::string bytes = read_file(earlier + "/splats.ply");
    Session session(shots_, {cameras_, "--size", "900x800"});
    ASSERT_TRUE(session.found());
    session.screenshot();
    act(session, {"mousemove 60 330", "click 1"});
    ASSERT_TRUE(session.awaited(earlier + "-2/live.json")) << "no training has started";
    EXPECT_EQ(read_json(earlier + "-2/config.json")["steps"], 30000);
    EXPECT_TRUE(changes(session)) << "the picture stays as it is";
    expect_silent(session.quit());
    EXPECT_EQ(read_json(earlier + "-2/summary.json")["interrupted"], true);
    EXPECT_EQ(read_file(earlier + "/splats.ply"), bytes);
}

/// A run that has saved no splats yet is seen by the points it starts from, and the window says so over the picture.
TEST_F(Training, PointsAreCalledPoints) {
    give_points();
    std::filesystem::create_directories(run_);
    write_file(run_ + "/config.json", "{\"dataset\": \"" + cameras_ + "\", \"steps\": 300}");
    const XClient display(display_.name());
    for (const std::string& path : {run_, cameras_}) {
        Session session(shots_, {path, "--size", "400x300"});  // too narrow for the panel
        ASSERT_TRUE(session.found());
        session.send("key F1 key F1");  // no hint
        const auto window = display.window_titled("ewa");
        ASSERT_TRUE(window);
        session.screenshot();
        const Image upper = upper_quarter(display.pixels_at_rest(*window));
        const bool said = range_of(upper) > 0.9f;
        EXPECT_EQ(said, path == run_);
        expect_silent(session.quit());
    }
}

TEST_F(Training, NobodyThereIsSaidOnceAndLarge) {
    const XClient display(display_.name());
    Session session(shots_, {"--connect", "127.0.0.1:9", "--size", "500x300"});
    ASSERT_TRUE(session.found());
    const auto window = display.window_titled("ewa");
    ASSERT_TRUE(window);
    const std::string errors = shots_ + "/err.txt";
    EXPECT_TRUE(soon([&] { return !read_file(errors).empty(); }));
    const auto middle = [&] { return range_of(lower_part(display.pixels(*window))); };
    EXPECT_TRUE(soon([&] { return middle() > 0.9f; })) << "nothing stands in the middle";
    act(session, {"key 2", "key 1"});  // the window goes on
    const Outcome outcome = session.quit();
    EXPECT_EQ(outcome.status, 0);
    EXPECT_EQ(outcome.err, "ewa-view: cannot reach 127.0.0.1:9: nobody answers there\n");
}

TEST(WithoutWindow, WrongWaysToATrainingAreOneLine) {
    const Folder folder;
    make_splats(folder / "splats.ply");
    expect_failure(run_view({"--train", folder / "splats.ply"}), 2, "--train needs a dataset");
    expect_failure(run_view({folder / "splats.ply", "--steps", "7"}), 2, "--steps");
    expect_failure(run_view({"--connect", "nowhere"}), 2, "localhost:7000");
    expect_failure(run_view({"--connect", "localhost:7000", "--token-file", folder / "none"}), 2,
                   "holds no token");
    // A run that would be replaced is found before the window opens.
    make_dataset(folder / "data");
    std::filesystem::create_directory(folder / "run");
    make_splats(folder / "run/splats.ply");
    expect_failure(run_view({"--train", folder / "data", "-o", folder / "run"}), 2, "holds splats.ply");
    // So are options that ewa train does not have.
    expect_failure(run_view({"--train", folder / "data", "--step", "3"}), 2, "did you mean --steps?");
    expect_failure(run_view({"--train", folder / "data", "--steps", "none"}), 2, "--steps");
    expect_failure(run_view({"--train", folder / "data", "--resume", "--force"}), 2, "--force");
}

}  // namespace
}  // namespace ewa::test
