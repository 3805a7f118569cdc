// SPDX-License-Identifier: Apache-2.0
// --robust: what single images show and the others do not is found and masked.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "ewa/error.h"
#include "ewa/run.h"
#include "ewa/trainer.h"
#include "gpu/test_device.h"
#include "prepare/passers_by.h"
#include "support/temp_folder.h"
#include "support/thread_ranks.h"
#include "train/checkpoint.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 120, kHeight = 90;  // of the compared images

/// An image, and a render with errors of about 0.02.
struct Pair {
    Image image{kWidth, kHeight, 3}, render{kWidth, kHeight, 3};

    explicit Pair(uint64_t seed) {
        Random random(seed);
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x)
                for (size_t c = 0; c < 3; ++c) {
                    image.at(x, y)[c] = float(0.5 + 0.2 * std::sin(0.2 * x + double(c)) * std::cos(0.15 * y));
                    render.at(x, y)[c] = image.at(x, y)[c] + float(0.025 * random.normal());
                }
    }
    /// Adds to the image's values.
    template <class Value>
    void add(const Value& value) {
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x)
                for (size_t c = 0; c < 3; ++c) image.at(x, y)[c] += float(value(x, y));
    }
    train::Residual residual(const Image& weights = {}) const {
        return train::residual_of(image, weights, render);
    }
};

double block(int x, int y, int left, int top, int width, int height, double value) {
    return x >= left && x < left + width && y >= top && y < top + height ? value : 0;
}

/// A person of 24x40 px with a hole of 2x2 px.
double person(int x, int y) {
    return block(x, y, 40, 30, 24, 40, 0.5) - block(x, y, 50, 50, 2, 2, 0.5);
}

double black_pixels(const Image& mask) {
    return double(std::ranges::count(mask.pixels, 0.0f));
}

TEST(PassersBy, AreFoundWithTheirBorderAndWithoutHoles) {
    std::vector<train::Residual> residuals;
    for (uint64_t i = 0; i < 5; ++i) {
        Pair pair(i);
        if (i == 2) pair.add(person);
        residuals.push_back(pair.residual());
    }
    const std::vector<Image> masks = train::passers_by(residuals);
    ASSERT_EQ(masks.size(), 5u);
    for (const size_t i : {0, 1, 3, 4}) EXPECT_TRUE(masks[i].pixels.empty()) << i;
    const Image& mask = masks[2];
    ASSERT_EQ(mask.width, kWidth);
    ASSERT_EQ(mask.height, kHeight);
    for (int y = 30; y < 70; ++y)
        for (int x = 40; x < 64; ++x) EXPECT_EQ(*mask.at(x, y), 0) << x << " " << y;
    // A border of at most 2 px.
    EXPECT_LE(black_pixels(mask), 28 * 44);
}

/// Glare is a wide gradient; a spot is smaller than 0.2 % of the image.
TEST(PassersBy, GlareSpotsAndExposureAreNone) {
    std::vector<train::Residual> residuals;
    for (uint64_t i = 0; i < 6; ++i) {
        Pair pair(i);
        if (i == 1)
            pair.add([](int x, int y) {
                return 0.6 * std::exp(-(std::pow(x - 60, 2) + std::pow(y - 45, 2)) / (2 * 18 * 18));
            });
        if (i == 2) pair.add([](int x, int y) { return block(x, y, 30, 30, 2, 2, 0.6); });
        if (i == 3)
            for (float& value : pair.image.pixels) value = 0.6f * value + 0.1f;
        residuals.push_back(pair.residual());
    }
    for (const Image& mask : train::passers_by(residuals)) EXPECT_TRUE(mask.pixels.empty());
    // Without the rule for glare, it would be: the same error that ends abruptly is.
    Pair pair(9);
    pair.add([](int x, int y) { return std::hypot(x - 60, y - 45) < 22 ? 0.6 : 0; });
    residuals.push_back(pair.residual());
    EXPECT_GT(black_pixels(train::passers_by(residuals).back()), 300);
}

