// SPDX-License-Identifier: Apache-2.0
// Clouds with fewer points: as many as asked for, evenly over space, and the same each time.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "core/random.h"
#include "scene/thin_points.h"

namespace {

using namespace ewa;

/// Nine of ten points are in a corner of a unit cube.
PointCloud lopsided(uint32_t count) {
    PointCloud cloud;
    for (uint32_t i = 0; i < count; ++i) {
        const auto u = core::uniform4({i, 1, 2, 3});
        const double side = i % 10 == 0 ? 1 : 0.1;
        cloud.positions.emplace_back(side * u[0], side * u[1], side * u[2]);
        cloud.colors.push_back({uint8_t(i), uint8_t(i >> 8), uint8_t(i >> 16)});
    }
    return cloud;
}

size_t in_corner(const PointCloud& cloud) {
    size_t count = 0;
    for (const glm::dvec3& p : cloud.positions) count += p.x < 0.1 && p.y < 0.1 && p.z < 0.1;
    return count;
}

TEST(ThinPoints, AreAsManyAsAskedForAndEven) {
    const PointCloud cloud = lopsided(100'000);
    EXPECT_GT(in_corner(cloud), 89'000u);
    for (const size_t most : {1u, 2u, 100u, 777u, 5'000u}) {
        SCOPED_TRACE(most);
        const PointCloud thin = scene::thinned(cloud, most);
        ASSERT_EQ(thin.positions.size(), most);
        ASSERT_EQ(thin.colors.size(), most);
        EXPECT_LE(in_corner(thin), 1 + most / 50) << "a thousandth of the cube";
        EXPECT_EQ(thin.positions, scene::thinned(cloud, most).positions);
        // They are points of the cloud, in its order, with their colours.
        size_t at = 0;
        for (size_t i = 0; i < most; ++i) {
            while (at < cloud.positions.size() && cloud.positions[at] != thin.positions[i]) ++at;
            ASSERT_LT(at, cloud.positions.size());
            EXPECT_EQ(thin.colors[i], cloud.colors[at]);
        }
    }
    EXPECT_EQ(scene::thinned(cloud, 100'000).positions, cloud.positions);
}

TEST(ThinPoints, ThatCoincideOrAreFarApart) {
    PointCloud same;
    same.positions.assign(300, {1, 2, 3});
    same.colors.resize(300);
    EXPECT_EQ(scene::thinned(same, 100).positions.size(), 100u);
    PointCloud far = lopsided(300);
    for (size_t i = 0; i < 8; ++i)
        far.positions[i] = {i & 1 ? 3e38 : -3e38, i & 2 ? 3e38 : -3e38, i & 4 ? 3e38 : -3e38};
    for (const size_t most : {1u, 7u, 8u, 9u, 100u})
        EXPECT_EQ(scene::thinned(far, most).positions.size(), most) << most;
    const PointCloud thin = scene::thinned(far, 100);
    std::set<double> places;
    for (const glm::dvec3& p : thin.positions) places.insert(p.x);
    EXPECT_GT(places.size(), 90u);
}

}  // namespace
