// SPDX-License-Identifier: Apache-2.0
// Training as a whole: it learns, it repeats itself byte by byte, and it stays within its bounds.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numeric>

#include "ewa/error.h"
#include "ewa/evaluation.h"
#include "ewa/splat_files.h"
#include "ewa/trainer.h"
#include "gpu/test_device.h"
#include "reference/render.h"
#include "shared/layouts.h"
#include "support/random_sky.h"
#include "support/shared_by_tests.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

/// The same capture with a stripe of garbage across every training image, which masks exclude.
struct Spoilt {
    Synthetic data;
    Dataset masked, unmasked;
    Spoilt() {
        make_synthetic(data, 40, 8, 48, 36, 7);
        std::filesystem::create_directories(data.folder / "masks");
        for (const Frame& frame : data.dataset.frames) {
            Image photo = load_image(frame.image_path), mask(48, 36, 3);
            for (int y = 0; y < 36; ++y)
                for (int x = 0; x < 48; ++x)
                    for (int c = 0; c < 3; ++c) {
                        const bool garbage = x >= 18 && x < 28;
                        mask.at(x, y)[c] = garbage ? 0.0f : 1.0f;
                        if (garbage) photo.at(x, y)[c] = c == 0 ? 1.0f : 0.0f;
                    }
            save_image(frame.image_path, photo);
            save_image(data.folder / "masks" / frame.name, mask);
        }
        masked = load_dataset(data.folder.path(), {});
        unmasked = load_dataset(data.folder.path(), {.masks = MaskUse::none});
    }
};

struct TrainedScene {
    Gaussians gaussians;
    StepReport report;
    double first_loss = 0;
};
TrainedScene train(const TrainOptions& options, const Gaussians& start, int steps,
                   const std::shared_ptr<gpu::Device>& on = device()) {
    Trainer trainer(on, small_capture().dataset, all_frames(small_capture().dataset), start, options);
    TrainedScene run;
    for (int step = 1; step <= steps; ++step) {
        run.report = trainer.step();
        if (step == 1) run.first_loss = run.report.loss;
        EXPECT_EQ(run.report.step, step);
        EXPECT_TRUE(std::isfinite(run.report.loss));
    }
    EXPECT_EQ(trainer.steps_done(), steps);
    run.gaussians = trainer.gaussians();
    EXPECT_EQ(run.gaussians.size(), trainer.splats());
    return run;
}

double train_psnr(const Gaussians& gaussians) {
    return evaluate(device(), gaussians, small_capture().dataset, all_frames(small_capture().dataset), {})
        .psnr;
}

TEST(Dataset, IsReadAsItWasMade) {
    ASSERT_EQ(small_capture().dataset.frames.size(), 8u);
    ASSERT_EQ(small_capture().dataset.points.positions.size(), 40u);
    // The training images are those of the CPU reference, rounded to 8 bit and clamped. The truth scores about 59 dB.
    EXPECT_GT(train_psnr(small_capture().truth), 57);
}

TEST(Trainer, OverfitsASmallScene) {
    const Gaussians start = shaken_start(small_capture(), 0.05, 1, 0);
    const double before = train_psnr(start);
    const TrainedScene run = train(quick(200), start, 200);
    const double after = train_psnr(run.gaussians);
    printf("    psnr %.2f -> %.2f dB, loss %.4f -> %.4f, %.2f s\n", before, after, run.first_loss,
           run.report.loss, run.report.seconds);
    EXPECT_LT(before, 20);
    EXPECT_GT(after, 25);  // to be measured
    EXPECT_LT(run.report.loss, 0.5 * run.first_loss);
    EXPECT_EQ(run.report.dropped_updates, 0u);
    EXPECT_EQ(run.report.skipped_nonfinite, 0u);
}

/// Spheres of the radius and opacity that a run of points begins with.
Gaussians sphere_start(double shake, uint64_t seed) {
    Gaussians start = shaken_start(small_capture(), shake, seed, 0);
    for (float& scale : start.log_scales) scale -= float(std::log(2));
    return start;
}

TEST(Trainer, FitsPoints) {
    TrainOptions options = quick(200);
    options.render.points = true;
    const Gaussians start = sphere_start(0.05, 1);
    const auto psnr_of = [&](const Gaussians& gaussians) {
        return evaluate(device(), gaussians, small_capture().dataset, all_frames(small_capture().dataset),
                        options.render)
            .psnr;
    };
    const TrainedScene run = train(options, start, 200);
    printf("    psnr %.2f -> %.2f dB\n", psnr_of(start), psnr_of(run.gaussians));
    EXPECT_GT(psnr_of(run.gaussians), psnr_of(start) + 4);
    EXPECT_EQ(run.gaussians.quaternions, train(options, start, 1).gaussians.quaternions);
    EXPECT_EQ(run.report.dropped_updates, 0u);
    for (size_t i = 0; i < run.gaussians.log_scales.size(); ++i)
        ASSERT_EQ(run.gaussians.log_scales[i], run.gaussians.log_scales[i - i % 3]);
    const TrainedScene again = train(options, start, 200);
    EXPECT_EQ(again.gaussians.means, run.gaussians.means);
    EXPECT_EQ(again.gaussians.sh, run.gaussians.sh);
}

