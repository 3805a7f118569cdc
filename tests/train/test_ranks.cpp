// SPDX-License-Identifier: Apache-2.0
// Training by several ranks: the bytes of one that trains alone, and no more memory than a share.
#include <gtest/gtest.h>

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "ewa/error.h"
#include "ewa/renderer.h"
#include "ewa/trainer.h"
#include "gpu/test_device.h"
#include "portions/collect.h"
#include "portions/portions.h"
#include "support/temp_folder.h"
#include "support/thread_ranks.h"
#include "train/checkpoint.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

Gaussians start() {
    Gaussians splats = seven_views().truth;
    for (size_t i = 0; i < splats.size(); ++i) {
        splats.means[3 * i] += 0.05f;
        splats.opacity_logits[i] = i % 5 == 0 ? -3.0f : -1.0f;
    }
    return splats;
}

/// The same capture with a mask that excludes columns of each image, and rows of some.
const Dataset& masked_capture() {
    static const Dataset* const made = [] {
        static Synthetic data;
        make_synthetic(data, 300, 7, 64, 48, 11);
        std::filesystem::create_directories(data.folder / "masks");
        for (size_t i = 0; i < data.dataset.frames.size(); ++i) {
            Image mask(64, 48, 3);
            for (int y = 0; y < 48; ++y)
                for (int x = 0; x < 64; ++x)
                    for (int c = 0; c < 3; ++c)
                        mask.at(x, y)[c] = (x >= 18 && x < 28) || (i % 3 == 1 && y >= 20) ? 0.0f : 1.0f;
            save_image(data.folder / "masks" / data.dataset.frames[i].name, mask);
        }
        return new Dataset(load_dataset(data.folder.path(), {}));
    }();
    return *made;
}

/// The state after training by so many ranks.
TrainerState trained(const TrainOptions& options, int ranks, int until,
                     const Dataset& dataset = seven_views().dataset) {
    TrainerState result;
    run_ranks(ranks, [&](std::shared_ptr<Ranks> group) {
        const auto own = open_test_device(false);
        Trainer trainer(own, dataset, all_frames(dataset), start(), options, group);
        if (group->rank() != 0) return trainer.follow();
        while (trainer.steps_done() < until) trainer.step();
        trainer.keep_waiting();
        result = trainer.state();
        const Gaussians splats = trainer.gaussians();
        EXPECT_EQ(splats.size(), trainer.splats());
        const auto& params = result.arrays.front().bytes;
        float first;
        std::memcpy(&first, params.data(), sizeof(first));
        EXPECT_EQ(splats.means.front(), first);
    });
    return result;
}

void expect_same(const TrainerState& a, const TrainerState& b) {
    EXPECT_EQ(a.report.step, b.report.step);
    EXPECT_EQ(a.report.splats, b.report.splats);
    EXPECT_EQ(a.report.loss, b.report.loss);
    EXPECT_EQ(a.report.psnr, b.report.psnr);
    EXPECT_EQ(a.report.limited_steps, b.report.limited_steps);
    EXPECT_EQ(a.report.dropped_updates, b.report.dropped_updates);
    EXPECT_EQ(a.report.skipped_nonfinite, b.report.skipped_nonfinite);
    ASSERT_EQ(a.arrays.size(), b.arrays.size());
    for (size_t i = 0; i < a.arrays.size(); ++i) {
        EXPECT_EQ(a.arrays[i].name, b.arrays[i].name);
        EXPECT_TRUE(a.arrays[i].bytes == b.arrays[i].bytes) << a.arrays[i].name;
    }
}

/// As devices of other ranks may have more or less memory.
TEST(Ranks, TrainUpToTheCapOfTheFirst) {
    run_ranks(2, [&](std::shared_ptr<Ranks> group) {
        TrainOptions options = busy(Strategy::mcmc, 2);
        options.max_splats = kAutomaticMaxSplats;
        options.least_max_splats = group->rank() == 0 ? 5000 : 6000;
        const Dataset& dataset = seven_views().dataset;
        Trainer trainer(open_test_device(false), dataset, all_frames(dataset), start(), options, group);
        EXPECT_EQ(trainer.max_splats(), 5000u);
        if (group->rank() != 0) trainer.follow();
    });
}

struct RanksCase {
    Strategy strategy;
    int batch, ranks;
    void (*change)(TrainOptions&) = nullptr;
    const char* name = "";
};
void wide_moments(TrainOptions& options) {
    options.moment_bits = 32;
}
void absolute_density(TrainOptions& options) {
    options.absolute_gradients = true;
    options.render.kernel = Footprint::density;
    options.grow_gradient_absolute = 1e-5;
}
void antialiased(TrainOptions& options) {
    options.render.kernel = Footprint::antialias;
    options.random_background = true;
}

void exposed_photos(TrainOptions& options) {
    options.appearance = AppearanceModel::affine;
}
template <AppearanceModel model>
void with_model(TrainOptions& options) {
    options.appearance = model;
}
void with_squares(TrainOptions& options) {
    options.loss = {0.5, 2, 0.1};
    options.bands = 2;
}
void without_similarity(TrainOptions& options) {
    options.loss = {1, 0, 0};
}
void under_sky(TrainOptions& options) {
    options.sky = true;
}
void under_sky_with_model(TrainOptions& options) {
    options.sky = true;
    options.appearance = AppearanceModel::ppisp;
}
void fewer(TrainOptions& options) {
    options.final_splats = 250;
}
void fewer_in_bands(TrainOptions& options) {
    options.bands = 2;
    options.render.kernel = Footprint::density;
    fewer(options);
}
template <int bands>
void cut(TrainOptions& options) {
    options.bands = bands;
}
void cut_absolute(TrainOptions& options) {
    absolute_density(options);
    options.bands = 2;
}

