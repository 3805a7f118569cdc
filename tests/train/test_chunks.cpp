// SPDX-License-Identifier: Apache-2.0
// Training of scenes that are larger than the device: limits, refusals, and what leaves the device.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "ewa/error.h"
#include "ewa/evaluation.h"
#include "ewa/renderer.h"
#include "portions/portions.h"
#include "train/divided.h"

namespace ewa::test {
namespace {

DividedResult train_within(const TrainOptions& options, uint64_t limit, size_t splats, int until,
                           const TrainerState* resume = nullptr) {
    return train_divided(options, tall_scene(splats), {.limit = limit}, until, seven_views().dataset, resume);
}

/// It is said before the run, not after three quarters of it.
TEST(Chunks, RefuseTooFewSplatsForTheEnd) {
    TrainOptions options = busy_chunks(Strategy::adc, 2);
    options.final_splats = 8;
    expect_error<RunError>([&] { train_within(options, 3 * kMiB, 20000, 0); },
                           {"8 splats are too few", "parts"});
}

TEST(Chunks, GoOnFromAnyOtherLimit) {
    const TrainOptions options = busy_chunks(Strategy::adc, 2);
    const uint64_t limits[] = {0, 5 * kMiB, 3 * kMiB};
    const DividedResult whole = train_within(options, 0, 20000, 24);
    for (const uint64_t first : limits) {
        const DividedResult begun = train_within(options, first, 20000, 12);
        for (const uint64_t then : limits) {
            SCOPED_TRACE(std::to_string(first) + " to " + std::to_string(then));
            expect_same(train_within(options, then, 20000, 24, &begun.state), whole);
        }
    }
}

/// Where the host cannot map the device's memory, staging buffers count too.
TEST(Chunks, CopiesThroughStagingBuffersKeepWithinTheLimit) {
    const TrainOptions options = busy_chunks(Strategy::adc, 2);
    const DividedResult staged =
        train_divided(options, tall_scene(20000), {.limit = 3 * kMiB, .staged = true}, 16);
    EXPECT_LE(staged.peak, 3 * kMiB);
    expect_same(staged, train_within(options, 0, 20000, 16));
}

TEST(Chunks, AScenesPicturesAreDrawnWithinTheLimit) {
    const Gaussians scene = tall_scene(28000);
    const Dataset& dataset = seven_views().dataset;
    const auto free = open_test_device(false), limited = open_test_device(false);
    limited->limit_memory(3 * kMiB, {});
    Renderer whole(free, scene, {}), parts(limited, scene, {});
    for (const Frame& frame : dataset.frames) {
        const Rendering a = whole.render(frame.camera, true), b = parts.render(frame.camera, true);
        EXPECT_EQ(a.color.pixels, b.color.pixels);
        EXPECT_EQ(a.alpha.pixels, b.alpha.pixels);
        EXPECT_EQ(a.depth.pixels, b.depth.pixels);
        EXPECT_EQ(whole.render_bytes(frame.camera, {}), parts.render_bytes(frame.camera, {}));
        EXPECT_EQ(whole.splats_drawn(), parts.splats_drawn());
    }
    EXPECT_GT(peak_device_bytes(*free), 3 * kMiB);
    EXPECT_LE(peak_device_bytes(*limited), 3 * kMiB);
}

/// Each part of the scene has its own marks.
TEST(Chunks, AScenesMarksHideAndTintWithinTheLimit) {
    const Gaussians scene = tall_scene(28000);
    const Camera& camera = seven_views().dataset.frames.front().camera;
    const auto free = open_test_device(false), limited = open_test_device(false);
    limited->limit_memory(3 * kMiB, {});
    Renderer whole(free, scene, {}), parts(limited, scene, {});
    const std::vector<uint8_t> before = parts.render_bytes(camera, {});
    std::vector<uint8_t> marks(28000);
    for (size_t i = 0; i < marks.size(); ++i)
        marks[i] = uint8_t(i % 7 == 0 ? kMarkHidden : i % 5 == 0 ? kMarkSelected : 0);
    whole.mark(marks);
    parts.mark(marks);
    EXPECT_EQ(whole.render_bytes(camera, {}), parts.render_bytes(camera, {}));
    EXPECT_NE(parts.render_bytes(camera, {}), before);
    EXPECT_EQ(whole.splats_drawn(), parts.splats_drawn());
    EXPECT_LE(peak_device_bytes(*limited), 3 * kMiB);
    parts.mark({});
    EXPECT_EQ(parts.render_bytes(camera, {}), before);
}

TEST(Chunks, ALimitThatNoStepFitsInIsOneError) {
    const TrainOptions options = busy_chunks(Strategy::adc, 1);
    expect_error<RunError>([&] { train_within(options, kMiB / 4, 20000, 1); },
                           {"--device-memory 0.0003 is too little: this needs 0.0"});
}

TEST(Chunks, AMuchLargerLimitChangesNothing) {
    const TrainOptions options = busy_chunks(Strategy::adc, 1);
    const DividedResult limited = train_within(options, 1024 * kMiB, 2000, 2);
    EXPECT_FALSE(limited.chunks);
    expect_same(limited, train_within(options, 0, 2000, 2));
}

TEST(Chunks, ExcludeWhatTheyCannotTrain) {
    const auto refused = [](const std::string& option, auto change) {
        TrainOptions options = busy_chunks(Strategy::adc, 1);
        change(options);
        expect_error<InputError>([&] { train_within(options, kMiB, 2000, 1); }, {option, "--device-memory"});
    };
    refused("--refine-poses", [](TrainOptions& o) { o.refine_poses = true; });
    refused("--points", [](TrainOptions& o) { o.render.points = true; });
}

/// The limit is that of one training, and ends with it.
TEST(Chunks, ADeviceTakesOneLimitedTraining) {
    const auto device = open_test_device(false);
    const Dataset& dataset = seven_views().dataset;
    TrainOptions options = busy_chunks(Strategy::adc, 1);
    options.device_memory_bytes = 3 * kMiB;
    {
        Trainer first(device, dataset, all_frames(dataset), tall_scene(20000), options);
        EXPECT_THROW(Trainer(device, dataset, all_frames(dataset), tall_scene(20000), options), InputError);
        // The one that failed has left the limit to the first.
        while (first.steps_done() < 4) first.step();
        const std::array cameras{dataset.frames[0].camera};
        EXPECT_EQ(first.render(cameras).size(), 1u);
        EXPECT_LE(peak_device_bytes(*device), 3 * kMiB);
    }
    EXPECT_EQ(device->memory_limit(), 0u);
    Trainer second(device, dataset, all_frames(dataset), tall_scene(20000), options);
    EXPECT_EQ(device->memory_limit(), 3 * kMiB);
}

TEST(Chunks, AFewSplatsAreNotDivided) {
    TrainOptions options = busy_chunks(Strategy::none, 1);
    EXPECT_FALSE(train_within(options, 16 * kMiB, 5, 2).chunks);
}

/// Splats whose parameters are all their portion's number.
Gaussians numbered(uint32_t portions, uint32_t each) {
    Gaussians splats;
    splats.resize(size_t(portions) * each);
    for (size_t i = 0; i < splats.size(); ++i) splats.opacity_logits[i] = float(i / each);
    return splats;
}

TEST(Portions, LeaveTheDeviceAndComeBack) {
    const auto device = open_test_device(false);
    portions::Portions portions(*device, alone(), numbered(5, 12000),
                                {.count = 5, .limit = 3 * kMiB, .moments = 1});  // two of five fit
    for (int turn = 0; turn < 3; ++turn) {
        std::vector<int> visited;
        portions.visit(portions::Portions::Need::state, [&](int portion, pipeline::Model& model) {
            visited.push_back(portion);
            EXPECT_EQ(model.first, 12000u * uint32_t(portion));
            const Gaussians splats = download_model(model, model.params);
            EXPECT_EQ(splats.opacity_logits.front(), float(100 * turn + portion));
            EXPECT_EQ(splats.opacity_logits.back(), float(100 * turn + portion));
            Gaussians more = splats;
            for (float& logit : more.opacity_logits) logit += 100;
            model.params = pipeline::upload_model(*device, more, 0, false).params;
            portions.changed();
        });
        std::vector<int> expected{0, 1, 2, 3, 4};
        if (turn == 1) std::ranges::reverse(expected);
        EXPECT_EQ(visited, expected);
    }
    const Gaussians all = portions.gaussians();
    for (size_t i = 0; i < all.size(); ++i) ASSERT_EQ(all.opacity_logits[i], float(300 + i / 12000));
    EXPECT_LE(peak_device_bytes(*device), 3 * kMiB);
}

/// Their numbers change, on one rank or several. Afterwards each has its range, and the order is as before.
TEST(Portions, AreLevelAgainAfterTheirNumbersHaveChanged) {
    for (const int ranks : {1, 2})
        for (const int each : {1, 3})
            run_ranks(ranks, [&](std::shared_ptr<Ranks> group) {
                const auto device = open_test_device(false);
                portions::Portions portions(*device, group, numbered(uint32_t(ranks * each), 64),
                                            {.count = each, .limit = 8 * kMiB, .moments = 2});
                std::vector<float> expected;
                const auto size_of = [&](int portion) { return uint32_t(20 + 37 * (portion % 4)); };
                for (int p = 0; p < portions.all(); ++p)
                    for (uint32_t i = 0; i < size_of(p); ++i) expected.push_back(float(1000 * p) + float(i));
                portions.visit(portions::Portions::Need::state, [&](int portion, pipeline::Model& model) {
                    const int number = portions.first() + portion;
                    Gaussians other = numbered(1, size_of(number));
                    for (size_t i = 0; i < other.size(); ++i)
                        other.opacity_logits[i] = float(1000 * number) + float(i);
                    model = pipeline::upload_model(*device, other, 2, false);
                    portions.changed();
                });
                portions.level();
                EXPECT_EQ(portions.splats(), expected.size());
                portions.visit(portions::Portions::Need::state, [&](int portion, pipeline::Model& model) {
                    const portions::Range range =
                        portions::range_of(portions.splats(), portions.first() + portion, portions.all());
                    EXPECT_EQ(model.first, range.first);
                    EXPECT_EQ(model.splats, range.splats);
                    EXPECT_EQ(model.all, portions.splats());
                    const auto logits = download_model(model, model.params).opacity_logits;
                    ASSERT_EQ(logits.size(), range.splats);
                    for (size_t i = 0; i < logits.size(); ++i)
                        ASSERT_EQ(logits[i], expected[range.first + i]);
                    EXPECT_TRUE(model.moments1 && model.moments2);
                });
            });
}

}  // namespace
}  // namespace ewa::test