/// No sphere is pruned for an opacity that it does not have.
TEST(Trainer, PointsGrowAndAreNotPruned) {
    TrainOptions options = quick(400);
    options.render.points = true;
    options.strategy = Strategy::adc;
    options.grow_gradient = 1e-5;
    Gaussians start = sphere_start(0.05, 1);
    std::fill(start.opacity_logits.begin(), start.opacity_logits.end(), -20.0f);
    const TrainedScene run = train(options, start, 160);
    EXPECT_GT(run.gaussians.size(), start.size());
    for (const float logit : run.gaussians.opacity_logits) ASSERT_EQ(logit, -20.0f);
}

TEST(Trainer, ADensityLearnsAsWellAsAPeak) {
    const Gaussians start = shaken_start(small_capture(), 0.05, 1, 0);
    const auto run = [&](Footprint kernel, Strategy strategy) {
        TrainOptions options = quick(200);
        options.render.kernel = kernel;
        options.strategy = strategy;
        options.max_splats = uint32_t(start.size());
        if (strategy == Strategy::mcmc) {  // its noise grows with the rate of the means
            options.means_rate = 3e-3;
            options.means_rate_final = 2e-4;
        }
        const TrainedScene trained = train(options, start, 200);
        EXPECT_EQ(trained.gaussians.density, kernel == Footprint::density);
        EXPECT_LT(trained.report.loss, 0.5 * trained.first_loss);
        EXPECT_EQ(trained.report.dropped_updates, 0u);
        return trained.report.loss;
    };
    for (const Strategy strategy : {Strategy::none, Strategy::mcmc}) {
        const double peak = run(Footprint::peak, strategy), density = run(Footprint::density, strategy);
        printf("    loss %.4f, %.4f of a density\n", peak, density);
        EXPECT_LT(density, 1.3 * peak);
    }
}

TEST(Trainer, TheSameSeedWritesTheSameBytesAndAnotherDoesNot) {
    const Gaussians start = shaken_start(small_capture(), 0.05, 1, 1);
    const auto bytes = [&](uint64_t seed) {
        TrainOptions options = quick(160);
        options.sh_degree = 1;
        options.strategy = Strategy::adc;
        options.grow_gradient = 1e-5;
        options.refine_stop = 30000;
        options.random_background = true;
        options.seed = seed;
        const TrainedScene run = train(options, start, 160);
        EXPECT_GT(run.gaussians.size(), start.size());  // densification took part
        const auto path = small_capture().folder / "out.ply";
        save_splats(path, run.gaussians);
        return file_bytes(path);
    };
    const std::string first = bytes(1);
    EXPECT_EQ(first, bytes(1));
    EXPECT_NE(first, bytes(2));
}

/// GPUs with memory of their own: the host maps none of it, or reads what it maps slowly. Their kernels sort and blend in
/// other ways.
TEST(Trainer, MemoryAndKernelsOfAGpuChangeNoByte) {
    const Gaussians start = shaken_start(small_capture(), 0.05, 1, 1);
    const auto bytes = [&](gpu::HostAccess most, bool cpu_kernels = true) {
        const std::shared_ptr<gpu::Device> other = open_test_device(true);
        other->limit_host_access(most);
        gpu::Limits limits = other->limits();
        limits.cpu = cpu_kernels;
        limits.max_storage_range = ~0u;
        other->pretend(limits);
        TrainOptions options = quick(130);
        options.strategy = Strategy::adc;
        options.grow_gradient = 1e-5;
        options.refine_stop = 30000;
        const auto path = small_capture().folder / "out.ply";
        save_splats(path, train(options, start, 130, other).gaussians);
        return file_bytes(path);
    };
    const std::string mapped = bytes(gpu::HostAccess::read_write);
    EXPECT_TRUE(mapped == bytes(gpu::HostAccess::none));
    EXPECT_TRUE(mapped == bytes(gpu::HostAccess::write));
    EXPECT_TRUE(mapped == bytes(gpu::HostAccess::none, false));
}

/// The validation layer sees a buffer that goes while a step uses it.
TEST(Trainer, EndsAfterItsStepsInFlight) {
    const std::shared_ptr<gpu::Device> other = open_test_device(true);
    gpu::Limits limits = other->limits();
    limits.cpu = false;
    limits.max_storage_range = ~0u;
    other->pretend(limits);
    {
        Trainer trainer(other, small_capture().dataset, all_frames(small_capture().dataset),
                        shaken_start(small_capture(), 0.05, 1, 1), quick(130));
        for (int step = 0; step < 3; ++step) trainer.step();
    }
    EXPECT_NO_THROW(other->check_validation());
}

