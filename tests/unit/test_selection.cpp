// SPDX-License-Identifier: Apache-2.0
// Edits of a selection: shapes, values, undo and redo.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <glm/gtc/quaternion.hpp>

#include "edit/edits.h"
#include "edit/ground.h"
#include "edit/history.h"
#include "edit/shapes.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "scene/frustum.h"
#include "scene/native_lens.h"
#include "shared/constants.h"
#include "support/splat_scenes.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using namespace ewa::edit;
using test::expect_error;
using test::Random;

std::shared_ptr<const Gaussians> some_splats(uint64_t seed, size_t count = 300, int degree = 2) {
    Gaussians g = test::storable_splats(seed, count, degree);
    for (float& v : g.log_scales) v = std::min(v, -2.0f);
    return std::make_shared<const Gaussians>(std::move(g));
}

/// Isotropic opaque splats of this standard deviation.
Gaussians balls(const std::vector<glm::dvec3>& means, double deviation, float logit = 6) {
    Gaussians g;
    g.resize(means.size());
    for (size_t i = 0; i < means.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            g.means[3 * i + size_t(axis)] = float(means[i][axis]);
            g.log_scales[3 * i + size_t(axis)] = float(std::log(deviation));
        }
        g.quaternions[4 * i] = 1;
        g.opacity_logits[i] = logit;
    }
    return g;
}

void expect_same_bytes(const Gaussians& a, const Gaussians& b) {
    ASSERT_EQ(a.size(), b.size());
    EXPECT_EQ(a.origin, b.origin);
    const auto same = [](const std::vector<float>& x, const std::vector<float>& y) {
        return x.size() == y.size() && std::memcmp(x.data(), y.data(), 4 * x.size()) == 0;
    };
    EXPECT_TRUE(same(a.means, b.means));
    EXPECT_TRUE(same(a.quaternions, b.quaternions));
    EXPECT_TRUE(same(a.log_scales, b.log_scales));
    EXPECT_TRUE(same(a.opacity_logits, b.opacity_logits));
    EXPECT_TRUE(same(a.sh, b.sh));
}

std::vector<bool> selected(const History& history) {
    std::vector<bool> flags;
    for (const uint8_t state : history.splats().states()) flags.push_back((state & kSelected) != 0);
    return flags;
}

Step step(const std::vector<Words>& edits) {
    return {"Test", edits};
}

Step selection(const std::string& shape) {
    return step({{"select", shape}});
}

/// What a selection takes of a scene in which nothing is selected.
std::vector<bool> taken(const Gaussians& splats, const std::string& shape) {
    History history(std::make_shared<const Gaussians>(splats));
    history.perform(selection(shape));
    return selected(history);
}

/// What ewa convert makes of the splats.
Gaussians replayed(const Gaussians& splats, const std::vector<Words>& words) {
    std::vector<Edit> edits;
    for (const Words& w : words) edits.push_back(parse(w.name, w.value));
    Gaussians result = splats;
    edit::apply(result, edits);
    return result;
}

Camera camera_at(const glm::dvec3& translation) {
    Camera camera;
    camera.width = 200, camera.height = 100;
    camera.fx = camera.fy = 100;
    camera.cx = 100, camera.cy = 50;
    camera.translation = translation;
    return camera;
}

