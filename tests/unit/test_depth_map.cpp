// SPDX-License-Identifier: Apache-2.0
// Depth maps of datasets: where they are found, and what they hold.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "ewa/dataset.h"
#include "scene/depth_map.h"
#include "scene/lens.h"
#include "scene/native_lens.h"
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

/// The nearest of a pixel's points, in front of the camera and inside the image. Others than the frame's do not count.
TEST(DepthMap, PointsHaveDepths) {
    Frame frame;
    frame.camera = {.width = 8, .height = 6, .fx = 10, .fy = 10, .cx = 4, .cy = 3};
    frame.camera.translation = {0, 0, 1};
    frame.pinhole = frame.source = frame.camera;
    const std::vector<glm::dvec3> points{{0.01, 0.01, 3}, {0.02, 0.01, 1}, {0.03, 0.01, 2},   {0.62, 0, 1},
                                         {0, 0, -2},      {2, 0, 1},       {-0.5, -0.5, 1.5}, {0.3, 0.3, 1}};
    frame.seen = std::make_shared<const std::vector<uint32_t>>(std::vector<uint32_t>{0, 2, 1, 3, 4, 5, 6});
    const Image depths = depths_of_points(frame, points);
    ASSERT_EQ(depths.channels, 1);
    Image expected(8, 6, 1);
    *expected.at(4, 3) = 2;
    *expected.at(7, 3) = 2;
    *expected.at(2, 1) = 2.5f;
    EXPECT_EQ(depths.pixels, expected.pixels);
    frame.camera.height = 4;
    frame.camera.distortion.lens = Lens::equirectangular;
    scene::set_equirectangular(frame.camera);
    const Image around = depths_of_points(frame, points);
    EXPECT_FLOAT_EQ(*around.at(4, 2), float(glm::length(glm::dvec3(0.02, 0.01, 2))));
    EXPECT_FLOAT_EQ(*around.at(3, 1), float(glm::length(glm::dvec3(0.5, 0.5, 2.5))));
}

/// The tracks of text files. Images that the model lacks do not count, nor does what is no track.
TEST(DepthMap, TracksSayWhichPointsAnImageSees) {
    const TempFolder folder;
    fs::create_directories(folder / "images");
    for (const char* name : {"a.png", "b.png"}) save_image(folder / "images" / name, Image(8, 6, 3));
    folder.write("sparse/0/cameras.txt", "1 PINHOLE 8 6 10 11 4 3\n");
    folder.write("sparse/0/images.txt", "4 1 0 0 0 0 0 0 1 b.png\n\n7 1 0 0 0 0 0 0 1 a.png\n\n");
    folder.write("sparse/0/points3D.txt",
                 "1 1 2 3 0 0 0 0.5 4 17 9 2\n2 1 2 3 0 0 0 0.5\n3 1 2 3 0 0 0 0.5 9 1 4 1 x\n");
    const Dataset dataset = load_dataset(folder.path(), {});
    EXPECT_FALSE(dataset.frames[0].seen);
    EXPECT_EQ(*dataset.frames[1].seen, (std::vector<uint32_t>{0, 2}));
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
    scene.refuse({(scene.folder / "a.png").string(), "there is no such file"});
}

}  // namespace
}  // namespace ewa::test
