// SPDX-License-Identifier: Apache-2.0
// The editor of the window under real key and mouse events.
#include "support/temp_folder.h"
#include "viewer/session.h"

namespace ewa::test {
namespace {

class Editor : public SessionTest {
  protected:
    void SetUp() override {
        SessionTest::SetUp();
        std::filesystem::create_directories(folder_ / "scene");
        if (!IsSkipped()) make_splats(scene_, 400, 2);
    }
    /// Waits until the journal has so many lines. The first one names the file.
    bool journal_has(size_t lines) const {
        soon([&] { return this->lines() >= lines; }, kSessionPatience);
        return this->lines() == lines;
    }
    size_t lines() const {
        const std::string text = file_bytes(journal_);
        return size_t(std::count(text.begin(), text.end(), '\n'));
    }
    /// Selects the left half of the picture, and deletes it.
    void delete_half(Session& session) {
        session.send("key Tab key r");
        // On a busy machine a whole drag may fall into one frame, and is then a click.
        constexpr int kTries = 6;
        for (int i = 0; i < kTries && lines() < 2; ++i) {
            session.send("mousemove 370 60 sleep 0.5 mousedown 1 sleep 0.5");
            for (const char* at : {"420 100", "500 300", "620 560"})
                session.send(std::string("mousemove ") + at + " sleep 0.2");
            session.send("mouseup 1");
            soon([&] { return lines() >= 2; }, kSessionPatience / kTries);
        }
        EXPECT_TRUE(journal_has(2)) << "no selection";
        session.send("key Delete");
        EXPECT_TRUE(journal_has(3)) << "nothing was deleted";
    }
    /// Saves under a name, by the dialog. Returns the file's bytes.
    std::string saved(Session& session, const std::string& file) {
        // A key that comes before the dialog has the focus is lost, so the dialog is opened again.
        constexpr int kTries = 6;
        bool there = false;
        for (int i = 0; i < kTries && !there; ++i) {
            session.send("key ctrl+shift+s sleep 1 key ctrl+a type --delay 20 " + file);
            session.send("sleep 1 key Return");
            there = soon([&] { return std::filesystem::exists(file); }, kSessionPatience / kTries);
            if (!there) session.send("key Escape sleep 1");
        }
        EXPECT_TRUE(there) << "nothing was saved";
        session.send("sleep 3");  // the window learns that the program has ended, and takes keys again
        return file_bytes(file);
    }
    std::string replayed() {
        expect_success(
            run_ewa({"convert", scene_, folder_ / "replayed.ply", "--edits", journal_, "--quiet"}));
        return file_bytes(folder_ / "replayed.ply");
    }
    std::vector<std::string> arguments() const { return {scene_, "--size", "900x600"}; }

