// SPDX-License-Identifier: Apache-2.0
// Cameras that training refines: they come nearer to the true ones, and held-out cameras follow.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "core/json.h"
#include "ewa/error.h"
#include "ewa/evaluation.h"
#include "ewa/run.h"
#include "ewa/splat_files.h"
#include "gpu/test_device.h"
#include "io/datasets/image_records.h"
#include "io/datasets/refined_cameras.h"
#include "run/refined_cameras.h"
#include "run/wrong_cameras.h"
#include "support/temp_folder.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

std::vector<Camera> cameras_of(const Dataset& dataset) {
    std::vector<Camera> cameras;
    for (const Frame& frame : dataset.frames) cameras.push_back(frame.camera);
    return cameras;
}

/// Each camera turned by 0.6 degrees and moved by 0.05 units at random.
Dataset disturbed(Dataset dataset, double focal = 0) {
    Random random(91);
    for (Frame& frame : dataset.frames) {
        const auto way = [&] {
            return glm::normalize(glm::dvec3(random.normal(), random.normal(), random.normal()));
        };
        const glm::dvec3 turn = 0.0105 * way();
        frame.camera = moved(frame.camera, {turn, focal * random.normal(), 0.05 * way()});
    }
    return dataset;
}

struct Errors {
    double degrees = 0, length = 0, focal = 0;  // RMS
};

/// After the similarity that brings `cameras` closest to the true ones.
Errors errors_of(const std::vector<Camera>& cameras, const std::vector<Camera>& truth) {
    const train::Similarity back = train::similarity_between(cameras, truth);
    Errors sum;
    for (size_t i = 0; i < truth.size(); ++i) {
        const CameraDistance d = distance_between(transformed(cameras[i], back), truth[i]);
        sum.degrees += d.degrees * d.degrees;
        sum.length += d.length * d.length;
        sum.focal += std::log(d.focal) * std::log(d.focal);
    }
    const double count = double(truth.size());
    return {std::sqrt(sum.degrees / count), std::sqrt(sum.length / count), std::sqrt(sum.focal / count)};
}

TrainOptions refining(int steps) {
    TrainOptions options = quick(steps);
    options.short_run_power = 0;
    options.means_rate = 2e-3;
    options.means_rate_final = 2e-4;
    options.refine_poses = true;
    return options;
}

struct Refined {
    std::vector<Camera> cameras;
    Gaussians gaussians;
};

Refined refine(const Dataset& dataset, const TrainOptions& options) {
    const auto frames = all_frames(dataset);
    Trainer trainer(device(), dataset, frames, shaken_start(small_capture(), 0.02, 11, 0), options);
    while (trainer.steps_done() < options.steps) trainer.step();
    return {train::refined_cameras(dataset, frames, trainer.camera_motions()).cameras, trainer.gaussians()};
}

TEST(RefinedCameras, ComeNearerToTheTrueOnes) {
    const Dataset& truth = small_capture().dataset;
    const Dataset wrong = disturbed(truth);
    TrainOptions options = refining(800);
    const Refined refined = refine(wrong, options);
    const Errors before = errors_of(cameras_of(wrong), cameras_of(truth));
    const Errors after = errors_of(refined.cameras, cameras_of(truth));
    printf("    %.3f degrees and %.4f units before, %.3f degrees and %.4f units after\n", before.degrees,
           before.length, after.degrees, after.length);
    EXPECT_LT(after.degrees, before.degrees / 2.2);
    EXPECT_LT(after.length, before.length / 2.7);
    for (size_t i = 0; i < refined.cameras.size(); ++i)
        EXPECT_EQ(refined.cameras[i].fx, truth.frames[i].camera.fx);  // not asked for

    // Without, no camera moves, and a run has no motions.
    options.refine_poses = false;
    Trainer plain(device(), wrong, {0, 1}, shaken_start(small_capture(), 0.02, 11, 0), options);
    plain.step();
    EXPECT_TRUE(plain.camera_motions().empty());
}

