// SPDX-License-Identifier: Apache-2.0
// What a path is opened as.
#include <gtest/gtest.h>

#include <filesystem>

#include "cli/program.h"
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

TEST(Opening, TheSplatsOfARunHaveItsCameras) {
    const test::Folder folder;
    std::filesystem::create_directories(folder / "run");
    test::make_dataset(folder / "data");
    test::make_splats(folder / "run/splats.ply");
    const std::string splats = folder / "run/splats.ply";
    EXPECT_FALSE(open_scene(splats, {}).dataset);
    test::write_file(folder / "run/config.json",
                     R"({"dataset": "data", "downscale": 2, "kernel": "ewa", "background": "1,0,1"})");
    const OpenedScene scene = open_scene(splats, {});
    ASSERT_TRUE(scene.dataset);
    EXPECT_EQ(scene.dataset->frames.size(), 4u);
    EXPECT_EQ(scene.dataset->frames[0].camera.width, 24);
    EXPECT_EQ(scene.look.kernel, Footprint::unit_mass);
    EXPECT_EQ(scene.look.background, (std::array<float, 3>{1, 0, 1}));
    EXPECT_TRUE(scene.run.empty()) << "a file is not watched";
    // A dataset that is named has precedence; one that is gone leaves the splats.
    EXPECT_EQ(open_scene(splats, folder / "data").dataset->frames[0].camera.width, 48);
    test::write_file(folder / "run/config.json", R"({"dataset": "gone"})");
    EXPECT_FALSE(open_scene(splats, {}).dataset);
    EXPECT_EQ(open_scene(splats, {}).gaussians->size(), 50u);
    // Another name is not the run's.
    test::write_file(folder / "run/config.json", R"({"dataset": "data"})");
    std::filesystem::copy_file(splats, folder / "run/mine.ply");
    EXPECT_FALSE(open_scene(folder / "run/mine.ply", {}).dataset);
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
