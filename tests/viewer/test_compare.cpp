// SPDX-License-Identifier: Apache-2.0
// The comparison of a render with the image of its camera, and the thread that does it.
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <memory>
#include <vector>

#include "support/soon.h"
#include "viewer/comparison.h"

namespace ewa::viewer {
namespace {

ByteImage flat(int width, int height, uint8_t value) {
    return {width, height, std::vector<uint8_t>(size_t(width) * size_t(height) * 4, value), 0};
}

TEST(Compare, TheDifferenceOfEqualSizesIsPixelByPixel) {
    ByteImage rendering = flat(4, 2, 100);
    const ByteImage image = flat(4, 2, 90);
    rendering.rgba[4] = 30;  // the second pixel's red
    ByteImage result = difference(rendering, image, {0, 0, 4, 2});
    EXPECT_EQ(result.rgba[0], 10);
    EXPECT_EQ(result.rgba[4], 60);
    EXPECT_EQ(result.rgba[3], 255);
    amplify(result, 5);
    EXPECT_EQ(result.rgba[0], 50);
    EXPECT_EQ(result.rgba[4], 255);
    EXPECT_EQ(result.rgba[3], 255);
}

TEST(Compare, OutsideOfTheImageIsBlack) {
    const ByteImage result = difference(flat(6, 4, 100), flat(2, 4, 0), {2, 0, 2, 4});
    EXPECT_EQ(result.rgba[4 * 1], 0);
    EXPECT_EQ(result.rgba[4 * 2], 100);
    EXPECT_EQ(result.rgba[4 * 4], 0);
}

TEST(Compare, AnImageOfAnotherSizeIsSampled) {
    ByteImage image = flat(2, 1, 0);
    for (size_t c = 0; c < 3; ++c) image.rgba[4 + c] = 200;
    const ByteImage result = difference(flat(4, 2, 0), image, {0, 0, 4, 2});
    EXPECT_EQ(result.rgba[0], 0);   // at 0.25 of the first pixel: the border goes on
    EXPECT_EQ(result.rgba[4], 50);  // a quarter of the way to the second pixel's centre
    EXPECT_EQ(result.rgba[4 * 3], 200);
}

TEST(Compare, ADifferenceImageIsMadeOnRequest) {
    auto rendering = std::make_shared<RenderedFrame>();
    rendering->picture = flat(4, 2, 100);
    auto image = std::make_shared<CameraImage>();
    image->picture = flat(4, 2, 90);
    const ComparisonRequest request{rendering, image, {0, 0, 4, 2}, 3};
    const Compared compared = compare_with_image(request);
    EXPECT_EQ(compared.of, request);
    EXPECT_EQ(compared.difference.rgba[0], 30);
}

TEST(Latest, WhatWaitsGivesWayToTheLast) {
    std::promise<void> begun, go_on;
    std::atomic<int> news = 0;
    std::vector<int> made;
    const auto make = [&](const int& request) {
        made.push_back(request);
        if (request == 1) {
            begun.set_value();
            go_on.get_future().wait();
        }
        return 10 * request;
    };
    {
        Latest<int, int> latest(make, [&] { ++news; });
        EXPECT_EQ(latest.result(), nullptr);
        latest.ask(1);
        begun.get_future().wait();
        latest.ask(2);
        latest.ask(3);
        EXPECT_EQ(latest.result(), nullptr) << "asking does not wait";
        go_on.set_value();
        EXPECT_TRUE(test::soon([&] { return news >= 2; }));
        ASSERT_TRUE(latest.result());
        EXPECT_EQ(*latest.result(), 30);
    }
    EXPECT_EQ(made, (std::vector<int>{1, 3}));
}

}  // namespace
}  // namespace ewa::viewer
