// SPDX-License-Identifier: Apache-2.0
// Training of scenes that are larger than the device: the bytes of one that fits, within the limit.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "ewa/error.h"
#include "ewa/evaluation.h"
#include "ewa/trainer.h"
#include "gpu/test_device.h"
#include "portions/portions.h"
#include "support/thread_ranks.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

constexpr uint64_t kChunkMiB = uint64_t(1) << 20;

/// Splats of which the cameras see one in twenty: the others are far above and below.
Gaussians tall_scene(size_t splats) {
    Random random(5);
    Gaussians g;
    g.sh_degree = 3;
    g.resize(splats);
    for (size_t i = 0; i < splats; ++i) {
        const bool seen = i % 20 == 0;
        g.means[3 * i] = float(random.uniform(-1, 1));
        g.means[3 * i + 1] = float(random.uniform(-1, 1)) + (seen ? 0.0f : i % 2 == 0 ? 30.0f : -30.0f);
        g.means[3 * i + 2] = float(random.uniform(-1, 1));
        for (size_t k = 0; k < 3; ++k) g.log_scales[3 * i + k] = float(std::log(random.uniform(0.03, 0.1)));
        for (size_t k = 0; k < 4; ++k) g.quaternions[4 * i + k] = float(random.normal());
        for (size_t k = 0; k < g.sh_stride(); ++k) g.sh[g.sh_stride() * i + k] = float(random.uniform(-1, 1));
        g.opacity_logits[i] = i % 9 == 0 ? -3.0f : -1.0f;
    }
    return g;
}

/// Densifies, resets and relocates within some tens of steps.
TrainOptions busy_chunks(Strategy strategy, int batch) {
    TrainOptions options = busy(strategy, batch);
    options.steps = 36;
    options.sh_degree = 3;
    options.max_splats = 28000;
    options.dead_opacity = 0.06;
    options.opacity_reset_every = 25;
    options.noise_rate = 2e4;  // as much as usual: the others stay out of sight
    // With mcmc the opacity of what no camera sees falls. It should not all die and move to where it is seen.
    if (strategy == Strategy::mcmc) options.opacity_rate = 0.02;
    return options;
}

struct ChunksTrained {
    TrainerState state;
    uint64_t peak = 0;
    std::optional<ChunkFigures> chunks;
    Gaussians splats;
};

/// resume: where the training begins.
ChunksTrained train_within(TrainOptions options, uint64_t limit, size_t splats, int until,
                           const TrainerState* resume = nullptr) {
    options.device_memory_bytes = limit;
    const auto device = open_test_device(false);
    Trainer trainer(device, seven_views().dataset, all_frames(seven_views().dataset), tall_scene(splats),
                    options);
    if (resume) trainer.restore(*resume);
    while (trainer.steps_done() < until) trainer.step();
    return {trainer.state(), peak_device_bytes(*device), trainer.chunk_figures(), trainer.gaussians()};
}

void expect_same_training(const ChunksTrained& a, const ChunksTrained& b) {
    EXPECT_EQ(a.state.report.step, b.state.report.step);
    EXPECT_EQ(a.state.report.splats, b.state.report.splats);
    EXPECT_EQ(a.state.report.loss, b.state.report.loss);
    EXPECT_EQ(a.state.report.psnr, b.state.report.psnr);
    EXPECT_EQ(a.state.report.limited_steps, b.state.report.limited_steps);
    EXPECT_EQ(a.state.report.dropped_updates, b.state.report.dropped_updates);
    EXPECT_EQ(a.state.report.skipped_nonfinite, b.state.report.skipped_nonfinite);
    ASSERT_EQ(a.state.arrays.size(), b.state.arrays.size());
    for (size_t i = 0; i < a.state.arrays.size(); ++i) {
        EXPECT_EQ(a.state.arrays[i].name, b.state.arrays[i].name);
        EXPECT_TRUE(a.state.arrays[i].bytes == b.state.arrays[i].bytes) << a.state.arrays[i].name;
    }
    EXPECT_EQ(a.splats.means, b.splats.means);
    EXPECT_EQ(a.splats.sh, b.splats.sh);
}

