// SPDX-License-Identifier: Apache-2.0
// The parts of the viewer that are independent of the window: camera, first view, modes, resolution.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>

#include "ewa/error.h"
#include "support/soon.h"
#include "viewer/byte_image.h"
#include "viewer/latest.h"
#include "viewer/measurement.h"
#include "viewer/renders.h"
#include "viewer/view_camera.h"

namespace ewa::viewer {
namespace {

/// Looks along +z from (0, 0, -4) at the origin.
Viewpoint plain_view() {
    Viewpoint view;
    view.camera.width = 400;
    view.camera.height = 300;
    view.camera.fx = view.camera.fy = 350;
    view.camera.cx = 210;
    view.camera.cy = 140;
    view.camera.translation = {0, 0, 4};
    view.pivot = {0, 0, 0};
    view.radius = 2;
    return view;
}

glm::dvec2 pixel(const Camera& camera, const glm::dvec3& point) {
    const glm::dvec3 p = camera.rotation * point + camera.translation;
    return {camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy};
}

void expect_rotation(const glm::dmat3& r) {
    const glm::dmat3 product = r * glm::transpose(r);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) EXPECT_NEAR(product[i][j], i == j ? 1 : 0, 1e-12);
    EXPECT_NEAR(glm::determinant(r), 1, 1e-12);
}

TEST(ViewCamera, TheSameSizeIsTheSameCamera) {
    const Viewpoint view = plain_view();
    const Camera camera = ViewCamera(view).camera(400, 300);
    EXPECT_EQ(camera.fx, view.camera.fx);
    EXPECT_EQ(camera.cx, view.camera.cx);
    EXPECT_EQ(camera.translation, view.camera.translation);
}

TEST(ViewCamera, AWiderWindowKeepsTheWholeViewInTheMiddle) {
    const Viewpoint view = plain_view();
    const Camera wide = ViewCamera(view).camera(1000, 600);
    const glm::dvec3 point(0.3, -0.2, 1);
    const glm::dvec2 before = pixel(view.camera, point), after = pixel(wide, point);
    EXPECT_NEAR(after.x, 500 + 2 * (before.x - 200), 1e-9);
    EXPECT_NEAR(after.y, 2 * before.y, 1e-9);
}

TEST(ViewCamera, OrbitKeepsThePivotsPixelAndDistance) {
    const Viewpoint view = plain_view();
    ViewCamera camera(view);
    for (int i = 0; i < 1000; ++i) camera.orbit(0.3 * std::sin(i), 0.4 * std::cos(3 * i));
    EXPECT_NEAR(camera.distance(), 4, 1e-9);
    const Camera now = camera.camera(400, 300);
    expect_rotation(now.rotation);
    EXPECT_NEAR(pixel(now, {0, 0, 0}).x, 210, 1e-6);
    EXPECT_NEAR(pixel(now, {0, 0, 0}).y, 140, 1e-6);
    EXPECT_NEAR(now.rotation[1][0], 0, 1e-9) << "the horizon tilts";
}

TEST(ViewCamera, WhatIsInFrontFollowsTheDrag) {
    const glm::dvec3 near_point(0, 0, -1);
    const auto moved = [&](auto&& action) {
        ViewCamera camera(plain_view());
        const glm::dvec2 before = pixel(camera.camera(400, 300), near_point);
        action(camera);
        return pixel(camera.camera(400, 300), near_point) - before;
    };
    EXPECT_GT(moved([](ViewCamera& c) { c.orbit(0.1, 0); }).x, 1);
    EXPECT_GT(moved([](ViewCamera& c) { c.orbit(0, 0.1); }).y, 1);
    EXPECT_GT(moved([](ViewCamera& c) { c.look(0.1, 0); }).x, 1);
    EXPECT_GT(moved([](ViewCamera& c) { c.look(0, 0.1); }).y, 1);
}

TEST(ViewCamera, OrbitStopsBeforeThePoles) {
    ViewCamera camera(plain_view());
    for (int i = 0; i < 100; ++i) camera.orbit(0, 0.2);
    const Camera top = camera.camera(400, 300);
    expect_rotation(top.rotation);
    EXPECT_LT(top.position().y, -3.9);  // y is down: the camera is above
    EXPECT_GT(top.rotation[0][0], 0.99) << "it has gone over the top";
}

TEST(ViewCamera, LookStaysWhereItIs) {
    ViewCamera camera(plain_view());
    camera.look(0.7, -0.3);
    EXPECT_NEAR(glm::length(camera.camera(400, 300).position() - glm::dvec3(0, 0, -4)), 0, 1e-12);
    EXPECT_NEAR(camera.distance(), 4, 1e-12);
}

TEST(ViewCamera, PanMovesThePivotWithThePointer) {
    ViewCamera camera(plain_view());
    camera.pan(30, -20, 400, 300);
    const glm::dvec2 at = pixel(camera.camera(400, 300), {0, 0, 0});
    EXPECT_NEAR(at.x, 240, 1e-9);
    EXPECT_NEAR(at.y, 120, 1e-9);
}

TEST(ViewCamera, ZoomNeverReachesThePivot) {
    ViewCamera camera(plain_view());
    camera.zoom(1);
    EXPECT_NEAR(camera.distance(), 3.6, 1e-12);
    camera.zoom(1e6);
    EXPECT_GT(camera.distance(), 1e-3);
    camera.zoom(-40);
    EXPECT_GT(camera.distance(), 0.1);
}

TEST(ViewCamera, FlyGoesAlongTheCamerasAxesAndResetComesBack) {
    ViewCamera camera(plain_view());
    camera.fly({0.5, 0.25, 1});
    EXPECT_NEAR(glm::length(camera.camera(400, 300).position() - glm::dvec3(2, 1, 0)), 0, 1e-12);
    camera.reset();
    EXPECT_EQ(camera.camera(400, 300).translation, glm::dvec3(0, 0, 4));
}

TEST(ViewCamera, FocusTurnsToThePointAndAboutIt) {
    ViewCamera camera(plain_view());
    const glm::dvec3 point(1, 0.5, 1);
    camera.focus(point);
    const Camera now = camera.camera(400, 300);
    expect_rotation(now.rotation);
    EXPECT_NEAR(glm::length(now.position() - glm::dvec3(0, 0, -4)), 0, 1e-12) << "it stays where it is";
    EXPECT_NEAR(pixel(now, point).x, 210, 1e-9);
    EXPECT_NEAR(pixel(now, point).y, 140, 1e-9);
    EXPECT_NEAR(now.rotation[1][0], 0, 1e-12) << "the horizon tilts";
    camera.orbit(0.5, 0.2);
    EXPECT_NEAR(pixel(camera.camera(400, 300), point).x, 210, 1e-6);
    camera.focus(camera.camera(400, 300).position());  // nowhere to turn to
    expect_rotation(camera.camera(400, 300).rotation);
}

TEST(ViewCamera, ResetComesBackFromAnotherPlace) {
    ViewCamera camera(plain_view());
    Viewpoint other = plain_view();
    other.camera.translation = {1, 2, 9};
    camera.stand(other);
    EXPECT_EQ(camera.camera(400, 300).translation, glm::dvec3(1, 2, 9));
    camera.reset();
    EXPECT_EQ(camera.camera(400, 300).translation, glm::dvec3(0, 0, 4));
}

TEST(Framing, TheNearestCameraStandsAndLooksAlike) {
    Dataset dataset;
    EXPECT_EQ(nearest_frame(dataset, plain_view().camera, 1), -1);
    dataset.frames.resize(3);
    for (Frame& frame : dataset.frames) frame.camera = plain_view().camera;
    dataset.frames[0].camera.rotation =
        glm::dmat3(-1, 0, 0, 0, 1, 0, 0, 0, -1);  // the same place, from behind
    dataset.frames[0].camera.translation = {0, 0, -4};
    dataset.frames[1].camera.translation = {0, 0, 9};
    dataset.frames[2].camera.translation = {0.5, 0, 4};
    EXPECT_EQ(nearest_frame(dataset, plain_view().camera, 1), 2);
    EXPECT_NEAR(camera_size(dataset, 1), 0.3 * 5, 1e-9);
    dataset.frames.resize(1);
    EXPECT_NEAR(camera_size(dataset, 2), 0.1, 1e-12);
}

TEST(Framing, AFewFarSplatsDoNotCount) {
    Gaussians splats;
    splats.resize(1000);
    for (size_t i = 0; i < 1000; ++i)
        for (size_t k = 0; k < 3; ++k)
            splats.means[3 * i + k] = float(10 + double((7 * i + 13 * i * k) % 101) / 50 - 1);
    for (float& scale : splats.log_scales) scale = -6;
    for (size_t i = 0; i < 1000; ++i) splats.quaternions[4 * i] = 1;
    for (size_t i = 0; i < 20; ++i)
        splats.means[3 * i] = i < 10 ? 1e9f : std::numeric_limits<float>::quiet_NaN();
    const SceneBounds bounds = scene_bounds(splats);
    EXPECT_NEAR(glm::length(bounds.center - glm::dvec3(10)), 0, 0.3);
    EXPECT_GT(bounds.radius, 1);
    EXPECT_LT(bounds.radius, 2);

    const Viewpoint view = framing_view(splats, nullptr, 640, 480);
    expect_rotation(view.camera.rotation);
    const glm::dvec2 middle = pixel(view.camera, scene::framed_box(splats).center());
    EXPECT_NEAR(middle.x, 320, 1e-6);
    EXPECT_NEAR(middle.y, 240, 1e-6);
    EXPECT_NEAR(glm::length(view.pivot - glm::dvec3(10)), 0, 0.3);
    for (size_t i = 20; i < 1000; ++i) {
        const glm::dvec2 at = pixel(view.camera, splats.world_mean(i));
        EXPECT_TRUE(at.x > 0 && at.x < 640 && at.y > 0 && at.y < 480) << i;
    }
}

TEST(Framing, NothingAtAllHasAView) {
    const Viewpoint view = framing_view(Gaussians(), nullptr, 640, 480);
    EXPECT_GT(view.radius, 0);
    expect_rotation(view.camera.rotation);
    EXPECT_TRUE(std::isfinite(view.camera.translation.z));
}

TEST(Framing, ADatasetsViewIsItsCamera) {
    Dataset dataset;
    dataset.frames.resize(3);
    for (Frame& frame : dataset.frames) frame.camera = plain_view().camera;
    const Viewpoint view = dataset_view(Gaussians(), dataset, 1);
    EXPECT_EQ(view.camera.translation, plain_view().camera.translation);
    EXPECT_EQ(view.up, glm::dvec3(0, -1, 0));
    EXPECT_NEAR(glm::length(view.pivot), 0, 1e-12)
        << "with no splats, the closest point to the scene's middle";
}

Rendering two_pixels() {
    Rendering rendering{Image(2, 1, 3), Image(2, 1, 1), Image(2, 1, 1), Image(2, 1, 1)};
    rendering.color.pixels = {0.5f, 2.0f, -1.0f, 0.1f, NAN, 0.3f};
    rendering.alpha.pixels = {1.0f, 0.5f};
    rendering.depth.pixels = {4.0f, 2.0f};
    rendering.count.pixels = {0.0f, 30.0f};
    return rendering;
}

TEST(Picture, RoundsAndClampsColor) {
    const ByteImage picture = picture_of(two_pixels(), Mode::color);
    EXPECT_EQ(picture.rgba, (std::vector<uint8_t>{128, 255, 0, 255, 26, 0, 77, 255}));
    EXPECT_EQ(picture_of(two_pixels(), Mode::ellipsoids).rgba, picture.rgba);
}

TEST(Picture, DepthAndOpacityAreGrey) {
    const ByteImage one_depth = picture_of(two_pixels(), Mode::depth);
    EXPECT_EQ(one_depth.white, 2.0f);  // the 98th percentile of two values is the lower
    EXPECT_EQ(one_depth.rgba, (std::vector<uint8_t>{255, 255, 255, 255, 255, 255, 255, 255}));
    Rendering hundred{Image(101, 1, 3), Image(101, 1, 1), Image(101, 1, 1), Image(101, 1, 1)};
    for (size_t i = 0; i < 100; ++i) {
        hundred.alpha.pixels[i] = 1;
        hundred.depth.pixels[i] = 1000 + float(i);
    }
    const ByteImage depth = picture_of(hundred, Mode::depth);
    EXPECT_EQ(depth.dark, 1001.0f);
    EXPECT_EQ(depth.white, 1097.0f);
    EXPECT_EQ(depth.rgba[0], 26) << "the nearest is not black";
    EXPECT_EQ(depth.rgba[4 * 49], 140) << "half way";
    EXPECT_EQ(depth.rgba[4 * 99], 255);
    EXPECT_EQ(depth.rgba[4 * 100], 0) << "nothing is";
    const ByteImage opacity = picture_of(two_pixels(), Mode::opacity);
    EXPECT_EQ(opacity.rgba, (std::vector<uint8_t>{255, 255, 255, 255, 128, 128, 128, 255}));
}

TEST(Picture, CountsAreHeat) {
    const ByteImage count = picture_of(two_pixels(), Mode::count);
    EXPECT_EQ(count.white, 30.0f);
    EXPECT_EQ(count.rgba, (std::vector<uint8_t>{0, 0, 0, 255, 255, 255, 255, 255}));
    EXPECT_EQ(heat(1 / 3.0f)[0], 1.0f);
    EXPECT_EQ(heat(1 / 3.0f)[1], 0.0f);
}

TEST(Picture, SurfacesHaveNoColours) {
    Rendering rendering;
    rendering.alpha = Image(3, 1, 1);
    rendering.alpha.pixels = {1.0f, 1.0f, 0.6f};
    rendering.median_depth = Image(3, 1, 1);
    rendering.median_depth.pixels = {4.0f, 2.0f, 0.0f};
    const ByteImage depth = picture_of(rendering, Mode::median_depth);
    EXPECT_EQ(depth.white, 2.0f);
    EXPECT_EQ(depth.rgba[4], 255);
    EXPECT_EQ(depth.rgba[8], 0) << "no splat takes half of the light";
    rendering.normal = Image(3, 1, 3);
    rendering.normal.pixels = {1, 0, 0, 0, -1, 0, 0, 0, 0};
    EXPECT_EQ(picture_of(rendering, Mode::normal).rgba,
              (std::vector<uint8_t>{255, 128, 128, 255, 128, 0, 128, 255, 0, 0, 0, 255}));
}

TEST(Measurement, IsOfTheLastTwoPoints) {
    Measurement measurement;
    measurement.add({1, 2, 3});
    EXPECT_FALSE(measurement.complete());
    measurement.add({1, 5, 7});
    EXPECT_EQ(measurement.distance(), 5);
    EXPECT_EQ(measurement.label(), "5");
    EXPECT_EQ(measurement.text(), "distance 5; points 1,2,3,1,5,7");
    measurement.add({0, 0, 0});
    EXPECT_FALSE(measurement.complete());
    EXPECT_EQ(measurement.points.size(), 1u);
}

TEST(Picture, EmptyDepthIsBlack) {
    Rendering nothing{Image(1, 1, 3), Image(1, 1, 1), Image(1, 1, 1), Image(1, 1, 1)};
    EXPECT_EQ(picture_of(nothing, Mode::depth).rgba, (std::vector<uint8_t>{0, 0, 0, 255}));
    EXPECT_EQ(picture_of(nothing, Mode::count).rgba, (std::vector<uint8_t>{0, 0, 0, 255}));
}

TEST(Picture, ATransparentImageIsBlendedOverTheBackground) {
    Image image(1, 1, 4);
    image.pixels = {1, 0, 0, 0.5f};
    EXPECT_EQ(picture_of(image, {0, 1, 1}).rgba, (std::vector<uint8_t>{128, 128, 128, 255}));
}

TEST(Pace, GivesUpResolutionUntilPicturesAreFast) {
    Pace pace;
    EXPECT_EQ(pace.divisor(), 1);
    pace.drawn(1, 900);
    EXPECT_GT(pace.divisor(), 2);
    for (int i = 0; i < 100; ++i) pace.drawn(pace.divisor(), 900.0 / (pace.divisor() * pace.divisor()));
    EXPECT_LE(900.0 / (pace.divisor() * pace.divisor()), 50);
    for (int i = 0; i < 20; ++i) pace.drawn(pace.divisor(), 1);
    EXPECT_EQ(pace.divisor(), 1);
    pace.drawn(1, 30);
    EXPECT_EQ(pace.divisor(), 1);
}

/// Where the splats cost what the pixels do not, a coarse picture is hardly faster than a fine one.
TEST(Pace, GivesUpNoResolutionForNothing) {
    const auto settled = [](double fixed, double by_pixels) {
        Pace pace;
        for (int i = 0; i < 100; ++i) {
            const int divisor = i % 10 == 0 ? 1 : pace.divisor();  // it rests now and then
            const double noise = 1 + 0.1 * std::sin(i * i);
            pace.drawn(divisor, noise * (fixed + by_pixels / (divisor * divisor)));
        }
        return pace.divisor();
    };
    EXPECT_EQ(settled(200, 10), 1);
    EXPECT_LE(settled(45, 80), 4);
    EXPECT_GE(settled(45, 80), 2);
    EXPECT_GE(settled(5, 900), 4);
    EXPECT_EQ(settled(1, 20), 1);
}

TEST(Fluency, CountsPicturesOfAMovingCamera) {
    Fluency fluency;
    double time = 0;
    fluency.shown(time += 5, false, 2);
    fluency.shown(time += 30, true, 2);  // it has rested
    EXPECT_EQ(fluency.rate(time), 0);
    for (int i = 0; i < 20; ++i) fluency.shown(time += 0.1, true, i < 5 ? 2 : 3);
    EXPECT_NEAR(fluency.rate(time), 10, 1e-6);
    EXPECT_EQ(fluency.rate(time + 2), 0) << "it rests";
    fluency.shown(time += 0.2, false, 1);  // the full picture of a camera at rest
    EXPECT_EQ(fluency.count(), 20u);
    EXPECT_NEAR(fluency.seconds(), 2, 1e-6);
    EXPECT_EQ(fluency.by_divisor(), (std::map<int, uint64_t>{{2, 5}, {3, 15}}));
}

TEST(ATask, WakesOnceItsResultCanBeTaken) {
    for (const bool fails : {false, true}) {
        Task<int> task;
        std::atomic<int> wakes = 0, ready = 0;
        const auto wake = [&] {
            ready += task.ready() ? 1 : 0;
            ++wakes;
        };
        task.start(wake, [fails] { return fails ? throw InputError("no") : 3; });
        EXPECT_TRUE(task.running());
        EXPECT_TRUE(test::soon([&] { return wakes == 1; }));
        EXPECT_EQ(ready, 1) << "the window would wake in vain";
        if (fails)
            EXPECT_THROW(task.take(), InputError);
        else
            EXPECT_EQ(task.take(), 3);
        EXPECT_FALSE(task.running() || task.ready());
    }
}

}  // namespace
}  // namespace ewa::viewer
