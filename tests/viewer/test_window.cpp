// SPDX-License-Identifier: Apache-2.0
// ewa-view as a process, in a real window on a virtual display.
#include <gtest/gtest.h>

#include <algorithm>

#include "cli/expect.h"
#include "ewa/image.h"
#include "viewer/virtual_display.h"

namespace ewa::test {
namespace {

Outcome run_view(const std::vector<std::string>& arguments) {
    Circumstances circumstances;
    circumstances.program = EWA_VIEW_PROGRAM;
    return run_ewa(arguments, circumstances);
}

float largest_difference(const Image& a, const Image& b) {
    EXPECT_EQ(a.pixels.size(), b.pixels.size());
    float largest = 0;
    for (size_t i = 0; i < std::min(a.pixels.size(), b.pixels.size()); ++i)
        largest = std::max(largest, std::abs(a.pixels[i] - b.pixels[i]));
    return largest;
}

class Window : public testing::Test {
  protected:
    void SetUp() override {
        unsetenv("WAYLAND_DISPLAY");
        if (display_.name().empty())
            GTEST_SKIP() << "no X server can be started here (Debian: xvfb); the window is not tested";
        setenv("DISPLAY", display_.name().c_str(), 1);
        // Its messages come on standard output, which expect_silent() wants empty.
        setenv("VK_INSTANCE_LAYERS", "VK_LAYER_KHRONOS_validation", 1);
        make_splats(splats_, 400, 2);
        make_dataset(cameras_);
    }
    void TearDown() override { unsetenv("VK_INSTANCE_LAYERS"); }

    void expect_silent(const Outcome& outcome) {
        expect_success(outcome);
        EXPECT_EQ(outcome.out, "");
    }

    VirtualDisplay display_;
    Folder folder_;
    const std::string splats_ = folder_ / "splats.ply", cameras_ = folder_ / "views";
};

TEST_F(Window, ShowsWhatRenderWrites) {
    expect_silent(
        run_view({splats_, "--cameras", cameras_, "--frame", "2", "--screenshot", folder_ / "shown.png"}));
    expect_silent(run_ewa(
        {"render", splats_, "--cameras", cameras_, "--frames", "2", "-o", folder_ / "rendered", "--quiet"}));
    const Image shown = load_image(folder_ / "shown.png"), rendered = load_image(folder_ / "rendered/2.png");
    ASSERT_EQ(shown.width, rendered.width);
    ASSERT_EQ(shown.height, rendered.height);
    EXPECT_LE(largest_difference(shown, rendered), 1.001f / 255);
    const auto [darkest, brightest] = std::minmax_element(shown.pixels.begin(), shown.pixels.end());
    EXPECT_GT(*brightest - *darkest, 0.3f) << "there is nothing in the picture";
}

TEST_F(Window, HasTheSizeAskedForWithoutADataset) {
    expect_silent(run_view({splats_, "--size", "301x203", "--screenshot", folder_ / "shown.png"}));
    const Image shown = load_image(folder_ / "shown.png");
    EXPECT_EQ(shown.width, 301);
    EXPECT_EQ(shown.height, 203);
    EXPECT_GT(*std::max_element(shown.pixels.begin(), shown.pixels.end()), 0.3f)
        << "the scene is not in view";
}

TEST_F(Window, APictureThatCannotBeWrittenIsAFailure) {
    expect_failure(run_view({splats_, "--screenshot", folder_ / "nowhere/shown.png"}), 1, "nowhere");
}

TEST(WithoutWindow, NoDisplayIsOneLine) {
    unsetenv("DISPLAY");
    unsetenv("WAYLAND_DISPLAY");
    const Folder folder;
    make_splats(folder / "splats.ply");
    expect_failure(run_view({folder / "splats.ply"}), 1, "no window can be opened");
}

TEST(WithoutWindow, WrongUseIsOneLine) {
    const Folder folder;
    make_splats(folder / "splats.ply");
    make_dataset(folder / "views");
    const std::string splats = folder / "splats.ply";
    expect_failure(run_view({}), 2, "FILE");
    expect_failure(run_view({folder / "none.ply"}), 2, "none.ply");
    expect_failure(run_view({splats, "--size", "640"}), 2, "--size");
    expect_failure(run_view({splats, "--size", "0x480"}), 2, "--size");
    expect_failure(run_view({splats, "--frame", "1"}), 2, "--cameras");
    expect_failure(run_view({splats, "--cameras", folder / "views", "--frame", "4"}), 2, "no frame 4");
    expect_failure(run_view({splats, "--screenshot", folder / "shown.jpg"}), 2, ".png");
    expect_failure(run_view({splats, "--device", "no such device"}), 2, "no such device");
}

}  // namespace
}  // namespace ewa::test