std::string name_of_case(const testing::TestParamInfo<RanksCase>& tested) {
    const char* names[] = {"none", "adc", "mcmc"};
    std::string name = names[int(tested.param.strategy)];
    return name + tested.param.name + "_batch" + std::to_string(tested.param.batch) + "_ranks" +
           std::to_string(tested.param.ranks);
}

class RanksTrain : public testing::TestWithParam<RanksCase> {};

TEST_P(RanksTrain, TheBytesOfOneRank) {
    const auto& [strategy, batch, ranks, change, name] = GetParam();
    TrainOptions options = busy(strategy, batch);
    if (change) change(options);
    const TrainerState alone = trained(options, 1, options.steps);
    EXPECT_EQ(alone.report.splats == start().size(), strategy == Strategy::none && options.final_splats == 0)
        << "the number of splats should change";
    expect_same(trained(options, ranks, options.steps), alone);
}

INSTANTIATE_TEST_SUITE_P(
    Ranks, RanksTrain,
    testing::Values(
        RanksCase{Strategy::adc, 4, 2}, RanksCase{Strategy::adc, 4, 3}, RanksCase{Strategy::adc, 3, 5},
        RanksCase{Strategy::adc, 1, 2}, RanksCase{Strategy::adc, 2, 2, wide_moments, "_wide"},
        RanksCase{Strategy::adc, 1, 2, absolute_density, "_absolute_density"},
        RanksCase{Strategy::adc, 2, 3, antialiased, "_antialiased"}, RanksCase{Strategy::mcmc, 4, 2},
        RanksCase{Strategy::mcmc, 3, 4}, RanksCase{Strategy::mcmc, 1, 3},
        RanksCase{Strategy::mcmc, 2, 2, wide_moments, "_wide"},
        RanksCase{Strategy::mcmc, 2, 3, absolute_density, "_absolute_density"},
        RanksCase{Strategy::none, 2, 2}, RanksCase{Strategy::adc, 4, 3, exposed_photos, "_exposure"},
        RanksCase{Strategy::mcmc, 1, 2, exposed_photos, "_exposure"},
        RanksCase{Strategy::adc, 3, 2, with_model<AppearanceModel::ppisp>, "_ppisp"},
        RanksCase{Strategy::mcmc, 1, 2, with_model<AppearanceModel::ppisp>, "_ppisp"},
        RanksCase{Strategy::mcmc, 2, 3, with_model<AppearanceModel::grid>, "_grid"},
        RanksCase{Strategy::adc, 2, 3, with_squares, "_squares"},
        RanksCase{Strategy::mcmc, 2, 2, without_similarity, "_without_ssim"},
        RanksCase{Strategy::adc, 3, 2, under_sky, "_sky"}, RanksCase{Strategy::mcmc, 1, 2, under_sky, "_sky"},
        RanksCase{Strategy::mcmc, 2, 3, under_sky_with_model, "_sky_ppisp"},
        RanksCase{Strategy::none, 1, 4, wide_moments, "_wide"},
        RanksCase{Strategy::adc, 1, 2, fewer, "_fewer"}, RanksCase{Strategy::none, 3, 3, fewer, "_fewer"},
        RanksCase{Strategy::mcmc, 2, 4, fewer_in_bands, "_fewer"},
        RanksCase{Strategy::adc, 1, 2, cut<2>, "_bands2"}, RanksCase{Strategy::adc, 2, 3, cut<2>, "_bands2"},
        RanksCase{Strategy::adc, 1, 5, cut<3>, "_bands3"},
        RanksCase{Strategy::adc, 1, 3, cut_absolute, "_bands2_absolute"},
        RanksCase{Strategy::mcmc, 1, 4, cut<3>, "_bands3"},
        RanksCase{Strategy::mcmc, 3, 2, cut<3>, "_bands3"},
        RanksCase{Strategy::mcmc, 4, 8, cut<2>, "_bands2"}),
    name_of_case);

/// The file after `until` steps of so many ranks. resume: a checkpoint where they begin.
std::string checkpoint_of(const TrainOptions& options, int ranks, int until,
                          const std::filesystem::path& path, const std::filesystem::path& resume = {}) {
    run_ranks(ranks, [&](std::shared_ptr<Ranks> group) {
        const auto own = open_test_device(false);
        Trainer trainer(own, seven_views().dataset, all_frames(seven_views().dataset), start(), options,
                        group);
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

TEST(Bands, OfMaskedImagesHaveTheBytesOfOneRank) {
    TrainOptions options = busy(Strategy::adc, 2);
    options.steps = 24;
    options.bands = 3;
    const TrainerState alone = trained(options, 1, 24, masked_capture());
    expect_same(trained(options, 4, 24, masked_capture()), alone);
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
            Trainer trainer(own, seven_views().dataset, all_frames(seven_views().dataset), start(), options,
                            group);
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
            Trainer trainer(own, seven_views().dataset, all_frames(seven_views().dataset), start(), options,
                            group);
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

TEST(Ranks, ABatchThatDoesNotDivideTheStepsEndsWithASmallerOne) {
    TrainOptions options = busy(Strategy::none, 7);
    options.steps = 17;
    const TrainerState state = trained(options, 1, 17);
    EXPECT_EQ(state.report.step, 17);
    expect_same(trained(options, 2, 17), state);
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