/// A random edit of any kind.
Step random_step(Random& random) {
    const auto number = [&](double low, double high) { return std::to_string(random.uniform(low, high)); };
    const auto point = [&] { return number(-4, 4) + "," + number(-4, 4) + "," + number(-4, 4); };
    const char* operations[] = {"", "add:", "remove:", "and:"};
    const std::string operation = operations[random.integer(0, 3)];
    switch (random.integer(0, 13)) {
        case 0:
            return selection(operation + "sphere=" + point() + "," + number(1, 5));
        case 1:
            return selection(operation + "opacity=" + number(0, 0.5) + "..");
        case 2:
            return selection("invert");
        case 3:
            return selection("grow=" + number(0.1, 1));
        case 4:
            return step({{"delete", ""}});
        case 5:
            return step({{"duplicate", ""}});
        case 6:
            return step({{"transform", "turn=" + number(0.1, 1) + ",1,0," + number(-90, 90)}});
        case 7:
            return step({{"select", "all"}, {"transform", "move=" + point()}, {"select", "none"}});
        case 8:
            return step({{"adjust", "tint=" + number(0, 2) + ",1,1;contrast=" + number(0.5, 2)}});
        case 9:
            return step({{random.integer(0, 1) != 0 ? "lock" : "unlock", ""}});
        case 10:
            return step({{random.integer(0, 1) != 0 ? "hide" : "unhide", ""}});
        case 11:
            return step({{"reset", ""}});
        case 12:
            return step({{"transform", "all:move=" + point()}});
        default:
            return selection(
                polygon_shape(camera_at({0, 0, 8}), {{random.uniform(0, 200), 10}, {150, 20}, {90, 90}}));
    }
}

TEST(Selection, TakesWhatAnyOfItsShapesSays) {
    const Gaussians g = balls({{0, 0, 0}, {1, 0, 0}, {3, 0, 0}, {9, 9, 9}}, 0.1);
    using Flags = std::vector<bool>;
    EXPECT_EQ(taken(g, "all"), (Flags{true, true, true, true}));
    EXPECT_EQ(taken(g, "none"), (Flags{false, false, false, false}));
    EXPECT_EQ(taken(g, "invert"), (Flags{true, true, true, true}));
    EXPECT_EQ(taken(g, "x=0.5..3.5"), (Flags{false, true, true, false}));
    EXPECT_EQ(taken(g, "box=-1,-1,-1,2,1,1"), (Flags{true, true, false, false}));
    EXPECT_EQ(taken(g, "sphere=3,0,0,2"), (Flags{false, true, true, false}));
    EXPECT_EQ(taken(g, "floaters"), (Flags{true, true, true, true}));
}

TEST(Selection, CombinesWithTheOneBefore) {
    History history(
        std::make_shared<const Gaussians>(balls({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}, 0.1)));
    using Flags = std::vector<bool>;
    history.perform(selection("x=..1.5"));
    history.perform(selection("add:x=2.5.."));
    EXPECT_EQ(selected(history), (Flags{true, true, false, true}));
    history.perform(selection("remove:x=..0.5"));
    EXPECT_EQ(selected(history), (Flags{false, true, false, true}));
    history.perform(selection("and:x=..2"));
    EXPECT_EQ(selected(history), (Flags{false, true, false, false}));
    history.perform(selection("grow=1.1"));
    EXPECT_EQ(selected(history), (Flags{true, true, true, false}));
    history.perform(selection("shrink=1.1"));
    EXPECT_EQ(selected(history), (Flags{true, true, false, false}));
}

TEST(Selection, FollowsGroupsAndColours) {
    std::vector<glm::dvec3> means;
    for (int i = 0; i < 20; ++i) means.emplace_back(0.1 * i, 0, 0);  // a row whose splats touch
    means.emplace_back(50, 0, 0);
    Gaussians g = balls(means, 0.1);
    for (size_t i = 0; i < 10; ++i) g.sh[3 * i] = 1;  // half of the row is redder
    const auto count = [&](const std::string& shape) {
        const auto flags = taken(g, shape);
        return std::count(flags.begin(), flags.end(), true);
    };
    EXPECT_EQ(count("cluster=0,1,0"), 20);
    EXPECT_EQ(count("flood=0,0,0,0.1"), 10);
    EXPECT_EQ(count("flood=0,0,0,1"), 20);
    EXPECT_EQ(count("floaters"), 1);
    EXPECT_EQ(count("far"), 1);
    EXPECT_EQ(count("color=0.782,0.5,0.5,0.01"), 10);
}

