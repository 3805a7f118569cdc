// SPDX-License-Identifier: Apache-2.0
// ewa-view as a process, in a real window on a virtual display.
#include <vulkan/vulkan_core.h>
#include <algorithm>

#include "io/datasets/view_list.h"
#include "scene/framing.h"
#include "viewer/window_test.h"

namespace ewa::test {
namespace {

using Window = WindowTest;

Circumstances with_fault(const std::string& name, const std::string& value) {
    Circumstances circumstances;
    circumstances.environment = {{"LD_PRELOAD", EWA_FAULTS_LIBRARY}, {name, value}};
    return circumstances;
}

TEST_F(Window, ShowsWhatRenderWrites) {
    const Image picture = shown({"--frame", "2"});
    EXPECT_LE(largest_difference(picture, rendered("2")), kRounding);
    EXPECT_GT(range_of(picture), 0.3f) << "there is nothing in the picture";
}

TEST_F(Window, ShowsWhatRenderWritesWithItsOptions) {
    EXPECT_LE(largest_difference(shown({"--frame", "1", "--background", "1,0.5,0", "--kernel", "antialias"}),
                                 rendered("1", {"--background", "1,0.5,0", "--kernel", "antialias"})),
              kRounding);
    EXPECT_LE(
        largest_difference(shown({"--frame", "1", "--mode", "alpha"}), rendered("1", {"--mode", "alpha"})),
        kRounding);
}

TEST_F(Window, EveryModeShowsSomethingElse) {
    std::vector<Image> pictures;
    for (const char* mode : {"color", "depth", "alpha", "count", "ellipsoids", "median-depth", "normal"}) {
        pictures.push_back(shown({"--mode", mode}));
        EXPECT_GT(range_of(pictures.back()), 0.3f) << mode;
        for (size_t i = 0; i + 1 < pictures.size(); ++i)
            EXPECT_GT(largest_difference(pictures[i], pictures.back()), 0.1f) << mode << " is as mode " << i;
    }
}

TEST_F(Window, TheImageIsWhereItsCameraSawIt) {
    const Image image = load_image(cameras_ + "/images/1.png"), splats = rendered("1");
    const Image beside = shown({"--frame", "1", "--size", "96x32", "--compare", "beside"});
    const Image wipe = shown({"--frame", "1", "--compare", "wipe"});
    const Image difference = shown({"--frame", "1", "--compare", "difference"});
    for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 48; ++x)
            for (int c = 0; c < 3; ++c) {
                EXPECT_NEAR(beside.at(x, y)[c], splats.at(x, y)[c], kRounding);
                EXPECT_NEAR(beside.at(48 + x, y)[c], image.at(x, y)[c], kRounding);
                EXPECT_NEAR(wipe.at(x, y)[c], x < 24 ? image.at(x, y)[c] : splats.at(x, y)[c], kRounding);
                const float error = std::min(1.0f, 4 * std::abs(splats.at(x, y)[c] - image.at(x, y)[c]));
                EXPECT_NEAR(difference.at(x, y)[c], error, 5 * kRounding);
            }
}

TEST_F(Window, HasTheSizeAskedForWithoutADataset) {
    expect_silent(run_view({splats_, "--size", "301x203", "--screenshot", folder_ / "shown.png"}));
    const Image picture = load_image(folder_ / "shown.png");
    EXPECT_EQ(picture.width, 301);
    EXPECT_EQ(picture.height, 203);
    EXPECT_GT(*std::max_element(picture.pixels.begin(), picture.pixels.end()), 0.3f)
        << "the scene is not in view";
}

TEST_F(Window, ADatasetShowsItsPoints) {
    give_points();
    for (const std::string& path : {cameras_, cameras_ + "/transforms.json"}) {
        expect_silent(run_view({path, "--frame", "3", "--screenshot", folder_ / "shown.png"}));
        EXPECT_GT(range_of(load_image(folder_ / "shown.png")), 0.3f);
    }
}

TEST_F(Window, ARunIsShownWithItsDatasetAndItsOptions) {
    expect_success(run_ewa({"train", cameras_, "-o", folder_ / "run", "--steps", "3", "--init", splats_,
                            "--background", "1,1,1", "--kernel", "antialias", "--quiet"}));
    expect_silent(run_view({folder_ / "run", "--frame", "1", "--screenshot", folder_ / "shown.png"}));
    expect_silent(
        run_ewa({"render", folder_ / "run/splats.ply", "--cameras", cameras_, "--frames", "1", "-o",
                 folder_ / "rendered", "--background", "1,1,1", "--kernel", "antialias", "--quiet"}));
    EXPECT_LE(largest_difference(load_image(folder_ / "shown.png"), load_image(folder_ / "rendered/1.png")),
              kRounding);
}

TEST_F(Window, AFilmGoesThroughTheSavedViews) {
    const char* view = R"({"name": "%", "width": 48, "height": 32, "fx": 50, "fy": 50, "cx": 24, "cy": 16,
        "rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1], "translation": [%, 0, 4], "pivot": [0, 0, 0]})";
    std::string text = "{\"views\": [";
    for (const char* x : {"-1", "1"}) {
        std::string entry = view;
        for (size_t at; (at = entry.find('%')) != std::string::npos;) entry.replace(at, 1, x);
        text += (text.back() == '[' ? "" : ",") + entry;
    }
    write_file(folder_ / "views.json", text + "]}");
    expect_silent(run_view({splats_, "--size", "48x32", "--views", folder_ / "views.json", "--film",
                            folder_ / "film", "--film-seconds", "0.1"}));
    const std::vector<std::string> files = files_below(folder_ / "film");
    EXPECT_EQ(files, (std::vector<std::string>{"00000.png", "00001.png", "00002.png", "00003.png"}));
    const Image first = load_image(folder_ / "film/00000.png"), last = load_image(folder_ / "film/00003.png");
    EXPECT_EQ(first.width, 48);
    EXPECT_GT(range_of(first), 0.3f);
    EXPECT_GT(largest_difference(first, last), 0.1f);
    expect_failure(run_view({splats_, "--film", folder_ / "film"}), 2, "--views");
    write_file(folder_ / "views.json", "{\"views\": [{\"name\": \"a\", \"width\": 48}]}");
    expect_failure(run_view({splats_, "--views", folder_ / "views.json"}), 2, "view 0");
}

/// Whatever a swapchain may answer, at the first picture or later, the window ends up with the right one.
TEST_F(Window, WhatASwapchainSaysIsHandled) {
    const Image expected = rendered("2");
    for (const VkResult result : {VK_ERROR_OUT_OF_DATE_KHR, VK_ERROR_SURFACE_LOST_KHR, VK_ERROR_DEVICE_LOST,
                                  VK_SUBOPTIMAL_KHR, VK_TIMEOUT, VK_NOT_READY})
        for (const char* call : {"EWA_FAULT_ACQUIRE", "EWA_FAULT_PRESENT"})
            for (const char* at : {"1,", "2,"}) {
                const bool acquires = std::string(call) == "EWA_FAULT_ACQUIRE";
                if (acquires ? result == VK_SUBOPTIMAL_KHR : result == VK_TIMEOUT || result == VK_NOT_READY)
                    continue;  // this call does not answer so, or has then acquired an image
                SCOPED_TRACE(std::string(call) + " " + at + std::to_string(result));
                const std::string path = folder_ / "shown.png";
                std::filesystem::remove(path);
                expect_silent(run_view({splats_, "--cameras", cameras_, "--frame", "2", "--screenshot", path},
                                       with_fault(call, at + std::to_string(result))));
                EXPECT_LE(largest_difference(load_image(path), expected), kRounding);
            }
}

TEST_F(Window, WhatCannotBeMendedIsOneLine) {
    const std::vector<std::string> arguments{splats_, "--screenshot", folder_ / "shown.png"};
    expect_failure(run_view(arguments, with_fault("EWA_FAULT_ACQUIRE", "1,-3")), 1,
                   "ErrorInitializationFailed");
    for (const char* at : {"1", "3", "6"})
        expect_failure(run_view(arguments, with_fault("EWA_FAULT_SUBMITS", at)), 1, "lost");
    EXPECT_FALSE(std::filesystem::exists(folder_ / "shown.png"));
}

TEST_F(Window, VerboseTellsTheTimesAtTheEnd) {
    const Outcome outcome =
        run_view({splats_, "--size", "48x32", "--screenshot", folder_ / "shown.png", "--verbose"});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.err.find("first picture after "), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("last picture: 48 x 32 px"), std::string::npos) << outcome.err;
}

