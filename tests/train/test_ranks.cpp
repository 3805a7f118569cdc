// SPDX-License-Identifier: Apache-2.0
// Training by several ranks: files, figures, memory and refusals. test_divided.cpp compares bytes.
#include <gtest/gtest.h>

#include <zlib.h>

#include <algorithm>
#include <numeric>

#include "ewa/error.h"
#include "ewa/renderer.h"
#include "portions/collect.h"
#include "portions/portions.h"
#include "support/temp_folder.h"
#include "train/checkpoint.h"
#include "train/divided.h"

namespace ewa::test {
namespace {

TrainerState trained(const TrainOptions& options, int ranks, int until,
                     const Dataset& dataset = seven_views().dataset) {
    return train_divided(options, divided_start(), {ranks}, until, dataset).state;
}

/// As devices of other ranks may have more or less memory.
TEST(Ranks, TrainUpToTheCapOfTheFirst) {
    run_ranks(2, [&](std::shared_ptr<Ranks> group) {
        TrainOptions options = busy(Strategy::mcmc, 2);
        options.max_splats = kAutomaticMaxSplats;
        options.least_max_splats = group->rank() == 0 ? 5000 : 6000;
        const Dataset& dataset = seven_views().dataset;
        Trainer trainer(open_test_device(false), dataset, all_frames(dataset), divided_start(), options,
                        group);
        EXPECT_EQ(trainer.max_splats(), 5000u);
        if (group->rank() != 0) trainer.follow();
    });
}

/// The file after `until` steps of so many ranks. resume: a checkpoint where they begin.
std::string checkpoint_of(const TrainOptions& options, int ranks, int until,
                          const std::filesystem::path& path, const std::filesystem::path& resume = {}) {
    run_ranks(ranks, [&](std::shared_ptr<Ranks> group) {
        const auto own = open_test_device(false);
        Trainer trainer(own, seven_views().dataset, all_frames(seven_views().dataset), divided_start(),
                        options, group);
        if (group->rank() != 0) return trainer.follow();
        if (!resume.empty()) {
            train::CheckpointReader reader(resume);
            trainer.restore(reader);
        }
        while (trainer.steps_done() < until) trainer.step();
        train::CheckpointWriter writer(path, "settings", "metrics");
        trainer.save(writer);
        writer.commit();
    });
    return file_bytes(path);
}

TEST(Ranks, WriteTheSameCheckpointAndContinueFromIt) {
    TempFolder folder;
    for (const Strategy strategy : {Strategy::adc, Strategy::mcmc}) {
        const TrainOptions options = busy(strategy, 4);
        const std::string half = checkpoint_of(options, 1, 28, folder / "half");
        EXPECT_TRUE(checkpoint_of(options, 2, 28, folder / "two") == half);
        EXPECT_TRUE(checkpoint_of(options, 3, 28, folder / "three") == half);
        const std::string whole = checkpoint_of(options, 1, options.steps, folder / "one");
        EXPECT_TRUE(checkpoint_of(options, 2, options.steps, folder / "resumed", folder / "three") == whole);
        EXPECT_TRUE(checkpoint_of(options, 3, options.steps, folder / "again", folder / "two") == whole);
    }
}

TEST(Ranks, HandOnBytesInPieces) {
    const std::vector<uint64_t> sizes{3, (uint64_t(9) << 20) + 5, 0, uint64_t(4) << 20};
    std::vector<std::byte> all;
    for (uint64_t size = std::accumulate(sizes.begin(), sizes.end(), uint64_t(0)), i = 0; i < size; ++i)
        all.push_back(std::byte((i * i) >> 7));
    const auto* data = reinterpret_cast<const Bytef*>(all.data());
    run_ranks(int(sizes.size()), [&](std::shared_ptr<Ranks> group) {
        const size_t rank = size_t(group->rank());
        const uint64_t first = std::accumulate(sizes.begin(), sizes.begin() + group->rank(), uint64_t(0));
        const std::span<const std::byte> own = std::span(all).subspan(first, sizes[rank]);
        size_t taken = 0;
        portions::hand_out(
            *group, sizes,
            [&](uint64_t offset, std::span<std::byte> into) {
                EXPECT_EQ(rank, 0u);
                EXPECT_LE(into.size(), size_t(4) << 20);
                std::copy_n(all.begin() + std::ptrdiff_t(offset), into.size(), into.begin());
            },
            [&](size_t part, const std::vector<std::byte>& bytes) {
                EXPECT_EQ(part, rank);
                EXPECT_TRUE(std::ranges::equal(bytes, own));
                ++taken;
            });
        EXPECT_EQ(taken, 1u);
        std::vector<std::byte> joined;
        portions::pass_on(
            *group, own,
            [&](uint64_t bytes, uint32_t checksum) {
                EXPECT_EQ(bytes, all.size());
                EXPECT_EQ(checksum, crc32_z(0, data, all.size()));
            },
            [&](std::span<const std::byte> piece) {
                EXPECT_LE(piece.size(), size_t(4) << 20);
                joined.insert(joined.end(), piece.begin(), piece.end());
            });
        EXPECT_TRUE(rank == 0 ? joined == all : joined.empty());
    });
}

TEST(Bands, ARunMayContinueWithAnotherNumberOfRanks) {
    TempFolder folder;
    for (const Strategy strategy : {Strategy::adc, Strategy::mcmc}) {
        TrainOptions options = busy(strategy, 2);
        options.bands = 2;
        const std::string whole = checkpoint_of(options, 2, options.steps, folder / "whole");
        checkpoint_of(options, 4, 28, folder / "half");
        EXPECT_TRUE(checkpoint_of(options, 3, options.steps, folder / "rest", folder / "half") == whole);
    }
}

/// The first step sees the same splats. Its loss and error are those of the whole view, but for rounding.
TEST(Bands, HaveTheLossAndTheErrorOfTheirView) {
    for (const Dataset* dataset : {&seven_views().dataset, &masked_capture()})
        for (const int batch : {1, 3}) {
            TrainOptions options = busy(Strategy::none, batch);
            const StepReport whole = trained(options, 1, 1, *dataset).report;
            for (const int bands : {2, 3}) {
                options.bands = bands;
                const StepReport cut_up = trained(options, 2, 1, *dataset).report;
                EXPECT_NEAR(cut_up.loss, whole.loss, 2e-6);
                EXPECT_NEAR(cut_up.psnr, whole.psnr, 1e-4);
            }
        }
}

TEST(Bands, TrainTheSameScene) {
    TrainOptions options = busy(Strategy::none, 1);
    const StepReport whole = trained(options, 1, 60).report;
    options.bands = 3;
    const StepReport cut_up = trained(options, 1, 60).report;
    EXPECT_NEAR(cut_up.psnr, whole.psnr, 0.05);
}

TEST(Ranks, EachHoldsItsShareOfTheState) {
    const TrainOptions options = busy(Strategy::adc, 3);
    for (const int ranks : {1, 3}) {
        std::vector<RankFigures> figures;
        uint64_t state = 0;
        run_ranks(ranks, [&](std::shared_ptr<Ranks> group) {
            const auto own = open_test_device(false);
            Trainer trainer(own, seven_views().dataset, all_frames(seven_views().dataset), divided_start(),
                            options, group);
            if (group->rank() != 0) return trainer.follow();
            while (trainer.steps_done() < 30) trainer.step();
            figures = trainer.rank_figures();
            for (const TrainerArray& array : trainer.state().arrays)
                if (array.name != "origin") state += array.bytes.size();
        });
        ASSERT_EQ(figures.size(), ranks == 1 ? 0u : 3u);
        for (const RankFigures& figure : figures) {
            EXPECT_LT(figure.own_bytes, 0.4 * double(state));
            EXPECT_GT(figure.own_bytes, 0.1 * double(state));
            // A visible splat is 48 bytes one way and 36 back. Two thirds of them go to other ranks.
            EXPECT_GT(figure.sent_bytes, 84 * 20.0);
            EXPECT_LT(figure.sent_bytes, 84 * 900.0);
            EXPECT_GT(figure.exchange, 0);
            EXPECT_GT(figure.peak_device_bytes, figure.own_bytes);
        }
    }
}

TEST(Ranks, DrawThePicturesOfARenderer) {
    for (const int ranks : {1, 3}) {
        std::vector<Image> drawn, expected;
        // One that is alone draws them too, where its steps have one view.
        const TrainOptions options = busy(Strategy::adc, ranks == 1 ? 1 : 2);
        run_ranks(ranks, [&](std::shared_ptr<Ranks> group) {
            const auto own = open_test_device(false);
            Trainer trainer(own, seven_views().dataset, all_frames(seven_views().dataset), divided_start(),
                            options, group);
            if (group->rank() != 0) return trainer.follow();
            while (trainer.steps_done() < 30) trainer.step();
            std::vector<Camera> cameras;
            for (const Frame& frame : seven_views().dataset.frames) cameras.push_back(frame.camera);
            // One that sees nothing, between others.
            cameras[4].rotation = glm::dmat3(-1, 0, 0, 0, 1, 0, 0, 0, -1) * cameras[4].rotation;
            cameras[4].translation = glm::dvec3(0, 0, -1e4);
            drawn = trainer.render(cameras);
            EXPECT_TRUE(trainer.render({}).empty());
            Renderer renderer(own, trainer.gaussians(), options.render);
            for (const Camera& camera : cameras) expected.push_back(renderer.render(camera).color);
            trainer.step();  // the training continues
        });
        ASSERT_EQ(drawn.size(), expected.size());
        for (size_t i = 0; i < drawn.size(); ++i) EXPECT_TRUE(drawn[i].pixels == expected[i].pixels) << i;
    }
}

TEST(Ranks, EachHoldsItsRange) {
    for (const uint32_t all : {8u, 9u, 64u, 100u, 1000003u})
        for (const int ranks : {1, 2, 3, 7, 64}) {
            uint32_t next = 0;
            for (int rank = 0; rank < ranks; ++rank) {
                const portions::Range range = portions::range_of(all, rank, ranks);
                EXPECT_EQ(range.first, next);
                EXPECT_EQ(range.first % shared::PARAM_BLOCK == 0 || range.splats == 0, true);
                EXPECT_LE(range.splats, all / uint32_t(ranks) + 2 * shared::PARAM_BLOCK);
                next += range.splats;
            }
            EXPECT_EQ(next, all);
        }
}

TEST(Ranks, AreRefusedWhatTheyCannotDo) {
    const auto message = [&](void (*change)(TrainOptions&)) {
        TrainOptions options = busy(Strategy::none, 1);
        change(options);
        try {
            trained(options, 2, 1);
        } catch (const std::exception& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    const auto begins = [](const std::string& text, const std::string& with) {
        EXPECT_TRUE(text.starts_with(with)) << text;
    };
    begins(message([](TrainOptions& o) { o.render.points = true; }),
           "several ranks and --points exclude each other: ");
    begins(message([](TrainOptions& o) { o.refine_poses = true; }),
           "several ranks and --refine-poses exclude each other: ");
    TrainOptions options = busy(Strategy::none, 1);
    options.bands = 49;
    try {
        trained(options, 1, 1);
        ADD_FAILURE() << "there are 48 rows";
    } catch (const InputError& error) {
        EXPECT_EQ(std::string(error.what())
                      .find("--bands 49: an image with 48 rows of pixels takes at most --bands "),
                  0u)
            << error.what();
    }
    // 300 splats are 38 blocks.
    EXPECT_THROW(portions::check_portions(300, 39), RunError);
    EXPECT_NO_THROW(portions::check_portions(300, 38));
}

}  // namespace
}  // namespace ewa::test
