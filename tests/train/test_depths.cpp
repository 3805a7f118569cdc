// SPDX-License-Identifier: Apache-2.0
// Training on images with depth maps.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <glm/matrix.hpp>

#include "ewa/renderer.h"
#include "ewa/trainer.h"
#include "gpu/test_device.h"
#include "run/depth_evaluation.h"
#include "scene/depth_map.h"
#include "support/temp_folder.h"
#include "support/thread_ranks.h"
#include "train/divided.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

/// Images of grey splats, which say little about depth, with depth maps that have holes of every kind.
const Synthetic& measured() {
    static const Synthetic* const made = [] {
        static Synthetic data;
        make_synthetic(data, 60, 8, 64, 48, 31);
        std::filesystem::create_directories(data.folder / "depth");
        for (const Frame& frame : data.dataset.frames) {
            const auto blended = reference::render(data.truth, frame.camera, {}).blended;
            Image map(64, 48, 1);
            for (size_t i = 0; i < map.pixels.size(); ++i)
                map.pixels[i] = blended.transmittance.values[i] < 0.5 ? float(blended.depth.values[i]) : 0.0f;
            map.pixels[0] = std::nanf("");
            map.pixels[1] = INFINITY;
            map.pixels[2] = -3;
            save_image(data.folder / "depth" / frame.image_path.filename().replace_extension(".exr"), map);
        }
        data.dataset = load_dataset(data.folder.path(), {});
        return &data;
    }();
    return *made;
}

Gaussians moved_start() {
    Gaussians start = measured().truth;
    Random random(5);
    for (float& x : start.means) x += float(random.uniform(-0.15, 0.15));
    return start;
}

/// Mean |ln D - ln d| of the renders, over the pixels with a depth.
double depth_error(const Gaussians& splats) {
    Renderer renderer(device(), splats, {});
    double sum = 0, pixels = 0;
    for (const Frame& frame : measured().dataset.frames) {
        const auto truth = reference::render(measured().truth, frame.camera, {}).blended;
        const Image depth = renderer.render(frame.camera, true).depth;
        for (size_t i = 0; i < depth.pixels.size(); ++i)
            if (truth.transmittance.values[i] < 0.5 && depth.pixels[i] > 0) {
                sum += std::abs(std::log(double(depth.pixels[i]) / truth.depth.values[i]));
                ++pixels;
            }
    }
    return sum / pixels;
}

TrainerState train_depths(const TrainOptions& options, int steps, const TrainerState* from = nullptr,
                          Gaussians* splats = nullptr) {
    const Dataset& dataset = measured().dataset;
    Trainer trainer(device(), dataset, all_frames(dataset), moved_start(), options);
    if (from) trainer.restore(*from);
    while (trainer.steps_done() < steps) trainer.step();
    if (splats) *splats = trainer.gaussians();
    return trainer.state();
}

TEST(Depths, MoveTheSplats) {
    TrainOptions options = quick(80);
    Gaussians without, with;
    train_depths(options, 80, nullptr, &without);
    options.loss.depth = 0.5;
    train_depths(options, 80, nullptr, &with);
    const double before = depth_error(moved_start()), usual = depth_error(without), own = depth_error(with);
    printf("    %.4f at the start, %.4f without depth maps, %.4f with them\n", before, usual, own);
    EXPECT_LT(own, 0.7 * usual);
}

/// From disk, and after a pause.
TEST(Depths, HaveTheSameBytesHoweverTheTrainingGoes) {
    TrainOptions options = quick(12);
    options.loss.depth = 0.5;
    const TrainerState whole = train_depths(options, 12), half = train_depths(options, 6);
    const TrainerState resumed = train_depths(options, 12, &half);
    options.image_cache_bytes = 0;
    const TrainerState from_disk = train_depths(options, 12);
    for (const TrainerState* other : {&resumed, &from_disk}) {
        EXPECT_EQ(other->report.loss, whole.report.loss);
        ASSERT_EQ(other->arrays.size(), whole.arrays.size());
        for (size_t i = 0; i < whole.arrays.size(); ++i)
            EXPECT_TRUE(other->arrays[i].bytes == whole.arrays[i].bytes);
    }
}

TrainerState train_on_ranks(const TrainOptions& options, int ranks) {
    const Dataset& dataset = measured().dataset;
    TrainerState state;
    run_ranks(ranks, [&](std::shared_ptr<Ranks> group) {
        Trainer trainer(open_test_device(false), dataset, all_frames(dataset), moved_start(), options, group);
        if (group->rank() != 0) return trainer.follow();
        while (trainer.steps_done() < 12) trainer.step();
        trainer.keep_waiting();
        state = trainer.state();
    });
    return state;
}