struct ChunksCase {
    Strategy strategy;
    int batch;
    void (*change)(TrainOptions&) = nullptr;
    const char* name = "";
};
void wide(TrainOptions& options) {
    options.moment_bits = 32;
}
void absolute(TrainOptions& options) {
    options.absolute_gradients = true;
    options.render.kernel = Footprint::density;
    options.grow_gradient_absolute = 1e-5;
}
void from_disk(TrainOptions& options) {
    options.image_cache_bytes = 0;
    options.halvings = 1;
}

std::string name_of_chunks_case(const testing::TestParamInfo<ChunksCase>& tested) {
    const char* names[] = {"none", "adc", "mcmc"};
    std::string name = names[int(tested.param.strategy)];
    return name + tested.param.name + "_batch" + std::to_string(tested.param.batch);
}

class ChunksTrain : public testing::TestWithParam<ChunksCase> {};

TEST_P(ChunksTrain, TheBytesOfOneThatFits) {
    const auto& [strategy, batch, change, name] = GetParam();
    TrainOptions options = busy_chunks(strategy, batch);
    if (change) change(options);
    // One chunk holds all that mcmc adds until the chunks are level.
    const size_t splats = strategy == Strategy::none ? 28000 : strategy == Strategy::mcmc ? 26500 : 20000;
    // With kernels of a GPU, a step of one view that is not in chunks has a kernel that rounds in another order.
    const bool other_kernel = batch == 1 && options.bands == 1 && std::getenv("EWA_TEST_KERNELS");
    const ChunksTrained whole =
        train_within(options, other_kernel ? 9 * kChunkMiB : 0, splats, options.steps);
    EXPECT_EQ(bool(whole.chunks), other_kernel);
    EXPECT_EQ(whole.state.report.splats == splats, strategy == Strategy::none)
        << "the number of splats should change";
    uint64_t state = 0;
    for (const TrainerArray& array : whole.state.arrays)
        if (!array.name.starts_with("exp") && !array.name.starts_with("app") &&
            !array.name.starts_with("sky"))
            state += array.bytes.size();

    const uint64_t limit = state / 4;
    const ChunksTrained chunked = train_within(options, limit, splats, options.steps);
    ASSERT_TRUE(chunked.chunks);
    EXPECT_GE(chunked.chunks->chunks, 4);
    EXPECT_EQ(chunked.chunks->state_bytes, state);
    EXPECT_GT(chunked.chunks->streamed_bytes, double(limit)) << "no splats should have left the device";
    EXPECT_LE(chunked.peak, limit);
    expect_same_training(chunked, whole);
}

void exposed_views(TrainOptions& options) {
    options.appearance = AppearanceModel::affine;
}
void ppisp_views(TrainOptions& options) {
    options.appearance = AppearanceModel::ppisp;
}
void with_sky(TrainOptions& options) {
    options.sky = true;
}
void with_fewer(TrainOptions& options) {
    options.final_splats = options.strategy == Strategy::mcmc ? 24000 : 18000;
}
void in_bands(TrainOptions& options) {
    options.bands = 2;
}

INSTANTIATE_TEST_SUITE_P(Chunks, ChunksTrain,
                         testing::Values(ChunksCase{Strategy::adc, 1}, ChunksCase{Strategy::adc, 3},
                                         ChunksCase{Strategy::mcmc, 1}, ChunksCase{Strategy::mcmc, 3},
                                         ChunksCase{Strategy::none, 1},
                                         ChunksCase{Strategy::mcmc, 2, wide, "_wide"},
                                         ChunksCase{Strategy::adc, 1, absolute, "_absolute_density"},
                                         ChunksCase{Strategy::adc, 2, from_disk, "_from_disk"},
                                         ChunksCase{Strategy::adc, 2, exposed_views, "_exposure"},
                                         ChunksCase{Strategy::adc, 2, ppisp_views, "_ppisp"},
                                         ChunksCase{Strategy::adc, 2, with_sky, "_sky"},
                                         ChunksCase{Strategy::adc, 1, with_fewer, "_fewer"},
                                         ChunksCase{Strategy::mcmc, 2, with_fewer, "_fewer"},
                                         ChunksCase{Strategy::adc, 1, in_bands, "_bands"}),
                         name_of_chunks_case);

