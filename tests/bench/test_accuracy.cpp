// SPDX-License-Identifier: Apache-2.0
// Error against run time: what a point is worth, and the whole measurement of a small scene.
#include "bench/accuracy.h"

#include <gtest/gtest.h>

namespace ewa::bench {
namespace {

TEST(Accuracy, APointIsOnTheFrontIfNothingIsFasterAndLessWrong) {
    std::vector<report::WorkSeries> series{
        {"ray, opacity", true, {{"a", 1, 0.1}, {"b", 4, 0.01}}},
        {"march, opacity", true, {{"few", 2, 0.2}, {"many", 8, 0.001}, {"slow", 9, 0.005}}},
        {"march, density", true, {{"few", 3, 0.3}}},
    };
    set_verdicts(series);
    EXPECT_EQ(series[0].points[0].verdict, "on the front");
    EXPECT_EQ(series[0].points[1].verdict, "on the front");
    EXPECT_EQ(series[1].points[0].verdict, "ray, opacity: a is faster and less wrong");
    EXPECT_EQ(series[1].points[1].verdict, "on the front");
    // The best of those that are faster and less wrong.
    EXPECT_EQ(series[1].points[2].verdict, "march, opacity: many is faster and less wrong");
    // Points of another exact image are no rivals.
    EXPECT_EQ(series[2].points[0].verdict, "on the front");
}

}  // namespace
}  // namespace ewa::bench