    const std::string scene_ = folder_ / "scene/splats.ply", journal_ = scene_ + ".edits";
};

TEST_F(Editor, DeletesWhatTheMouseSelectsAndUndoesIt) {
    const std::string original = file_bytes(scene_);
    Session session(shots_, arguments());
    ASSERT_TRUE(session.found());
    const Image first = screenshot(session);
    EXPECT_LT(first.height, 600) << "no bars";
    delete_half(session);
    EXPECT_GT(largest_difference(screenshot(session), first), 0.2f);
    const std::string half = saved(session, folder_ / "half.ply");
    EXPECT_LT(half.size(), original.size());
    EXPECT_EQ(half, replayed());

    EXPECT_TRUE(journal_has(4)) << "the journal does not know of the save";
    session.send("key ctrl+z key ctrl+z");
    EXPECT_TRUE(journal_has(6));
    EXPECT_EQ(largest_difference(screenshot(session), first), 0);
    session.send("key ctrl+shift+z key ctrl+y");
    EXPECT_TRUE(journal_has(8));
    EXPECT_EQ(replayed(), half);
    EXPECT_EQ(file_bytes(scene_), original);

    // The file has other splats. Esc stays, Return saves.
    session.send("key ctrl+z");
    EXPECT_TRUE(journal_has(9));
    session.send("key ctrl+q sleep 1 key Escape sleep 1");
    EXPECT_FALSE(session.ended());
    std::filesystem::remove(folder_ / "half.ply");
    session.send("key ctrl+q");
    constexpr int kTries = 6;
    for (int i = 0; i < kTries && !std::filesystem::exists(folder_ / "half.ply"); ++i) {
        session.send("sleep 1 key Return");
        soon([&] { return std::filesystem::exists(folder_ / "half.ply"); }, kSessionPatience / kTries);
    }
    expect_success(session.quit());
    expect_success(run_ewa({"convert", scene_, folder_ / "whole.ply", "--quiet"}));
    EXPECT_EQ(file_bytes(folder_ / "half.ply"), file_bytes(folder_ / "whole.ply"));
    EXPECT_FALSE(std::filesystem::exists(journal_)) << "nothing is left to restore";
}

TEST_F(Editor, AsksNothingOnceAllIsSaved) {
    {
        Session session(shots_, arguments());
        ASSERT_TRUE(session.found());
        screenshot(session);
        delete_half(session);
        saved(session, folder_ / "half.ply");
        EXPECT_TRUE(journal_has(4));
        session.send("key ctrl+z key ctrl+y");
        EXPECT_TRUE(journal_has(6));
        expect_success(session.quit());
    }
    // The dialog of an earlier session would take the keys.
    Session session(shots_ + "/..", arguments());
    ASSERT_TRUE(session.found());
    screenshot(session);
    session.send("key Tab key ctrl+a");
    EXPECT_TRUE(soon([&] { return std::filesystem::exists(journal_ + ".before"); }, kSessionPatience));
    EXPECT_TRUE(journal_has(2));
}

TEST_F(Editor, RestoresTheEditsOfASessionThatWasKilled) {
    {
        Session session(shots_, arguments());
        ASSERT_TRUE(session.found());
        screenshot(session);
        delete_half(session);
    }
    const std::string half = replayed();
    Session session(shots_ + "/..", arguments());
    ASSERT_TRUE(session.found());
    // The dialog's first button restores. Undo does nothing before.
    constexpr int kTries = 20;
    bool undone = false;
    for (int i = 0; i < kTries && !undone; ++i) {
        session.send("sleep 1 key Return sleep 1 key ctrl+z");
        undone = soon([&] { return lines() > 3; }, kSessionPatience / kTries);
    }
    ASSERT_TRUE(undone) << "nothing was restored";
    EXPECT_NE(replayed(), half);
    session.send("key ctrl+y");
    EXPECT_TRUE(journal_has(5));
    EXPECT_EQ(saved(session, folder_ / "restored.ply"), half);
}

TEST_F(Editor, SelectingAllNeitherTintsAScreenshotNorMovesTheView) {
    Session session(shots_, arguments());
    ASSERT_TRUE(session.found());
    const Image first = screenshot(session);
    // A alone flies to the left. Here it is held longer than Ctrl.
    session.send("key Tab keydown ctrl keydown a sleep 0.2 keyup ctrl sleep 1 keyup a");
    EXPECT_TRUE(journal_has(2));
    session.send("sleep 2");
    EXPECT_EQ(largest_difference(screenshot(session), first), 0);
}

TEST_F(Editor, SavesUnderAnotherNameAfterAWarning) {
    const std::string mine = folder_ / "mine.ply", other = folder_ / "other.ply";
    write_file(mine, "mine");
    Session session(shots_, arguments());
    ASSERT_TRUE(session.found());
    screenshot(session);
    constexpr int kTries = 6;
    bool there = false;
    for (int i = 0; i < kTries && !there; ++i) {
        session.send("key ctrl+shift+s sleep 1 key ctrl+a type --delay 20 " + mine);
        session.send("sleep 1 key Return sleep 1 key ctrl+a type --delay 20 " + other);
        session.send("sleep 1 key Return");
        there = soon([&] { return std::filesystem::exists(other); }, kSessionPatience / kTries);
        if (!there) session.send("key Escape sleep 1");
    }
    EXPECT_TRUE(there) << "nothing was saved";
    EXPECT_EQ(file_bytes(mine), "mine");
}

TEST_F(Editor, MovesTheSelectionAndCleansByTheCommandLine) {
    Session session(shots_, arguments());
    ASSERT_TRUE(session.found());
    screenshot(session);
    session.send("key Tab key ctrl+a");
    EXPECT_TRUE(journal_has(2));
    session.send("key ctrl+i");
    EXPECT_TRUE(journal_has(3));
    session.send("key ctrl+i");
    EXPECT_TRUE(journal_has(4));
    session.send("key h");  // locks all
    EXPECT_TRUE(journal_has(5));
    session.send("key ctrl+a key Delete key shift+h key ctrl+a");
    EXPECT_TRUE(journal_has(7)) << "locked splats were changed";
}

}  // namespace
}  // namespace ewa::test