/// Each rank holds its splats in chunks, and views are cut into bands.
TEST(Chunks, OfSeveralRanksHaveTheBytesOfOneThatFits) {
    for (const Strategy strategy : {Strategy::adc, Strategy::mcmc}) {
        TrainOptions options = busy_chunks(strategy, 1);
        options.bands = 2;
        const size_t splats = strategy == Strategy::mcmc ? 26500 : 20000;
        const ChunksTrained whole = train_within(options, 0, splats, options.steps);
        options.device_memory_bytes = 3 * kChunkMiB;
        ChunksTrained together;
        run_ranks(2, [&](std::shared_ptr<Ranks> group) {
            const auto device = open_test_device(false);
            Trainer trainer(device, seven_views().dataset, all_frames(seven_views().dataset),
                            tall_scene(splats), options, group);
            EXPECT_TRUE(trainer.chunk_figures());
            if (group->rank() != 0) return trainer.follow();
            while (trainer.steps_done() < options.steps) trainer.step();
            together = {trainer.state(), peak_device_bytes(*device), trainer.chunk_figures(),
                        trainer.gaussians()};
        });
        EXPECT_LE(together.peak, 3 * kChunkMiB);
        expect_same_training(together, whole);
    }
}

/// It is said before the run, not after three quarters of it.
TEST(Chunks, RefuseTooFewSplatsForTheEnd) {
    TrainOptions options = busy_chunks(Strategy::adc, 2);
    options.final_splats = 8;
    expect_error<RunError>([&] { train_within(options, 3 * kChunkMiB, 20000, 0); },
                           {"8 splats are too few", "parts"});
}

TEST(Chunks, GoOnFromAnyOtherLimit) {
    const TrainOptions options = busy_chunks(Strategy::adc, 2);
    const uint64_t limits[] = {0, 5 * kChunkMiB, 3 * kChunkMiB};
    const ChunksTrained whole = train_within(options, 0, 20000, 24);
    for (const uint64_t first : limits) {
        const ChunksTrained begun = train_within(options, first, 20000, 12);
        for (const uint64_t then : limits) {
            SCOPED_TRACE(std::to_string(first) + " to " + std::to_string(then));
            expect_same_training(train_within(options, then, 20000, 24, &begun.state), whole);
        }
    }
}

/// Where the host cannot map the device's memory, staging buffers count too.
TEST(Chunks, CopiesThroughStagingBuffersKeepWithinTheLimit) {
    TrainOptions options = busy_chunks(Strategy::adc, 2);
    const ChunksTrained whole = train_within(options, 0, 20000, 16);
    const auto device = open_test_device(false);
    device->limit_host_access(gpu::HostAccess::none);
    options.device_memory_bytes = 3 * kChunkMiB;
    Trainer trainer(device, seven_views().dataset, all_frames(seven_views().dataset), tall_scene(20000),
                    options);
    while (trainer.steps_done() < 16) trainer.step();
    EXPECT_LE(peak_device_bytes(*device), 3 * kChunkMiB);
    EXPECT_TRUE(trainer.gaussians().means == whole.splats.means);
}

TEST(Chunks, AScenesPicturesAreDrawnWithinTheLimit) {
    const Gaussians scene = tall_scene(28000);
    const Dataset& dataset = seven_views().dataset;
    const auto free = open_test_device(false), limited = open_test_device(false);
    limited->limit_memory(3 * kChunkMiB, {});
    Renderer whole(free, scene, {}), parts(limited, scene, {});
    for (const Frame& frame : dataset.frames) {
        const Rendering a = whole.render(frame.camera, true), b = parts.render(frame.camera, true);
        EXPECT_EQ(a.color.pixels, b.color.pixels);
        EXPECT_EQ(a.alpha.pixels, b.alpha.pixels);
        EXPECT_EQ(a.depth.pixels, b.depth.pixels);
        EXPECT_EQ(whole.render_bytes(frame.camera, {}), parts.render_bytes(frame.camera, {}));
        EXPECT_EQ(whole.splats_drawn(), parts.splats_drawn());
    }
    EXPECT_GT(peak_device_bytes(*free), 3 * kChunkMiB);
    EXPECT_LE(peak_device_bytes(*limited), 3 * kChunkMiB);
}

