// SPDX-License-Identifier: Apache-2.0
#include "scene/mask.h"

#include "support/png_bytes.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
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