TEST(RefinedCameras, LearnFocalLengthsToo) {
    const Dataset& truth = small_capture().dataset;
    const Dataset wrong = disturbed(truth, 0.02);
    TrainOptions options = refining(800);
    options.refine_focal = true;
    const Errors before = errors_of(cameras_of(wrong), cameras_of(truth));
    const Errors after = errors_of(refine(wrong, options).cameras, cameras_of(truth));
    printf("    focal lengths wrong by %.4f before, %.4f after\n", before.focal, after.focal);
    EXPECT_LT(after.focal, before.focal / 1.6);
}

/// A step with more instances than fit is repeated: it moves a camera once.
TEST(RefinedCameras, AStepIsRepeatedAsAWhole) {
    const Dataset wrong = disturbed(small_capture().dataset);
    Gaussians large = shaken_start(small_capture(), 0.02, 11, 0);
    while (large.size() < 4000) {
        const size_t n = large.size();
        large.resize(2 * n);
        for (auto* values :
             {&large.means, &large.quaternions, &large.log_scales, &large.opacity_logits, &large.sh})
            std::copy_n(values->begin(), values->size() / 2,
                        values->begin() + std::ptrdiff_t(values->size() / 2));
    }
    for (float& scale : large.log_scales) scale = std::log(0.5f);
    const auto motions = [&](int warm) {
        TrainOptions options = refining(100);
        Trainer trainer(device(), wrong, {0}, large, options);
        TrainerState start = trainer.state();
        for (int i = 0; i < warm; ++i) trainer.step();  // the capacity grows
        trainer.restore(start);
        trainer.step();
        return trainer.camera_motions();
    };
    EXPECT_EQ(motions(0), motions(2));
    EXPECT_NE(motions(0)[0], CameraMotion());
}

TEST(RefinedCameras, AlignmentFindsCamerasOfFixedSplats) {
    const Dataset& truth = small_capture().dataset;
    Dataset wrong = disturbed(truth);
    const std::vector<int> frames{1, 4};
    int asked = 0;
    const auto motions = train::align_cameras(device(), small_capture().truth, wrong, frames, refining(100),
                                              scene_extent(truth, all_frames(truth)), [&] { ++asked; });
    EXPECT_EQ(asked, 2);
    for (size_t i = 0; i < 2; ++i) {
        const Camera& camera = truth.frames[size_t(frames[i])].camera;
        const Camera& start = wrong.frames[size_t(frames[i])].camera;
        const CameraDistance before = distance_between(start, camera);
        const CameraDistance after = distance_between(moved(start, motions[i]), camera);
        EXPECT_LT(after.degrees, before.degrees / 10);
        EXPECT_LT(after.length, before.length / 10);
    }
}

TEST(RefinedCameras, AlignmentThroughLenses) {
    for (const Lens lens : {Lens::fisheye, Lens::equirectangular}) {
        Synthetic truth;
        put_lens(truth, {.lens = lens});
        const Dataset wrong = disturbed(truth.dataset);
        const std::vector<int> frames{1, 4};
        const auto motions = train::align_cameras(device(), truth.truth, wrong, frames, refining(100),
                                                  scene_extent(wrong, all_frames(wrong)), [] {});
        for (size_t i = 0; i < 2; ++i) {
            const Camera& camera = truth.dataset.frames[size_t(frames[i])].camera;
            const Camera& start = wrong.frames[size_t(frames[i])].camera;
            const CameraDistance before = distance_between(start, camera);
            const CameraDistance after = distance_between(moved(start, motions[i]), camera);
            EXPECT_LT(after.degrees, before.degrees / 5) << int(lens);
            EXPECT_LT(after.length, before.length / 5) << int(lens);
        }
    }
}

TEST(RefinedCameras, ASimilarityIsFound) {
    const std::vector<Camera> cameras = cameras_of(small_capture().dataset);
    const Camera turned = random_camera(92, 10, 10);
    const train::Similarity similarity{1.7, turned.rotation, {3, -2, 5}};
    for (const size_t count : {1u, 2u, 8u}) {  // one camera, or two, have a rotation by their axes alone
        std::vector<Camera> from(cameras.begin(), cameras.begin() + std::ptrdiff_t(count)), to;
        for (const Camera& camera : from) to.push_back(transformed(camera, similarity));
        const train::Similarity found = train::similarity_between(from, to);
        EXPECT_NEAR(found.scale, count == 1 ? 1 : 1.7, 1e-9);
        for (const Camera& camera : from) {
            const CameraDistance d =
                distance_between(transformed(camera, found), transformed(camera, similarity));
            EXPECT_NEAR(d.degrees, 0, 1e-6);
            EXPECT_NEAR(d.length, 0, 1e-9);
        }
    }
}