TEST(Chunks, ALimitThatNoStepFitsInIsOneError) {
    const TrainOptions options = busy_chunks(Strategy::adc, 1);
    try {
        train_within(options, kChunkMiB / 4, 20000, 1);
        FAIL() << "no error";
    } catch (const RunError& error) {
        EXPECT_NE(std::string(error.what()).find("--device-memory 0.0003 is too little: this needs 0.0"),
                  std::string::npos)
            << error.what();
    }
}

TEST(Chunks, AMuchLargerLimitChangesNothing) {
    const TrainOptions options = busy_chunks(Strategy::adc, 1);
    const ChunksTrained limited = train_within(options, 1024 * kChunkMiB, 2000, 2);
    EXPECT_FALSE(limited.chunks);
    expect_same_training(limited, train_within(options, 0, 2000, 2));
}

TEST(Chunks, ExcludeWhatTheyCannotTrain) {
    const auto refused = [](const std::string& option, auto change) {
        TrainOptions options = busy_chunks(Strategy::adc, 1);
        change(options);
        try {
            train_within(options, kChunkMiB, 2000, 1);
            ADD_FAILURE() << option;
        } catch (const InputError& error) {
            const std::string text = error.what();
            EXPECT_NE(text.find(option), std::string::npos) << text;
            EXPECT_NE(text.find("--device-memory"), std::string::npos) << text;
        }
    };
    refused("--refine-poses", [](TrainOptions& o) { o.refine_poses = true; });
    refused("--points", [](TrainOptions& o) { o.render.points = true; });
}

/// The limit is that of one training, and ends with it.
TEST(Chunks, ADeviceTakesOneLimitedTraining) {
    const auto device = open_test_device(false);
    const Dataset& dataset = seven_views().dataset;
    TrainOptions options = busy_chunks(Strategy::adc, 1);
    options.device_memory_bytes = 3 * kChunkMiB;
    {
        Trainer first(device, dataset, all_frames(dataset), tall_scene(20000), options);
        EXPECT_THROW(Trainer(device, dataset, all_frames(dataset), tall_scene(20000), options), InputError);
        // The one that failed has left the limit to the first.
        while (first.steps_done() < 4) first.step();
        const std::array cameras{dataset.frames[0].camera};
        EXPECT_EQ(first.render(cameras).size(), 1u);
        EXPECT_LE(peak_device_bytes(*device), 3 * kChunkMiB);
    }
    EXPECT_EQ(device->memory_limit(), 0u);
    Trainer second(device, dataset, all_frames(dataset), tall_scene(20000), options);
    EXPECT_EQ(device->memory_limit(), 3 * kChunkMiB);
}

TEST(Chunks, AFewSplatsAreNotDivided) {
    TrainOptions options = busy_chunks(Strategy::none, 1);
    EXPECT_FALSE(train_within(options, 16 * kChunkMiB, 5, 2).chunks);
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
                                {.count = 5, .limit = 3 * kChunkMiB, .moments = 1});  // two of five fit
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
    EXPECT_LE(peak_device_bytes(*device), 3 * kChunkMiB);
}

/// Their numbers change, on one rank or several. Afterwards each has its range, and the order is as before.
TEST(Portions, AreLevelAgainAfterTheirNumbersHaveChanged) {
    for (const int ranks : {1, 2})
        for (const int each : {1, 3})
            run_ranks(ranks, [&](std::shared_ptr<Ranks> group) {
                const auto device = open_test_device(false);
                portions::Portions portions(*device, group, numbered(uint32_t(ranks * each), 64),
                                            {.count = each, .limit = 8 * kChunkMiB, .moments = 2});
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