TEST(Selection, FloodsNeitherFaintNorLargeSplats) {
    const auto sized = [](Gaussians& g, size_t i, double deviation) {
        std::fill_n(&g.log_scales[3 * i], 3, float(std::log(deviation)));
    };
    const auto count = [](const Gaussians& g, const std::string& shape) {
        const auto flags = taken(g, shape);
        return std::count(flags.begin(), flags.end(), true);
    };
    // Two rows of like colours, and a faint splat that bridges them.
    std::vector<glm::dvec3> means;
    for (int i = 0; i < 20; ++i) means.emplace_back(0.1 * i + (i < 10 ? 0 : 1.1), 0, 0);
    means.emplace_back(1.5, 0, 0);
    Gaussians rows = balls(means, 0.1);
    for (size_t i = 10; i < 20; ++i) rows.sh[3 * i] = 0.2f;
    sized(rows, 20, 0.19);
    rows.opacity_logits[20] = -4;
    EXPECT_EQ(count(rows, "flood=0,0,0,0.1"), 21);
    EXPECT_EQ(count(rows, "flood=0,0,0,0.1,0.01"), 21) << "its opacity is 0.018";
    EXPECT_EQ(count(rows, "flood=0,0,0,0.1,0.1"), 10);
    EXPECT_EQ(count(rows, "flood=3,0,0,0.1,0.1"), 10);
    EXPECT_EQ(count(rows, "flood=1.4,0,0,0.1,0.1"), 10) << "it does not begin with the faint one";
    // Opaque splats of rising, then of falling sizes.
    Gaussians chain =
        balls({{0, 0, 0}, {0.5, 0, 0}, {1.6, 0, 0}, {3.6, 0, 0}, {5.6, 0, 0}, {6.7, 0, 0}, {7.2, 0, 0}}, 0.1);
    for (const auto& [i, deviation] : {std::pair(1, 0.19), {2, 0.36}, {3, 0.68}, {4, 0.36}, {5, 0.19}})
        sized(chain, size_t(i), deviation);
    EXPECT_EQ(count(chain, "flood=0,0,0,1"), 7);
    EXPECT_EQ(count(chain, "flood=0,0,0,1,0"), 3);
    EXPECT_EQ(count(chain, "flood=7.2,0,0,1,0"), 3);
    EXPECT_EQ(count(chain, "flood=3.6,0,0,1,0"), 7) << "none is larger than the first one";
}

TEST(Selection, TakesSplatsByTheirNumbers) {
    const Gaussians g = balls({{0, 0, 0}, {1, 0, 0}, {3, 0, 0}, {9, 9, 9}}, 0.1);
    using Flags = std::vector<bool>;
    EXPECT_EQ(taken(g, "splats=3"), (Flags{false, false, false, true}));
    EXPECT_EQ(taken(g, "splats=0,2-3"), (Flags{true, false, true, true}));
    for (const char* shape :
         {"splats=", "splats=1,,2", "splats=2-1", "splats=-1", "splats=1-x", "splats=4294967296"})
        expect_error<InputError>([&] { parse_selection(shape); }, {"--select: ", "splats="});
    expect_error<InputError>([&] { taken(g, "splats=2-4"); }, {"there is no splat 4 among 4"});
    expect_error<InputError>([&] { taken(g, "contradicted"); }, {"--select: photos are known of the folder"});
}

TEST(Selection, StaysWhereAShapeIsRemoved) {
    using Flags = std::vector<bool>;
    const Gaussians g = balls({{0, 0, 0}, {1, 0, 0}, {3, 0, 0}, {9, 9, 9}}, 0.1);
    History history(std::make_shared<const Gaussians>(g));
    history.perform(step({{"select", "x=9.."}, {"lock", ""}, {"select", "x=1.."}}));
    const Step removal = step({{"remove", "x=2.."}, {"remove", "x=..0"}});
    ASSERT_TRUE(history.perform(removal));
    EXPECT_EQ(selected(history), (Flags{false, true, false, false}));
    EXPECT_EQ(history.splats().left(), 2u) << "the last one is locked";
    EXPECT_EQ(lasting_edits(history.in_effect()).size(), 5u);
    expect_same_bytes(replayed(g, history.edits()), history.splats().result());
    expect_same_bytes(replayed(g, needed_edits(history.edits())), history.splats().result());
    history.undo();
    EXPECT_EQ(selected(history), (Flags{false, true, true, false}));
    EXPECT_EQ(history.splats().left(), 4u);
    history.redo();
    EXPECT_EQ(selected(history), (Flags{false, true, false, false}));
    history.perform(step({{"delete", ""}}));
    EXPECT_EQ(history.splats().left(), 1u);
    expect_error<InputError>([] { parse("remove", "add:x=2.."); }, {"--remove: 'add:x=2..'"});
}

