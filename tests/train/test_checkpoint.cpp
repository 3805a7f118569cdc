// SPDX-License-Identifier: Apache-2.0
// The checkpoint's file, and a trainer that goes on from another's state.
#include "train/checkpoint.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "ewa/error.h"
#include "ewa/trainer.h"
#include "gpu/test_device.h"
#include "run/resume.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

train::Checkpoint sample() {
    train::Checkpoint c{R"({"a":1})", "line 1\nline 2\n", 12.5, {}};
    c.state.report = {41, 7.25, 0.125, 3, (uint64_t(1) << 40), 2, 5, 21.5};
    c.state.sh_degree = 2;
    for (const size_t size : {size_t(0), size_t(5), size_t(100)}) {
        TrainerArray& array = c.state.arrays.emplace_back();
        array.name = "array" + std::to_string(size);
        for (size_t i = 0; i < size; ++i) array.bytes.push_back(std::byte(i * 7));
    }
    return c;
}

TEST(Checkpoint, ComesBackAsItWasWritten) {
    TempFolder folder;
    const auto written = sample();
    write_checkpoint(folder / "c.ewa", written);
    const auto read = train::read_checkpoint(folder / "c.ewa");
    EXPECT_EQ(read.settings, written.settings);
    EXPECT_EQ(read.metrics, written.metrics);
    EXPECT_EQ(read.wall_seconds, 12.5);
    EXPECT_EQ(read.state.report.step, 41);
    EXPECT_EQ(read.state.report.seconds, 7.25);
    EXPECT_EQ(read.state.report.loss, 0.125);
    EXPECT_EQ(read.state.report.splats, 3u);
    EXPECT_EQ(read.state.report.dropped_updates, uint64_t(1) << 40);
    EXPECT_EQ(read.state.report.skipped_nonfinite, 2u);
    EXPECT_EQ(read.state.report.limited_steps, 5u);
    EXPECT_EQ(read.state.report.psnr, 21.5);
    EXPECT_EQ(read.state.sh_degree, 2);
    ASSERT_EQ(read.state.arrays.size(), 3u);
    for (size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(read.state.arrays[i].name, written.state.arrays[i].name);
        EXPECT_EQ(read.state.arrays[i].bytes, written.state.arrays[i].bytes);
    }
}

TEST(Checkpoint, IsRefusedCutAndDamagedAtAnyByte) {
    TempFolder folder;
    const auto path = folder / "c.ewa";
    write_checkpoint(path, sample());
    const std::string bytes = file_bytes(path);
    EXPECT_EQ(read_every_cut(path, bytes, [&] { train::read_checkpoint(path); }), 0u);
    size_t accepted = 0;
    for (size_t i = 0; i < bytes.size(); ++i)
        for (const char flip : {char(1), char(0x80)}) {
            std::string damaged = bytes;
            damaged[i] = char(damaged[i] ^ flip);
            folder.write("c.ewa", damaged);
            try {
                train::read_checkpoint(path);
                ++accepted;
            } catch (const InputError&) {
            }
        }
    EXPECT_EQ(accepted, 2 * 4 * 6u);  // the zero behind each of the six checksums is not read
    folder.write("c.ewa", bytes + "x");
    expect_error<InputError>([&] { train::read_checkpoint(path); }, {"behind the last section"});
    std::string newer = bytes;
    newer[8] = 2;
    folder.write("c.ewa", newer);
    expect_error<InputError>([&] { train::read_checkpoint(path); }, {"layout 2", "layout 1"});
}

Split split() {
    return split_frames(small_capture().dataset, 4);
}

