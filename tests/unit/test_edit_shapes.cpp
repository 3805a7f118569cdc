// SPDX-License-Identifier: Apache-2.0
// Shapes of selections against their definitions, and where splats are dense.
#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <limits>

#include "edit/edits.h"
#include "edit/shapes.h"
#include "support/random_scene.h"

namespace ewa::test {
namespace {

void do_edit(edit::EditedSplats& splats, const char* name, const std::string& value) {
    edit::perform_on(splats, edit::parse(name, value));
}

TEST(Resized, IsFastWhereSplatsAreDense) {
    // Two heaps, 1.1 apart.
    constexpr size_t kHeap = 100'000;
    Random random(5);
    Gaussians g;
    g.resize(2 * kHeap + 2);
    for (size_t i = 0; i < 2 * kHeap; ++i)
        for (size_t k = 0; k < 3; ++k)
            g.means[3 * i + k] = float(random.uniform(-1e-3, 1e-3) + (k == 0 && i >= kHeap ? 1.1 : 0));
    g.means[6 * kHeap] = std::numeric_limits<float>::quiet_NaN();
    g.means[6 * kHeap + 3] = std::numeric_limits<float>::infinity();
    edit::EditedSplats splats(std::make_shared<const Gaussians>(std::move(g)));
    const std::clock_t start = std::clock();
    const auto selected_after = [&](const std::string& shape) {
        do_edit(splats, "select", shape);
        return splats.count(edit::kSelected);
    };
    EXPECT_EQ(selected_after("x=..0.5"), kHeap);
    EXPECT_EQ(selected_after("grow=1"), kHeap);
    EXPECT_EQ(selected_after("shrink=1"), kHeap);
    EXPECT_EQ(selected_after("grow=1.2"), 2 * kHeap);
    EXPECT_EQ(selected_after("shrink=1.2"), 2 * kHeap);
    EXPECT_EQ(selected_after("x=..0.5"), kHeap);
    EXPECT_EQ(selected_after("shrink=1.2"), 0u);
    EXPECT_LT(double(std::clock() - start), 8.0 * CLOCKS_PER_SEC);  // each pair by itself takes a minute
}

TEST(Resized, IsByTheDistanceOfMeans) {
    Random random(6);
    Gaussians g;
    g.resize(300);
    for (float& v : g.means) v = float(random.uniform(-1, 1));
    edit::EditedSplats splats(std::make_shared<const Gaussians>(g));
    do_edit(splats, "select", "x=0..");
    const std::vector<uint8_t> before = splats.states();
    const auto near = [&](size_t i, uint8_t state) {
        for (size_t k = 0; k < g.size(); ++k) {
            double square = 0;
            for (size_t axis = 0; axis < 3; ++axis)
                square += std::pow(double(g.means[3 * i + axis]) - g.means[3 * k + axis], 2);
            if (before[k] == state && square <= 0.2 * 0.2) return true;
        }
        return false;
    };
    do_edit(splats, "select", "grow=0.2");
    for (size_t i = 0; i < g.size(); ++i)
        EXPECT_EQ(splats.affected(i), before[i] != 0 || near(i, edit::kSelected)) << i;
    splats.set_states(before);
    do_edit(splats, "select", "shrink=0.2");
    for (size_t i = 0; i < g.size(); ++i)
        EXPECT_EQ(splats.affected(i), before[i] != 0 && !near(i, 0)) << i;
}

}  // namespace
}  // namespace ewa::test