/// Training cameras that all moved as one carry the others along.
TEST(RefinedCameras, HeldOutCamerasFollowTheTrainingCameras) {
    const Dataset& dataset = small_capture().dataset;
    const train::Similarity similarity{1.3, glm::dmat3(1.0), {3, -2, 5}};
    const std::vector<int> train{0, 2, 3, 5};
    std::vector<CameraMotion> motions;
    for (const int i : train) {
        const Camera& camera = dataset.frames[size_t(i)].camera;
        const glm::dvec3 center = camera.position();
        motions.push_back({glm::dvec3(0), 0, camera.rotation * (similarity(center) - center)});
    }
    const train::RefinedCameras refined = train::refined_cameras(dataset, train, motions);
    ASSERT_EQ(refined.cameras.size(), dataset.frames.size());
    for (size_t i = 0; i < dataset.frames.size(); ++i) {
        const Camera want = transformed(dataset.frames[i].camera, similarity);
        EXPECT_NEAR(distance_between(refined.cameras[i], want).length, 0, 1e-9) << i;
        EXPECT_NEAR(distance_between(refined.cameras[i], want).degrees, 0, 1e-6) << i;
    }
}

/// A run in the folder, from the true splats, over the small capture's images with these cameras.
RunOptions run_over(const Dataset& cameras, const TempFolder& folder) {
    std::vector<io::ImageRecord> records;
    for (const Frame& frame : cameras.frames)
        records.push_back({.name = frame.name,
                           .path = {},
                           .camera = frame.camera,
                           .mask = {},
                           .depth = {},
                           .distortion = {}});
    io::write_colmap(folder / "data/sparse/0", records, cameras.points);
    std::filesystem::create_directory_symlink(small_capture().folder / "images", folder / "data/images");
    RunOptions options;
    options.dataset = folder / "data";
    options.output = folder / "run";
    save_splats(folder / "truth.ply", small_capture().truth);
    options.init = (folder / "truth.ply").string();
    return options;
}

/// A dataset on disk with disturbed cameras: the run's files, its figures, and the model that is read back.
TEST(RefinedCameras, ARunWritesThemAndAlignsWhatItHeldOut) {
    const Dataset wrong = disturbed(small_capture().dataset);
    TempFolder folder;
    RunOptions options = run_over(wrong, folder);
    options.train = refining(400);
    options.train.means_rate = options.train.means_rate_final = 1e-5;
    options.test_every = 4;
    options.eval_every = 200;
    const RunResult run = run_training(options);
    ASSERT_TRUE(run.summary.cameras);
    EXPECT_TRUE(run.summary.cameras->test_aligned);
    EXPECT_GT(run.summary.cameras->median_degrees, 0.1);
    EXPECT_GE(run.summary.cameras->largest_degrees, run.summary.cameras->median_degrees);
    EXPECT_GT(run.summary.cameras->largest_share, 0);

    Dataset refined = load_dataset(folder / "data", {});
    const Dataset given = refined;
    io::use_refined_cameras(refined, folder / "run/cameras.json");
    const Errors before = errors_of(cameras_of(given), cameras_of(small_capture().dataset));
    const Errors after = errors_of(cameras_of(refined), cameras_of(small_capture().dataset));
    EXPECT_LT(after.degrees, before.degrees / 2);  // held-out ones among them
    EXPECT_LT(after.length, before.length / 2);
    const auto json = core::read_json_file<nlohmann::json>(folder / "run/cameras.json");
    ASSERT_EQ(json["views"].size(), refined.frames.size());
    for (size_t i = 0; i < refined.frames.size(); ++i) {
        const auto& view = json["views"][i];
        const CameraDistance d = distance_between(given.frames[i].camera, refined.frames[i].camera);
        EXPECT_EQ(view["split"], i % 4 == 0 ? "test" : "train");
        EXPECT_EQ(view.contains("aligned"), i % 4 == 0);
        EXPECT_NEAR(view["degrees"], d.degrees, 1e-9);
        EXPECT_NEAR(view["moved"], d.length, 1e-9);
        EXPECT_NEAR(view["percent_of_extent"].get<double>(), 100 * d.length / json["extent"].get<double>(),
                    1e-9);
    }
    Dataset halved = load_dataset(folder / "data", {.downscale = 2});
    io::use_refined_cameras(halved, folder / "run/cameras.json");
    for (size_t i = 0; i < halved.frames.size(); ++i) {
        EXPECT_EQ(halved.frames[i].camera.rotation, refined.frames[i].camera.rotation);
        EXPECT_NEAR(halved.frames[i].camera.fx, refined.frames[i].camera.fx / 2, 1e-9);
        EXPECT_NEAR(halved.frames[i].camera.fy, refined.frames[i].camera.fy / 2, 1e-9);
    }
    const Evaluation again =
        evaluate(device(), run.summary.splats ? load_splats(folder / "run/splats.ply") : Gaussians(), refined,
                 split_frames(refined, 4).test, {});
    EXPECT_NEAR(again.psnr, *run.summary.test_psnr, 1e-6);

    // The model is a dataset.
    const Dataset model = load_dataset(folder / "run/cameras", {});
    ASSERT_EQ(model.frames.size(), refined.frames.size());
    for (size_t i = 0; i < model.frames.size(); ++i) {
        const CameraDistance d = distance_between(model.frames[i].camera, refined.frames[i].camera);
        EXPECT_EQ(model.frames[i].name, refined.frames[i].name);
        EXPECT_NEAR(d.degrees, 0, 1e-6);
        EXPECT_NEAR(d.length, 0, 1e-9);
    }
    EXPECT_EQ(model.points.positions.size(), given.points.positions.size());
}