TEST(Selection, OfContradictedSplatsIsWrittenAsTheirNumbers) {
    Cameras cameras = [] { return std::vector<Camera>(); };
    std::vector<std::vector<uint32_t>> asked;
    cameras.contradicted = [&](const Gaussians& all, const std::vector<uint32_t>& left) {
        asked.push_back(left);
        std::vector<bool> flags(all.size());
        for (const uint32_t i : left) flags[i] = i != 2;
        return flags;
    };
    History history(std::make_shared<const Gaussians>(
                        balls({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}}, 0.1)),
                    cameras);
    history.perform(step(
        {{"select", "splats=0"}, {"delete", ""}, {"select", "x=1.5..2.5"}, {"select", "add:contradicted"}}));
    EXPECT_EQ(asked, (std::vector<std::vector<uint32_t>>{{1, 2, 3, 4}}));
    EXPECT_EQ(history.steps().back().edits.back(), (Words{"select", "add:splats=1,3-4"}));
    EXPECT_EQ(selected(history), (std::vector<bool>{false, true, true, true, true}));
    history.perform(step({{"delete", ""}}));
    EXPECT_FALSE(history.perform(selection("contradicted")));
    ASSERT_TRUE(history.undo() && history.undo() && history.redo());
    EXPECT_EQ(asked.size(), 2u);
    // Photos show the splats as they were at first.
    history.perform(
        step({{"select", "all"}, {"adjust", "opacity=0.1"}, {"duplicate", ""}, {"select", "contradicted"}}));
    EXPECT_EQ(history.steps().back().edits.back(), (Words{"select", "splats=1,3-4"}));
    history.perform(step({{"select", "all"}, {"transform", "move=1,0,0"}}));
    expect_error<InputError>([&] { history.perform(selection("contradicted")); }, {"before its splats move"});
}

TEST(Selection, OfAPolygonIsThatOfProjectedCentres) {
    const auto splats = some_splats(3, 2000);
    Camera camera = camera_at({0, 1, 9});
    camera.rotation = glm::mat3_cast(glm::normalize(glm::dquat(0.9, 0.1, -0.3, 0.2)));
    camera.cx = 150;
    camera.cy = 100;
    const std::vector<glm::dvec2> triangle{{20, 20}, {280, 60}, {120, 190}};
    const auto side = [](const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& p) {
        return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x) > 0;
    };
    const std::vector<bool> flags = taken(*splats, polygon_shape(camera, triangle));
    size_t inside = 0;
    for (size_t i = 0; i < splats->size(); ++i) {
        const auto pixel = projected(splats->world_mean(i), camera);
        const bool expected = pixel && side(triangle[0], triangle[1], *pixel) &&
                              side(triangle[1], triangle[2], *pixel) &&
                              side(triangle[2], triangle[0], *pixel);
        EXPECT_EQ(flags[i], expected) << i;
        inside += expected;
    }
    EXPECT_GT(inside, 20u);
}

TEST(Selection, OfABrushHasItsRadiusAndExtent) {
    // 100 px per unit at depth 1; splats of 5 px.
    const Gaussians g = balls({{0, 0, 0}, {0.12, 0, 0}, {0.3, 0, 0}}, 0.05);
    const Camera camera = camera_at({0, 0, 1});
    using Flags = std::vector<bool>;
    const std::string brush = brush_shape(camera, 11, {{100, 40}, {100, 60}});
    EXPECT_EQ(taken(g, brush), (Flags{true, false, false}));
    EXPECT_EQ(taken(g, brush + ";extent"), (Flags{true, true, false}));
    EXPECT_EQ(taken(g, rectangle_shape(camera, {80, 40}, {105, 60}) + ";extent"), (Flags{true, true, false}));
}

