// SPDX-License-Identifier: Apache-2.0
// The thread that draws, without a window.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <future>

#include "cli/program.h"
#include "ewa/error.h"
#include "ewa/evaluation.h"
#include "ewa/renderer.h"
#include "ewa/splat_edit.h"
#include "ewa/splat_files.h"
#include "support/soon.h"
#include "viewer/opening.h"
#include "viewer/render_thread.h"
#include "viewer/renders.h"
#include "viewer/view_quality.h"

namespace ewa::viewer {
namespace {

RenderRequest request(uint64_t serial) {
    RenderRequest request;
    Camera& camera = request.camera;
    camera.width = 40;
    camera.height = 30;
    camera.fx = camera.fy = 40;
    camera.cx = 20;
    camera.cy = 15;
    camera.translation = {0, 0, 4};
    request.serial = serial;
    return request;
}

/// One red splat at the origin.
std::shared_ptr<const Gaussians> red_splat() {
    PointCloud points;
    points.positions = {{0, 0, 0}};
    points.colors = {{255, 0, 0}};
    return std::make_shared<const Gaussians>(splats_of_points(points));
}

using test::soon;

/// What is answered up to this number.
std::vector<SurfacePoint> points_of(RenderThread& thread, uint64_t number) {
    std::vector<SurfacePoint> points;
    EXPECT_TRUE(soon([&] {
        for (const SurfacePoint& point : thread.take_news().points) points.push_back(point);
        return !points.empty() && points.back().number == number;
    }));
    return points;
}

TEST(RenderThread, DrawsTheSceneItWasGivenLast) {
    RenderThread thread([] { return open_device({}); }, [] {});
    EXPECT_EQ(thread.set_scene(std::make_shared<const Gaussians>()), 1u);
    thread.ask(request(1));
    ASSERT_TRUE(soon([&] { return thread.take_news().picture != nullptr; }));
    const size_t middle = 4 * (15 * 40 + 20);
    EXPECT_EQ(thread.take_news().picture->picture.rgba[middle], 0) << "no splats, no picture";
    EXPECT_EQ(thread.set_scene(red_splat()), 2u);
    thread.ask(request(2));
    ASSERT_TRUE(soon([&] { return thread.take_news().picture->request.serial == 2; }));
    const auto picture = thread.take_news().picture;
    EXPECT_EQ(picture->scene, 2u);
    EXPECT_EQ(picture->splats_drawn, 1u);
    EXPECT_GT(picture->device_bytes, 0u);
    EXPECT_GT(picture->picture.rgba[middle], 200);
    EXPECT_LT(picture->picture.rgba[middle + 1], 30);

    const Camera small = request(0).camera;
    EXPECT_EQ(thread.ask_point(small, {20.5, 15.5}, PointUse::look_at), 1u);
    std::vector<SurfacePoint> points = points_of(thread, 1);
    ASSERT_TRUE(points.size() == 1 && points[0].place);
    EXPECT_NEAR(points[0].place->z, 0, 1e-3);
    EXPECT_EQ(thread.ask_point(small, {1, 1}, PointUse::look_at), 2u);
    points = points_of(thread, 2);
    ASSERT_EQ(points.size(), 1u);
    EXPECT_FALSE(points[0].place) << "there is nothing in the corner";
    // Of a large image, a point is exact or that of a smaller one.
    Camera large = request(0).camera;
    for (int* side : {&large.width, &large.height}) *side *= 30;
    for (double* length : {&large.fx, &large.fy, &large.cx, &large.cy}) *length *= 30;
    double x[3];
    for (const PointUse use : {PointUse::look_at, PointUse::measure, PointUse::edit}) {
        points = points_of(thread, thread.ask_point(large, {600.2, 450.2}, use));
        ASSERT_TRUE(points.size() == 1 && points[0].place);
        EXPECT_EQ(points[0].use, use);
        x[int(use)] = points[0].place->x;
    }
    EXPECT_NEAR(x[1], 4 * 0.5 / 1200, 1e-6);
    EXPECT_EQ(x[2], x[1]);
    EXPECT_GT(x[0], 2 * x[1]);
}

/// Frames of a film leave alone what the window shows, also where they cannot be written.
TEST(RenderThread, ExtraRendersAreNotShown) {
    RenderThread thread([] { return open_device({}); }, [] {});
    thread.set_scene(red_splat());
    thread.ask(request(1));
    ASSERT_TRUE(soon([&] { return thread.take_news().picture != nullptr; }));
    std::vector<uint8_t> taken;
    ExtraRequest extra{.camera = request(0).camera};
    extra.take = [&](const std::vector<uint8_t>& rgba) { taken = rgba; };
    EXPECT_EQ(thread.ask_extra(extra), 1u);
    extra.take = [](const std::vector<uint8_t>&) { throw RunError("ffmpeg has ended"); };
    EXPECT_EQ(thread.ask_extra(extra), 2u);
    extra.take = {};
    extra.file = "/nowhere/frame.png";
    EXPECT_EQ(thread.ask_extra(extra), 3u);
    std::vector<ExtraDone> done;
    ASSERT_TRUE(soon([&] {
        for (const ExtraDone& one : thread.take_news().extras) done.push_back(one);
        return done.size() == 3;
    }));
    EXPECT_EQ(taken, thread.take_news().picture->picture.rgba);
    EXPECT_FALSE(done[0].failure);
    EXPECT_TRUE(done[1].failure && done[2].failure);
    for (size_t i = 0; i < done.size(); ++i) EXPECT_EQ(done[i].number, i + 1);
    EXPECT_EQ(thread.take_news().picture->request.serial, 1u);
    EXPECT_FALSE(thread.take_news().failure) << "the device is not to blame";
}

/// Clicks come faster than answers.
TEST(RenderThread, AnswersAllPointsToMeasure) {
    std::promise<void> opened;
    RenderThread thread(
        [&] {
            opened.get_future().wait();
            return open_device({});
        },
        [] {});
    thread.set_scene(red_splat());
    thread.ask(request(1));  // the thread takes it, and waits for the device
    const Camera camera = request(0).camera;
    thread.ask_point(camera, {1, 1}, PointUse::measure);
    thread.ask_point(camera, {1, 1}, PointUse::look_at);
    thread.ask_point(camera, {20.5, 15.5}, PointUse::measure);
    const uint64_t last = thread.ask_point(camera, {20.5, 15.5}, PointUse::look_at);
    opened.set_value();
    const std::vector<SurfacePoint> points = points_of(thread, last);
    std::vector<uint64_t> numbers;
    for (const SurfacePoint& point : points) numbers.push_back(point.number);
    EXPECT_EQ(numbers, (std::vector<uint64_t>{1, 3, 4}));
    for (const SurfacePoint& point : points) {
        EXPECT_EQ(point.use, point.number % 2 == 1 ? PointUse::measure : PointUse::look_at);
        EXPECT_EQ(bool(point.place), point.number > 2);
    }
}

/// Each point takes a render, which nobody waits for once measuring ends.
TEST(RenderThread, ForgetsPointsThatWait) {
    std::promise<void> opening, opened;
    RenderThread thread(
        [&] {
            opening.set_value();
            opened.get_future().wait();
            return open_device({});
        },
        [] {});
    thread.set_scene(red_splat());
    opening.get_future().wait();
    const Camera camera = request(0).camera;
    for (int i = 0; i < 3; ++i) thread.ask_point(camera, {20.5, 15.5}, PointUse::measure);
    thread.forget_points();
    const uint64_t last = thread.ask_point(camera, {20.5, 15.5}, PointUse::measure);
    opened.set_value();
    const std::vector<SurfacePoint> points = points_of(thread, last);
    ASSERT_EQ(points.size(), 1u);
    EXPECT_EQ(points[0].number, last);
}

/// Answers to what was asked of an earlier scene must not count in the next.
TEST(Renders, ForgetPoints) {
    std::promise<void> opened;
    Renders renders(
        [&] {
            opened.get_future().wait();
            return open_device({});
        },
        [] {});
    renders.set_scene(red_splat());
    const Camera camera = request(0).camera;
    renders.ask_point(camera, {20.5, 15.5}, PointUse::measure);
    renders.forget_points();
    renders.ask_point(camera, {20.5, 15.5}, PointUse::measure);
    opened.set_value();
    std::vector<SurfacePoint> points;
    renders.ask(camera, {}, true);
    ASSERT_TRUE(soon([&] {
        for (const SurfacePoint& point : renders.take().points) points.push_back(point);
        return renders.settled();
    }));
    ASSERT_EQ(points.size(), 1u);
    EXPECT_EQ(points[0].number, 2u);
    for (int i = 0; i < 3; ++i) renders.ask_point(camera, {20.5, 15.5}, PointUse::measure);
    renders.forget_points();
    EXPECT_TRUE(renders.settled()) << "no answer is awaited";
}

/// The eyedropper reads the splats, not the picture: without tints of selections and locks.
TEST(RenderThread, AnswersTheColourOfTheSplats) {
    RenderThread thread([] { return open_device({}); }, [] {});
    thread.set_scene(red_splat());
    for (const uint8_t mark : {0, int(kMarkSelected), int(kMarkLocked), int(kMarkPreview)}) {
        SCOPED_TRACE(int(mark));
        thread.set_marks(std::make_shared<const std::vector<uint8_t>>(1, mark));
        const uint64_t number = thread.ask_point(request(0).camera, {20.5, 15.5}, PointUse::color);
        const std::vector<SurfacePoint> points = points_of(thread, number);
        ASSERT_TRUE(points.size() == 1 && points[0].place);
        EXPECT_EQ(points[0].use, PointUse::color);
        const double expected[] = {1, 0, 0};
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(points[0].color[c], expected[c], 1e-3) << "without the background";
    }
    const std::vector<SurfacePoint> points =
        points_of(thread, thread.ask_point(request(0).camera, {1, 1}, PointUse::color));
    ASSERT_EQ(points.size(), 1u);
    EXPECT_FALSE(points[0].place) << "there is nothing in the corner";
}

TEST(RenderThread, FitsOpacitiesToTheKernel) {
    RenderThread thread([] { return open_device({}); }, [] {});
    Gaussians dense = *red_splat();
    dense.opacity_logits = {2};
    fit_opacities(dense, true);
    thread.set_scene(std::make_shared<const Gaussians>(dense));
    uint64_t serial = 0;
    const auto red = [&](Footprint kernel) {
        RenderRequest asked = request(++serial);
        asked.look.kernel = kernel;
        thread.ask(asked);
        EXPECT_TRUE(soon([&] {
            const auto picture = thread.take_news().picture;
            return picture && picture->request.serial == serial;
        }));
        return int(thread.take_news().picture->picture.rgba[4 * (15 * 40 + 20)]);
    };
    // The sigmoid of 2 is 0.88. The density's own logit is another one.
    const int density = red(Footprint::density), peak = red(Footprint::peak);
    EXPECT_NEAR(peak, 0.88 * 255, 8);
    EXPECT_GT(std::abs(density - peak), 2) << "the fit is of the whole footprint, not of its middle";
    EXPECT_EQ(red(Footprint::density), density) << "the fit is undone";
    EXPECT_EQ(red(Footprint::peak), peak);
}

/// A draft has rows of the scene, and shows their marks.
TEST(RenderThread, ADraftShowsTheMarksOfItsRows) {
    const std::shared_ptr<const Gaussians> red = red_splat();
    Gaussians both = *red;
    append_splats(both, *red);
    both.means[3] += 1000;  // out of the image
    RenderThread thread([] { return open_device({}); }, [] {});
    thread.set_scene(std::make_shared<const Gaussians>(both));
    uint64_t serial = 0;
    const auto drawn = [&](std::vector<uint32_t> rows, std::vector<uint8_t> marks) {
        thread.set_draft({red, std::make_shared<const std::vector<uint32_t>>(std::move(rows))});
        thread.set_marks(std::make_shared<const std::vector<uint8_t>>(std::move(marks)));
        RenderRequest asked = request(++serial);
        asked.coarse = true;
        thread.ask(asked);
        RenderThread::News news;
        EXPECT_TRUE(soon([&] {
            news = thread.take_news();
            return news.picture && news.picture->request.serial == serial;
        }));
        return news.picture ? news.picture->splats_drawn : 99;
    };
    EXPECT_EQ(drawn({0}, {0, 0}), 1u);
    EXPECT_EQ(drawn({0}, {kMarkHidden, 0}), 0u);
    EXPECT_EQ(drawn({0}, {0, kMarkHidden}), 1u);
    EXPECT_EQ(drawn({1}, {0, kMarkHidden}), 0u);
}

TEST(RenderThread, DrawsAPlainLookWithoutTints) {
    RenderThread thread([] { return open_device({}); }, [] {});
    thread.set_scene(red_splat());
    uint64_t serial = 0;
    const auto drawn = [&](bool plain) {
        RenderRequest asked = request(++serial);
        asked.look.plain = plain;
        thread.ask(asked);
        EXPECT_TRUE(soon([&] {
            const auto picture = thread.take_news().picture;
            return picture && picture->request.serial == serial;
        }));
        return thread.take_news().picture->picture.rgba;
    };
    const std::vector<uint8_t> unmarked = drawn(false);
    thread.set_marks(std::make_shared<const std::vector<uint8_t>>(1, uint8_t(kMarkSelected)));
    EXPECT_NE(drawn(false), unmarked);
    EXPECT_EQ(drawn(true), unmarked);
}

/// While the view changes there are fewer splats, and all of them once it rests.
TEST(Renders, ShowTheCoarseSceneUntilTheViewRests) {
    Gaussians green = *red_splat();
    std::swap(green.sh[0], green.sh[1]);
    Renders renders([] { return open_device({}); }, [] {});
    renders.set_scene(red_splat(), {std::make_shared<const Gaussians>(green), nullptr});
    Camera camera = request(0).camera;
    const auto shown = [&](const Camera& seen, bool coarse) {
        return soon([&] {
            renders.ask(seen, {}, false);
            renders.take();
            return renders.shown() && renders.shown()->request.camera.fx == seen.fx &&
                   renders.shown()->request.coarse == coarse;
        });
    };
    const auto red_and_green = [&] {
        const ByteImage& picture = renders.shown()->picture;
        const size_t middle = 4 * (size_t(picture.height / 2) * picture.width + picture.width / 2);
        return std::pair{picture.rgba[middle] > 100, picture.rgba[middle + 1] > 100};
    };
    for (int i = 0; i < 2; ++i) {
        camera.fx += 1;
        ASSERT_TRUE(shown(camera, true));
        EXPECT_EQ(red_and_green(), std::pair(false, true));
        EXPECT_FALSE(renders.settled());
        ASSERT_TRUE(shown(camera, false));
        EXPECT_EQ(red_and_green(), std::pair(true, false));
        EXPECT_TRUE(renders.settled());
    }
    camera.fx += 1;
    renders.ask(camera, {}, true);
    ASSERT_TRUE(shown(camera, false)) << "a film has all splats";
    renders.set_scene(red_splat());
    camera.fx += 1;
    ASSERT_TRUE(shown(camera, false)) << "there is no coarse scene any more";
}

TEST(RenderThread, OpensItsDeviceAgainWhereItFails) {
    std::atomic<int> opened = 0;
    RenderThread thread(
        [&]() -> std::shared_ptr<gpu::Device> {
            if (++opened <= 3) throw RunError("lost");
            return open_device({});
        },
        [] {});
    // Each call may wake the thread by itself: only a count that both orders lead to is asked for.
    thread.ask(request(1));
    ASSERT_TRUE(soon([&] { return thread.take_news().failure != nullptr; }));
    EXPECT_EQ(opened, 2) << "it was tried twice";
    thread.set_scene(red_splat());
    thread.ask(request(2));
    ASSERT_TRUE(soon([&] { return thread.take_news().picture != nullptr; }));
    EXPECT_EQ(opened, 4);
    EXPECT_EQ(thread.take_news().failure, nullptr);
    EXPECT_EQ(thread.take_news().picture->request.serial, 2u);
}

/// What the panel says of a view is what `ewa eval` says, whatever the window's size is.
TEST(ViewQuality, IsThatOfTheEvaluation) {
    const test::Folder folder;
    test::make_dataset(folder / "data");
    test::make_splats(folder / "splats.ply", 200, 1);
    const Dataset dataset = load_dataset(folder / "data", {});
    const auto splats = std::make_shared<const Gaussians>(load_splats(folder / "splats.ply"));
    Look look;
    look.background = {0.2f, 0.4f, 0.6f};
    ViewQuality quality([] {});
    Renders renders([] { return open_device({}); }, [] {});
    const auto measured = [&](int index) {
        std::optional<double> psnr;
        soon([&] {
            quality.measure(renders, index, dataset.frames[size_t(index)], look);
            return (psnr = quality.psnr(index)).has_value();
        });
        return psnr.value_or(0);
    };
    const auto expected = [&](const Gaussians& gaussians, int index) {
        RenderOptions options;
        options.background = look.background;
        return evaluate(open_device({}), gaussians, dataset, {index}, options).psnr;
    };
    renders.set_scene(splats);
    EXPECT_NEAR(measured(2), expected(*splats, 2), 1e-3);
    EXPECT_FALSE(quality.psnr(1)) << "that of another view";
    EXPECT_NEAR(measured(1), expected(*splats, 1), 1e-3);
    const double before = measured(1);
    renders.set_scene(red_splat());
    quality.measure(renders, 1, dataset.frames[1], look);
    const double present = quality.psnr(1).value_or(0), after = expected(*red_splat(), 1);
    EXPECT_TRUE(present == before || std::abs(present - after) < 1e-3) << present << " is of neither splats";
    EXPECT_TRUE(soon([&] { return std::abs(quality.psnr(1).value_or(0) - after) < 1e-3; }));
    const Exposure bright{1.5f, 0, 0, 0.1f, 0, 1.2f, 0, 0, 0, 0, 1, 0};
    quality.forget();
    EXPECT_TRUE(soon([&] {
        quality.measure(renders, 3, dataset.frames[3], look, bright);
        return quality.psnr(3).has_value();
    }));
    RenderOptions options;
    options.background = look.background;
    EXPECT_NEAR(*quality.psnr(3),
                evaluate(open_device({}), *red_splat(), dataset, {3}, options, {bright}).psnr, 1e-3);
    quality.forget();
    EXPECT_FALSE(quality.psnr(1));
    Frame absent = dataset.frames[0];
    absent.image_path = folder / "absent.png";
    EXPECT_TRUE(std::isnan(quality_of({Image(48, 32, 3), absent, {}, kIdentityExposure}).psnr));
}

}  // namespace
}  // namespace ewa::viewer
