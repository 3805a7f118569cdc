// SPDX-License-Identifier: Apache-2.0
// The window under real key and mouse events.
#include <cstdio>
#include <fstream>
#include <glm/geometric.hpp>
#include <random>

#include "ewa/dataset.h"
#include "scene/frustum.h"
#include "viewer/font.h"
#include "viewer/session.h"

namespace ewa::test {
namespace {

using Input = SessionTest;

/// The columns from `left` to below `right`.
Image part(const Image& image, int left, int right) {
    Image columns(right - left, image.height, image.channels);
    for (int y = 0; y < image.height; ++y)
        std::copy_n(image.at(left, y), size_t(columns.width) * size_t(image.channels), columns.at(0, y));
    return columns;
}

TEST_F(Input, KeysChooseModesCamerasAndViews) {
    Session session(shots_, {splats_, "--cameras", cameras_, "--size", "48x32"});
    ASSERT_TRUE(session.found());
    const Image first = screenshot(session);
    EXPECT_LE(largest_difference(first, rendered("0")), kRounding);
    session.send("key Right");
    EXPECT_LE(largest_difference(screenshot(session), rendered("1")), kRounding);
    session.send("key Left key Left");
    EXPECT_LE(largest_difference(screenshot(session), rendered("3")), kRounding);
    session.send("key ctrl+7 key 4");
    const Image count = screenshot(session);
    EXPECT_GT(largest_difference(count, rendered("3")), 0.1f);
    session.send("key 1 key r");
    EXPECT_EQ(largest_difference(screenshot(session), first), 0);
    session.send("key shift+7");
    EXPECT_LE(largest_difference(screenshot(session), rendered("3")), kRounding) << "the saved view";
    session.send("key minus key minus key minus");
    EXPECT_GT(largest_difference(screenshot(session), rendered("3")), 0.05f) << "smaller splats";
    expect_silent(session.quit());
}

/// Not what the viewer believes to show, but what the X server has: no encoding is done twice on the way.
TEST_F(Input, TheDisplayHasWhatRenderWrites) {
    const XClient display(display_.name());
    Session session(shots_, {splats_, "--cameras", cameras_, "--frame", "2", "--size", "48x32"});
    ASSERT_TRUE(session.found());
    session.send("key F1 key F1");  // no hint; the window is too narrow for the panel
    const auto window = display.window_titled("ewa");
    ASSERT_TRUE(window);
    const Image expected = rendered("2");
    float difference = 1;
    soon([&] { return (difference = largest_difference(display.pixels(*window), expected)) <= kRounding; });
    EXPECT_LE(difference, kRounding);
    expect_silent(session.quit());
}

/// The panel has the width of its text, and a screenshot is what the window shows beside it.
TEST_F(Input, ADenseDisplayHasLargerText) {
    const XClient display(display_.name());
    int widths[2] = {};
    for (const int dense : {0, 1}) {
        if (dense) display.set_resources("Xft.dpi:\t168\n");
        Session session(shots_, {splats_, "--cameras", cameras_, "--size", "1260x340"});
        ASSERT_TRUE(session.found());
        widths[dense] = 1260 - screenshot(session).width;
        std::filesystem::remove_all(shots_);
        std::filesystem::create_directories(shots_);
        const auto window = display.window_titled("ewa");
        ASSERT_TRUE(window);
        const Image shown = display.pixels_at_rest(*window);
        EXPECT_GT(largest_difference(part(shown, 0, widths[dense]), Image(widths[dense], 340, 3)), 0.5f)
            << "no text";
        expect_silent(session.quit());
    }
    EXPECT_GT(widths[0], 200);
    EXPECT_NEAR(double(widths[1]) / widths[0], 1.75, 0.05);
}

/// Beside the picture where there is room; else over it, and only when it is asked for.
TEST_F(Input, ThePanelIsBesideThePicture) {
    Session session(shots_, {splats_, "--cameras", cameras_, "--size", "700x300"});
    ASSERT_TRUE(session.found());
    const Image beside = screenshot(session);
    EXPECT_LT(beside.width, 500);
    EXPECT_GE(beside.width, 350);
    session.send("key F2");
    EXPECT_EQ(screenshot(session).width, 700);
    session.send("key F2");
    EXPECT_EQ(largest_difference(screenshot(session), beside), 0);
    // The camera's view is whole and in the middle of the part beside the panel.
    session.send("search --name ewa$ windowsize --sync 400 300");
    const Image narrow = screenshot(session);
    EXPECT_EQ(narrow.width, 400);
    const XClient display(display_.name());
    const auto window = display.window_titled("ewa");
    ASSERT_TRUE(window);
    session.send("key F1 key F1");  // no hint
    soon([&] { return largest_difference(display.pixels(*window), narrow) <= kRounding; });
    EXPECT_LE(largest_difference(display.pixels(*window), narrow), kRounding) << "something lies over it";
    session.send("key F2");
    soon([&] { return largest_difference(display.pixels(*window), narrow) > 0.3f; });
    EXPECT_GT(largest_difference(display.pixels(*window), narrow), 0.3f) << "no panel";
    expect_silent(session.quit());
}

/// Where there is no vector font, Dear ImGui's own takes its place.
TEST_F(Input, TheTextHasTheSizeOfTheSettings) {
    std::filesystem::create_directories(config_ + "/ewa");
    write_file(config_ + "/ewa/view.json", "{\"text_scale\": 1.5}");
    std::filesystem::create_directories(folder_ / "data");
    std::filesystem::create_directory_symlink("/usr/share/vulkan", folder_ / "data/vulkan");
    const XClient display(display_.name());
    std::vector<Image> panels;
    for (const std::string& fonts : {std::string("/usr/local/share:/usr/share"), folder_ / "data"}) {
        Session session(shots_, {splats_, "--size", "1100x500"},
                        {{"XDG_DATA_DIRS", fonts}, {"XDG_DATA_HOME", folder_ / "none"}});
        ASSERT_TRUE(session.found());
        const int panel = 1100 - screenshot(session).width;
        EXPECT_EQ(panel, int(19 * 16 * 1.5));
        const auto window = display.window_titled("ewa");
        ASSERT_TRUE(window);
        panels.push_back(part(display.pixels_at_rest(*window), 0, panel));
        EXPECT_GT(range_of(panels.back()), 0.8f) << "no text";
        std::filesystem::remove_all(shots_);
        std::filesystem::create_directories(shots_);
        expect_success(session.quit());
    }
    const bool alike = largest_difference(panels[0], panels[1]) < 0.3f;
    EXPECT_EQ(alike, viewer::find_font().empty()) << "the font";
}

/// What ewa render makes of the splats alone, whatever the cameras are.
TEST_F(Input, FShowsTheWholeScene) {
    expect_silent(run_ewa({"render", splats_, "--size", "300x200", "-o", folder_ / "whole.png", "--quiet"}));
    const Image whole = load_image(folder_ / "whole.png");
    Session session(shots_, {splats_, "--size", "300x200"});
    ASSERT_TRUE(session.found());
    EXPECT_LE(largest_difference(screenshot(session), whole), kRounding) << "the first view";
    act(session, {"mousemove 150 100", "click 4", "click 4"});
    EXPECT_GT(largest_difference(screenshot(session), whole), 0.1f);
    session.send("key f");
    EXPECT_LE(largest_difference(screenshot(session), whole), kRounding);
    expect_silent(session.quit());
}

TEST_F(Input, SettingsComeBack) {
    {
        Session session(shots_, {splats_});
        ASSERT_TRUE(session.found());
        session.send("search --name ewa$ windowsize --sync 612 345");
        session.send("key 3");
        screenshot(session);
        expect_silent(session.quit());
    }
    const auto json = read_json(config_ + "/ewa/view.json");
    EXPECT_EQ(json["window_width"], 612);
    EXPECT_FALSE(json.contains("mode")) << "the next scene would be shown in it";
    Session session(shots_, {splats_});
    ASSERT_TRUE(session.found());
    session.send("key F2");
    session.send("key F12");
    ASSERT_TRUE(session.awaited(shots_ + "/ewa-view-2.png"));
    const Image image = load_image(shots_ + "/ewa-view-2.png");
    EXPECT_EQ(image.width, 612);
    EXPECT_EQ(image.height, 345);
    bool coloured = false;
    for (size_t i = 0; i < image.pixels.size(); i += 3) coloured |= image.pixels[i] != image.pixels[i + 1];
    EXPECT_TRUE(coloured) << "it shows the opacity";
    expect_silent(session.quit());
    // A script is not asked how the window looked.
    expect_silent(run_view({splats_, "--screenshot", folder_ / "shown.png"}));
    EXPECT_EQ(load_image(folder_ / "shown.png").width, 1280);
}

TEST_F(Input, TheMouseTurnsMovesAndZooms) {
    Session session(shots_, {splats_, "--cameras", cameras_, "--size", "320x240"});
    ASSERT_TRUE(session.found());
    const Image first = screenshot(session);
    Image before = first;
    const std::vector<std::string> actions[] = {
        {"mousemove 160 200", "mousedown 1", "mousemove 200 200", "mousemove 240 190", "mouseup 1"},
        {"mousemove 160 200", "mousedown 3", "mousemove 180 200", "mousemove 200 190", "mouseup 3"},
        {"mousemove 160 120", "click 4", "click 4"},
        {"keydown w", "keyup w"},
        {"key r"},
        {"mousemove 175 105", "click --repeat 2 --delay 50 1"}};
    for (const std::vector<std::string>& action : actions) {
        // On a busy machine two clicks may be too far apart, or in one frame.
        float difference = 0;
        soon([&] {
            act(session, action);
            const Image after = screenshot(session);
            difference = largest_difference(before, after);
            before = after;
            return difference > 0.02f;
        });
        EXPECT_GT(difference, 0.02f) << action.back();
    }
    session.send("key r");
    EXPECT_EQ(largest_difference(screenshot(session), first), 0) << "back to the start";
    expect_silent(session.quit());
}

/// Two clicks measure what lies under them.
TEST_F(Input, MeasuresTheDistanceOfTwoPoints) {
    expect_silent(run_ewa({"render", splats_, "--cameras", cameras_, "--frames", "1", "-o", folder_ / "depth",
                           "--mode", "median-depth", "--format", "exr", "--quiet"}));
    const Image depth = load_image(folder_ / "depth/1.exr");
    const Camera camera = load_dataset(cameras_, {}).frames[1].camera;
    std::vector<glm::ivec2> clicks;
    for (const int y : {8, 24})
        for (int x = 4; x < 44 && clicks.size() < size_t(1 + y / 24); ++x)
            if (*depth.at(x, y) > 0) clicks.push_back({x, y});
    ASSERT_EQ(clicks.size(), 2u);
    std::vector<glm::dvec3> points;
    for (const glm::ivec2& at : clicks)
        points.push_back(world_point(camera, at.x + 0.5, at.y + 0.5, *depth.at(at.x, at.y)));

    const XClient display(display_.name());
    Session session(shots_, {splats_, "--cameras", cameras_, "--frame", "1", "--size", "48x32"});
    ASSERT_TRUE(session.found());
    const Image before = screenshot(session);
    session.send("key F1 key F1 key m");  // no hint
    for (const glm::ivec2& at : clicks)
        act(session, {"mousemove " + std::to_string(at.x) + " " + std::to_string(at.y), "click 1"});
    EXPECT_EQ(largest_difference(screenshot(session), before), 0) << "the view stays";
    soon([&] { return !read_file(shots_ + "/out.txt").empty(); });
    const std::string said = read_file(shots_ + "/out.txt");
    double n[7] = {};
    ASSERT_EQ(std::sscanf(said.c_str(), "distance %lf; points %lf,%lf,%lf,%lf,%lf,%lf", &n[0], &n[1], &n[2],
                          &n[3], &n[4], &n[5], &n[6]),
              7)
        << said;
    for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(n[1 + k], points[0][k], 1e-4);
        EXPECT_NEAR(n[4 + k], points[1][k], 1e-4);
    }
    EXPECT_NEAR(n[0], glm::length(points[1] - points[0]), 1e-3) << "four digits";
    // A mark on the display, which goes with the mode.
    const auto window = display.window_titled("ewa");
    ASSERT_TRUE(window);
    EXPECT_GT(largest_difference(display.pixels_at_rest(*window), before), 0.1f);
    session.send("key m");
    soon([&] { return largest_difference(display.pixels(*window), before) <= kRounding; });
    EXPECT_LE(largest_difference(display.pixels(*window), before), kRounding);
    const Outcome outcome = session.quit();
    expect_success(outcome);
}

/// Parallel rays show near and far splats at one scale, and the key goes back.
TEST_F(Input, ParallelRaysByKey) {
    Session session(shots_, {splats_, "--cameras", cameras_, "--size", "96x64"});
    ASSERT_TRUE(session.found());
    const Image first = screenshot(session);
    session.send("key p");
    const Image parallel = screenshot(session);
    EXPECT_GT(largest_difference(parallel, first), 0.1f);
    // A step closer to the pivot enlarges the picture, and a turn changes it.
    act(session, {"mousemove 20 20", "click 4"});
    const Image closer = screenshot(session);
    EXPECT_GT(largest_difference(closer, parallel), 0.02f);
    act(session, {"mousedown 1", "mousemove 30 20", "mousemove 40 20", "mouseup 1"});
    EXPECT_GT(largest_difference(screenshot(session), closer), 0.02f);
    session.send("key r");
    session.send("key p");
    EXPECT_EQ(largest_difference(screenshot(session), first), 0);
    expect_silent(session.quit());
}

/// Of the moment of the key, in full resolution; the turntable then goes on.
TEST_F(Input, AScreenshotIsTakenWhileTheViewTurns) {
    Session session(shots_, {splats_, "--cameras", cameras_, "--size", "1000x750"});
    ASSERT_TRUE(session.found());
    session.send("key t");
    const Image first = screenshot(session);
    float difference = 0;
    for (int i = 0; i < 100 && difference <= 0.1f; ++i)
        difference = largest_difference(screenshot(session), first);
    EXPECT_GT(difference, 0.1f) << "it stands still";
    expect_silent(session.quit());
}

/// A click with Ctrl opens a slider to be typed in: digits are its own then, and do not choose modes.
TEST_F(Input, AFieldOfThePanelTakesDigitsAndLeavesFunctionKeys) {
    if (viewer::find_font().empty()) GTEST_SKIP() << "the rows have other places without a vector font";
    Session session(shots_, {splats_, "--cameras", cameras_, "--frame", "1", "--size", "400x300"});
    ASSERT_TRUE(session.found());
    // What is pressed in one frame with the click may still mean the mode: a screenshot is some frames later.
    const auto after = [&](const char* commands) {
        session.send(commands);
        screenshot(session);
        return screenshot(session);
    };
    const Image before = after("key F2 key 4");
    after("mousemove 180 205");  // the slider of the splats' scale
    after("keydown ctrl click 1");
    EXPECT_LE(largest_difference(after("keyup ctrl key 1"), before), kRounding) << "1 has chosen a mode";
    float difference = largest_difference(after("key 0"), before);
    for (int i = 0; i < 100 && difference <= 0.05f; ++i)
        difference = largest_difference(screenshot(session), before);
    EXPECT_GT(difference, 0.05f) << "splats ten times the size";
    expect_silent(session.quit());
}

TEST_F(Input, ComparesWithTheImageByKey) {
    Session session(shots_, {splats_, "--cameras", cameras_, "--frame", "1", "--size", "96x32"});
    ASSERT_TRUE(session.found());
    session.send("key v");
    const Image beside = screenshot(session), image = load_image(cameras_ + "/images/1.png");
    for (int x = 0; x < 48; ++x) EXPECT_NEAR(beside.at(48 + x, 16)[1], image.at(x, 16)[1], kRounding);
    // A turn leaves the camera, and with it the image; G comes back.
    act(session, {"mousemove 20 20", "mousedown 1", "mousemove 30 20", "mousemove 40 20", "mouseup 1"});
    EXPECT_GT(largest_difference(screenshot(session), beside), 0.1f);
    session.send("key g");
    EXPECT_LE(largest_difference(screenshot(session), beside), kRounding);
    expect_silent(session.quit());
}

TEST_F(Input, TheWindowChangesItsSizeAndGoesAway) {
    Session session(shots_, {splats_, "--size", "200x150"});
    ASSERT_TRUE(session.found());
    session.send("search --name ewa$ windowsize --sync 333 222");
    Image picture = screenshot(session);
    EXPECT_EQ(picture.width, 333);
    EXPECT_EQ(picture.height, 222);
    session.send(
        "search --name ewa$ windowunmap --sync windowmap --sync windowsize --sync 1 1 windowsize --sync 150 "
        "90");
    session.send("mousemove 20 20");
    picture = screenshot(session);
    EXPECT_EQ(picture.width, 150);
    EXPECT_GT(range_of(picture), 0.3f);
    expect_silent(session.quit());
}

TEST_F(Input, AnExrHasTheRenderingsValues) {
    Session session(shots_, {splats_, "--cameras", cameras_, "--frame", "2", "--size", "48x32"});
    ASSERT_TRUE(session.found());
    const std::string path = session.screenshot(".exr");
    ASSERT_NE(path, "");
    expect_silent(run_ewa({"render", splats_, "--cameras", cameras_, "--frames", "2", "-o", folder_ / "exr",
                           "--format", "exr", "--quiet"}));
    EXPECT_LE(largest_difference(load_image(path), load_image(folder_ / "exr/2.exr")), 1e-6f);
    expect_silent(session.quit());
}

/// EWA_TEST_EVENTS: how many. EWA_TEST_SEED: those of a run that failed.
TEST_F(Input, AThousandRandomEventsAreSilent) {
    const char* wanted = std::getenv("EWA_TEST_EVENTS");
    const int events = wanted ? std::atoi(wanted) : 1000;
    const char* wanted_seed = std::getenv("EWA_TEST_SEED");
    const unsigned seed = wanted_seed ? unsigned(std::stoul(wanted_seed)) : std::random_device()();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const auto below = [&](int n) {
        return std::to_string(std::uniform_int_distribution<int>(0, n - 1)(random));
    };
    const std::vector<std::string> keys{
        "w",     "a",      "s",      "d",       "e",       "1",   "2",     "3",      "4",     "5",  "r",
        "f",     "t",      "u",      "c",       "g",       "v",   "Left",  "Right",  "F1",    "F2", "minus",
        "equal", "ctrl+1", "ctrl+2", "shift+1", "shift+2", "Tab", "space", "Return", "Escape"};
    std::ofstream script(folder_ / "events");
    for (int i = 0; i < events; ++i) {
        switch (std::uniform_int_distribution<int>(0, 6)(random)) {
            case 0:
            case 1:
                script << "key " << keys[std::uniform_int_distribution<size_t>(0, keys.size() - 1)(random)]
                       << "\n";
                break;
            case 2:
                script << "click " << 1 + std::stoi(below(5)) << "\n";
                break;
            case 3:
                script << "mousedown " << 1 + std::stoi(below(3)) << "\n";
                break;
            case 4:
                script << "mouseup " << 1 + std::stoi(below(3)) << "\n";
                break;
            default:
                script << "mousemove " << below(400) << " " << below(300) << "\n";
        }
        if (i % 100 == 99)
            script << "search --name ewa$ windowsize " << 50 + std::stoi(below(400)) << " "
                   << 50 + std::stoi(below(300)) << "\n";
    }
    script << "mouseup 1\nmouseup 2\nmouseup 3\n";
    script.close();
    Session session(shots_, {splats_, "--cameras", cameras_, "--size", "400x300"});
    ASSERT_TRUE(session.found());
    EXPECT_TRUE(session.send_file(folder_ / "events"));
    session.send("search --name ewa$ windowsize --sync 400 300 mousemove 200 280 key F12");
    EXPECT_TRUE(session.awaited(shots_ + "/ewa-view-1.png")) << "it does not answer any more";
    session.send("key ctrl+q sleep 2");  // there may be edits that it asks about
    expect_silent(session.quit());
}

}  // namespace
}  // namespace ewa::test