/// What a replayed step consists of changes with refinements, sizes of images, halvings and SH degrees, and the 101st step is timed.
TEST(Trainer, ReplayedStepsChangeNoByte) {
    Synthetic capture;
    capture.truth = small_capture().truth;
    capture.dataset = small_capture().dataset;
    Frame& wide = capture.dataset.frames[7];
    wide.camera.width = 64;
    wide.camera.cx = 32;
    draw_truth(capture, wide);
    const Gaussians start = shaken_start(capture, 0.05, 1, 2);
    for (const Strategy strategy : {Strategy::adc, Strategy::mcmc}) {
        const auto bytes = [&](bool cpu_kernels, int& recorded) {
            const std::shared_ptr<gpu::Device> other = open_test_device(true);
            gpu::Limits limits = other->limits();
            limits.cpu = cpu_kernels;
            limits.max_storage_range = ~0u;
            other->pretend(limits);
            TrainOptions options = quick(130);
            options.strategy = strategy;
            options.sh_degree = 2;
            options.halvings = 1;
            options.resolution_every = 9000;  // 39 of these steps
            options.max_splats = 60;
            options.grow_gradient = 1e-5;
            options.refine_stop = options.relocate_stop = 30000;
            Trainer trainer(other, capture.dataset, all_frames(capture.dataset), start, options);
            for (int step = 1; step <= 130; ++step) trainer.step();
            const Gaussians trained = trainer.gaussians();
            EXPECT_GT(trained.size(), start.size());
            recorded = trainer.step_times().recorded;
            const auto path = capture.folder / "out.ply";
            save_splats(path, trained);
            return file_bytes(path);
        };
        int of_cpu = 0, of_gpu = 0;
        const std::string expected = bytes(true, of_cpu);
        EXPECT_TRUE(expected == bytes(false, of_gpu));
        printf("    %d and %d of 130 steps recorded\n", of_cpu, of_gpu);
        EXPECT_LT(of_gpu, 90);
    }
}

/// With several steps in flight, those behind a step that has too many instances are in vain and are repeated.
TEST(Trainer, AnOverflowWithStepsInFlightChangesNoByte) {
    PointCloud points = small_capture().dataset.points;
    for (int doubling = 0; doubling < 4; ++doubling) {
        const PointCloud once = points;
        points.positions.insert(points.positions.end(), once.positions.begin(), once.positions.end());
        points.colors.insert(points.colors.end(), once.colors.begin(), once.colors.end());
    }
    // All cameras see the first 40 splats. Those that look away from the first camera do not see the others, which are large:
    // one step has too many instances, and the next one has few.
    const glm::dvec3 away = -3.0 * small_capture().dataset.frames[0].camera.position();
    Random random(5);
    for (size_t i = 0; i < points.positions.size(); ++i)
        for (int k = 0; k < 3; ++k) points.positions[i][k] += 0.05 * random.normal() + (i < 40 ? 0 : away[k]);
    Gaussians start = gaussians_from_points(points, 1);
    for (size_t i = 3 * 40; i < start.log_scales.size(); ++i) start.log_scales[i] += 4;
    std::shared_ptr<gpu::Device> other;
    const auto bytes = [&](bool cpu_kernels) {
        other = open_test_device(true);
        gpu::Limits limits = other->limits();
        limits.cpu = cpu_kernels;
        limits.max_storage_range = ~0u;
        other->pretend(limits);
        const auto path = small_capture().folder / "out.ply";
        TrainOptions options = quick(7);
        options.seed = 4;  // step 2 has 6,085 instances, step 3 has 662
        const TrainedScene run = train(options, start, 7, other);
        EXPECT_EQ(run.report.step, 7);
        save_splats(path, run.gaussians);
        return file_bytes(path);
    };
    const std::string expected = bytes(true);
    EXPECT_TRUE(expected == bytes(false));
}

TEST(Trainer, GrowsUpToTheCapAndNotPastIt) {
    const Gaussians start = shaken_start(small_capture(), 0.05, 1, 0);
    TrainOptions options = quick(300);
    options.strategy = Strategy::adc;
    options.grow_gradient = 1e-6;  // everything in view grows
    options.refine_stop = 30000;
    options.max_splats = 130;
    Trainer trainer(device(), small_capture().dataset, all_frames(small_capture().dataset), start, options);
    uint32_t most = 0;
    for (int step = 1; step <= 300; ++step) {
        const StepReport report = trainer.step();
        most = std::max(most, report.splats);
        ASSERT_LE(report.splats, 130u) << "step " << step;
        EXPECT_TRUE(step >= 60 || report.splats == 40) << "grew before the first refinement";
    }
    EXPECT_GE(most, 120u);
    for (const float value : trainer.gaussians().means) EXPECT_TRUE(std::isfinite(value));
}

