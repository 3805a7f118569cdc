// SPDX-License-Identifier: Apache-2.0
// The file in which `ewa bench` hands splats to ewa-bench.
#include "scene/scene_file.h"

#include <gtest/gtest.h>

#include "support/splat_scenes.h"
#include "support/temp_folder.h"

namespace ewa::scene {
namespace {

SceneFile some_scene() {
    SceneFile scene{test::storable_splats(7, 20, 2), {}};
    scene.gaussians.density = true;
    scene.gaussians.origin = {1e7, -2, 0.125};
    scene.camera = {64, 48, 70, 66, 31.3, 24.8, glm::dmat3(0, 1, 0, -1, 0, 0, 0, 0, 1), {1, 2, 3}};
    return scene;
}

TEST(SceneFile, KeepsEveryValue) {
    const test::TempFolder folder;
    const SceneFile scene = some_scene();
    write_scene_file(folder / "a", scene);
    const SceneFile read = read_scene_file(folder / "a");
    EXPECT_EQ(read.gaussians.sh_degree, 2);
    EXPECT_TRUE(read.gaussians.density);
    EXPECT_EQ(read.gaussians.origin, scene.gaussians.origin);
    EXPECT_EQ(read.gaussians.means, scene.gaussians.means);
    EXPECT_EQ(read.gaussians.quaternions, scene.gaussians.quaternions);
    EXPECT_EQ(read.gaussians.log_scales, scene.gaussians.log_scales);
    EXPECT_EQ(read.gaussians.opacity_logits, scene.gaussians.opacity_logits);
    EXPECT_EQ(read.gaussians.sh, scene.gaussians.sh);
    EXPECT_EQ(read.camera.width, 64);
    EXPECT_EQ(read.camera.height, 48);
    EXPECT_EQ(read.camera.fx, 70);
    EXPECT_EQ(read.camera.fy, 66);
    EXPECT_EQ(read.camera.cx, 31.3);
    EXPECT_EQ(read.camera.cy, 24.8);
    EXPECT_EQ(read.camera.rotation, scene.camera.rotation);
    EXPECT_EQ(read.camera.translation, scene.camera.translation);
}

TEST(SceneFile, OtherAndBrokenFilesAreRefused) {
    const test::TempFolder folder;
    write_scene_file(folder / "a", some_scene());
    const std::string good = test::file_bytes(folder / "a");
    folder.write("none", "");
    folder.write("splats.ply", std::string(500, 'p'));
    folder.write("short", good.substr(0, good.size() - 1));
    folder.write("long", good + "x");
    std::string degree = good;
    degree[16] = 4;  // behind the magic and the number of splats
    folder.write("degree", degree);
    std::string many = good;
    many[14] = 1;  // 2^48 splats
    folder.write("many", many);
    for (const char* name : {"missing", "none", "splats.ply", "short", "long", "degree", "many"})
        EXPECT_THROW(read_scene_file(folder / name), InputError) << name;
}

}  // namespace
}  // namespace ewa::scene