TEST(PassersBy, PixelsThatDoNotCountHideThem) {
    std::vector<train::Residual> residuals;
    for (uint64_t i = 0; i < 3; ++i) residuals.push_back(Pair(i).residual());
    Pair pair(4);
    pair.add(person);
    Image weights(kWidth, kHeight, 1);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) *weights.at(x, y) = person(x, y) == 0 ? 1.0f : 0.0f;
    residuals.push_back(pair.residual(weights));
    EXPECT_TRUE(train::passers_by(residuals).back().pixels.empty());
    // Nothing counts.
    std::ranges::fill(weights.pixels, 0.0f);
    EXPECT_TRUE(train::passers_by({pair.residual(weights)}).back().pixels.empty());
}

/// A capture of 21 training images, in which a striped board stands in 14.
struct Visited {
    static constexpr int kViews = 28, kColumns = 80, kRows = 60;
    Synthetic made;
    std::vector<int> visited;  // frames

    static double on_board(int frame, int x, int y) {
        return block(x, y, 12 + frame * 7 % 40, 10 + frame % 15, 14, 30, 1);
    }
    explicit Visited(bool board) {
        make_synthetic(made, 250, kViews, kColumns, kRows, 11);
        for (int i = 1; i < kViews && board; i += 2) {
            Image image = load_image(made.dataset.frames[size_t(i)].image_path);
            for (int y = 0; y < kRows; ++y)
                for (int x = 0; x < kColumns; ++x) {
                    if (on_board(i, x, y) == 0) continue;
                    const float color[]{y / 5 % 2 == 0 ? 1.0f : 0.1f, 0.15f, 0.9f};
                    std::copy_n(color, 3, image.at(x, y));
                }
            save_image(made.dataset.frames[size_t(i)].image_path, image);
            visited.push_back(i);
        }
    }
    RunOptions run(const fs::path& output, bool robust) const {
        RunOptions options;
        options.dataset = made.folder.path();
        options.output = output;
        options.train.steps = 250;
        options.train.seed = 3;
        options.test_every = 4;
        options.robust = robust;
        return options;
    }
};

const Visited& visited() {
    static const Visited made(true);
    return made;
}

struct Notes : RunObserver {
    void on_note(const std::string& line) override { lines.push_back(line); }
    bool should_stop() override { return asked++ >= stop_at; }
    int asked = 0, stop_at = 1 << 30;
    std::vector<std::string> lines;
};

TEST(Robust, LeavesOutWhatSingleImagesShow) {
    TempFolder folder;
    const Visited& data = visited();
    const double plain = *run_training(data.run(folder / "plain", false)).summary.test_psnr;
    Notes notes;
    const RunResult robust = run_training(data.run(folder / "robust", true), notes);
    EXPECT_GT(*robust.summary.test_psnr, plain + 1);
    EXPECT_FALSE(fs::exists(folder / "plain/passers_by"));
    double board = 0, found = 0, wrong = 0;  // pixels
    for (int i = 0; i < Visited::kViews; ++i) {
        const fs::path file =
            folder / "robust/passers_by" / data.made.dataset.frames[size_t(i)].image_path.filename();
        const bool shown = std::ranges::count(data.visited, i) > 0;
        EXPECT_TRUE(!shown || fs::exists(file)) << file;
        if (!fs::exists(file)) continue;
        const Image mask = load_image(file);
        ASSERT_EQ(mask.width, Visited::kColumns);
        for (int y = 0; y < Visited::kRows; ++y)
            for (int x = 0; x < Visited::kColumns; ++x) {
                const double here = shown ? Visited::on_board(i, x, y) : 0;
                const double black = 1 - double(*mask.at(x, y));
                board += here;
                found += here * black;
                wrong += (1 - here) * black;
            }
    }
    EXPECT_GT(found, 0.97 * board);
    EXPECT_LT(wrong, board);  // a border of 2 px is half of such a board
    EXPECT_TRUE(std::ranges::any_of(notes.lines, [](const std::string& line) {
        return line.find("% of the training images' pixels are masked, in 1") != std::string::npos;
    }));
    EXPECT_NE(file_bytes(folder / "robust/report.html").find("Masked by --robust"), std::string::npos);
}

