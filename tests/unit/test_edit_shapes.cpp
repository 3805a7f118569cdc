// SPDX-License-Identifier: Apache-2.0
// Shapes of selections against their definitions, and where splats are dense.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>

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
    for (size_t i = 0; i < g.size(); ++i) EXPECT_EQ(splats.affected(i), before[i] != 0 && !near(i, 0)) << i;
}

/// A splat in the image of parallel rays of 100 px per unit: its ellipse of 2 standard deviations.
struct Drawn {
    glm::dvec2 at;
    double a, b, turn;  // half axes, px, and the angle of the first

    glm::dvec2 border(double angle) const {
        const glm::dvec2 p(a * std::cos(angle), b * std::sin(angle));
        return at + glm::dvec2(p.x * std::cos(turn) - p.y * std::sin(turn),
                               p.x * std::sin(turn) + p.y * std::cos(turn));
    }
    bool has(const glm::dvec2& p) const {
        const glm::dvec2 d = p - at;
        return glm::length(glm::dvec2((d.x * std::cos(turn) + d.y * std::sin(turn)) / a,
                                      (d.y * std::cos(turn) - d.x * std::sin(turn)) / b)) <= 1;
    }
};

double distance_to(const std::vector<glm::dvec2>& line, const glm::dvec2& p) {
    double least = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i + 1 < line.size(); ++i) {
        const glm::dvec2 along = line[i + 1] - line[i];
        const double t = std::clamp(glm::dot(p - line[i], along) / glm::dot(along, along), 0.0, 1.0);
        least = std::min(least, glm::distance(p, line[i] + t * along));
    }
    return least;
}

TEST(BrushByExtent, TakesTheEllipsesThatItTouches) {
    constexpr int kSamples = 2000;
    Random random(7);
    std::vector<Drawn> drawn;
    Gaussians g;
    g.resize(100);
    for (size_t i = 0; i < g.size(); ++i) {
        const double a = std::pow(10, random.uniform(0, 2));
        drawn.push_back({{random.uniform(0, 500), random.uniform(0, 500)},
                         a,
                         a * std::pow(10, random.uniform(-2, 0)),
                         random.uniform(0, 3)});
        // In steps of float32, which the scene has.
        g.means[3 * i] = float(drawn[i].at.x / 100);
        g.means[3 * i + 1] = float(drawn[i].at.y / 100);
        g.log_scales[3 * i] = float(std::log(drawn[i].a / 200));
        g.log_scales[3 * i + 1] = g.log_scales[3 * i + 2] = float(std::log(drawn[i].b / 200));
        g.quaternions[4 * i] = float(std::cos(drawn[i].turn / 2));
        g.quaternions[4 * i + 3] = float(std::sin(drawn[i].turn / 2));
    }
    edit::EditedSplats splats(std::make_shared<const Gaussians>(g));
    size_t taken = 0, left = 0;
    for (int stroke = 0; stroke < 30; ++stroke) {
        const double radius = std::pow(10, random.uniform(-1, 2));
        std::vector<glm::dvec2> line;
        std::string text = "brush=" + std::to_string(radius);
        for (int k = 0; k < 3; ++k) {
            line.emplace_back(random.integer(0, 500), random.integer(0, 500));
            text += "," + std::to_string(int(line[k].x)) + "," + std::to_string(int(line[k].y));
        }
        do_edit(splats, "select", text + ";view=parallel:100,100,0,0,1,0,0,0,0,0,10;extent");
        for (size_t i = 0; i < drawn.size(); ++i) {
            const Drawn& splat = drawn[i];
            double distance = splat.has(line[0]) || splat.has(line[1]) || splat.has(line[2]) ? 0 : 1e9;
            for (int k = 0; k < kSamples; ++k)
                distance =
                    std::min(distance, distance_to(line, splat.border(2 * std::numbers::pi * k / kSamples)));
            const double unsure = 2 * std::numbers::pi * splat.a / kSamples + 1e-3;
            if (std::abs(distance - radius) < unsure) continue;
            EXPECT_EQ(splats.affected(i), distance < radius) << "stroke " << stroke << ", splat " << i;
            (distance < radius ? taken : left) += 1;
        }
    }
    EXPECT_GT(taken, 100u);
    EXPECT_GT(left, 1000u);
}

TEST(Undo, AfterAResetInAnotherOriginGivesTheSameBits) {
    Random random(8);
    Gaussians far;
    far.resize(200);
    for (float& v : far.means) v = float(random.uniform(-5, 5));
    for (float& v : far.quaternions) v = float(random.normal());
    far.origin = {5e5, 4e6, 100};
    edit::EditedSplats splats(std::make_shared<const Gaussians>(far));
    do_edit(splats, "select", "all");
    do_edit(splats, "transform", "move=-499990.1,-3999990.3,0");
    ASSERT_NE(splats.splats()->origin, far.origin);
    do_edit(splats, "select", "x=10..");
    ASSERT_GT(splats.count(edit::kSelected), 50u);
    do_edit(splats, "reset", "");
    do_edit(splats, "transform", "turn=0.1,0.2,0.3,40");
    const std::vector<float> before = splats.splats()->means;
    const edit::EditedSplats::Extent extent = splats.extent();
    do_edit(splats, "transform", "scale=1.1");
    EXPECT_NE(splats.splats()->means, before);
    splats.rewind(extent);
    EXPECT_EQ(splats.splats()->means, before);
}

}  // namespace
}  // namespace ewa::test
