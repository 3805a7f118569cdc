// SPDX-License-Identifier: Apache-2.0
// Frustums and paths: what a viewer draws of cameras.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <numbers>
#include <vector>

#include "scene/camera.h"
#include "scene/frustum.h"
#include "support/random_lens.h"

namespace ewa {
namespace {

Camera camera_at(const glm::dvec3& position, double angle = 0) {
    Camera camera;
    camera.width = 400;
    camera.height = 300;
    camera.fx = camera.fy = 350;
    camera.cx = 210;
    camera.cy = 140;
    camera.rotation = glm::dmat3(glm::rotate(glm::dmat4(1), angle, glm::dvec3(0, 1, 0)));
    camera.translation = -(camera.rotation * position);
    return camera;
}

void expect_near(const glm::dvec2& a, double x, double y) {
    EXPECT_NEAR(a.x, x, 1e-9);
    EXPECT_NEAR(a.y, y, 1e-9);
}

TEST(Frustum, SeenThroughItselfItIsThePicturesBorder) {
    const Camera camera = camera_at({1, 2, 3}, 0.4);
    const auto segments = frustum_segments(camera, 2.5);
    const auto top = projected(segments[4], camera), right = projected(segments[5], camera);
    ASSERT_TRUE(top && right);
    expect_near((*top)[0], 0, 0);
    expect_near((*top)[1], 400, 0);
    expect_near((*right)[1], 400, 300);
    EXPECT_NEAR(glm::length(segments[0].from - glm::dvec3(1, 2, 3)), 0, 1e-12);
    EXPECT_NEAR((camera.rotation * segments[2].to + camera.translation).z, 2.5, 1e-12);
    EXPECT_LT((*projected(segments[8], camera))[1].y, 0) << "the roof is over the picture";
}

TEST(Frustum, WhatIsBehindTheCameraIsCutOff) {
    const Camera camera = camera_at({0, 0, 0});
    EXPECT_FALSE(projected(Segment{{0, 0, -1}, {5, 0, -2}}, camera));
    EXPECT_FALSE(projected(glm::dvec3(0, 0, -1), camera));
    const auto cut = projected(Segment{{0, 0, 1}, {1, 0, -1}}, camera);
    ASSERT_TRUE(cut);
    expect_near((*cut)[0], 210, 140);
    // Half way but for the near plane at 0.01: x = 0.495.
    expect_near((*cut)[1], 210 + 350 * 0.495 / 0.01, 140);
    const auto other_way = projected(Segment{{1, 0, -1}, {0, 0, 1}}, camera);
    ASSERT_TRUE(other_way);
    expect_near((*other_way)[0], (*cut)[1].x, (*cut)[1].y);
}

TEST(CameraPath, GoesThroughItsKeysAndIsSmoothBetween) {
    const std::vector<Camera> keys{camera_at({0, 0, 0}), camera_at({1, 0, 0}, 0.5), camera_at({2, 1, 0}, 1.0),
                                   camera_at({3, 1, 2}, 1.2)};
    for (size_t i = 0; i < keys.size(); ++i) {
        const Camera at = along_path(keys, double(i));
        EXPECT_NEAR(glm::length(at.position() - keys[i].position()), 0, 1e-12);
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(glm::length(at.rotation[k] - keys[i].rotation[k]), 0, 1e-12);
    }
    EXPECT_EQ(along_path(keys, -1).translation, keys.front().translation);
    EXPECT_NEAR(glm::length(along_path(keys, 9).position() - keys.back().position()), 0, 1e-12);
    glm::dvec3 speed(0);
    for (double time = 0.01; time < 3; time += 0.01) {
        const Camera camera = along_path(keys, time);
        EXPECT_NEAR(glm::determinant(camera.rotation), 1, 1e-12);
        const glm::dvec3 now = camera.position() - along_path(keys, time - 0.01).position();
        if (time > 0.015) {
            EXPECT_LT(glm::length(now - speed), 2e-3) << "a kink at " << time;
        }
        speed = now;
    }
}

TEST(CameraPath, TurnsTheShortWayAndZoomsInProportion) {
    std::vector<Camera> keys{camera_at({0, 0, 0}, -0.9 * std::numbers::pi),
                             camera_at({0, 0, 0}, 0.9 * std::numbers::pi)};
    keys[1].fx = keys[1].fy = 4 * 350;
    const Camera middle = along_path(keys, 0.5);
    EXPECT_NEAR(middle.rotation[2][2], -1, 1e-12);
    EXPECT_NEAR(middle.fx, 700, 1e-9);
    keys[1].width *= 2;  // the same view in twice the pixels
    keys[1].fx = keys[1].fy = 700;
    EXPECT_NEAR(along_path(keys, 0.5).fx, 350, 1e-9);
    EXPECT_EQ(along_path(std::span(keys).first(1), 0.7).fx, 350);
}

/// With equal distances in time it is the path without times.
TEST(CameraPath, PassesItsKeysAtTheirTimes) {
    const std::vector<Camera> keys{camera_at({0, 0, 0}), camera_at({1, 0, 0}, 0.5), camera_at({2, 1, 0}, 1.0),
                                   camera_at({3, 1, 2}, 1.2)};
    const std::vector<double> even{1, 3, 5, 7}, times{0, 0.5, 3, 4};
    for (double time = 0; time <= 3; time += 0.125) {
        const Camera a = along_path(keys, time), b = along_path(keys, even, 1 + 2 * time, true);
        EXPECT_NEAR(glm::length(a.position() - b.position()), 0, 1e-12) << time;
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(glm::length(a.rotation[k] - b.rotation[k]), 0, 1e-12);
    }
    for (const bool smooth : {true, false}) {
        for (size_t i = 0; i < keys.size(); ++i) {
            const Camera at = along_path(keys, times, times[i], smooth);
            EXPECT_EQ(at.translation, keys[i].translation);
            EXPECT_EQ(at.rotation, keys[i].rotation);
        }
        EXPECT_EQ(along_path(keys, times, -1, smooth).translation, keys.front().translation);
        EXPECT_EQ(along_path(keys, times, 9, smooth).translation, keys.back().translation);
    }
    const auto velocity = [&](double time) {
        const double step = 1e-6;
        return (along_path(keys, times, time + step, true).position() -
                along_path(keys, times, time, true).position()) /
               step;
    };
    for (const double time : {0.5, 3.0})
        EXPECT_LT(glm::length(velocity(time + 1e-7) - velocity(time - 1.1e-6)), 1e-4) << "a kink at " << time;
    const glm::dvec3 third = along_path(keys, times, 0.5 + 2.5 / 3, false).position();
    EXPECT_NEAR(glm::length(third - glm::dvec3(4.0 / 3, 1.0 / 3, 0)), 0, 1e-12) << "a straight line";
    EXPECT_EQ(along_path(std::span(keys).first(1), std::span(times).first(1), 3, true).fx, 350);
}

}  // namespace
/// A point that a render shows is where the lens puts it, and frusta are lines in the picture.
TEST(CameraOfALens, PointsComeBack) {
    for (const auto& [name, camera] : test::random_lenses(40, 61, 47)) {
        SCOPED_TRACE(name);
        for (const double depth : {0.5, 3.0})
            for (const glm::dvec2 at : {glm::dvec2(30.5, 20.25), glm::dvec2(40, 31), glm::dvec2(22, 12.5)}) {
                const glm::dvec3 point = world_point(camera, at.x, at.y, depth);
                const auto pixel = projected(point, camera);
                ASSERT_TRUE(pixel);
                EXPECT_LT(glm::distance(*pixel, at), 1e-6);
                const glm::dvec3 view = camera.rotation * point + camera.translation;
                const bool far = camera.distortion.lens == Lens::fisheye ||
                                 camera.distortion.lens == Lens::equirectangular;
                EXPECT_NEAR(far ? glm::length(view) : view.z, depth, 1e-9);
            }
        int shown = 0;
        const auto segments = frustum_segments(camera, 2);
        for (size_t i = 4; i < 8; ++i) shown += projected(segments[i], camera) ? 1 : 0;
        EXPECT_EQ(shown, 4) << "the sides of what it sees";
        const bool parallel = camera.distortion.lens == Lens::orthographic;
        EXPECT_EQ(segments[0].from == segments[1].from, !parallel);
    }
}

}  // namespace ewa