TEST(Robust, LeavesAlmostNothingOutWhereImagesAgree) {
    TempFolder folder;
    const Visited data(false);
    RunOptions plain = data.run(folder / "plain", false);
    plain.automatic_background = false;  // as with robust
    run_training(plain);
    Notes notes;
    run_training(data.run(folder / "robust", true), notes);
    EXPECT_TRUE(std::ranges::count(notes.lines, "robust: the images agree, and nothing is masked") == 1);
    EXPECT_EQ(file_bytes(folder / "robust/splats.ply"), file_bytes(folder / "plain/splats.ply"));
}

constexpr int kFewestSteps = 150;  // with a scout, which takes 300 here

TEST(Robust, AShortRunHasNoScout) {
    TempFolder folder;
    RunOptions plain = visited().run(folder / "plain", false),
               robust = visited().run(folder / "robust", true);
    plain.train.steps = robust.train.steps = kFewestSteps - 1;
    plain.automatic_background = false;  // as with robust
    run_training(plain);
    Notes notes;
    run_training(robust, notes);
    EXPECT_EQ(std::ranges::count(
                  notes.lines,
                  "robust: nothing is masked, since 149 steps are too few to find what only one image "
                  "shows; 150 are enough"),
              1);
    EXPECT_EQ(file_bytes(folder / "robust/splats.ply"), file_bytes(folder / "plain/splats.ply"));
}

TEST(Robust, ContinuesWithTheMasksOfItsFolder) {
    TempFolder folder;
    RunOptions whole = visited().run(folder / "whole", true), cut = visited().run(folder / "cut", true);
    whole.train.steps = cut.train.steps = kFewestSteps;
    run_training(whole);
    cut.resume = true;
    Notes early;  // stops while the masks are looked for
    early.stop_at = 100;
    EXPECT_EQ(run_training(cut, early).summary.steps, 0);
    EXPECT_FALSE(fs::exists(folder / "cut/passers_by"));
    Notes later;
    later.stop_at = 340;
    const RunResult some = run_training(cut, later);
    EXPECT_TRUE(some.summary.interrupted);
    ASSERT_GT(some.summary.steps, 0);

    const fs::path mask = fs::directory_iterator(folder / "cut/passers_by")->path();
    const std::string bytes = file_bytes(mask);
    fs::remove(mask);
    expect_error<InputError>(
        [&] { run_training(cut); },
        {"checkpoint.ewa", "the masks of --robust beside it, in passers_by/, have changed"});
    folder.write(mask, bytes);
    Notes last;
    run_training(cut, last);
    EXPECT_FALSE(std::ranges::any_of(last.lines, [](const std::string& line) {
        return line.find("find what images") != std::string::npos;
    }));
    EXPECT_EQ(file_bytes(folder / "cut/splats.ply"), file_bytes(folder / "whole/splats.ply"));
    EXPECT_EQ(ewa::train::read_checkpoint_head(folder / "cut/checkpoint.ewa").settings,
              ewa::train::read_checkpoint_head(folder / "whole/checkpoint.ewa").settings);

    RunOptions other = cut;
    other.robust = false;
    expect_error<InputError>([&] { run_training(other); }, {"--robust true, not false"});
}

/// The other rank has no folder, whether the masks are looked for or come from the checkpoint.
TEST(Robust, RanksHaveTheSameMasks) {
    TempFolder folder;
    const auto train = [&](const char* name, int ranks, int last_step) {
        run_ranks(ranks, [&](std::shared_ptr<Ranks> group) {
            RunOptions options = visited().run(folder / name, true);
            options.train.steps = kFewestSteps;
            options.train.batch = 2;
            options.train.bands = 2;
            options.resume = true;
            options.ranks = group;
            struct Stops : RunObserver {
                bool should_stop() override { return step >= last; }
                void on_step(const StepReport& report) override { step = report.step; }
                int step = 0, last = 0;
            } stops;
            stops.last = last_step;
            run_training(options, stops);
        });
    };
    train("one", 1, 1000);
    train("two", 2, 20);
    train("two", 2, 1000);
    EXPECT_EQ(file_bytes(folder / "two/splats.ply"), file_bytes(folder / "one/splats.ply"));
}