TEST(Selection, OfTheFrontLeavesCoveredSplats) {
    std::vector<glm::dvec3> means;
    for (int y = -10; y <= 10; ++y)
        for (int x = -10; x <= 10; ++x) means.emplace_back(0.05 * x, 0.05 * y, 0);  // a wall
    const size_t wall = means.size();
    means.emplace_back(0, 0, 2);  // behind it
    means.emplace_back(3, 0, 2);  // beside it
    const Camera camera = camera_at({0, 0, 2});
    const std::vector<bool> flags =
        taken(balls(means, 0.05), rectangle_shape(camera, {0, 0}, {200, 100}) + ";front");
    EXPECT_TRUE(flags[wall / 2]);
    EXPECT_FALSE(flags[wall]);
    EXPECT_TRUE(flags[wall + 1]);
}

TEST(Selection, GoesThroughParallelRays) {
    const Gaussians g = balls({{0, 0, 0}, {1, 0, 50}, {3, 0, 0}}, 0.1);
    Camera camera = camera_at({0, 0, 10});
    camera.fx = camera.fy = 40;
    camera.distortion.lens = Lens::orthographic;
    EXPECT_EQ(taken(g, rectangle_shape(camera, {90, 40}, {150, 60})), (std::vector<bool>{true, true, false}));
}

TEST(Selection, LeavesLockedHiddenAndDeletedSplats) {
    History history(
        std::make_shared<const Gaussians>(balls({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}, 0.1)));
    for (const auto& [shape, edit] :
         {std::pair("x=..0.5", "lock"), {"x=0.5..1.5", "hide"}, {"x=1.5..2.5", "delete"}}) {
        history.perform(selection(shape));
        EXPECT_EQ(history.splats().count(kSelected), 1u);
        history.perform(step({{edit, ""}}));
        EXPECT_EQ(history.splats().count(kSelected), 0u);
    }
    history.perform(selection("all"));
    EXPECT_EQ(selected(history), (std::vector<bool>{false, false, false, true}));
    history.perform(step({{"unlock", ""}, {"unhide", ""}, {"select", "all"}}));
    EXPECT_EQ(history.splats().count(kSelected), 3u);
    EXPECT_EQ(history.splats().result().size(), 3u);
}

TEST(Selection, IsWhatEditsChange) {
    const auto splats = some_splats(8);
    History history(splats);
    history.perform(selection("x=0.."));
    history.perform(step({{"transform", "turn=0,1,0,90"}}));
    Gaussians turned = *splats;
    transform_splats(turned, parse("transform", "turn=0,1,0,90")
                                 .place(glm::dmat4(1), *std::make_unique<std::vector<std::string>>()));
    for (size_t i = 0; i < splats->size(); ++i) {
        const Gaussians& expected = splats->means[3 * i] >= 0 ? turned : *splats;
        for (size_t k = 0; k < 3; ++k)
            EXPECT_EQ(history.splats().splats()->means[3 * i + k], expected.means[3 * i + k]);
        for (size_t k = 0; k < splats->sh_stride(); ++k)
            EXPECT_EQ(history.splats().splats()->sh[splats->sh_stride() * i + k],
                      expected.sh[splats->sh_stride() * i + k]);
    }
}

