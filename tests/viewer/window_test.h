// SPDX-License-Identifier: Apache-2.0
// What the tests of the window share: a display, small inputs, and the validation layer listening.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "cli/expect.h"
#include "ewa/image.h"
#include "viewer/virtual_display.h"

namespace ewa::test {

inline Outcome run_view(const std::vector<std::string>& arguments, Circumstances circumstances = {}) {
    circumstances.program = EWA_VIEW_PROGRAM;
    return run_ewa(arguments, circumstances);
}

inline float largest_difference(const Image& a, const Image& b) {
    EXPECT_EQ(a.width, b.width);
    EXPECT_EQ(a.height, b.height);
    float largest = a.pixels.size() == b.pixels.size() ? 0.0f : 1.0f;
    for (size_t i = 0; i < std::min(a.pixels.size(), b.pixels.size()); ++i)
        largest = std::max(largest, std::abs(a.pixels[i] - b.pixels[i]));
    return largest;
}

inline constexpr float kRounding = 1.001f / 255;  // of 8 bits

class WindowTest : public testing::Test {
  protected:
    void SetUp() override {
        unsetenv("WAYLAND_DISPLAY");
        if (display_.name().empty())
            GTEST_SKIP() << "no X server can be started here (Debian: xvfb); the window is not tested";
        setenv("DISPLAY", display_.name().c_str(), 1);
        // Its messages come on standard output, which expect_silent() wants empty.
        setenv("VK_INSTANCE_LAYERS", "VK_LAYER_KHRONOS_validation", 1);
        setenv("XDG_CONFIG_HOME", config_.c_str(), 1);  // the user's settings are not the tests'
        setenv("DBUS_SESSION_BUS_ADDRESS", "unix:path=/nonexistent/bus", 1);  // nor are its dialogs
        make_splats(splats_, 400, 2);
        make_dataset(cameras_);
    }
    void TearDown() override {
        unsetenv("VK_INSTANCE_LAYERS");
        unsetenv("XDG_CONFIG_HOME");
        unsetenv("DBUS_SESSION_BUS_ADDRESS");
    }

    static void expect_silent(const Outcome& outcome) {
        expect_success(outcome);
        EXPECT_EQ(outcome.out, "");
    }
    static float range_of(const Image& image) {
        const auto [darkest, brightest] = std::minmax_element(image.pixels.begin(), image.pixels.end());
        return *brightest - *darkest;
    }
    /// Three points for the dataset.
    void give_points() {
        write_file(
            cameras_ + "/points.ply",
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
            "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
            "0 0 0 255 0 0\n0 0.3 0 0 255 0\n0 0 0.3 0 0 255\n");
        auto json = read_json(cameras_ + "/transforms.json");
        json["ply_file_path"] = "points.ply";
        write_file(cameras_ + "/transforms.json", json.dump());
    }
    Image rendered(const std::string& frame, const std::vector<std::string>& more = {}) {
        std::vector<std::string> arguments{"render", splats_, "--cameras",          cameras_, "--frames",
                                           frame,    "-o",    folder_ / "rendered", "--quiet"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        expect_silent(run_ewa(arguments));
        return load_image(folder_ / "rendered/" + frame + ".png");
    }
    Image shown(const std::vector<std::string>& more) {
        std::vector<std::string> arguments{splats_, "--cameras", cameras_, "--screenshot",
                                           folder_ / "shown.png"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        expect_silent(run_view(arguments));
        return load_image(folder_ / "shown.png");
    }

    VirtualDisplay display_;
    Folder folder_;
    const std::string splats_ = folder_ / "splats.ply", cameras_ = folder_ / "views",
                      config_ = folder_ / "config";
};

}  // namespace ewa::test