TEST(Robust, ALimitOfTheDevicesMemoryHoldsForBothTrainings) {
    TempFolder folder;
    RunOptions usual = visited().run(folder / "usual", true),
               limited = visited().run(folder / "limited", true);
    usual.train.steps = limited.train.steps = kFewestSteps;
    limited.train.device_memory_bytes = uint64_t(1) << 30;
    run_training(usual);
    run_training(limited);
    EXPECT_EQ(file_bytes(folder / "limited/splats.ply"), file_bytes(folder / "usual/splats.ply"));
}

TEST(Robust, IsNotForSpheres) {
    TempFolder folder;
    RunOptions options = visited().run(folder / "o", true);
    options.train.render.points = true;
    expect_error<InputError>([&] { run_training(options); }, {"--robust", "--points"});
}

/// Where everything is masked, no splat is added, and with one strategy without regularisers none moves.
TEST(Robust, WhatIsLeftOutAddsNoSplats) {
    const auto splats = [](bool masked) {
        Dataset dataset = seven_views().dataset;
        const auto black = std::make_shared<const Image>(2, 2, 1);
        for (Frame& frame : dataset.frames)
            if (masked) frame.left_out = black;
        TrainOptions options = busy(Strategy::adc, 1);
        options.opacity_reset_every = 0;
        Trainer trainer(device(), dataset, all_frames(dataset), shaken_start(seven_views(), 0.1, 5, 1),
                        options);
        const uint32_t before = trainer.splats();
        while (trainer.steps_done() < 45) trainer.step();
        return std::pair(before, trainer.splats());
    };
    const auto [open_before, open_after] = splats(false);
    EXPECT_GT(open_after, open_before + 20);
    const auto [before, after] = splats(true);
    EXPECT_EQ(after, before);
}

/// The file's alpha cuts, weighs or is unused. A left-out part never counts.
TEST(Robust, AMaskOfItsOwnKeepsTheUseOfAlpha) {
    TempFolder folder;
    Image image(8, 4, 4);
    for (int i = 0; i < 32; ++i) {
        float* pixel = &image.pixels[size_t(4 * i)];
        pixel[0] = pixel[1] = pixel[2] = 1;
        pixel[3] = i % 8 < 4 ? 0.0f : 1.0f;  // the left half is transparent
    }
    Frame frame;
    frame.image_path = folder / "image.png";
    save_image(frame.image_path, image);
    frame.camera.width = frame.source.width = 8;
    frame.camera.height = frame.source.height = 4;
    auto mask = std::make_shared<Image>(2, 2, 1);
    mask->pixels = {1, 0, 1, 1};  // the upper right quarter is masked
    frame.left_out = mask;
    EXPECT_TRUE(frame.alpha_weighs());
    const auto values = [&](MaskUse use, int x, int y) {
        frame.masks = use;
        const TrainingImage seen = load_training_image(frame, {0.5f, 0.5f, 0.5f});
        return std::pair(*seen.image.at(x, y), *seen.weights.at(x, y));
    };
    for (const MaskUse use : {MaskUse::ignore, MaskUse::cut, MaskUse::none}) {
        EXPECT_EQ(values(use, 6, 0), std::pair(1.0f, 0.0f));
        EXPECT_EQ(values(use, 6, 3), std::pair(1.0f, 1.0f));
    }
    EXPECT_EQ(values(MaskUse::ignore, 1, 3).second, 0);
    EXPECT_EQ(values(MaskUse::cut, 1, 3).second, 0);
    EXPECT_EQ(values(MaskUse::none, 1, 3), std::pair(1.0f, 1.0f));
    frame.behind = {0.25f, 0.25f, 0.25f};
    EXPECT_EQ(values(MaskUse::cut, 1, 3), std::pair(0.25f, 1.0f));
}

}  // namespace
}  // namespace ewa::test