/// Three quarters of the way, splats that no image shows go first, and nothing grows afterwards.
TEST(Trainer, TheLastQuarterHasTheSplatsThatShowMost) {
    Gaussians start = shaken_start(small_capture(), 0.05, 1, 0);
    for (size_t i = 0; i < start.size(); i += 4)
        start.means[3 * i + 1] = 50.0f + float(i);  // above all cameras
    for (const Strategy strategy : {Strategy::none, Strategy::adc, Strategy::mcmc}) {
        TrainOptions options = quick(160);
        options.strategy = strategy;
        options.grow_gradient = 1e-6;
        options.refine_stop = options.relocate_stop = 30000;
        options.max_splats = 200;
        options.final_splats = 30;
        options.noise_rate = 0;
        Trainer trainer(device(), small_capture().dataset, all_frames(small_capture().dataset), start,
                        options);
        for (int step = 1; step <= 160; ++step) {
            const StepReport report = trainer.step();
            if (step == 119) {
                EXPECT_GE(report.splats, 40u);
            }
            if (step >= 120) {
                ASSERT_EQ(report.splats, 30u) << "step " << step;
            }
        }
        const Gaussians left = trainer.gaussians();
        for (size_t i = 0; i < left.size(); ++i) EXPECT_LT(left.means[3 * i + 1], 10) << int(strategy);
        EXPECT_GT(train_psnr(left), 15);
    }
    TrainOptions grows = quick(160);
    grows.strategy = Strategy::mcmc;
    grows.relocate_stop = 30000;
    grows.growth = 3;
    Trainer automatic(device(), small_capture().dataset, all_frames(small_capture().dataset), start, grows);
    const uint32_t cap = automatic.max_splats();
    for (int step = 1; step <= 160; ++step)
        ASSERT_LE(automatic.step().splats, step < 120 ? cap : cap * 2 / 3) << "step " << step;
    EXPECT_EQ(automatic.splats(), cap * 2 / 3);
    TrainOptions options = quick(8);
    options.final_splats = 40;  // no fewer than there are
    EXPECT_EQ(train(options, start, 8).report.splats, 40u);
}

TEST(Trainer, WithoutAStrategyTheNumberStays) {
    const Gaussians start = shaken_start(small_capture(), 0.05, 1, 0);
    TrainOptions options = quick(160);
    options.grow_gradient = 1e-6;
    EXPECT_EQ(train(options, start, 160).report.splats, 40u);
}

TEST(Trainer, ASplatThatIsNotFiniteStaysOutAndTheRestLearns) {
    Gaussians start = shaken_start(small_capture(), 0.05, 1, 0);
    start.means[3 * 5] = std::nanf("");
    const TrainedScene run = train(quick(60), start, 60);
    EXPECT_EQ(run.report.skipped_nonfinite, 1u);
    EXPECT_EQ(run.report.dropped_updates, 0u);  // nothing was tried with it
    EXPECT_LT(run.report.loss, run.first_loss);
    // A splat without a place stands last on the curve.
    for (size_t i = 0; i < run.gaussians.means.size(); ++i)
        EXPECT_EQ(std::isfinite(run.gaussians.means[i]), i != run.gaussians.means.size() - 3) << i;
    for (const float value : run.gaussians.log_scales) EXPECT_TRUE(std::isfinite(value));
}

TEST(Trainer, CamerasInOnePlaceStillHaveAScale) {
    Dataset panorama = small_capture().dataset;
    for (Frame& frame : panorama.frames) frame.camera.translation = glm::dvec3(0.0);
    const Gaussians start = shaken_start(small_capture(), 0.05, 1, 0);
    for (const Strategy strategy : {Strategy::adc, Strategy::mcmc}) {
        TrainOptions options = quick(10);
        options.strategy = strategy;
        Trainer trainer(device(), panorama, {0, 1}, start, options);
        StepReport report;
        for (int step = 0; step < 3; ++step) report = trainer.step();
        EXPECT_EQ(report.dropped_updates, 0u);
        const Gaussians after = trainer.gaussians();
        EXPECT_NE(std::accumulate(after.log_scales.begin(), after.log_scales.end(), 0.0),
                  std::accumulate(start.log_scales.begin(), start.log_scales.end(), 0.0));
        EXPECT_NE(std::accumulate(after.means.begin(), after.means.end(), 0.0),
                  std::accumulate(start.means.begin(), start.means.end(), 0.0));
    }
}

TEST(Trainer, RefusesWhatItCannotTrain) {
    const Gaussians start = shaken_start(small_capture(), 0.05, 1, 0);
    TrainOptions options = quick(10);
    const auto make = [&](const std::vector<int>& frames, const Gaussians& from, uint32_t cap) {
        return [&, frames, from, cap] {
            options.max_splats = cap;
            Trainer(device(), small_capture().dataset, frames, from, options);
        };
    };
    expect_error<InputError>(make({}, start, 1000), {"no training image"});
    expect_error<InputError>(make({0}, Gaussians{}, 1000), {"no splat"});
    expect_error<InputError>(make({0}, start, 39), {"40", "39"});
    options.render.points = true;
    options.strategy = Strategy::mcmc;
    expect_error<InputError>(make({0}, start, 1000), {"--strategy mcmc", "--points"});
    options.strategy = Strategy::adc;
    options.final_splats = 10;
    expect_error<InputError>(make({0}, start, 1000), {"--final-splats", "--points"});
}