TEST(Fingerprint, TellsDatasetsApart) {
    Dataset dataset = small_capture().dataset;
    const std::string own = train::dataset_fingerprint(dataset, split());
    EXPECT_EQ(own.size(), 16u);
    EXPECT_EQ(own, train::dataset_fingerprint(small_capture().dataset, split()));
    EXPECT_NE(own, train::dataset_fingerprint(dataset, split_frames(dataset, 3)));
    EXPECT_NE(own, train::dataset_fingerprint(dataset, split(), true));
    const std::string with_points = train::dataset_fingerprint(dataset, split(), true);
    dataset.points.positions.emplace_back(1, 2, 3);
    EXPECT_EQ(own, train::dataset_fingerprint(dataset, split()));
    EXPECT_NE(with_points, train::dataset_fingerprint(dataset, split(), true));
    dataset.frames[2].camera.translation.x += 1e-12;
    EXPECT_NE(own, train::dataset_fingerprint(dataset, split()));
    dataset = small_capture().dataset;
    dataset.frames[1].image_path = dataset.frames[2].image_path;
    EXPECT_NE(own, train::dataset_fingerprint(dataset, split()));
    dataset = small_capture().dataset;
    dataset.frames[0].name = "x";
    EXPECT_NE(own, train::dataset_fingerprint(dataset, split()));
    dataset = small_capture().dataset;
    dataset.frames[0].mask_path = dataset.frames[1].image_path;
    EXPECT_NE(own, train::dataset_fingerprint(dataset, split()));
    dataset = small_capture().dataset;
    dataset.frames[0].masks = MaskUse::ignore;
    EXPECT_NE(own, train::dataset_fingerprint(dataset, split()));
    dataset = small_capture().dataset;
    dataset.frames[0].distortion.k1 = 1e-9;
    EXPECT_NE(own, train::dataset_fingerprint(dataset, split()));
}

class RestoredTrainer : public testing::TestWithParam<std::tuple<Strategy, int>> {};

TEST_P(RestoredTrainer, GoesOnAsIfNothingHadHappened) {
    TrainOptions options;
    options.steps = 230;
    options.strategy = std::get<0>(GetParam());
    options.moment_bits = std::get<1>(GetParam());
    options.refine_stop = 30000;
    options.grow_gradient = 1e-5;
    options.max_splats = 300;
    options.final_splats = 100;
    options.sh_degree = 1;
    options.random_background = true;
    options.refine_poses = options.refine_focal = true;
    options.appearance = AppearanceModel::affine;
    options.halvings = 1;
    options.absolute_gradients = true;  // of adc
    options.grow_gradient_absolute = 1e-5;
    const Gaussians start = shaken_start(small_capture(), 0.05, 1, 1);
    const auto frames = split().train;
    Trainer whole(device(), small_capture().dataset, frames, start, options);
    std::vector<TrainerState> states;
    for (int step = 1; step <= 230; ++step) {
        whole.step();
        if (step == 60 || step == 150 || step == 173) states.push_back(whole.state());
    }
    const Gaussians expected = whole.gaussians();
    EXPECT_EQ(options.strategy == Strategy::none, expected.size() == start.size());
    for (const TrainerState& state : states) {
        Trainer later(device(), small_capture().dataset, frames, start, options);
        later.step();  // restoring replaces whatever was there
        later.restore(state);
        EXPECT_EQ(later.steps_done(), state.report.step);
        StepReport report;
        while (later.steps_done() < 230) report = later.step();
        EXPECT_EQ(later.gaussians().means, expected.means);
        EXPECT_EQ(later.gaussians().sh, expected.sh);
        EXPECT_EQ(later.gaussians().opacity_logits, expected.opacity_logits);
        EXPECT_EQ(later.camera_motions(), whole.camera_motions());
        EXPECT_EQ(report.splats, expected.size());
    }
}

INSTANTIATE_TEST_SUITE_P(Strategies, RestoredTrainer,
                         testing::Combine(testing::Values(Strategy::none, Strategy::adc, Strategy::mcmc),
                                          testing::Values(16, 32)));