void expect_same_bytes(const TrainerState& a, const TrainerState& b) {
    EXPECT_EQ(a.report.loss, b.report.loss);
    ASSERT_EQ(a.arrays.size(), b.arrays.size());
    for (size_t i = 0; i < a.arrays.size(); ++i)
        EXPECT_TRUE(a.arrays[i].bytes == b.arrays[i].bytes) << a.arrays[i].name;
}

/// By ranks, in a batch, in bands, and with the gradients by the screen that growth reads.
TEST(Depths, HaveTheSameBytesHoweverTheTrainingIsDivided) {
    for (const int views : {1, 2})
        for (const bool absolute : {false, true}) {
            TrainOptions options = quick(12);
            options.loss.depth = 0.5;
            options.batch = views;
            options.bands = 3 - views;
            options.absolute_gradients = absolute;
            expect_same_bytes(train_depths(options, 12), train_on_ranks(options, 2));
        }
    // With kernels of a GPU, a step of one view on one rank has a kernel that rounds in another order.
    if (std::getenv("EWA_TEST_KERNELS")) return;
    TrainOptions options = quick(12);
    options.loss.depth = 0.5;
    expect_same_bytes(train_depths(options, 12), train_on_ranks(options, 2));
}

/// In chunks, of which a part is in host memory.
TEST(Depths, HaveTheSameBytesWhereSplatsLeaveTheDevice) {
    const Dataset& dataset = measured().dataset;
    TrainOptions options = quick(4);
    options.strategy = Strategy::none;
    options.sh_degree = 3;
    options.loss.depth = 0.5;
    options.bands = 2;  // whose kernels are those of chunks
    const auto train = [&](uint64_t limit) {
        options.device_memory_bytes = limit;
        Trainer trainer(open_test_device(false), dataset, all_frames(dataset), tall_scene(28000), options);
        while (trainer.steps_done() < 4) trainer.step();
        EXPECT_EQ(limit > 0, trainer.chunk_figures().has_value());
        return trainer.state();
    };
    const TrainerState whole = train(0);
    uint64_t bytes = 0;
    for (const TrainerArray& array : whole.arrays) bytes += array.bytes.size();
    expect_same_bytes(whole, train(bytes / 4));
    options.loss.depth = 0;
    EXPECT_NE(train(0).report.loss, whole.report.loss);
}

/// The bands of a view count the pixels of the whole view.
TEST(Depths, BandsHaveTheLossOfTheWholeView) {
    TrainOptions options = quick(1);
    options.loss.depth = 0.5;
    const double whole = train_depths(options, 1).report.loss;
    options.bands = 2;
    EXPECT_NEAR(train_depths(options, 1).report.loss, whole, 1e-6 * whole);
    options.loss.depth = 0;
    EXPECT_GT(whole, 1.05 * train_depths(options, 1).report.loss);
}

/// Maps that the loss does not compare are not read, and change nothing.
TEST(Depths, AreNotUsedWithoutAWeight) {
    Dataset lost = measured().dataset;
    for (Frame& frame : lost.frames) frame.depth_path = "nowhere.exr";
    Gaussians trained[2];
    for (const bool with : {false, true}) {
        Trainer trainer(device(), with ? lost : measured().dataset, all_frames(lost), moved_start(),
                        quick(4));
        while (trainer.steps_done() < 4) trainer.step();
        trained[with] = trainer.gaussians();
    }
    EXPECT_EQ(trained[0].means, trained[1].means);
    EXPECT_EQ(trained[0].opacity_logits, trained[1].opacity_logits);
}

/// A point at every fifth pixel of each image, where the truth is.
Dataset with_points(size_t every) {
    Dataset dataset = measured().dataset;
    dataset.points = {};
    for (Frame& frame : dataset.frames) {
        const Image map = load_depth_map(frame);
        std::vector<uint32_t> seen;
        for (size_t i = 0; i < map.pixels.size(); i += every) {
            if (map.pixels[i] == 0) continue;
            const double x = double(i % 64) + 0.5, y = double(i / 64) + 0.5, z = map.pixels[i];
            const Camera& camera = frame.camera;
            const glm::dvec3 p{z * (x - camera.cx) / camera.fx, z * (y - camera.cy) / camera.fy, z};
            seen.push_back(uint32_t(dataset.points.positions.size()));
            dataset.points.positions.push_back(glm::transpose(camera.rotation) * (p - camera.translation));
        }
        frame.seen = std::make_shared<const std::vector<uint32_t>>(std::move(seen));
        frame.depth_path.clear();
    }
    return dataset;
}