std::vector<std::string> names(const std::vector<PlanLine>& plan) {
    std::vector<std::string> names;
    for (const PlanLine& line : plan) names.push_back(line.what + " " + std::to_string(line.bytes_saved));
    return names;
}

/// What a trainer says that it skips is what plan_lines says of its options and its images.
TEST(Trainer, RunsThePlanThatItTells) {
    const Spoilt spoilt;
    const std::vector<int> frames = all_frames(spoilt.masked);
    for (const Strategy strategy : {Strategy::none, Strategy::adc, Strategy::mcmc})
        for (const bool exposure : {false, true}) {
            TrainOptions options = quick(10);
            options.strategy = strategy;
            options.refine_poses = options.absolute_gradients = exposure;
            if (exposure) options.appearance = AppearanceModel::affine;
            const Gaussians start = shaken_start(spoilt.data, 0.05, 1, 0);
            const Trainer masked(device(), spoilt.masked, frames, start, options);
            const Trainer plain(device(), spoilt.unmasked, frames, start, options);
            EXPECT_EQ(names(masked.plan()), names(plan_lines(start, options, true)));
            EXPECT_EQ(names(plain.plan()), names(plan_lines(start, options, false)));
            EXPECT_EQ(plain.plan().size(), masked.plan().size() + 1);
            // A checkpoint has what the plan keeps from step to step.
            EXPECT_EQ(plain.state().arrays.size(), 2u + (strategy == Strategy::adc) + (exposure ? 7 : 0));
        }
}

TEST(Trainer, TimesEveryPass) {
    Trainer trainer(device(), small_capture().dataset, {0, 1}, shaken_start(small_capture(), 0.05, 1, 0),
                    quick(10));
    StepReport report;
    for (int step = 0; step < 3; ++step) report = trainer.step();
    double total = 0;
    bool blends = false;
    const StepTimes times = trainer.step_times();
    for (const PassTime& time : times.passes) {
        EXPECT_GE(time.milliseconds, 0) << time.pass;
        total += time.milliseconds;
        blends = blends || time.pass == "blend_backward";
    }
    EXPECT_GT(total, 0);
    EXPECT_TRUE(blends);
    EXPECT_EQ(times.steps, 3);
    EXPECT_NEAR(times.step, 1000 * report.seconds / 3, 1e-6);
    EXPECT_LE(times.refinement, times.step);
    EXPECT_GT(times.host, 0);
    EXPECT_LT(times.host, times.step);
}

TEST(Trainer, TellsThePsnrOfEachTrainingImage) {
    const Spoilt spoilt;
    const Gaussians start = shaken_start(spoilt.data, 0.05, 1, 0);
    for (const Dataset* dataset : {&spoilt.masked, &spoilt.unmasked})
        for (const int frame : {0, 3}) {
            Trainer trainer(device(), *dataset, {frame}, start, quick(10));
            EXPECT_NEAR(trainer.step().psnr, evaluate(device(), start, *dataset, {frame}, {}).psnr, 1e-3);
        }
}

TEST(Trainer, LearnsNothingFromWhatIsMasked) {
    const Spoilt spoilt;
    const Gaussians start = shaken_start(spoilt.data, 0.05, 11, 0);
    const auto learn = [&](const Dataset& dataset) {
        Trainer trainer(device(), dataset, all_frames(dataset), start, quick(150));
        for (int step = 0; step < 150; ++step) trainer.step();
        return trainer.gaussians();
    };
    const Gaussians with = learn(spoilt.masked), without = learn(spoilt.unmasked);
    // Against the training images before they were spoilt.
    const auto clean = [&](const Gaussians& g) {
        return evaluate(device(), g, small_capture().dataset, all_frames(small_capture().dataset), {}).psnr;
    };
    const double good = clean(with), bad = clean(without);
    printf("    %.2f dB with masks, %.2f dB without\n", good, bad);
    EXPECT_GT(good, bad + 3);
    // The evaluation leaves the garbage out as well.
    const Evaluation masked = evaluate(device(), with, spoilt.masked, {0, 3}, {});
    EXPECT_GT(masked.psnr, evaluate(device(), with, spoilt.unmasked, {0, 3}, {}).psnr + 3);
}

/// The same capture by a camera that exposes each image but the first one in its own way.
Dataset exposed_by_itself(Synthetic& made) {
    make_synthetic(made, 40, 8, 48, 36, 7);
    Random random(5);
    for (size_t i = 1; i < made.dataset.frames.size(); ++i) {
        Exposure e = kIdentityExposure;
        for (const size_t k : {0u, 5u, 10u}) e[k] = float(random.uniform(0.5, 1));
        const Frame& frame = made.dataset.frames[i];
        save_image(frame.image_path, with_appearance(load_image(frame.image_path), e));
    }
    return load_dataset(made.folder.path(), {});
}

