// SPDX-License-Identifier: Apache-2.0
// Files dropped on the window, by another client of the X server as a file manager does it.
#include "viewer/session.h"

namespace ewa::test {
namespace {

class Drop : public SessionTest {
  protected:
    void SetUp() override {
        SessionTest::SetUp();
        if (!IsSkipped()) x_ = std::make_unique<XClient>(display_.name());
    }
    uint32_t window(const std::string& title = "ewa") const {
        const auto found = x_->window_titled(title);
        EXPECT_TRUE(found) << "no window is called " << title;
        return found.value_or(0);
    }
    /// What a window of its own shows of it.
    Image alone(const std::string& path) {
        expect_silent(run_view({path, "--size", "96x64", "--screenshot", folder_ / "alone.png"}));
        return load_image(folder_ / "alone.png");
    }
    /// Drops it, and what the window then shows.
    Image dropped(Session& session, const std::string& path, const std::string& title) {
        EXPECT_TRUE(x_->drop(window(), uri_of(path))) << "the window did not take it";
        window(title + " - ewa");
        return screenshot(session);
    }
    std::unique_ptr<XClient> x_;
};

TEST_F(Drop, OpensAFileOfAnyName) {
    const std::string name = "a b%20+\xc3\xbc.ply";
    make_splats(folder_ / name, 30, 0);
    Session session(shots_, {splats_, "--size", "96x64"});
    ASSERT_TRUE(session.found());
    const Image before = screenshot(session), after = dropped(session, folder_ / name, name);
    EXPECT_EQ(largest_difference(after, alone(folder_ / name)), 0);
    EXPECT_GT(largest_difference(after, before), 0.1f);
    expect_silent(session.quit());
}

TEST_F(Drop, OpensTheFirstOfSeveralScenes) {
    make_splats(folder_ / "one.ply", 30, 0);
    make_splats(folder_ / "two.ply", 60, 0);
    Session session(shots_, {splats_, "--size", "96x64"});
    ASSERT_TRUE(session.found());
    ASSERT_TRUE(x_->drop(window(), uri_of(folder_ / "one.ply") + uri_of(folder_ / "two.ply")));
    window("one.ply - ewa");
    EXPECT_EQ(largest_difference(screenshot(session), alone(folder_ / "one.ply")), 0);
    expect_silent(session.quit());
}

/// The splats that are shown, or dropped with it, are seen through its cameras.
TEST_F(Drop, ADatasetGivesItsCamerasToSplats) {
    for (const bool together : {false, true}) {
        std::filesystem::remove_all(shots_);
        std::filesystem::create_directories(shots_);
        std::vector<std::string> arguments{"--size", "48x32"};
        if (!together) arguments.insert(arguments.begin(), splats_);
        Session session(shots_, arguments);
        ASSERT_TRUE(session.found());
        const std::string first = together ? uri_of(splats_) : std::string();
        ASSERT_TRUE(x_->drop(window(), first + uri_of(cameras_)));
        const Image expected = rendered("0");
        Image shown;
        soon([&] {
            shown = screenshot(session);
            return largest_difference(shown, expected) <= kRounding;
        });
        EXPECT_LE(largest_difference(shown, expected), kRounding) << together;
        session.send("key Right");
        EXPECT_LE(largest_difference(screenshot(session), rendered("1")), kRounding) << together;
        expect_silent(session.quit());
    }
}

TEST_F(Drop, OpensFolders) {
    expect_success(run_ewa({"train", cameras_, "-o", folder_ / "run", "--steps", "3", "--init", splats_,
                            "--background", "0.2,0.4,0.6", "--quiet"}));
    Session session(shots_, {"--size", "96x64"});
    ASSERT_TRUE(session.found());
    EXPECT_EQ(range_of(screenshot(session)), 0) << "there is something in the empty window";
    // A dataset of cameras alone shows nothing but them; its keys work.
    const Image cameras = dropped(session, cameras_, "views");
    EXPECT_EQ(largest_difference(cameras, alone(cameras_)), 0);
    session.send("key v key Right");
    EXPECT_GT(range_of(screenshot(session)), 0.3f) << "the image of the dropped dataset";
    session.send("key v key v key v");
    EXPECT_EQ(largest_difference(dropped(session, folder_ / "run", "run"), alone(folder_ / "run")), 0);
    EXPECT_EQ(largest_difference(dropped(session, splats_, "splats.ply"), alone(splats_)), 0);
    // On splats, the dataset only gives its cameras the first time.
    ASSERT_TRUE(x_->drop(window(), uri_of(cameras_)));
    screenshot(session);
    EXPECT_LT(largest_difference(dropped(session, cameras_, "views"), cameras), kRounding);
    expect_silent(session.quit());
}

/// The window stays as it was and says what is wrong, with the panel and without it.
TEST_F(Drop, WhatCannotBeReadIsSaid) {
    write_file(folder_ / "notes.txt", "no splats");
    write_file(folder_ / "broken.ply", read_file(splats_).substr(0, 3000));
    Session session(shots_, {splats_, "--size", "640x480"});
    ASSERT_TRUE(session.found());
    session.send("key F1 key F1");  // the hint would go by itself
    for (const bool panel : {true, false}) {
        if (!panel) session.send("key F2");
        const Image picture = screenshot(session);  // the window says where, and that goes by itself
        const Image saying = x_->pixels_at_rest(window()), quiet = x_->pixels_at_rest(window(), &saying);
        for (const char* name : {"notes.txt", "broken.ply", "absent.ply"}) {
            const Image before = x_->pixels_at_rest(window());
            EXPECT_TRUE(x_->drop(window(), uri_of(folder_ / name)));
            Image after = before;
            soon([&] {
                after = x_->pixels(window());
                return std::min(largest_difference(before, after), largest_difference(quiet, after)) > 0.3f;
            });
            EXPECT_GT(largest_difference(before, after), 0.3f) << name << " is not spoken of";
            EXPECT_GT(largest_difference(quiet, after), 0.3f) << name << " is not spoken of";
            EXPECT_TRUE(x_->window_titled("splats.ply - ewa", 1)) << name;
            EXPECT_EQ(largest_difference(screenshot(session), picture), 0) << name;
        }
    }
    make_splats(folder_ / "good.ply", 30, 0);
    dropped(session, folder_ / "good.ply", "good.ply");
    expect_silent(session.quit());
}

TEST_F(Drop, TextIsNoFile) {
    Session session(shots_, {splats_, "--size", "96x64"});
    ASSERT_TRUE(session.found());
    const Image before = screenshot(session);
    // Not "file://" alone, since GLFW 3.3 reads beyond its end. No list without a line, since GLFW 3.4 asserts one.
    for (const char* text : {"", "\r\n# a remark\r\nhttp://example.org/splats.ply\r\n", "%zz%\r\nfile:"}) {
        x_->drop(window(), text);
        ASSERT_FALSE(session.ended()) << text << session.quit().err;
    }
    act(session, {"key 2", "key 1"});
    EXPECT_EQ(largest_difference(screenshot(session), before), 0);
    expect_silent(session.quit());
}

}  // namespace
}  // namespace ewa::test
