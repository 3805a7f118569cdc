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