/// A budget is for views that change. What stays has all splats.
TEST_F(Window, ABudgetLeavesTheLastPictureWhole) {
    const std::string levels = folder_ / "l/lod-meta.json", part = folder_ / "part.png",
                      whole = folder_ / "whole.png";
    expect_success(run_ewa({"convert", splats_, levels, "--levels", "3", "--quiet"}));
    expect_silent(run_view({levels, "--size", "48x32", "--screenshot", whole}));
    expect_silent(run_view({levels, "--size", "48x32", "--screenshot", part, "--budget", "5"}));
    EXPECT_EQ(load_image(part).pixels, load_image(whole).pixels);
    expect_failure(run_view({levels, "--budget", "0"}), 2, "--budget: '0' is not a whole number from 1");
}

TEST_F(Window, APictureThatCannotBeWrittenIsAFailure) {
    write_file(folder_ / "file", "in the way");
    expect_failure(run_view({splats_, "--screenshot", folder_ / "file/shown.png"}), 1, "file");
}

TEST(WithoutWindow, NoDisplayIsOneLine) {
    unsetenv("DISPLAY");
    unsetenv("WAYLAND_DISPLAY");
    const Folder folder;
    make_splats(folder / "splats.ply");
    expect_failure(run_view({folder / "splats.ply"}), 1, "no window can be opened");
}