/// The unit and the origin are of the whole scene.
TEST(Selection, LeavesNothingBehindWhereAllIsMoved) {
    const Gaussians g = balls({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}, 0.1);
    const std::vector<Words> edits{{"select", "x=0.5..1.5"}, {"lock", ""},
                                   {"select", "x=1.5..2.5"}, {"hide", ""},
                                   {"select", "x=2.5.."},    {"transform", "all:move=0,5,0"}};
    History history(std::make_shared<const Gaussians>(g));
    ASSERT_TRUE(history.perform(step(edits)));
    for (size_t i = 0; i < 4; ++i) EXPECT_EQ(history.splats().splats()->means[3 * i + 1], 5.0f) << i;
    EXPECT_EQ(history.splats().states(), (std::vector<uint8_t>{0, kLocked, kHidden, kSelected}));
    expect_same_bytes(replayed(g, edits), history.splats().result());
    ASSERT_TRUE(history.undo());
    EXPECT_EQ(history.splats().splats()->means, g.means);
    // Before any selection, the bytes are those of the window, and what follows moves the scene too.
    const auto splats = some_splats(30);
    History whole(splats);
    for (const char* value : {"all:scale=3.1", "all:turn=1,2,3,40", "all:move=0.3,0,1"})
        whole.perform(step({{"transform", value}}));
    expect_same_bytes(replayed(*splats, whole.edits()), whole.splats().result());
    const auto moved = replayed(g, {{"transform", "all:move=0,5,0"}, {"transform", "move=0,1,0"}});
    for (size_t i = 0; i < 4; ++i) EXPECT_EQ(moved.means[3 * i + 1], 6.0f) << i;
}

/// A ground that slopes by 15 degrees, with things on it and a few splats below.
TEST(Ground, BecomesLevel) {
    Random random(40);
    const glm::dvec3 normal = glm::normalize(glm::dvec3(0.2, -1, 0.15)), at(3, 2, -1);
    const glm::dvec3 u = glm::normalize(glm::cross(normal, glm::dvec3(0, 0, 1))), v = glm::cross(normal, u);
    std::vector<glm::dvec3> means;
    for (int i = 0; i < 3000; ++i) {
        const double height = i < 1500 ? random.uniform(-0.01, 0.01) : random.uniform(i < 1600 ? -3 : 0, 4);
        const double wide = i < 1600 ? 10 : 3;
        means.push_back(at + u * random.uniform(-wide, wide) + v * random.uniform(-wide, wide) +
                        normal * height);
    }
    Gaussians g = balls(means, 0.05);
    const std::vector<uint8_t> states(g.size());
    const auto matrix = level_ground(g, states, {0, -1, 0});
    ASSERT_TRUE(matrix);
    const glm::dvec3 turned = glm::dmat3(*matrix) * normal;
    EXPECT_NEAR(turned.y, -1, 1e-5);
    EXPECT_NEAR((*matrix * glm::dvec4(at, 1)).y, 0, 0.02);
    EXPECT_FALSE(level_ground(g, std::vector<uint8_t>(g.size(), kDeleted), {0, -1, 0}));
    EXPECT_FALSE(level_ground(g, states, {1, 0, 0})) << "it is a wall then";
    // ewa convert does the same, whatever is selected.
    History history(std::make_shared<const Gaussians>(g));
    history.perform(selection("x=0.."));
    ASSERT_TRUE(history.perform(step({{"transform", "level=ground"}})));
    expect_same_bytes(replayed(g, history.edits()), history.splats().result());
    EXPECT_NEAR(history.splats().splats()->means[1], 0, 0.02);
    for (float& mean : g.means) mean = float(random.uniform(-1, 1));
    expect_error<InputError>([&] { replayed(g, {{"transform", "level=ground"}}); }, {"finds no ground"});
}

TEST(Selection, AdjustsColoursByTheFormula) {
    Gaussians g = *some_splats(9, 20, 1);
    const Gaussians before = g;
    adjust_splats(
        g, {.tint = {0.5f, 1, 2}, .brightness = 0.1f, .contrast = 1.5f, .white = 0.8f, .opacity = 0.5f});
    const auto color = [](const Gaussians& s, size_t i, size_t c) {
        return 0.5 + double(shared::SH_C0) * s.sh[12 * i + c];
    };
    const double tint[] = {0.5, 1, 2};
    for (size_t i = 0; i < g.size(); ++i) {
        for (size_t c = 0; c < 3; ++c) {
            const double expected = ((tint[c] * color(before, i, c) + 0.1 - 0.5) * 1.5 + 0.5) / 0.8;
            EXPECT_NEAR(color(g, i, c), expected, 1e-5);
            EXPECT_NEAR(g.sh[12 * i + 3 + c], before.sh[12 * i + 3 + c] * tint[c] * 1.5 / 0.8, 1e-5);
        }
        const auto opacity = [](float logit) { return 1 / (1 + std::exp(-double(logit))); };
        EXPECT_NEAR(opacity(g.opacity_logits[i]), opacity(before.opacity_logits[i]) / 2, 1e-6);
    }
    g = before;
    adjust_splats(g, {});
    expect_same_bytes(g, before);
}

