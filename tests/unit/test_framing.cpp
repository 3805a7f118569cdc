// SPDX-License-Identifier: Apache-2.0
// The first view of a scene of which nothing is known but its splats.
#include "scene/framing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <limits>
#include <numbers>

#include "ewa/splat_edit.h"
#include "support/random_scene.h"

namespace ewa::scene {
namespace {

/// Opaque splats of one size at these positions.
Gaussians splats_at(const std::vector<glm::dvec3>& positions, double size = 0.01) {
    Gaussians splats;
    splats.resize(positions.size());
    for (size_t i = 0; i < positions.size(); ++i) {
        for (int k = 0; k < 3; ++k) {
            splats.means[3 * i + size_t(k)] = float(positions[i][k]);
            splats.log_scales[3 * i + size_t(k)] = float(std::log(size));
        }
        splats.quaternions[4 * i] = 1;
        splats.opacity_logits[i] = 2;
    }
    return splats;
}

/// A figure of 1.8 units with a thin neck and head, which hold 3 % of its splats. y is down.
std::vector<glm::dvec3> figure(test::Random& random) {
    std::vector<glm::dvec3> points;
    for (int i = 0; i < 3000; ++i) {
        const bool head = i % 33 == 0;
        const double wide = head ? 0.08 : 0.3;
        points.emplace_back(random.uniform(-wide, wide),
                            head ? random.uniform(-1.8, -1.5) : random.uniform(-1.5, 0),
                            random.uniform(-wide / 2, wide / 2));
    }
    return points;
}

glm::dvec2 framing_pixel(const Camera& camera, const glm::dvec3& point) {
    const glm::dvec3 p = camera.rotation * point + camera.translation;
    EXPECT_GT(p.z, 0);
    return {camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy};
}

bool in_image(const Camera& camera, const glm::dvec3& point) {
    const glm::dvec2 at = framing_pixel(camera, point);
    return at.x > 0 && at.x < camera.width && at.y > 0 && at.y < camera.height;
}

TEST(FrameScene, HeadAndFeetAreInTheImageAndFloatersDoNotMatter) {
    test::Random random(1);
    std::vector<glm::dvec3> points = figure(random);
    const Framing without = frame_scene(splats_at(points), 640, 480);
    const size_t count = points.size();
    for (int i = 0; i < 60; ++i)  // 2 %, near and far
        points.emplace_back(random.uniform(-40, 40), random.uniform(-40, 40), random.uniform(-40, 40));
    points.emplace_back(1e8, 0, 0);
    for (const glm::ivec2 size : {glm::ivec2(640, 480), glm::ivec2(300, 900), glm::ivec2(900, 300)}) {
        const Framing framing = frame_scene(splats_at(points), size.x, size.y);
        double top = 1e9, bottom = -1e9;
        for (size_t i = 0; i < count; ++i) {
            EXPECT_TRUE(in_image(framing.camera, points[i])) << size.x << "x" << size.y;
            const double y = framing_pixel(framing.camera, points[i]).y;
            top = std::min(top, y);
            bottom = std::max(bottom, y);
        }
        if (size.x < 900) continue;
        EXPECT_GT(bottom - top, 0.8 * size.y) << "the figure is small in the image";
    }
    const Framing with = frame_scene(splats_at(points), 640, 480);
    EXPECT_LT(glm::length(with.target - without.target), 0.1);
    EXPECT_NEAR(with.radius, without.radius, 0.1 * without.radius);
    EXPECT_LT(with.camera.position().z, -1) << "it is not seen from the front";
    EXPECT_LT(with.camera.position().y, with.target.y) << "it is not seen from above";
}

TEST(FrameScene, FaintAndUndrawableSplatsDoNotCount) {
    test::Random random(2);
    std::vector<glm::dvec3> points = figure(random);
    const Box figure_alone = framed_box(splats_at(points));
    const size_t count = points.size();
    for (int i = 0; i < 1000; ++i) points.emplace_back(random.uniform(-9, 9), random.uniform(-9, 9), 0);
    Gaussians splats = splats_at(points);
    for (size_t i = count; i < points.size(); ++i)
        if (i % 2)
            splats.opacity_logits[i] = -5;
        else
            splats.means[3 * i] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_NEAR(glm::length(framed_box(splats).high - figure_alone.high), 0, 1e-9);
}

TEST(FrameScene, LargeSplatsCountWithTheirSize) {
    const Framing framing = frame_scene(splats_at({{0, 0, 0}}, 0.5), 100, 100);
    EXPECT_TRUE(in_image(framing.camera, {0.45, 0, 0}));
    EXPECT_TRUE(in_image(framing.camera, {0, -0.45, 0}));
    EXPECT_NEAR(framing.radius, 0.5 * std::sqrt(3.0), 1e-6);
}

TEST(FrameScene, AllRoundFitsFromEverySide) {
    test::Random random(3);
    std::vector<glm::dvec3> points;  // a long plank away from the camera
    for (int i = 0; i < 2000; ++i)
        points.emplace_back(random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), random.uniform(-3, 3));
    const Framing framing =
        frame_scene(splats_at(points), 320, 240, {.up = {}, .forward = {}, .all_round = true});
    for (int side = 0; side < 8; ++side) {
        const Camera camera =
            orbited(framing.camera, framing.target, framing.up, side * std::numbers::pi / 4);
        for (const glm::dvec3& end : {glm::dvec3(0, 0, 2.9), glm::dvec3(0, 0, -2.9)})
            EXPECT_TRUE(in_image(camera, end)) << side;
    }
}

/// A board of 2 x 1 x 0.4 units, turned about the vertical, is seen at its broad side, from the usual half of the
/// directions. A cube is seen from the usual direction.
TEST(FrameScene, TheBroadSideIsTheFront) {
    test::Random random(5);
    std::vector<glm::dvec3> board, cube;
    for (int i = 0; i < 3000; ++i) {
        board.emplace_back(random.uniform(-1, 1), random.uniform(-0.5, 0.5), random.uniform(-0.2, 0.2));
        cube.emplace_back(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    }
    for (const double degrees : {0.0, 20.0, 70.0, 85.0, 110.0, 160.0}) {
        const double angle = degrees * std::numbers::pi / 180;
        const auto turned = [&](const glm::dvec3& p) {
            return glm::dvec3(p.x * std::cos(angle) + p.z * std::sin(angle), p.y,
                              p.z * std::cos(angle) - p.x * std::sin(angle));
        };
        std::vector<glm::dvec3> points;
        for (const glm::dvec3& p : board) points.push_back(turned(p));
        glm::dvec3 view = frame_scene(splats_at(points), 64, 64).camera.position();
        EXPECT_LT(view.z, 0) << degrees;
        view.y = 0;
        EXPECT_GT(std::abs(glm::dot(glm::normalize(view), turned({0, 0, 1}))), 0.99) << degrees;

        points.clear();
        for (const glm::dvec3& p : cube) points.push_back(turned(p));
        EXPECT_NEAR(frame_scene(splats_at(points), 64, 64).camera.rotation[0][2], 0, 1e-9) << degrees;
    }
    // Splats that cover little of an image say little.
    Gaussians splats = splats_at(board);
    for (int i = 0; i < 300; ++i) {
        const Gaussians one = splats_at({{0, 0, random.uniform(-3, 3)}}, 0.001);
        append_splats(splats, one);
    }
    EXPECT_NEAR(frame_scene(splats, 64, 64).camera.rotation[0][2], 0, 0.1);
}

TEST(FrameScene, NothingAtAllHasACamera) {
    const Framing framing = frame_scene(Gaussians(), 640, 480);
    EXPECT_GT(framing.radius, 0);
    EXPECT_TRUE(std::isfinite(framing.camera.translation.z));
    EXPECT_EQ(framing.up, glm::dvec3(0, -1, 0));
}

TEST(FrameScene, HintsChooseTheSide) {
    test::Random random(4);
    const Gaussians splats = splats_at(figure(random));
    const Framing framing =
        frame_scene(splats, 64, 64, {.up = glm::dvec3(0, 0, 2), .forward = glm::dvec3(3, 0, 1)});
    const glm::dvec3 offset = framing.camera.position() - framing.target;
    EXPECT_LT(offset.x, 0);
    EXPECT_NEAR(offset.y, 0, 1e-9);
    EXPECT_GT(offset.z, 0);
    EXPECT_EQ(framing.up, glm::dvec3(0, 0, 1));
    // A forward along up is no side.
    const Framing above = frame_scene(splats, 64, 64, {.up = {}, .forward = glm::dvec3(0, 1, 0)});
    EXPECT_LT(above.camera.position().z, above.target.z);
}

/// A ground of 4 x 4 units with a figure on it; `turn` maps from y down to the file's axes.
Gaussians on_ground(const std::function<glm::dvec3(const glm::dvec3&)>& turn, bool ceiling = false) {
    test::Random random(5);
    std::vector<glm::dvec3> points = figure(random);
    for (int i = 0; i < 4000; ++i) points.emplace_back(random.uniform(-2, 2), 0.02, random.uniform(-2, 2));
    for (int i = 0; i < 4000 && ceiling; ++i)
        points.emplace_back(random.uniform(-2, 2), -1.9, random.uniform(-2, 2));
    for (glm::dvec3& point : points) point = turn(point);
    return splats_at(points);
}

TEST(GuessedUp, IsAwayFromTheGround) {
    const auto same = [](const glm::dvec3& p) { return p; };
    const auto z_up = [](const glm::dvec3& p) { return glm::dvec3(p.x, p.z, -p.y); };
    const auto y_up = [](const glm::dvec3& p) { return glm::dvec3(p.x, -p.y, -p.z); };
    EXPECT_EQ(guessed_up(on_ground(same)), glm::dvec3(0, -1, 0));
    EXPECT_EQ(guessed_up(on_ground(z_up)), glm::dvec3(0, 0, 1));
    EXPECT_EQ(guessed_up(on_ground(y_up)), glm::dvec3(0, 1, 0));
    EXPECT_EQ(guessed_up(on_ground(y_up, true)), glm::dvec3(0, -1, 0)) << "a room says nothing";
    test::Random random(6);
    EXPECT_EQ(guessed_up(splats_at(figure(random))), glm::dvec3(0, -1, 0));
    // A wall that the cameras look at, as in a forward-facing capture, is no ground.
    const auto wall = [](const glm::dvec3& p) { return glm::dvec3(p.x, p.z, p.y); };
    EXPECT_EQ(guessed_up(on_ground(wall)), glm::dvec3(0, -1, 0));
}

TEST(LookAt, TheTargetIsInTheMiddleAndUpIsUp) {
    const glm::dvec3 eye(1, 2, 3), target(-2, 5, 1), up(0, 0, 1);
    const Camera camera = look_at(eye, target, up, 640, 480);
    EXPECT_NEAR(glm::length(camera.position() - eye), 0, 1e-12);
    const glm::dvec2 middle = framing_pixel(camera, target), above = framing_pixel(camera, target + 0.1 * up);
    EXPECT_NEAR(middle.x, 320, 1e-9);
    EXPECT_NEAR(middle.y, 240, 1e-9);
    EXPECT_NEAR(above.x, 320, 1e-9);
    EXPECT_LT(above.y, 240);
    const Camera down = look_at({0, 0, 5}, {0, 0, 0}, {0, 0, 1}, 64, 64);  // along up
    EXPECT_NEAR(glm::determinant(down.rotation), 1, 1e-12);
    EXPECT_NEAR(framing_pixel(down, {0, 0, 0}).x, 32, 1e-9);
}

TEST(PinholeAt, LooksTheSameWay) {
    Camera camera = look_at({1, 2, 3}, {4, 0, 1}, {0, 0, 1}, 200, 100);
    camera.fx = 77;
    EXPECT_EQ(pinhole_at(camera).fx, 77) << "a pinhole stays what it is";
    camera.distortion.lens = Lens::equirectangular;
    const Camera pinhole = pinhole_at(camera);
    EXPECT_TRUE(pinhole.distortion.none());
    EXPECT_EQ(pinhole.rotation, camera.rotation);
    EXPECT_EQ(pinhole.translation, camera.translation);
    EXPECT_NEAR(pinhole.fx, 50 / std::tan(glm::radians(25.0)), 1e-9);
}

TEST(Orbited, KeepsTheTargetsPixelAndTheDistance) {
    const glm::dvec3 target(1, 0, 2), up(0, -1, 0);
    const Camera start = look_at({1, -1, -3}, target, up, 640, 480);
    const Camera quarter = orbited(start, target, up, std::numbers::pi / 2);
    EXPECT_NEAR(glm::length(quarter.position() - target), glm::length(start.position() - target), 1e-12);
    EXPECT_NEAR(framing_pixel(quarter, target).x, 320, 1e-9);
    // Counterclockwise from above: from the front (-z) to the right, which is +x where y is down.
    EXPECT_NEAR(quarter.position().x, 6, 1e-9);
    EXPECT_NEAR(quarter.position().y, -1, 1e-9);
    const Camera whole = orbited(start, target, up, 2 * std::numbers::pi);
    EXPECT_NEAR(glm::length(whole.position() - start.position()), 0, 1e-9);
}

TEST(FrameScene, SplatsFarLargerThanTheSceneDoNotMatter) {
    test::Random random(3);
    for (const size_t count : {24u, 3000u}) {
        std::vector<glm::dvec3> points;
        for (size_t i = 0; i < count; ++i)
            points.emplace_back(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        Gaussians splats = splats_at(points, 0.1);
        const Framing usual = frame_scene(splats, 64, 48, {});
        for (const float huge : {8.f, 60.f, 88.f, 3e38f}) {
            for (size_t k = 0; k < 3; ++k) splats.log_scales[k] = huge;
            const Framing framing = frame_scene(splats, 64, 48, {});
            EXPECT_LT(glm::length(framing.camera.position() - usual.camera.position()), 1.5)
                << count << " " << huge;
        }
        splats.log_scales[0] = -std::numeric_limits<float>::infinity();
        splats.opacity_logits[1] = std::numeric_limits<float>::infinity();
        EXPECT_LT(glm::length(frame_scene(splats, 64, 48, {}).camera.position() - usual.camera.position()),
                  1.5);
    }
}

}  // namespace
}  // namespace ewa::scene