TEST(WithoutWindow, ScreenshotsAndFilmsNeedNoDisplay) {
    unsetenv("DISPLAY");
    unsetenv("WAYLAND_DISPLAY");
    const Folder folder;
    make_splats(folder / "splats.ply", 400, 2);
    make_dataset(folder / "views");
    const std::string splats = folder / "splats.ply", shown = folder / "shown.png";
    expect_success(run_view({splats, "--cameras", folder / "views", "--frame", "2", "--screenshot", shown}));
    expect_success(run_ewa({"render", splats, "--cameras", folder / "views", "-o", folder / "r", "--quiet"}));
    EXPECT_LE(largest_difference(load_image(shown), load_image(folder / "r/2.png")), kRounding);
    expect_success(run_view({splats, "--size", "64x48", "--mode", "count", "--screenshot", shown}));
    EXPECT_EQ(load_image(shown).width, 64);
    const Camera camera = scene::look_at({0, 0, -6}, {0, 0, 0}, {0, -1, 0}, 48, 32);
    io::write_views(folder / "views.json", {{"1", camera, {}}, {"2", camera, {}}});
    expect_success(run_view({splats, "--size", "48x32", "--views", folder / "views.json", "--film",
                             folder / "film", "--film-seconds", "0.1"}));
    EXPECT_EQ(files_below(folder / "film").size(), 4u);
    expect_success(run_ewa({"render", splats, "--views", folder / "views.json", "-o", folder / "saved"}));
    EXPECT_LE(
        largest_difference(load_image(folder / "film/00003.png"), load_image(folder / "saved/00001.png")),
        kRounding);
    expect_failure(
        run_view({splats, "--cameras", folder / "views", "--compare", "wipe", "--screenshot", shown}), 2,
        "--compare");
    expect_success(run_view({splats, "--size", "8x8", "--screenshot", folder / "new/folder/shown.png"}));
    EXPECT_TRUE(std::filesystem::exists(folder / "new/folder/shown.png"));
    write_file(folder / "file", "in the way");
    expect_failure(run_view({splats, "--screenshot", folder / "file/shown.png"}), 1, "file");
}

TEST(WithoutWindow, NoPictureTakesTheNameOfAnInput) {
    unsetenv("DISPLAY");
    unsetenv("WAYLAND_DISPLAY");
    const Folder folder;
    make_splats(folder / "splats.ply");
    make_dataset(folder / "views", {"0.png", "1.png", "00002.png"});
    const Camera camera = scene::look_at({0, 0, -6}, {0, 0, 0}, {0, -1, 0}, 48, 32);
    io::write_views(folder / "views.json", {{"1", camera, {}}, {"2", camera, {}}});
    const std::string splats = folder / "splats.ply", data = folder / "views", saved = folder / "views.json",
                      link = folder / "link.png", hard = folder / "hard.png";
    std::filesystem::create_symlink(splats, link);
    std::filesystem::create_hard_link(saved, hard);
    std::filesystem::copy_file(splats, folder / "same.png");
    const auto whole = [&] {
        std::string all;
        for (const std::string& file : files_below(folder / "")) all += file + read_file(folder / file);
        return all;
    };
    const std::string before = whole();
    const auto refused = [&](const std::vector<std::string>& arguments, const std::string& text) {
        expect_failure(run_view(arguments), 2, text);
        EXPECT_EQ(whole(), before);
    };
    refused({splats, "--screenshot", link}, "--screenshot " + link + " is the same file as PATH");
    refused({splats, "--views", saved, "--screenshot", hard}, "is the same file as --views");
    refused({folder / "same.png", "--screenshot", folder / "same.png"}, "is the same file as PATH");
    refused({data, "--screenshot", data + "/images/1.png"}, "is the same file as an image of the dataset");
    refused({splats, "--cameras", data, "--screenshot", data + "/images/0.png"}, "an image of the dataset");
    refused(
        {splats, "--cameras", data, "--views", saved, "--film-seconds", "0.1", "--film", data + "/images"},
        "00002.png is the same file as an image of the dataset");
}

TEST(WithoutWindow, WrongUseIsOneLine) {
    const Folder folder;
    EXPECT_TRUE(run_view({"--version"}).out.starts_with("ewa-view "));
    make_splats(folder / "splats.ply");
    make_dataset(folder / "views");
    const std::string splats = folder / "splats.ply";
    expect_failure(run_view({"--screenshot", folder / "shown.png"}), 2, "PATH");
    expect_failure(run_view({"--cameras", folder / "views"}), 2, "PATH");
    expect_failure(run_view({"--train"}), 2, "PATH");
    expect_failure(run_view({folder / "none.ply"}), 2, "none.ply");
    expect_failure(run_view({folder / "none"}), 2, "no such file or folder");
    expect_failure(run_view({splats, "--size", "640"}), 2, "--size");
    expect_failure(run_view({splats, "--size", "0x480"}), 2, "--size");
    expect_failure(run_view({splats, "--frame", "1"}), 2, "--cameras");
    expect_failure(run_view({splats, "--cameras", folder / "views", "--frame", "4"}), 2, "no frame 4");
    expect_failure(run_view({splats, "--screenshot", folder / "shown.jpg"}), 2, ".png");
    expect_failure(run_view({splats, "--device", "no such device"}), 2, "no such device");
}

}  // namespace
}  // namespace ewa::test