TEST(CheckpointSettings, HaveAdvancedOptionsThatAreNotUsual) {
    RunOptions options;
    auto stored = train::checkpoint_settings(options, "x");
    EXPECT_FALSE(stored["options"].contains("means-rate"));
    EXPECT_NO_THROW(train::check_resumable("c", stored.dump(), train::checkpoint_settings(options, "x")));
    options.train.means_rate = 1e-3;
    expect_error<InputError>(
        [&] { train::check_resumable("c", stored.dump(), train::checkpoint_settings(options, "x")); },
        {"--means-rate", "not 0.001"});
    const auto other = train::checkpoint_settings(options, "x");
    EXPECT_EQ(other["options"]["means-rate"], 1e-3);
    EXPECT_NO_THROW(train::check_resumable("c", other.dump(), other));
    expect_error<InputError>([&] { train::check_resumable("c", other.dump(), stored); },
                             {"--means-rate 0.001, not 0.00016"});
    stored["options"]["means-rate"] = 1.6e-4;  // a checkpoint may list a usual value
    EXPECT_NO_THROW(train::check_resumable("c", stored.dump(), train::checkpoint_settings({}, "x")));
}

/// A checkpoint from before there was --moments has 32 bits.
TEST(CheckpointSettings, WithoutMomentsHave32Bits) {
    RunOptions options;
    auto stored = train::checkpoint_settings(options, "x");
    EXPECT_EQ(stored["options"]["moments"], 16);
    stored["options"].erase("moments");
    expect_error<InputError>(
        [&] { train::check_resumable("c", stored.dump(), train::checkpoint_settings(options, "x")); },
        {"--moments 32", "16"});
    options.train.moment_bits = 32;
    EXPECT_NO_THROW(train::check_resumable("c", stored.dump(), train::checkpoint_settings(options, "x")));
}

TEST(CheckpointSettings, OfEarlierVersionsHaveTheirOwnNames) {
    RunOptions options;
    options.train.appearance = AppearanceModel::affine;
    const auto now = train::checkpoint_settings(options, "x");
    auto stored = now;
    stored["options"]["appearance"] = "none";
    stored["options"]["exposure"] = true;
    stored["options"]["smoothness"] = false;
    EXPECT_NO_THROW(train::check_resumable("c", stored.dump(), now));
    stored["options"]["exposure"] = false;
    expect_error<InputError>([&] { train::check_resumable("c", stored.dump(), now); },
                             {"--appearance \"none\", not \"affine\""});
    stored["options"]["exposure"] = true;
    stored["options"]["smoothness"] = 3;
    expect_error<InputError>([&] { train::check_resumable("c", stored.dump(), now); },
                             {"--smoothness 3, which this version of ewa lacks"});
}

TEST(TrainerRestore, RefusesMomentsOfOtherBits) {
    TrainOptions options;
    options.steps = 10;
    options.strategy = Strategy::none;
    const Gaussians start = shaken_start(small_capture(), 0.05, 1, 1);
    Trainer packed(device(), small_capture().dataset, split().train, start, options);
    options.moment_bits = 32;
    Trainer exact(device(), small_capture().dataset, split().train, start, options);
    EXPECT_EQ(packed.state().arrays.size() + 1, exact.state().arrays.size());
    expect_error<InputError>([&] { exact.restore(packed.state()); }, {"bits"});
    expect_error<InputError>([&] { packed.restore(exact.state()); }, {"bits"});
}

TEST(TrainerRestore, RefusesAnotherTrainersState) {
    TrainOptions options;
    options.steps = 10;
    options.strategy = Strategy::none;
    const Gaussians start = shaken_start(small_capture(), 0.05, 1, 1);
    Trainer trainer(device(), small_capture().dataset, split().train, start, options);
    const TrainerState state = trainer.state();
    TrainerState other = state;
    other.sh_degree = 0;
    expect_error<InputError>([&] { trainer.restore(other); }, {"SH degree"});
    other = state;
    other.report.step = 11;
    expect_error<InputError>([&] { trainer.restore(other); }, {"more steps"});
    other = state;
    other.arrays[1].bytes.pop_back();
    expect_error<InputError>([&] { trainer.restore(other); }, {"moments1"});
    other = state;
    other.arrays.pop_back();
    expect_error<InputError>([&] { trainer.restore(other); }, {"strategy"});
    trainer.restore(state);
    EXPECT_EQ(trainer.step().step, 1);
}

}  // namespace
}  // namespace ewa::test
