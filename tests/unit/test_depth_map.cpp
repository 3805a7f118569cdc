// SPDX-License-Identifier: Apache-2.0
// Depth maps of datasets: where they are found, and what they hold.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "ewa/dataset.h"
#include "scene/depth_map.h"
#include "scene/lens.h"
#include "support/png_bytes.h"
#include "support/temp_folder.h"

namespace ewa::test {
namespace {

namespace fs = std::filesystem;

/// A picture of 8 x 6 pixels with a depth map of that size, in which pixel (x, y) has 1000 + 10 x + y levels.
struct DepthScene {
    TempFolder folder;
    nlohmann::json model = {
        {"fl_x", 10},
        {"w", 8},
        {"h", 6},
        {"frames",
         {{{"file_path", "images/a.png"},
           {"depth_file_path", "maps/a.png"},
           {"transform_matrix", {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}}}}}};

    DepthScene() {
        for (const char* name : {"images", "maps"}) fs::create_directories(folder / name);
        save_image(folder / "images/a.png", Image(8, 6, 3));
        folder.write("maps/a.png", deep_png(levels(8, 6)));
    }
    static Image levels(int width, int height) {
        Image image(width, height, 3);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                std::fill_n(image.at(x, y), 3, float(1000 + 10 * x + y) / 65535.0f);
        return image;
    }
    Dataset load(const DatasetOptions& options = {}) const {
        folder.write("transforms.json", model.dump());
        return load_dataset(folder.path(), options);
    }
    void refuse(std::initializer_list<std::string> parts) const {
        expect_error<InputError>([&] { load_depth_map(load().frames[0]); }, parts);
    }
};

TEST(DepthMap, LevelsHaveAUnit) {
    DepthScene scene;
    Image map = load_depth_map(scene.load().frames[0]);
    ASSERT_EQ(map.channels, 1);
    ASSERT_EQ(map.width, 8);
    for (int y = 0; y < 6; ++y)
        for (int x = 0; x < 8; ++x) EXPECT_NEAR(*map.at(x, y), 0.001 * (1000 + 10 * x + y), 1e-6);
    scene.model["depth_unit_scale_factor"] = 0.25;
    EXPECT_NEAR(*load_depth_map(scene.load().frames[0]).at(3, 2), 0.25 * 1032, 1e-4);
    scene.model["frames"][0]["depth_unit_scale_factor"] = 2;
    EXPECT_NEAR(*load_depth_map(scene.load().frames[0]).at(3, 2), 2064, 1e-3);
    scene.model["depth_unit_scale_factor"] = 0;
    scene.model["frames"][0].erase("depth_unit_scale_factor");
    scene.refuse({"transforms.json: frame 0", "\"depth_unit_scale_factor\" is not above 0"});
}

/// Of another size than the image, and of an image that is downscaled: the middle of four pixels.
TEST(DepthMap, NeighboursThatAgreeAreInterpolated) {
    const DepthScene scene;
    Image map = load_depth_map(scene.load({.downscale = 2}).frames[0]);
    ASSERT_EQ(map.width, 4);
    ASSERT_EQ(map.height, 3);
    EXPECT_NEAR(*map.at(1, 2), 0.001 * (1000 + 10 * 2.5 + 4.5), 1e-6);
    scene.folder.write("maps/a.png", deep_png(DepthScene::levels(16, 12)));
    map = load_depth_map(scene.load().frames[0]);
    ASSERT_EQ(map.width, 8);
    EXPECT_NEAR(*map.at(3, 2), 0.001 * (1000 + 10 * 6.5 + 4.5), 1e-6);
}

TEST(DepthMap, AtAnEdgeTheNearestPixelCounts) {
    Image map(4, 4, 1);
    for (float& depth : map.pixels) depth = 2;
    *map.at(2, 1) = 5;
    EXPECT_EQ(depth_at(map, {1.9f, 1.5f}, 0.2f), 2);
    EXPECT_EQ(depth_at(map, {2.1f, 1.5f}, 0.2f), 5);
    *map.at(2, 1) = NAN;
    EXPECT_EQ(depth_at(map, {1.9f, 1.6f}, 0.2f), 2);
    *map.at(2, 1) = 2.1f;
    EXPECT_FLOAT_EQ(depth_at(map, {2, 1.5f}, 0.2f), 2.05f);
    EXPECT_EQ(depth_at(map, {0.1f, 3.9f}, 0.2f), 2);
    EXPECT_EQ(depth_at(map, {-0.1f, 2}, 0.2f), 0);
    EXPECT_EQ(depth_at(map, {2, 4}, 0.2f), 0);
}

TEST(DepthMap, IsUndistortedAsItsImageIs) {
    DepthScene scene;
    scene.model["k1"] = 0.4;
    const Frame frame = scene.load().frames[0];
    const Image map = load_depth_map(frame);
    ASSERT_EQ(map.width, frame.camera.width);
    ASSERT_FALSE(frame.distortion.none());
    bool moved = false;
    for (int y = 0; y < map.height; ++y)
        for (int x = 0; x < map.width; ++x) {
            const glm::dvec2 at =
                scene::source_pixel(frame.source, frame.distortion, frame.pinhole, {x + 0.5, y + 0.5});
            const double column = std::clamp(at.x - 0.5, 0.0, 7.0), row = std::clamp(at.y - 0.5, 0.0, 5.0);
            EXPECT_NEAR(*map.at(x, y), 0.001 * (1000 + 10 * column + row), 2e-6);
            moved = moved || int(at.x) != x;
        }
    EXPECT_TRUE(moved);
    scene.model["camera_model"] = "OPENCV_FISHEYE";
    scene.refuse({"frame \"images/a.png\"", "depth maps need a pinhole"});
}

/// 0 says that there is no depth, and so does a photo that is transparent there.
TEST(DepthMap, PixelsMayHaveNoDepth) {
    const DepthScene scene;
    Image levels = DepthScene::levels(8, 6);
    std::fill_n(levels.at(5, 1), 3, 0.0f);
    scene.folder.write("maps/a.png", deep_png(levels));
    Image map = load_depth_map(scene.load().frames[0]);
    EXPECT_EQ(*map.at(5, 1), 0);
    EXPECT_GT(*map.at(4, 1), 0);
    Image photo(8, 6, 4);
    for (int x = 0; x < 8; ++x) photo.at(x, 1)[3] = x == 4 ? 0.6f : 0.4f;
    drop_masked(map, Image(8, 6, 3));
    EXPECT_GT(*map.at(3, 1), 0);
    drop_masked(map, photo);
    EXPECT_EQ(*map.at(3, 1), 0);
    EXPECT_GT(*map.at(4, 1), 0);
}

/// Beside images/, without a name in the model.
TEST(DepthMap, FoldersAreFound) {
    DepthScene scene;
    scene.model["frames"][0].erase("depth_file_path");
    EXPECT_TRUE(scene.load().frames[0].depth_path.empty());
    fs::create_directories(scene.folder / "depths");
    for (const char* name : {"depths/a.png", "depths/a.png.png", "depths/a.exr", "depths/a.png.exr"}) {
        scene.folder.write(name, "");
        EXPECT_EQ(scene.load().frames[0].depth_path, scene.folder / name) << name;
    }
    fs::create_directories(scene.folder / "depth");
    scene.folder.write("depth/a.png", "");
    EXPECT_EQ(scene.load().frames[0].depth_path, scene.folder / "depth/a.png");
}

TEST(DepthMap, NamesWhatIsWrong) {
    DepthScene scene;
    scene.folder.write("maps/a.png", deep_png(DepthScene::levels(8, 5)));
    scene.refuse({"maps/a.png: the depth map is 8 x 5 pixels, its image 8 x 6"});
    save_image(scene.folder / "maps/a.png", Image(8, 6, 3));
    scene.refuse({"maps/a.png", "8 bits a pixel"});
    const std::string whole = deep_png(DepthScene::levels(8, 6));
    scene.folder.write("maps/a.png", whole.substr(0, whole.size() / 2));
    scene.refuse({"maps/a.png"});
    fs::remove(scene.folder / "maps/a.png");
    scene.refuse({"maps/a.png"});
    scene.model["frames"][0]["depth_file_path"] = "maps/a.npy";
    scene.folder.write("maps/a.npy", "");
    scene.refuse({"maps/a.npy: is no depth map; .exr and .png"});
    scene.model["frames"][0]["depth_file_path"] = "../a.png";
    scene.refuse({"frame 0", "\"depth_file_path\"", "leaves the file's folder"});
}

}  // namespace
}  // namespace ewa::test
