// SPDX-License-Identifier: Apache-2.0
#include "core/progress.h"

#include <gtest/gtest.h>

#include <string>

namespace {

using namespace ewa::core;

TEST(Pace, CountsDownBetweenUnitsOfEqualLength) {
    Pace pace;
    EXPECT_FALSE(pace.left(3, 10).has_value());
    for (int done = 1; done <= 4; ++done) pace.add(5 * done, done);
    EXPECT_DOUBLE_EQ(pace.rate(), 0.2);
    EXPECT_DOUBLE_EQ(pace.left(20, 10).value(), 30);
    EXPECT_DOUBLE_EQ(pace.left(23, 10).value(), 27);
}

/// Groups of photos took 23 minutes, 8 minutes, 8 seconds and 6 minutes by the last two seconds alone.
TEST(Pace, DoesNotJumpWithASingleQuickUnit) {
    Pace pace;
    double seconds = 0, last = 0;
    int done = 0;
    for (const double unit : {20.0, 22.0, 0.1, 18.0, 21.0, 0.1, 19.0, 0.1, 20.0, 21.0}) {
        pace.add(seconds += unit, ++done);
        const double whole = seconds + pace.left(seconds, 25).value();
        if (done > 4) {
            EXPECT_NEAR(whole, last, 0.4 * last) << done;
        }
        last = whole;
    }
}

TEST(Pace, GrowsWhileAUnitIsLate) {
    Pace pace;
    pace.add(1, 1);
    const double soon = pace.left(1.5, 10).value();
    EXPECT_LT(soon, pace.left(1, 10).value());
    EXPECT_GE(pace.left(20, 10).value(), 80);
}

TEST(Pace, FollowsTheLaterHalfOfTheTime) {
    Pace pace;
    for (int done = 1; done <= 100; ++done) pace.add(done, done);
    for (int done = 101; done <= 200; ++done) pace.add(100 + 4 * (done - 100), done);
    EXPECT_NEAR(pace.rate(), 0.25, 0.02);
}

TEST(Pace, LeavesOutWhatWasDoneBefore) {
    Pace pace(1, 1500);
    pace.add(2, 1510);
    EXPECT_DOUBLE_EQ(pace.left(2, 2000).value(), 49);
}

TEST(Drawn, FitsAnyTerminal) {
    const ProgressLine line{0.31, 230, "trained 831/2692 steps, loss 0.0712, PSNR 25.1 dB, 38211 splats"};
    for (size_t columns = 1; columns < 200; ++columns)
        EXPECT_LT(drawn(line, columns, false).size(), columns) << columns;
    EXPECT_EQ(drawn(line, 30, false), " 31 %  3 min 50 s left  train");
    EXPECT_EQ(drawn(line, 50, false), "###-------  31 %  3 min 50 s left  trained 831/26");
    EXPECT_EQ(drawn({1, {}, "rendered 4/4 views"}, 80, false), "################ 100 %  rendered 4/4 views");
    EXPECT_EQ(drawn({0, {}, ""}, 50, true).find("\u2500\u2500"), 0u);
}

}  // namespace
