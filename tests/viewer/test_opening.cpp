// SPDX-License-Identifier: Apache-2.0
// What a path is opened as.
#include <gtest/gtest.h>

#include <filesystem>
#include <vector>

#include "cli/expect.h"
#include "cli/program.h"
#include "ewa/error.h"
#include "ewa/sky_map.h"
#include "viewer/opening.h"

namespace ewa::viewer {
namespace {

const std::string kMesh = std::string(EWA_SOURCE_DIR) + "/scenes/railing.gltf";

TEST(Opening, AMeshSceneIsItsViews) {
    const OpenedScene scene = open_scene(kMesh, {});
    ASSERT_TRUE(scene.dataset);
    EXPECT_EQ(scene.dataset->frames.size(), 44u);
    EXPECT_EQ(scene.gaussians->size(), 0u);
    EXPECT_NE(scene.remark.find("mesh scene"), std::string::npos) << scene.remark;
}

TEST(Opening, ARunOnAMeshSceneHasTheRenderedImages) {
    const test::Folder folder;
    std::filesystem::create_directories(folder / "run");
    test::write_file(folder / "run/config.json", "{\"dataset\": \"" + kMesh + "\"}");
    const OpenedScene before = open_scene(folder / "run", {});
    ASSERT_TRUE(before.dataset) << before.remark;
    EXPECT_EQ(before.dataset->frames.size(), 44u);
    EXPECT_FALSE(before.dataset->frames[0].image_exists);
    test::make_dataset(folder / "run/dataset");
    const OpenedScene after = open_scene(folder / "run", {});
    ASSERT_TRUE(after.dataset) << after.remark;
    EXPECT_NE(after.dataset->frames.size(), 44u);
    EXPECT_TRUE(after.dataset->frames[0].image_exists);
}

TEST(Opening, UsdIsNotRead) {
    const test::Folder folder;
    test::make_splats(folder / "s.usdz");
    try {
        open_scene(folder / "s.usdz", {});
        ADD_FAILURE() << "opened";
    } catch (const InputError& error) {
        EXPECT_EQ(std::string(error.what()), folder / "s.usdz" + ": ewa writes USD and does not read it");
    }
}

TEST(Opening, TheSplatsOfARunHaveItsCameras) {
    const test::Folder folder;
    std::filesystem::create_directories(folder / "run");
    test::make_dataset(folder / "data");
    test::make_splats(folder / "run/splats.ply");
    const std::string splats = folder / "run/splats.ply";
    EXPECT_FALSE(open_scene(splats, {}).dataset);
    test::write_file(folder / "run/config.json",
                     R"({"dataset": "data", "downscale": 2, "kernel": "ewa", "background": "1,0,1",
                         "points": true, "nearest": 5})");
    const OpenedScene scene = open_scene(splats, {});
    ASSERT_TRUE(scene.dataset);
    EXPECT_EQ(scene.dataset->frames.size(), 4u);
    EXPECT_EQ(scene.dataset->frames[0].camera.width, 24);
    EXPECT_EQ(scene.look.kernel, Footprint::density);
    EXPECT_TRUE(scene.look.points);
    EXPECT_EQ(scene.look.nearest, 5);
    EXPECT_EQ(scene.look.background, (std::array<float, 3>{1, 0, 1}));
    EXPECT_TRUE(scene.run.empty()) << "a file is not watched";
    EXPECT_TRUE(scene.appearances.empty());
    test::write_file(folder / "run/exposures.json",
                     R"({"0.png": [[1, 0, 0, 0.25], [0, 1, 0, 0], [0, 0, 1, 0]]})");
    const OpenedScene exposed = open_scene(splats, {});
    EXPECT_EQ(exposed.appearances.size(), 1u);
    test::write_file(folder / "run/exposures.json", "no exposures");
    EXPECT_TRUE(open_scene(splats, {}).appearances.empty());
    // A dataset that is named has precedence; one that is gone leaves the splats.
    EXPECT_EQ(open_scene(splats, folder / "data").dataset->frames[0].camera.width, 48);
    test::write_file(folder / "run/config.json", R"({"dataset": "gone"})");
    EXPECT_FALSE(open_scene(splats, {}).dataset);
    EXPECT_EQ(open_scene(splats, {}).gaussians->size(), 50u);
    EXPECT_FALSE(scene.look.sky);
    test::write_file(folder / "run/config.json", R"({"dataset": "data", "background": "sky"})");
    EXPECT_FALSE(open_scene(splats, {}).look.sky);
    test::write_file(folder / "run/sky.json", R"({"size": 1, "texels": [1, 0.5, 0]})");
    ASSERT_TRUE(open_scene(splats, {}).look.sky);
    EXPECT_EQ(open_scene(splats, {}).look.sky->texels, (std::vector<float>{1, 0.5f, 0}));
    test::write_file(folder / "run/sky.json", "no sky");
    EXPECT_FALSE(open_scene(splats, {}).look.sky);
    // Another name is not the run's.
    test::write_file(folder / "run/config.json", R"({"dataset": "data"})");
    std::filesystem::copy_file(splats, folder / "run/mine.ply");
    EXPECT_FALSE(open_scene(folder / "run/mine.ply", {}).dataset);
}

TEST(Opening, AViewThatChangesGetsALevelWithinTheBudget) {
    const test::Folder folder;
    test::make_splats(folder / "s.ply", 1000);
    test::expect_success(
        test::run_ewa({"convert", folder / "s.ply", folder / "l/lod-meta.json", "--levels", "3"}));
    const auto coarse = [&](size_t budget) {
        const OpenedScene scene = open_scene(folder / "l/lod-meta.json", {}, budget);
        EXPECT_EQ(scene.gaussians->size(), 1000u);
        return scene.coarse ? scene.coarse->size() : 0;
    };
    EXPECT_EQ(coarse(1000), 0u) << "all fit";
    EXPECT_EQ(coarse(999), 500u);
    EXPECT_EQ(coarse(499), 250u);
    EXPECT_EQ(coarse(1), 250u) << "there is no coarser one";
    EXPECT_EQ(open_scene(folder / "s.ply", {}, 10).coarse, nullptr) << "no levels";
}

TEST(Opening, ALevelThatIsDamagedOrEmptyIsLeftOut) {
    const test::Folder folder;
    test::make_splats(folder / "s.ply", 1000);
    const std::string levels = folder / "l/lod-meta.json";
    test::expect_success(test::run_ewa({"convert", folder / "s.ply", levels, "--levels", "3"}));
    test::write_file(folder / "l/1_0/means_l.webp", "damaged");
    OpenedScene scene = open_scene(levels, {}, 600);
    EXPECT_EQ(scene.gaussians->size(), 1000u);
    ASSERT_TRUE(scene.coarse);
    EXPECT_EQ(scene.coarse->size(), 250u);
    EXPECT_NE(scene.remark.find("level 1 is not shown: "), std::string::npos) << scene.remark;
    EXPECT_NE(scene.remark.find("means_l.webp"), std::string::npos) << scene.remark;
    test::write_file(folder / "l/2_0/means_l.webp", "damaged");
    scene = open_scene(levels, {}, 600);
    EXPECT_EQ(scene.gaussians->size(), 1000u);
    EXPECT_FALSE(scene.coarse);

    // A fourth level without rows.
    test::expect_success(test::run_ewa({"convert", folder / "s.ply", levels, "--levels", "3"}));
    std::string text = test::read_file(levels);
    const std::string before = "\"lodLevels\":3";
    ASSERT_NE(text.find(before), std::string::npos);
    text.replace(text.find(before), before.size(), "\"lodLevels\":4");
    test::write_file(levels, text);
    scene = open_scene(levels, {}, 100);
    ASSERT_TRUE(scene.coarse);
    EXPECT_EQ(scene.coarse->size(), 250u);
}

TEST(Opening, AnEmptyFileSaysSo) {
    const test::Folder folder;
    test::make_splats(folder / "none.ply", 0, 0);
    const OpenedScene scene = open_scene(folder / "none.ply", {});
    EXPECT_EQ(scene.gaussians->size(), 0u);
    EXPECT_EQ(scene.remark, "none.ply is empty: it has no splats");
}

class Dropping : public testing::Test {
  protected:
    void SetUp() override {
        test::make_splats(splats_);
        test::make_splats(folder_ / "more.ply", 60, 0);
        test::make_dataset(dataset_);
    }
    test::Folder folder_;
    const std::string splats_ = folder_ / "splats.ply", dataset_ = folder_ / "data";
};

TEST_F(Dropping, ADatasetGivesItsCamerasToSplats) {
    const OpenedScene splats = open_dropped({splats_}, {});
    EXPECT_FALSE(splats.dataset);
    const OpenedScene both = open_dropped({dataset_}, splats);
    EXPECT_EQ(both.gaussians, splats.gaussians);
    EXPECT_FALSE(both.points);
    ASSERT_TRUE(both.dataset);
    EXPECT_EQ(both.title, "splats.ply");
    EXPECT_NE(both.remark.find("with the cameras of data; drop it again"), std::string::npos) << both.remark;
    const OpenedScene alone = open_dropped({dataset_}, both);
    EXPECT_TRUE(alone.points);
    EXPECT_EQ(alone.title, "data");
}

TEST_F(Dropping, SplatsTakeTheCamerasOfADataset) {
    const OpenedScene dataset = open_dropped({dataset_}, {});
    const OpenedScene both = open_dropped({splats_}, dataset);
    EXPECT_EQ(both.dataset, dataset.dataset);
    EXPECT_EQ(both.gaussians->size(), 50u);
    EXPECT_EQ(both.remark, "with the cameras of data");
    EXPECT_FALSE(open_dropped({splats_}, both).dataset) << "the cameras belong to other splats";
}

TEST_F(Dropping, OfSeveralFilesEachIsSpokenOf) {
    for (const std::vector<std::filesystem::path>& paths :
         {std::vector<std::filesystem::path>{splats_, dataset_}, {dataset_, splats_}}) {
        const OpenedScene both = open_dropped(paths, {});
        EXPECT_EQ(both.gaussians->size(), 50u);
        EXPECT_TRUE(both.dataset);
        EXPECT_EQ(both.remark, "with the cameras of data");
    }
    const OpenedScene first = open_dropped({splats_, folder_ / "more.ply"}, {});
    EXPECT_EQ(first.gaussians->size(), 50u);
    EXPECT_EQ(first.remark, "one scene is shown at a time: more.ply is left out");
}

TEST_F(Dropping, LevelsKeepToTheBudget) {
    const std::string levels = folder_ / "l/lod-meta.json";
    test::expect_success(test::run_ewa({"convert", splats_, levels, "--levels", "3"}));
    for (const std::vector<std::filesystem::path>& paths :
         {std::vector<std::filesystem::path>{levels}, {levels, dataset_}}) {
        ASSERT_TRUE(open_dropped(paths, {}, 20).coarse);
        EXPECT_EQ(open_dropped(paths, {}, 20).coarse->size(), 13u);
        EXPECT_FALSE(open_dropped(paths, {}, 50).coarse);
    }
}

TEST(Opening, SettingsThatAreNoneLeaveTheSplats) {
    const test::Folder folder;
    std::filesystem::create_directories(folder / "run");
    test::make_splats(folder / "run/splats.ply");
    for (const std::string& config : {std::string(), std::string("[1]"), std::string(400000, '[')}) {
        test::write_file(folder / "run/config.json", config);
        EXPECT_EQ(open_scene(folder / "run", {}).gaussians->size(), 50u) << config.substr(0, 9);
    }
}

}  // namespace
}  // namespace ewa::viewer