Gaussians trained(const Dataset& dataset, const TrainOptions& options, int steps) {
    Trainer trainer(device(), dataset, all_frames(dataset), moved_start(), options);
    while (trainer.steps_done() < steps) trainer.step();
    return trainer.gaussians();
}

/// Points are few, and the mean over them has the weight of one over all pixels.
TEST(Depths, OfPointsMoveTheSplats) {
    const Dataset dataset = with_points(7);
    TrainOptions options = quick(80);
    const double usual = depth_error(trained(dataset, options, 80));
    options.loss.sfm_depth = 0.5;
    const Gaussians with = trained(dataset, options, 80);
    printf("    %.4f without points, %.4f with them\n", usual, depth_error(with));
    EXPECT_LT(depth_error(with), 0.8 * usual);
    options.image_cache_bytes = 0;
    EXPECT_EQ(trained(dataset, options, 80).means, with.means) << "from disk";
    Dataset none = dataset;
    for (Frame& frame : none.frames) frame.seen = nullptr;
    expect_error<InputError>([&] { trained(none, options, 1); }, {"sfm-depth", "which point an image shows"});
}

/// Only the mean differs: points at all pixels with a depth are a depth map.
TEST(Depths, OfPointsAreThoseOfMapsOverTheirPixels) {
    Dataset maps = measured().dataset, points = with_points(1);
    maps.frames.resize(1);
    points.frames.resize(1);
    const Image map = load_depth_map(maps.frames[0]);
    const double share =
        double(std::ranges::count_if(map.pixels, [](float z) { return z > 0; })) / double(map.pixels.size());
    TrainOptions by_points = quick(3), by_map = quick(3);
    by_points.loss.sfm_depth = 0.5 * share;
    by_map.loss.depth = 0.5;
    const Gaussians a = trained(points, by_points, 3), b = trained(maps, by_map, 3);
    for (size_t i = 0; i < a.means.size(); ++i) EXPECT_NEAR(a.means[i], b.means[i], 2e-4) << i;
    EXPECT_NE(a.means, trained(maps, quick(3), 3).means);
}

TEST(Depths, SomeImagesMayHaveNone) {
    Dataset some = measured().dataset;
    TrainOptions options = quick(8);
    options.loss.depth = 0.5;
    for (size_t i = 1; i < some.frames.size(); ++i) some.frames[i].depth_path.clear();
    Trainer trainer(device(), some, all_frames(some), moved_start(), options);
    while (trainer.steps_done() < 8) trainer.step();
    EXPECT_TRUE(std::isfinite(trainer.report().loss));
    for (Frame& frame : some.frames) frame.depth_path.clear();
    expect_error<InputError>([&] { Trainer(device(), some, all_frames(some), moved_start(), options); },
                             {"no training image has a depth map"});
}

TEST(Depths, ExclusionsAreNamed) {
    const TrainOptions options = quick(4);
    const Dataset& dataset = measured().dataset;
    const auto refuse = [&](TrainOptions asked, const std::string& other) {
        const auto start = [&] { Trainer(device(), dataset, all_frames(dataset), moved_start(), asked); };
        asked.loss.depth = 0.5;
        expect_error<InputError>(start, {"--loss depth", other});
        std::swap(asked.loss.depth, asked.loss.sfm_depth);
        expect_error<InputError>(start, {"--loss sfm-depth", other});
    };
    TrainOptions asked = options;
    asked.render.points = true;
    refuse(asked, "--points");
    asked = options;
    asked.render.integrator = Integrator::fast_ray;
    refuse(asked, "--integrator");
}

}  // namespace
TEST(Depths, ErrorsCountPixelsThatTheMapHas) {
    Image map(5, 2, 1), drawn(5, 2, 1);
    map.pixels = {0, 1, 2, 4, 0, 1, 1, 2, 0, 0};
    drawn.pixels = {7, 1, 2.01f, 4.1f, 0, 0, 2, 2.2f, 0, 1};
    // 0, 0.005, 0.025, 1, 1 and 0.1
    const train::DepthErrors errors = train::depth_errors(drawn, map);
    EXPECT_NEAR(errors.median, 0.1, 1e-6) << "the upper one of the two in the middle";
    EXPECT_NEAR(errors.mean, (0.005 + 0.025 + 2 + 0.1) / 6, 1e-6);
    EXPECT_NEAR(errors.within_1, 2 / 6.0, 1e-12);
    EXPECT_NEAR(errors.within_5, 3 / 6.0, 1e-12);
}

}  // namespace ewa::test