TEST(Trainer, LearnsTheExposureOfEachImage) {
    Synthetic made;
    const Dataset dataset = exposed_by_itself(made);
    const Gaussians start = shaken_start(made, 0.05, 11, 0);
    const auto learn = [&](bool exposure) {
        TrainOptions options = quick(400);
        if (exposure) options.appearance = AppearanceModel::affine;
        options.exposure_rate = 0.03;  // each training image is used 50 times
        Trainer trainer(device(), dataset, all_frames(dataset), start, options);
        for (int step = 0; step < 400; ++step) trainer.step();
        const auto appearances = trainer.appearances();
        EXPECT_EQ(appearances.size(), exposure ? 8u : 0u);
        return evaluate(device(), trainer.gaussians(), dataset, all_frames(dataset), {}, appearances).psnr;
    };
    const double with = learn(true), without = learn(false);
    printf("    %.2f dB with exposures, %.2f dB without\n", with, without);
    EXPECT_GT(with, without + 3);
}

/// Colours of images that differ are learned, and a checkpoint has all that is learned.
TEST(Trainer, LearnsTheAppearanceOfEachImageAndResumes) {
    Synthetic made;
    const Dataset dataset = exposed_by_itself(made);
    const Gaussians start = shaken_start(made, 0.05, 11, 0);
    const std::vector<int> frames = all_frames(dataset);
    std::map<AppearanceModel, double> psnr;
    for (const AppearanceModel model :
         {AppearanceModel::none, AppearanceModel::ppisp, AppearanceModel::grid}) {
        TrainOptions options = quick(400);
        options.appearance = model;
        options.appearance_rate = 0.02;  // each training image is used 50 times
        Trainer whole(device(), dataset, frames, start, options);
        while (whole.steps_done() < 150) whole.step();
        Trainer later(device(), dataset, frames, start, options);
        later.restore(whole.state());
        while (whole.steps_done() < 400) whole.step();
        while (later.steps_done() < 400) later.step();
        EXPECT_EQ(later.appearances(), whole.appearances());
        EXPECT_EQ(later.gaussians().sh, whole.gaussians().sh);
        psnr[model] = evaluate(device(), whole.gaussians(), dataset, frames, {}, whole.appearances()).psnr;
    }
    printf("    %.2f dB with PPISP, %.2f dB with grids, %.2f dB without\n", psnr[AppearanceModel::ppisp],
           psnr[AppearanceModel::grid], psnr[AppearanceModel::none]);
    EXPECT_GT(psnr[AppearanceModel::ppisp], psnr[AppearanceModel::none] + 3);
    EXPECT_GT(psnr[AppearanceModel::grid], psnr[AppearanceModel::none] + 3);
}

/// The sky behind splats is learned, a checkpoint has it, and a renderer draws what the trainer does.
TEST(Trainer, LearnsTheSkyAndResumes) {
    Synthetic made;
    make_synthetic(made, 40, 8, 64, 48, 13);
    RenderOptions truth;
    truth.sky = std::make_shared<const SkyMap>(random_sky(14, 4));
    for (const Frame& frame : made.dataset.frames) {
        const auto render = reference::render(made.truth, frame.camera, truth);
        Image image(64, 48, 3);
        for (size_t i = 0; i < image.pixels.size(); ++i)
            image.pixels[i] = float(render.blended.color.values[i]);
        save_image(frame.image_path, image);
    }
    const Gaussians start = shaken_start(made, 0.05, 11, 0);
    const std::vector<int> frames = all_frames(made.dataset);
    double psnr[2];
    for (const bool sky : {false, true}) {
        TrainOptions options = quick(400);
        options.sky = sky;
        Trainer whole(device(), made.dataset, frames, start, options);
        while (whole.steps_done() < 150) whole.step();
        Trainer later(device(), made.dataset, frames, start, options);
        later.restore(whole.state());
        while (whole.steps_done() < 400) whole.step();
        while (later.steps_done() < 400) later.step();
        RenderOptions look;
        look.sky = whole.sky();
        ASSERT_EQ(bool(look.sky), sky);
        EXPECT_EQ(later.gaussians().sh, whole.gaussians().sh);
        psnr[sky] = evaluate(device(), whole.gaussians(), made.dataset, frames, look).psnr;
        if (!sky) continue;
        EXPECT_EQ(*later.sky(), *look.sky);
        const Camera& camera = made.dataset.frames[0].camera;
        Renderer renderer(device(), whole.gaussians(), look);
        EXPECT_EQ(whole.render({&camera, 1})[0].pixels, renderer.render(camera).color.pixels);
    }
    printf("    %.2f dB with a sky, %.2f dB without\n", psnr[1], psnr[0]);
    EXPECT_GT(psnr[1], psnr[0] + 5);
}