TEST(Selection, DuplicatesAndResets) {
    const auto splats = some_splats(10, 50);
    History history(splats);
    history.perform(selection("x=0.."));
    const size_t chosen = history.splats().count(kSelected);
    history.perform(step({{"duplicate", ""}, {"transform", "move=1,2,3"}}));
    EXPECT_EQ(history.splats().left(), 50 + chosen);
    EXPECT_EQ(history.splats().count(kSelected), chosen);
    for (size_t k = 0; k < 3 * splats->size(); ++k)
        EXPECT_EQ(history.splats().splats()->means[k], splats->means[k]);  // the originals stay
    history.perform(step({{"reset", ""}}));
    const Gaussians result = history.splats().result();
    for (size_t i = 50, k = 0; k < 50; ++k)
        if (splats->means[3 * k] >= 0) {
            EXPECT_EQ(result.means[3 * i++], splats->means[3 * k]);
        }
}

TEST(Selection, NamesWhatItCannotRead) {
    for (const char* text :
         {"", "everything", "box=1,2", "polygon=1,2,3,4,5,6", "brush=0,1,1;view=1,1,0,0,1,0,0,0,0,0,0",
          "polygon=1,2,3,4;view=1,1,0,0,1,0,0,0,0,0,0", "polygon=0,0,1,0,1,1;view=1,1,0,0,0,0,0,0,0,0,0",
          "polygon=0,0,1,0,1,1;view=1,1,0,0,1,0,0,0,0,0,0;behind", "grow=-1", "flood=1,2,3", "add:"})
        expect_error<InputError>([&] { parse_selection(text); }, {"--select: '"});
    for (const char* text :
         {"", "tint=1,1", "contrast=0", "white=-1", "glow=1", "opacity=nan", "brightness=2"})
        expect_error<InputError>([&] { parse("adjust", text); }, {"--adjust: '"});
}

TEST(History, UndoOfRandomEditsLeavesNothing) {
    for (const uint64_t seed : {1u, 2u, 3u}) {
        SCOPED_TRACE(seed);
        Random random(seed);
        const auto splats = some_splats(seed);
        History history(splats);
        std::vector<std::pair<Gaussians, std::vector<uint8_t>>> states{{*splats, history.splats().states()}};
        while (states.size() < 200) {
            const int kind = random.integer(0, 9);
            if (kind < 7 || history.done() == 0) {
                if (!history.perform(random_step(random))) continue;
                states.resize(history.done());
                states.emplace_back(*history.splats().splats(), history.splats().states());
            } else {
                ASSERT_TRUE(history.undo());
                if (kind == 9) {
                    ASSERT_TRUE(history.redo());
                }
            }
            const auto& [values, marks] = states[history.done()];
            ASSERT_EQ(history.splats().states(), marks);
            expect_same_bytes(*history.splats().splats(), values);
            if (history.done() > 60) break;
        }
        EXPECT_GT(history.done(), 20u);
        while (history.undo()) {
            ASSERT_EQ(history.splats().states(), states[history.done()].second);
            expect_same_bytes(*history.splats().splats(), states[history.done()].first);
        }
        EXPECT_EQ(history.splats().splats(), splats);  // not even a copy
        while (history.redo()) {
            ASSERT_EQ(history.splats().states(), states[history.done()].second);
            expect_same_bytes(*history.splats().splats(), states[history.done()].first);
        }
    }
}

