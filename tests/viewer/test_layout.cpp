// SPDX-License-Identifier: Apache-2.0
// Where the window shows what, what it remembers, and its font: the parts that need no window.
#include <gtest/gtest.h>

#include <filesystem>

#include "cli/program.h"
#include "viewer/font.h"
#include "viewer/kept_settings.h"
#include "viewer/layout.h"
#include "viewer/message.h"
#include "viewer/variable.h"

namespace ewa::viewer {
namespace {

using test::Variable;

TEST(Layout, ThePictureIsBesideThePanel) {
    EXPECT_EQ(free_area({1100, 800}, 300), (Rectangle{300, 0, 800, 800}));
    EXPECT_EQ(free_area({1100, 800}, 0), (Rectangle{0, 0, 1100, 800}));
    EXPECT_EQ(free_area({667, 800}, 300), (Rectangle{300, 0, 367, 800}));
    EXPECT_EQ(free_area({666, 800}, 300), (Rectangle{0, 0, 666, 800}))
        << "too narrow: the panel lies over it";
    EXPECT_EQ(free_area({0, 0}, 300), (Rectangle{0, 0, 1, 1}));
}

TEST(Layout, ThePanelLeavesTheBarsRoom) {
    EXPECT_EQ(panel_width(1280, 16), 304);
    EXPECT_EQ(panel_width(640, 16), 288);
    EXPECT_EQ(panel_width(1280, 32), 576);
    EXPECT_EQ(panel_width(600, 16), 304) << "it lies over the picture";
    for (int width = 100; width < 1000; ++width) {
        const Rectangle area = free_area({width, 800}, panel_width(width, 16));
        EXPECT_GE(area.width, std::min(width, int(kBarsNeed * 16))) << width;
    }
}

TEST(Layout, ADenseMonitorHasLargerText) {
    EXPECT_EQ(monitor_scale({1920, 1040}, {344, 194}), 1) << "small, with few px";
    EXPECT_EQ(monitor_scale({3840, 2120}, {597, 336}), 2);
    EXPECT_EQ(monitor_scale({3840, 2120}, {1210, 680}), 1) << "a television";
    EXPECT_EQ(monitor_scale({3840, 2160}, {1016, 571}), 1) << "96 px an inch, as virtual displays have";
    EXPECT_EQ(monitor_scale({3840, 2160}, {0, 0}), 2);
    EXPECT_EQ(monitor_scale({2880, 1760}, {302, 189}), 1.75);
    EXPECT_EQ(monitor_scale({1280, 720}, {0, 0}), 1);
    EXPECT_EQ(monitor_scale({0, 0}, {0, 0}), 1);
}

TEST(Layout, PlacesKeepTheImagesAspectRatio) {
    const Rectangle area{101, 0, 701, 300};
    const Arrangement beside = arrange(Comparison::beside, area, {200, 100});
    EXPECT_EQ(beside.rendering, (Rectangle{101, 0, 350, 300}));
    EXPECT_EQ(beside.image, (Rectangle{451, 62, 351, 176}));
    const Arrangement wipe = arrange(Comparison::wipe, area, {200, 100});
    EXPECT_EQ(wipe.rendering, area);
    EXPECT_EQ(wipe.image, (Rectangle{151, 0, 600, 300}));
}

TEST(Layout, WidePicturesStandAboveEachOtherInAHighArea) {
    const Arrangement high = arrange(Comparison::beside, {300, 0, 400, 800}, {200, 100});
    EXPECT_EQ(high.rendering, (Rectangle{300, 0, 400, 400}));
    EXPECT_EQ(high.image, (Rectangle{300, 500, 400, 200}));
    const Arrangement portrait = arrange(Comparison::beside, {300, 0, 400, 800}, {200, 800});
    EXPECT_EQ(portrait.rendering, (Rectangle{300, 0, 200, 800}));
}

TEST(Layout, ANewWindowHasRoomForThePanelAndThePicture) {
    const Size portrait = window_size({270, 480}, 304, {1920, 1080}, 1);
    EXPECT_EQ(portrait, (Size{1100, 880}));
    const Size landscape = window_size({1920, 1080}, 304, {2560, 1440}, 1);
    EXPECT_EQ(landscape, (Size{1584, 880}));
    EXPECT_EQ(window_size({1920, 1080}, 304, {0, 0}, 1), landscape) << "an unknown desktop";
    const Size small = window_size({1920, 1080}, 304, {1024, 600}, 1);
    EXPECT_LE(small.width, 1024);
    EXPECT_LE(small.height, 600);
    EXPECT_GT(small.width, 900);
    const Size dense = window_size({270, 480}, 608, {3840, 2160}, 2);
    EXPECT_EQ(dense, (Size{2200, 1760}));
}

TEST(Layout, AnImageWithoutItsLeftColumns) {
    Image image(3, 2, 1);
    image.pixels = {1, 2, 3, 4, 5, 6};
    EXPECT_EQ(part_of(image, {0, 0, 3, 2}).pixels, image.pixels);
    EXPECT_EQ(part_of(image, {1, 0, 2, 2}).pixels, (std::vector<float>{2, 3, 5, 6}));
    EXPECT_EQ(part_of(image, {0, 1, 9, 1}).pixels, (std::vector<float>{4, 5, 6}));
    EXPECT_EQ(part_of(image, {9, 0, 5, 2}).pixels, (std::vector<float>{3, 6}));
}

TEST(KeptSettings, ComeBack) {
    const test::Folder folder;
    const KeptSettings kept{
        .window = Size{1234, 777}, .text_scale = 1.5f, .gain = 8, .film_seconds = 3, .light = true};
    const std::string file = folder / "new/folder/view.json";
    write_settings(file, kept);
    EXPECT_EQ(read_settings(file), kept);
    EXPECT_EQ(read_settings(folder / "absent.json"), KeptSettings());
    write_settings("", kept);
    write_settings("/dev/null/view.json", kept);
}

TEST(KeptSettings, DamageIsIgnored) {
    const test::Folder folder;
    const std::string file = folder / "view.json";
    const auto read = [&](const std::string& text) {
        test::write_file(file, text);
        return read_settings(file);
    };
    for (const std::string& text :
         {std::string(), std::string("{"), std::string("[1]"), std::string(70000, ' ') + "{}",
          std::string(300, '['), std::string("{\"mode\": 7, \"gain\": \"x\", \"text_scale\": 1e9}"),
          std::string("{\"window_width\": -5, \"window_height\": 1e300}"),
          std::string("{\"window_width\": 800}"), std::string("{\"theme\": 1}"), std::string("\xff\xfe")})
        EXPECT_EQ(read(text), KeptSettings()) << text.substr(0, 60);
    const KeptSettings partly = read("{\"text_scale\": 2, \"gain\": null, \"mode\": \"depth\"}");
    EXPECT_EQ(partly.text_scale, 2);
    EXPECT_EQ(partly.gain, KeptSettings().gain);
}

TEST(KeptSettings, AreInTheUsersFolder) {
    const Variable home("HOME", "/home/someone");
    {
        const Variable config("XDG_CONFIG_HOME", "/elsewhere");
        EXPECT_EQ(settings_file(), "/elsewhere/ewa/view.json");
    }
    const Variable config("XDG_CONFIG_HOME", "relative");
    EXPECT_EQ(settings_file(), "/home/someone/.config/ewa/view.json");
    const Variable homeless("HOME", "");
    EXPECT_TRUE(settings_file().empty());
}

TEST(Message, AnEmptyNoteIsNotShown) {
    const auto now = Message::Clock::now();
    Message message;
    message.note = "broken.ply cannot be read";
    message.note_until = now + std::chrono::seconds(10);
    EXPECT_TRUE(message.noting(now));
    EXPECT_FALSE(message.noting(now + std::chrono::seconds(11)));
    message.note.clear();
    EXPECT_FALSE(message.noting(now));
    EXPECT_FALSE(message.expire(now + std::chrono::seconds(9)));
    EXPECT_TRUE(message.expire(now + std::chrono::seconds(10)));
    EXPECT_FALSE(message.expire(now + std::chrono::seconds(10)));
}

TEST(Message, AHintFades) {
    const auto now = Message::Clock::now();
    Message message;
    message.hint_until = now + std::chrono::seconds(15);
    EXPECT_EQ(message.hint_opacity(now), 1);
    EXPECT_FALSE(message.expire(now));
    EXPECT_NEAR(message.hint_opacity(now + std::chrono::seconds(14)), 0.5, 1e-3);
    EXPECT_TRUE(message.expire(now + std::chrono::seconds(14)));
    EXPECT_TRUE(message.hinting(now + std::chrono::seconds(14)));
    EXPECT_TRUE(message.expire(now + std::chrono::seconds(15)));
    EXPECT_FALSE(message.expire(now + std::chrono::seconds(16)));
    EXPECT_EQ(message.hint_opacity(now + std::chrono::seconds(16)), 0);
}

TEST(Font, IsAUsualOneOrNone) {
    const test::Folder folder;
    const Variable home("XDG_DATA_HOME", folder / "mine"), others("XDG_DATA_DIRS", folder / "theirs");
    EXPECT_TRUE(find_font().empty());
    const std::string font = folder / "theirs/fonts/truetype/dejavu/DejaVuSans.ttf";
    std::filesystem::create_directories(std::filesystem::path(font).parent_path());
    test::write_file(font, "no tables of a font");
    EXPECT_EQ(find_font(), font);
    EXPECT_TRUE(read_font(font).empty()) << "another magic number";
    test::write_file(font, std::string("\0\1\0\0", 4));
    EXPECT_TRUE(read_font(font).empty()) << "too short";
    test::write_file(font, std::string("\0\1\0\0\0\0\0\0\0\0\0\0\0", 13));
    EXPECT_EQ(read_font(font).size(), 13u);
    EXPECT_TRUE(read_font(folder / "absent.ttf").empty());
}

}  // namespace
}  // namespace ewa::viewer