/// A run on halves and quarters first ends at the whole resolution, and resumes to the byte in the middle of
/// them.
TEST(Trainer, AResolutionScheduleEndsAtTheWholeResolutionAndResumes) {
    const Gaussians start = shaken_start(small_capture(), 0.05, 1, 0);
    TrainOptions options = quick(200);
    options.halvings = 2;
    const auto frames = all_frames(small_capture().dataset);
    Trainer whole(device(), small_capture().dataset, frames, start, options);
    TrainerState middle;
    for (int step = 1; step <= 200; ++step) {
        whole.step();
        if (step == 30) middle = whole.state();
    }
    EXPECT_GT(train_psnr(whole.gaussians()), 25);
    Trainer resumed(device(), small_capture().dataset, frames, start, options);
    resumed.restore(middle);
    while (resumed.steps_done() < 200) resumed.step();
    EXPECT_EQ(resumed.gaussians().means, whole.gaussians().means);
    EXPECT_EQ(resumed.gaussians().sh, whole.gaussians().sh);
    // Half the sides are another picture: the first step tells.
    const double loss = Trainer(device(), small_capture().dataset, frames, start, quick(200)).step().loss;
    EXPECT_NE(Trainer(device(), small_capture().dataset, frames, start, options).step().loss, loss);
}

/// The regularisers pull at splats that no photo shows.
TEST(Trainer, RegularisesAFewPhotos) {
    const Dataset& dataset = small_capture().dataset;
    const Gaussians start = shaken_start(small_capture(), 0.05, 1, 0);
    const auto opacities = [&](size_t photos, double weight) {
        TrainOptions options = quick(3);
        options.few_photos = 16;
        options.opacity_weight = weight;
        std::vector<int> frames;
        for (size_t i = 0; i < photos; ++i) frames.push_back(int(i % 8));
        Trainer trainer(device(), dataset, frames, start, options);
        while (trainer.steps_done() < 3) trainer.step();
        return trainer.gaussians().opacity_logits;
    };
    EXPECT_NE(opacities(16, 10), opacities(16, 0));
    EXPECT_EQ(opacities(17, 10), opacities(17, 0));
}

/// A training on a device of its own: its peak of device memory is within a share of the estimate. Returns the peak.
uint64_t expect_estimated(const Synthetic& capture, const Gaussians& start, const TrainOptions& options,
                          double share) {
    const auto frames = all_frames(capture.dataset);
    const MemoryEstimate estimate = estimate_memory(*device(), capture.dataset, frames, start, options);
    DeviceOptions fresh;
    const auto own = open_device(fresh);
    Trainer trainer(own, capture.dataset, frames, start, options);
    while (trainer.steps_done() < options.steps) trainer.step();
    EXPECT_LE(trainer.splats(), estimate.splats);
    EXPECT_GE(trainer.splats(), 0.99 * estimate.splats);
    const uint64_t peak = peak_device_bytes(*own);
    printf("    %u splats: estimate %.0f KiB, peak %.0f KiB\n", trainer.splats(),
           double(estimate.total()) / 1024, double(peak) / 1024);
    EXPECT_NEAR(double(peak) / double(estimate.total()), 1, share);
    return peak;
}

TEST(Trainer, TheMemoryEstimateHoldsForARun) {
    const Gaussians start = shaken_start(small_capture(), 0.05, 1, 1);
    TrainOptions options = quick(160);
    options.strategy = Strategy::adc;
    options.grow_gradient = 1e-5;
    options.refine_stop = 30000;
    options.max_splats = 60;
    expect_estimated(small_capture(), start, options, 0.1);
}

/// Thousands of splats, as a capture's points give them: nearly all of the memory depends on their number.
struct ManyPoints : Synthetic {
    Gaussians start;
    ManyPoints() {
        make_synthetic(*this, 6000, 6, 160, 120, 9);
        start = gaussians_from_points(dataset.points, 3);
    }
};
SharedByTests<ManyPoints>* const many_points = SharedByTests<ManyPoints>::add();

/// Strategy, bits of the moments, views a step, bands.
class MemoryOf : public testing::TestWithParam<std::tuple<Strategy, int, int, int>> {};

TEST_P(MemoryOf, ARunIsEstimatedAndAKilobyteASplat) {
    const auto& [strategy, bits, batch, bands] = GetParam();
    const ManyPoints& capture = many_points->get([] { return ManyPoints(); });
    TrainOptions options;
    options.steps = strategy == Strategy::none ? 30 : 160;
    options.strategy = strategy;
    options.moment_bits = bits;
    options.batch = batch;
    options.bands = bands;
    options.max_splats = strategy == Strategy::none ? 6000 : 12000;
    options.grow_gradient = 1e-7;
    options.refine_stop = options.relocate_stop = 30000;
    options.short_run_power = 0;
    // The splats of these images of noise grow less than those of a capture: see docs/performance.md for some.
    const uint64_t peak = expect_estimated(capture, capture.start, options, 0.25);
    // Besides the splats there are planes of 160x120 pixels, the images, and the counters of the sorts.
    if (bits == 16 && batch == 1) {
        EXPECT_LT(peak, options.max_splats * 1000 + 5000000);
    }
}

