// SPDX-License-Identifier: Apache-2.0
// The largest number of splats of a training that does not name it.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "ewa/device.h"
#include "ewa/trainer.h"
#include "gpu/test_device.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

/// Cameras alone: a cap needs no images.
Dataset views_of(int count, int width, int height) {
    Dataset dataset;
    dataset.frames.resize(size_t(count));
    for (Frame& frame : dataset.frames) {
        frame.camera.width = width;
        frame.camera.height = height;
        frame.camera.fx = frame.camera.fy = width;
        frame.eight_bit = true;
    }
    return dataset;
}

Gaussians some_splats(size_t count) {
    Gaussians splats;
    splats.resize(count);
    return splats;
}

TrainOptions long_run() {
    TrainOptions options;
    options.steps = 30000;
    return options;
}

SplatCap cap_of(const Dataset& dataset, const TrainOptions& options, size_t start = 100) {
    return splat_cap(*device(), dataset, all_frames(dataset), some_splats(start), options);
}

TEST(SplatCap, FollowsThePixelsAndTheSquareRootOfThePhotos) {
    EXPECT_EQ(cap_of(views_of(1, 200, 100), long_run()).splats, 12000u);
    EXPECT_EQ(cap_of(views_of(9, 200, 100), long_run()).splats, 36000u);
    EXPECT_EQ(cap_of(views_of(9, 400, 100), long_run()).splats, 72000u);
    EXPECT_EQ(cap_of(views_of(9, 200, 100), long_run()).reason,
              "9 photos with 0.18 million pixels have detail for no more");
    const Dataset dataset = views_of(10, 200, 100);
    EXPECT_EQ(splat_cap(*device(), dataset, {0, 3, 4, 9}, some_splats(9), long_run()).splats, 24000u)
        << "of the training frames alone";
}

TEST(SplatCap, RisesWithTheSteps) {
    const Dataset dataset = views_of(100, 1300, 840);
    TrainOptions options;
    options.steps = 1000;
    EXPECT_EQ(cap_of(dataset, options, 500).splats, 100500u);
    EXPECT_EQ(cap_of(dataset, options, 500).reason, "100 more for each step");
    options.steps = 7000;
    EXPECT_EQ(cap_of(dataset, options, 500).splats, 700500u);
}

TEST(SplatCap, IsWhatTheOptionsSay) {
    TrainOptions options = long_run();
    options.max_splats = 77;
    EXPECT_EQ(cap_of(views_of(10, 200, 100), options).splats, 77u);
}

TEST(SplatCap, IsNotBelowTheStartNorAnEarlierCap) {
    TrainOptions options = long_run();
    EXPECT_EQ(cap_of(views_of(1, 200, 100), options, 15000).splats, 15000u);
    options.least_max_splats = 13000;
    EXPECT_EQ(cap_of(views_of(1, 200, 100), options).splats, 13000u);
    options.least_max_splats = 7000;
    EXPECT_EQ(cap_of(views_of(1, 200, 100), options).splats, 12000u);
}

/// With a limit of device memory, splats that do not fit are in host memory.
TEST(SplatCap, KeepsTheTrainingOnTheDevice) {
    const Dataset dataset = views_of(20000, 2000, 1000);
    const Gaussians start = some_splats(1000);
    TrainOptions options;
    options.strategy = Strategy::adc;
    options.steps = 10000000;
    options.image_cache_bytes = 0;
    const double room = 0.8 * double(device_info(*device()).memory_bytes);
    const auto bytes = [&](uint32_t splats) {
        TrainOptions given = options;
        given.max_splats = splats;
        return double(estimate_memory(*device(), dataset, all_frames(dataset), start, given).total());
    };
    options.device_memory_bytes = uint64_t(1) << 30;
    const uint32_t all = cap_of(dataset, options, 1000).splats;
    EXPECT_GT(all, 100000000u);
    options.device_memory_bytes = 0;
    if (bytes(all) <= room) GTEST_SKIP() << "this device has room for all of them";
    const SplatCap cap = cap_of(dataset, options, 1000);
    EXPECT_EQ(cap.reason, "the device's memory has room for them");
    EXPECT_GT(cap.splats, 1000u);
    EXPECT_LE(bytes(cap.splats), room);
    EXPECT_GT(bytes(cap.splats + all / 50), room);
}

/// Also the most splats in the estimate of memory. Where splats are removed at the end, the list of them needs memory too.
TEST(SplatCap, BoundsATraining) {
    const Gaussians start = shaken_start(small_capture(), 0.05, 1, 1);
    const auto frames = all_frames(small_capture().dataset);
    TrainOptions options = busy(Strategy::mcmc, 1);
    options.max_splats = kAutomaticMaxSplats;
    options.growth = 10;
    std::vector<uint64_t> bytes;
    for (const uint32_t final_splats : {0u, kAutomaticFinalSplats}) {
        options.final_splats = final_splats;
        Trainer trainer(device(), small_capture().dataset, frames, start, options);
        uint32_t most = 0;
        while (trainer.steps_done() < options.steps) most = std::max(most, trainer.step().splats);
        EXPECT_EQ(most, 2932u);
        EXPECT_EQ(trainer.max_splats(), most);
        EXPECT_EQ(trainer.splats(), final_splats == 0 ? most : most * 2 / 3);
        const MemoryEstimate estimate =
            estimate_memory(*device(), small_capture().dataset, frames, start, options);
        EXPECT_EQ(estimate.splats, most);
        bytes.push_back(estimate.total());
    }
    EXPECT_GT(bytes[1], bytes[0]);
}

}  // namespace
}  // namespace ewa::test
