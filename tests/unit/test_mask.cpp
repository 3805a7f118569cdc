// SPDX-License-Identifier: Apache-2.0
#include "scene/mask.h"

#include <algorithm>
#include <cmath>

#include "ewa/image.h"
#include "support/png_bytes.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
namespace fs = std::filesystem;
using test::expect_error;

/// What a PNG of two pixels says. type: bits and colour type. row: the bytes of its pixels.
std::vector<float> weights(const std::string& type, const std::string& row, const std::string& notes = "") {
    const test::TempFolder folder;
    const std::string kind = type + std::string(3, '\0');
    return scene::load_mask(folder.write("m.png", test::png_bytes(2, 1, kind, notes, '\0' + row))).pixels;
}

std::string bytes(std::initializer_list<int> values) {
    std::string text;
    for (const int value : values) text += char(value);
    return text;
}

using Weights = std::vector<float>;
const std::string kGrey = bytes({8, 0}), kSixteen = bytes({16, 0}), kColor = bytes({8, 2}),
                  kPalette = bytes({8, 3}), kAlpha = bytes({8, 6});

TEST(Mask, LargestValueOfOneIsWhite) {
    EXPECT_EQ(weights(kGrey, bytes({255, 51})), Weights({1, 0.2f}));
    EXPECT_EQ(weights(kGrey, bytes({1, 0})), Weights({1, 0}));
    EXPECT_EQ(weights(kGrey, bytes({0, 0})), Weights({0, 0}));
    EXPECT_EQ(weights(kGrey, bytes({16, 0})), Weights({16 / 255.f, 0})) << "a soft mask";
    EXPECT_EQ(weights(bytes({1, 0}), bytes({0x80})), Weights({1, 0}));
    EXPECT_EQ(weights(kSixteen, bytes({255, 255, 0, 0})), Weights({1, 0}));
    EXPECT_EQ(weights(kSixteen, bytes({0, 1, 0, 0})), Weights({1, 0}));
    EXPECT_EQ(weights(kSixteen, bytes({0, 255, 0, 51})), Weights({1, 0.2f}));
    EXPECT_EQ(weights(kSixteen, bytes({128, 0, 0, 0})), Weights({32768 / 65535.f, 0}));
    expect_error<InputError>(
        [&] {
            weights(kGrey, bytes({3, 1}));
        },
        {"m.png: the mask's largest value is 3"});
}

/// A mask of 64 x 48 pixels with these levels of 8 bits.
fs::path mask_of(const test::TempFolder& folder, int (*level)(int x, int y)) {
    Image mask(64, 48, 1);
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 64; ++x) *mask.at(x, y) = float(level(x, y)) / 255;
    save_image(folder / "m.png", mask);
    return folder / "m.png";
}

TEST(Mask, NumbersOfObjectsAreRefused) {
    const test::TempFolder folder;
    for (int (*level)(int, int) :
         {+[](int x, int) { return x < 32 ? 20 : 0; }, +[](int x, int) { return x < 32 ? 91 : 0; },
          +[](int x, int) { return x / 3; }, +[](int x, int y) { return x / 16 * 20 + y / 24 * 70; },
          +[](int x, int y) { return 17 * (x / 8 * 5 % 8 + y / 12 * 2); },
          +[](int x, int y) { return x < 5 && y < 6 ? 30 : 0; }})
        expect_error<InputError>([&] { scene::load_mask(mask_of(folder, level)); },
                                 {"m.png: the mask's largest value is ", "seem to number objects"});
    const auto at = [](const Image& mask) { return std::lround(*mask.at(10, 24) * 255); };
    for (const auto& [level, middle] : std::initializer_list<std::pair<int (*)(int, int), long>>{
             {[](int x, int) { return x < 32 ? 128 : 0; }, 128},
             {[](int, int) { return 128; }, 128},
             {[](int, int) { return 80; }, 80},
             {[](int x, int) { return x < 32 ? 235 : 16; }, 235},
             {[](int x, int) { return x < 32 ? 250 : 0; }, 250},
             {[](int x, int) { return 2 * x; }, 20},
             {[](int x, int y) { return 60 - (x + y) / 4; }, 52},
             {[](int x, int y) { return std::max(0, 120 - 2 * (x - 10) * (x - 10) - (y - 24) * (y - 24)); },
              120},
             {[](int x, int y) { return x < 32   ? 90
                                        : x < 33 ? 60 + y % 5
                                                 : 0; }, 90},
             {[](int x, int y) { return std::max(0, x + y - 101); }, 0}})
        EXPECT_EQ(at(scene::load_mask(mask_of(folder, level))), middle);
}

TEST(Mask, AnotherShapeIsRefusedUnlessThePhotoIsTurned) {
    const test::TempFolder folder;
    const fs::path path = mask_of(folder, [](int x, int y) { return x < 32 && y < 24 ? 255 : 0; });
    EXPECT_EQ(scene::load_mask(path, {128, 96, 6}).width, 64);
    // What is at the left and the top of the upright photo.
    const Image right = scene::load_mask(path, {48, 64, 6}), left = scene::load_mask(path, {48, 64, 8});
    ASSERT_EQ(right.width, 48);
    EXPECT_EQ(oriented(right, 6).pixels, scene::load_mask(path).pixels);
    EXPECT_EQ(oriented(left, 8).pixels, scene::load_mask(path).pixels);
    EXPECT_EQ(*right.at(0, 63), 1.0f);
    EXPECT_EQ(*left.at(47, 0), 1.0f);
    for (const int orientation : {1, 3})
        expect_error<InputError>(
            [&] {
                scene::load_mask(path, {48, 64, orientation});
            },
            {"m.png: the mask is 64 x 48 pixels, its image 48 x 64"});
    expect_error<InputError>([&] { scene::load_mask(path, {50, 64, 6}); }, {"the mask is 64 x 48"});
}

TEST(Mask, AlphaThatVariesIsTheMask) {
    EXPECT_EQ(weights(kAlpha, bytes({0, 0, 0, 255, 0, 0, 0, 0})), Weights({1, 0}));
    EXPECT_EQ(weights(kAlpha, bytes({9, 80, 200, 1, 70, 8, 9, 0})), Weights({1, 0}));
    EXPECT_EQ(weights(kAlpha, bytes({255, 255, 255, 255, 0, 0, 0, 255})), Weights({1, 0}));
}

TEST(Mask, OneColourBesideBlackIsWhite) {
    const std::string palette = test::png_chunk("PLTE", bytes({0, 0, 0, 128, 0, 0, 0, 128, 0}));
    EXPECT_EQ(weights(kPalette, bytes({1, 0}), palette), Weights({1, 0}));
    EXPECT_EQ(weights(kColor, bytes({0, 0, 128, 0, 0, 0})), Weights({1, 0}));
    expect_error<InputError>(
        [&] {
            weights(kPalette, bytes({1, 2}), palette);
        },
        {"m.png: the mask has colours"});
}

}  // namespace