TEST(WrongCameras, AreFarBelowOthersAndTheTrainingViews) {
    const std::vector<train::ViewFigure> views{{0, 25}, {8, 14}, {16, 26}, {24, 12}, {32, 24}};
    const auto low = train::far_below(views, 30);
    ASSERT_EQ(low.size(), 2u);
    EXPECT_EQ(low[0].frame, 24);
    EXPECT_EQ(low[1].frame, 8);
    EXPECT_TRUE(train::far_below(views, 19).empty()) << "the training views are no better";
    EXPECT_TRUE(train::far_below({{0, 25}, {8, 5}}, 30).empty()) << "two views have no usual figure";
    EXPECT_EQ(train::wrong_cameras_text({}, 20), "");
    const std::string text =
        train::wrong_cameras_text({{"a.jpg", 12, 17, 2.5, 0.031}, {"b.jpg", 13, 13.5, 9, 0.2}}, 24.3);
    EXPECT_EQ(text,
              "some cameras are probably wrong: a.jpg: 12.0 dB, and 17.0 dB with its camera turned by 2.5 "
              "degrees and moved "
              "by 3.1 % of the scene's extent. some cameras may be wrong, or no training image shows what "
              "these held-out "
              "views do: b.jpg (13.0 dB). The median view has 24.3 dB");
}

/// A run over true cameras but one, which was held out.
TEST(WrongCameras, ARunNamesAHeldOutOne) {
    const auto remark_of = [](const Dataset& dataset) {
        const TempFolder folder;
        RunOptions options = run_over(dataset, folder);
        options.train = quick(1);
        options.automatic_background = false;  // the true splats are transparent in places
        options.test_every = 3;
        run_training(options);
        const std::string html = file_bytes(folder / "run/report.html");
        const size_t at = html.find("some cameras are probably wrong: ");
        return at == std::string::npos ? std::string() : html.substr(at, 300);
    };
    Dataset cameras = small_capture().dataset;
    EXPECT_EQ(remark_of(cameras), "");
    cameras.frames[3].camera = moved(cameras.frames[3].camera, {{0, glm::radians(2.0), 0}, 0, {}});
    const std::string remark = remark_of(cameras);
    EXPECT_TRUE(remark.starts_with("some cameras are probably wrong: " + cameras.frames[3].name + ": "))
        << remark;
    const size_t turned = remark.find("turned by ");
    ASSERT_NE(turned, std::string::npos) << remark;
    EXPECT_NEAR(std::stod(remark.substr(turned + std::string("turned by ").size())), 2, 0.4) << remark;
}

}  // namespace
}  // namespace ewa::test