TEST(History, IsWhatConvertReplays) {
    for (const uint64_t seed : {11u, 12u, 13u, 14u}) {
        SCOPED_TRACE(seed);
        Random random(seed);
        const auto splats = some_splats(seed, 400, 3);
        History history(splats);
        for (int i = 0; i < 40; ++i) history.perform(random_step(random));
        for (int i = 0; i < 5; ++i) history.undo();
        expect_same_bytes(replayed(*splats, history.edits()), history.splats().result());
    }
}

TEST(History, KeepsTheOriginOfFarScenes) {
    Gaussians far = *some_splats(20, 100);
    far.origin = {5e5, 4e6, 100};
    History history(std::make_shared<const Gaussians>(far));
    history.perform(step({{"select", "x=500000.."}, {"transform", "move=0,0,2"}}));
    history.perform(step({{"select", "all"}, {"transform", "move=-500000,-4000000,0"}}));
    EXPECT_EQ(history.splats().splats()->origin, glm::dvec3(0));
    EXPECT_NEAR(history.splats().splats()->means[0], far.means[0], 1e-5);
    expect_same_bytes(replayed(far, history.edits()), history.splats().result());
    history.undo();
    history.undo();
    expect_same_bytes(*history.splats().splats(), far);
}

TEST(History, AnEditThatFailsChangesNothing) {
    const auto splats = some_splats(21);
    History history(splats);
    history.perform(selection("all"));
    const auto states = history.splats().states();
    expect_error<InputError>(
        [&] {
            history.perform(step({{"duplicate", ""}, {"transform", "scale=1e300"}}));
        },
        {""});
    expect_error<InputError>([&] { history.perform(step({{"transform", "scale=1e300"}})); }, {"transform"});
    expect_error<InputError>(
        [&] {
            history.perform(step({{"decimate", "50%"}}));
        },
        {"--decimate is no edit of a selection"});
    EXPECT_EQ(history.splats().states(), states);
    EXPECT_EQ(history.splats().splats(), splats);
    EXPECT_EQ(history.done(), 1u);
}

TEST(History, OfAHundredEditsIsSmall) {
    const auto splats = some_splats(22, 100'000, 0);
    Random random(23);
    History history(splats);
    for (int i = 0; i < 50; ++i) {
        history.perform(selection("add:sphere=" + std::to_string(random.uniform(-4, 4)) + ",0,0,1"));
        history.perform(step({{"delete", ""}}));
    }
    EXPECT_LT(history.bytes(), 1'000'000u);
}

TEST(History, GivesTheCommandThatDoesTheSame) {
    EXPECT_EQ(command_line({{"select", "x=0.."}, {"delete", ""}, {"select", "polygon=0,0;view=1"}},
                           "it's.ply", "b.ply"),
              "ewa convert 'it'\\''s.ply' b.ply --select x=0.. --delete --select 'polygon=0,0;view=1'");
}

TEST(History, NeedsNoSelectionThatALaterOneReplaces) {
    const std::vector<Words> edits{
        {"select", "x=0.."},  {"select", "add:y=0.."},      {"select", "z=..0"}, {"select", "remove:x=1.."},
        {"lock", ""},         {"select", "y=..0"},          {"select", "all"},   {"select", "invert"},
        {"select", "x=..0"},  {"select", "and:z=0.5.."},    {"hide", ""},        {"unlock", ""},
        {"select", "z=..-1"}, {"select", "sphere=0,0,0,1"}, {"delete", ""},      {"select", "grow=0.1"}};
    const std::vector<Words> needed{{"select", "z=..0"},   {"select", "remove:x=1.."},   {"lock", ""},
                                    {"select", "x=..0"},   {"select", "and:z=0.5.."},    {"hide", ""},
                                    {"unlock", ""},        {"select", "sphere=0,0,0,1"}, {"delete", ""},
                                    {"select", "grow=0.1"}};
    EXPECT_EQ(needed_edits(edits), needed);
    const auto splats = some_splats(24);
    History all(splats), some(splats);
    all.perform(step(edits));
    some.perform(step(needed));
    EXPECT_EQ(some.splats().states(), all.splats().states());
}

}  // namespace