INSTANTIATE_TEST_SUITE_P(
    Strategies, MemoryOf,
    testing::Values(std::tuple(Strategy::none, 16, 1, 1), std::tuple(Strategy::adc, 16, 1, 1),
                    std::tuple(Strategy::mcmc, 16, 1, 1), std::tuple(Strategy::mcmc, 32, 1, 1),
                    std::tuple(Strategy::mcmc, 16, 4, 1), std::tuple(Strategy::none, 16, 2, 3)));

TEST(Trainer, ABatchLearnsAsMuchFromAsManyViews) {
    const Gaussians start = shaken_start(small_capture(), 0.05, 1, 0);
    double psnr[2];
    for (const int batch : {1, 4}) {
        TrainOptions options = quick(400);
        options.batch = batch;
        Trainer trainer(device(), small_capture().dataset, all_frames(small_capture().dataset), start,
                        options);
        while (trainer.steps_done() < options.steps) trainer.step();
        psnr[batch > 1] = train_psnr(trainer.gaussians());
    }
    // A quarter of the steps, at the large rates of quick().
    EXPECT_GT(psnr[0], 30);
    EXPECT_GT(psnr[1], psnr[0] - 2.5);
}

TEST(Trainer, MomentsIn16BitsTrainAsWellAsIn32) {
    const Gaussians start = shaken_start(small_capture(), 0.05, 1, 0);
    TrainOptions options = quick(200);
    const double packed = train_psnr(train(options, start, 200).gaussians);
    options.moment_bits = 32;
    const double exact = train_psnr(train(options, start, 200).gaussians);
    printf("    psnr %.2f dB with 16 bits, %.2f dB with 32\n", packed, exact);
    EXPECT_NEAR(packed, exact, 0.3);
    EXPECT_GT(std::min(packed, exact), 25);
}

TEST(Trainer, ImagesOnDiskChangeNoResult) {
    const Spoilt spoilt;
    const Gaussians start = shaken_start(spoilt.data, 0.05, 11, 0);
    const uint64_t photo = 48 * 36 * 4;
    Gaussians held;
    for (const auto& [bytes, on_disk] :
         {std::pair<uint64_t, size_t>{8 * photo, 0}, {8 * photo - 1, 1}, {3 * photo, 5}, {0, 8}}) {
        TrainOptions options = quick(20);
        options.image_cache_bytes = bytes;
        Trainer trainer(device(), spoilt.masked, all_frames(spoilt.masked), start, options);
        EXPECT_EQ(trainer.images_on_disk(), on_disk);
        for (int step = 0; step < 20; ++step) trainer.step();
        const Gaussians learnt = trainer.gaussians();
        if (on_disk == 0) held = learnt;
        EXPECT_EQ(learnt.means, held.means) << on_disk;
        EXPECT_EQ(learnt.opacity_logits, held.opacity_logits) << on_disk;
        EXPECT_EQ(learnt.sh, held.sh) << on_disk;
    }
}

TEST(Trainer, SaysWhichImageVanished) {
    Synthetic capture;
    make_synthetic(capture, 10, 4, 24, 18, 7);
    TrainOptions options = quick(20);
    options.image_cache_bytes = 0;
    Trainer trainer(device(), capture.dataset, all_frames(capture.dataset), shaken_start(capture, 0, 1, 0),
                    options);
    for (const Frame& frame : capture.dataset.frames) std::filesystem::remove(frame.image_path);
    expect_error<InputError>(
        [&] {
            for (int step = 0; step < 4; ++step) trainer.step();
        },
        {"view_10"});
}

TEST(Trainer, TakesImagesOfSeveralSizes) {
    Synthetic mixed;
    make_synthetic(mixed, 40, 8, 48, 36, 7);
    for (size_t i = 0; i < mixed.dataset.frames.size(); i += 2) {
        const auto& path = mixed.dataset.frames[i].image_path;
        save_image(path, downscale(load_image(path), i % 4 == 0 ? 2 : 3));
    }
    const Dataset dataset = load_dataset(mixed.folder.path(), {});
    ASSERT_EQ(dataset.frames[0].camera.width, 24);
    Trainer trainer(device(), dataset, all_frames(dataset), shaken_start(mixed, 0.05, 11, 0), quick(120));
    for (int step = 0; step < 120; ++step) trainer.step();
    const Gaussians learnt = trainer.gaussians();
    EXPECT_GT(evaluate(device(), learnt, dataset, all_frames(dataset), {}).psnr, 22);
    EXPECT_GT(
        evaluate(device(), learnt, small_capture().dataset, all_frames(small_capture().dataset), {}).psnr,
        22);
}

}  // namespace
}  // namespace ewa::test
