// SPDX-License-Identifier: Apache-2.0
// What photos are trained and shown over: their mean colour, with noise.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/json.h"
#include "ewa/run.h"
#include "ewa/trainer.h"
#include "gpu/test_device.h"
#include "support/shared_by_tests.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// A capture whose photos have one colour, and alpha if it is below 1.
void make_plain(Synthetic& out, const std::array<float, 3>& color, float alpha = 1) {
    make_synthetic(out, 40, 8, 48, 36, 7);
    for (const Frame& frame : out.dataset.frames) {
        Image photo(48, 36, alpha < 1 ? 4 : 3);
        for (size_t i = 0; i < photo.pixels.size(); ++i) {
            const size_t c = i % size_t(photo.channels);
            photo.pixels[i] = c < 3 ? color[c] : alpha;
        }
        save_image(frame.image_path, photo);
    }
    out.dataset = load_dataset(out.folder.path(), {});
}

/// The losses of 60 steps in which no splat is seen: mean |background - photo|.
std::vector<double> losses_over(double noise) {
    static const Synthetic* const black = [] {
        auto* made = new Synthetic;
        make_plain(*made, {0, 0, 0});
        return made;
    }();
    Gaussians far = gaussians_from_points({{{0, 500, 0}}, {{0, 0, 0}}}, 0);
    TrainOptions options = quick(60);
    options.loss = {1, 0, 0};
    options.render.background = {0.5f, 0.5f, 0.5f};
    options.background_noise = noise;
    Trainer trainer(device(), black->dataset, all_frames(black->dataset), std::move(far), options);
    std::vector<double> losses;
    for (int step = 0; step < 60; ++step) losses.push_back(trainer.step().loss);
    return losses;
}

TEST(Background, EachStepHasAColourNearIt) {
    for (const double loss : losses_over(0)) EXPECT_NEAR(loss, 0.5, 1e-5);
    // The mean of three uniform numbers of this width has the deviation width / 6.
    constexpr double kWidth = 0.4, kDeviation = kWidth / 6;
    const std::vector<double> losses = losses_over(kWidth);
    double mean = 0, square = 0;
    for (const double loss : losses) {
        EXPECT_LE(std::abs(loss - 0.5), 0.5 * kWidth + 1e-5);
        mean += loss / 60;
        square += (loss - 0.5) * (loss - 0.5) / 60;
    }
    EXPECT_NEAR(mean, 0.5, 4 * kDeviation / std::sqrt(60));
    EXPECT_NEAR(std::sqrt(square), kDeviation, 0.4 * kDeviation);
    EXPECT_EQ(losses, losses_over(kWidth));
}

/// A short run of the photos. Returns its config.json.
Json config_of(const Synthetic& data, RunOptions options, const fs::path& output) {
    options.dataset = data.folder.path();
    options.output = output;
    options.train.steps = 2;
    options.train.max_splats = 60;
    options.force = true;
    run_training(options);
    return core::read_json_file<Json>(output / "config.json");
}

TEST(Background, OfPhotosIsTheirMeanColour) {
    TempFolder folder;
    Synthetic opaque, transparent;
    make_plain(opaque, {0.2f, 0.4f, 0.8f});
    make_plain(transparent, {0.2f, 0.4f, 0.8f}, 0.6f);
    Json config = config_of(opaque, {}, folder / "o");
    EXPECT_EQ(config["background"], "0.2,0.4,0.8");
    EXPECT_EQ(config["background-noise"], 0.4);
    config = config_of(transparent, {}, folder / "o");
    EXPECT_EQ(config["background"], "0,0,0");
    EXPECT_FALSE(config.contains("background-noise"));

    // Masks leave the photos opaque.
    RunOptions options;
    options.masks = MaskUse::ignore;
    EXPECT_EQ(config_of(transparent, options, folder / "o")["background"], "0.2,0.4,0.8");

    options = {};
    options.train.render.points = true;
    EXPECT_EQ(config_of(opaque, options, folder / "o")["background"], "0,0,0");
    options = {};
    options.train.refine_poses = true;
    EXPECT_EQ(config_of(opaque, options, folder / "o")["background"], "0,0,0");
    options = {};
    options.train.render.background = {1, 1, 0};
    EXPECT_EQ(config_of(opaque, options, folder / "o")["background"], "1,1,0");
    options = {};
    options.train.random_background = true;
    EXPECT_EQ(config_of(opaque, options, folder / "o")["background"], "random");
}

/// A run of an earlier version was trained over black, and its checkpoint goes on so.
TEST(Background, OfACheckpointIsKept) {
    TempFolder folder;
    Synthetic data;
    make_plain(data, {0.2f, 0.4f, 0.8f});
    RunOptions options;
    options.automatic_background = false;
    EXPECT_EQ(config_of(data, options, folder / "o")["background"], "0,0,0");
    options.automatic_background = true;
    options.dataset = data.folder.path();
    options.output = folder / "o";
    options.resume = true;
    options.train.max_splats = 60;
    options.train.steps = 4;
    EXPECT_EQ(run_training(options).summary.steps, 4);
    EXPECT_EQ(core::read_json_file<Json>(folder / "o/config.json")["background"], "0,0,0");

    options.automatic_background = true;
    options.resume = false;
    options.force = true;
    run_training(options);
    options.force = false;
    options.resume = true;
    options.train.steps = 6;
    EXPECT_EQ(run_training(options).summary.steps, 6);
    EXPECT_EQ(core::read_json_file<Json>(folder / "o/config.json")["background"], "0.2,0.4,0.8");
}

}  // namespace
}  // namespace ewa::test
