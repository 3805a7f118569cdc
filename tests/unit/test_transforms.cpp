// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/json.h"
#include "ewa/dataset.h"
#include "io/datasets/image_records.h"
#include "scene/lens.h"
#include "scene/readout.h"
#include "support/temp_folder.h"
#include "support/transforms_scene.h"

namespace {

using namespace ewa;
using nlohmann::json;
using test::expect_error;
using test::TempFolder;
using Scene = test::TransformsScene;
using test::kTransformsPose;

TEST(Transforms, InstantNgp) {
    Scene scene;
    const Dataset dataset = scene.load();
    ASSERT_EQ(dataset.frames.size(), 2u);
    EXPECT_EQ(dataset.frames[0].name, "images/a.png");
    const Camera& camera = dataset.frames[1].camera;
    EXPECT_EQ(dataset.frames[1].name, "images/b.png");
    EXPECT_EQ(dataset.frames[1].split, 0);
    EXPECT_EQ(camera.width, 8);
    EXPECT_EQ(camera.height, 6);
    EXPECT_EQ(camera.fx, 10);
    EXPECT_EQ(camera.fy, 11);
    EXPECT_EQ(camera.cx, 4.5);
    EXPECT_EQ(camera.cy, 2.5);
    // The world is the file's: the camera stands where the matrix says, a point ahead is at (-x), one above
    // at +z.
    EXPECT_NEAR(glm::length(camera.position() - glm::dvec3(1, 2, 3)), 0, 1e-15);
    const auto to_camera = [&](const glm::dvec3& p) { return camera.rotation * p + camera.translation; };
    EXPECT_NEAR(glm::length(to_camera({-4, 2, 3}) - glm::dvec3(0, 0, 5)), 0, 1e-14);
    EXPECT_NEAR(glm::length(to_camera({1, 2, 4}) - glm::dvec3(0, -1, 0)), 0, 1e-14);
    EXPECT_NEAR(glm::length(to_camera({1, 3, 3}) - glm::dvec3(1, 0, 0)), 0, 1e-14);
    EXPECT_EQ(load_dataset(scene.folder / "transforms.json", {}).frames.size(), 2u);
}

TEST(Transforms, NerfstudioFramesHaveTheirOwnIntrinsicsAndPoints) {
    Scene scene;
    scene.model["camera_model"] = "OPENCV";
    scene.model["applied_transform"] = {{0, 1, 0, 0}, {1, 0, 0, 0}, {0, 0, -1, 0}};
    scene.model["frames"][0].update({{"fl_x", 20}, {"fl_y", 21}, {"cx", 3}, {"camera_model", "PINHOLE"}});
    scene.model["ply_file_path"] = "sparse.ply";
    scene.folder.write("sparse.ply",
                       "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
                       "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
                       "end_header\n1 2 3 4 5 6\nnan 0 0 0 0 0\n");
    const Dataset dataset = scene.load();
    EXPECT_EQ(dataset.frames[0].camera.fx, 10);
    EXPECT_EQ(dataset.frames[1].camera.fx, 20);
    EXPECT_EQ(dataset.frames[1].camera.fy, 21);
    EXPECT_EQ(dataset.frames[1].camera.cx, 3);
    EXPECT_EQ(dataset.frames[1].camera.cy, 2.5);
    EXPECT_EQ(dataset.points.positions, (std::vector<glm::dvec3>{{1, 2, 3}}));
    EXPECT_EQ(dataset.points.colors[0], (std::array<uint8_t, 3>{4, 5, 6}));
    EXPECT_EQ(dataset.dropped_points, 1);
    EXPECT_NEAR(glm::length(dataset.frames[0].camera.position() - glm::dvec3(1, 2, 3)), 0, 1e-15);
    std::filesystem::remove(scene.folder / "sparse.ply");
    scene.refuse({"sparse.ply"});
    EXPECT_EQ(scene.load(false).frames.size(), 2u);
}

TEST(Transforms, TheProgramShowsInTheKeys) {
    Scene scene;
    EXPECT_EQ(scene.load().program, "instant-ngp");
    EXPECT_EQ(scene.load().format, "transforms");
    scene.model["applied_transform"] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
    EXPECT_EQ(scene.load().program, "nerfstudio");
}

TEST(Transforms, BlenderSplits) {
    TempFolder folder;
    for (const char* set : {"train", "test", "val"}) {
        const json model = {{"camera_angle_x", 2 * std::atan(0.5)},
                            {"frames",
                             {test::transforms_frame(std::string("./") + set + "/r_0"),
                              test::transforms_frame(std::string("./") + set + "/r_1")}}};
        folder.write(std::string("transforms_") + set + ".json", model.dump());
        std::filesystem::create_directories(folder / set);
        save_image(folder / set / "r_0.png", Image(8, 6, 4));
    }
    const Dataset dataset = load_dataset(folder.path(), {});
    ASSERT_EQ(dataset.frames.size(), 2u);
    EXPECT_EQ(dataset.missing_images, 2);
    EXPECT_EQ(dataset.frames[0].name, "test/r_0.png");
    EXPECT_EQ(dataset.frames[0].split, 2);
    EXPECT_EQ(dataset.frames[1].name, "train/r_0.png");
    EXPECT_EQ(dataset.frames[1].split, 1);
    EXPECT_NEAR(dataset.frames[0].camera.fx, 8, 1e-12);
    EXPECT_NEAR(dataset.frames[0].camera.fy, 8, 1e-12);
    EXPECT_EQ(dataset.frames[0].camera.cx, 4);
    EXPECT_EQ(dataset.frames[0].camera.cy, 3);
    const Split split = split_frames(dataset, 1);
    EXPECT_EQ(split.train, std::vector<int>{1});
    EXPECT_EQ(split.test, std::vector<int>{0});
    EXPECT_EQ(load_frame_image(dataset.frames[0]).channels, 4);
    // Without their pictures the sizes of r_1 are not known.
    DatasetOptions cameras_only;
    cameras_only.need_images = false;
    EXPECT_EQ(load_dataset(folder.path(), cameras_only).frames.size(), 2u);
    EXPECT_EQ(load_dataset(folder / "transforms_val.json", {}).frames.size(), 1u);
}

TEST(Transforms, MissingImagesAreCounted) {
    Scene scene;
    std::filesystem::remove(scene.folder / "images" / "a.png");
    EXPECT_EQ(scene.load().frames.size(), 1u);
    EXPECT_EQ(scene.load().missing_images, 1);
    EXPECT_EQ(scene.load(false).frames.size(), 2u);
    std::filesystem::remove(scene.folder / "images" / "b.png");
    scene.refuse({"none of the 2 images"});
    save_image(scene.folder / "images" / "b.png", Image(6, 8, 3));
    scene.refuse({"b.png", "6 x 8", "8 x 6"});
}

TEST(Transforms, AnImageWithTwoCamerasIsNoted) {
    Scene scene;
    scene.model["frames"] = {test::transforms_frame("images/b.png"), test::transforms_frame("images/b.png")};
    const Dataset dataset = scene.load();
    EXPECT_EQ(dataset.frames.size(), 2u);
    ASSERT_EQ(dataset.notes.size(), 1u);
    EXPECT_NE(dataset.notes[0].find("images/b.png has several cameras"), std::string::npos);
}

TEST(Transforms, RotationsAreMadeOrthonormal) {
    Scene scene;
    json& matrix = scene.model["frames"][0]["transform_matrix"];
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
            matrix[size_t(row)][size_t(column)] =
                3 * (kTransformsPose[size_t(row)][size_t(column)].get<double>() + 3e-4 * (row - column));
    const glm::dmat3 r = scene.load().frames[1].camera.rotation;
    const glm::dmat3 product = glm::transpose(r) * r;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) EXPECT_NEAR(product[i][j], i == j, 1e-14);
    EXPECT_NEAR(r[0][2], -1, 1e-3);
    const auto refuse = [&](json wrong, const char* part) {
        matrix = std::move(wrong);
        scene.refuse({"transforms.json: frame 0", part});
    };
    refuse({{0, 0, 1, 1}, {1, 0, 0, 2}, {0, 1.1, 0, 3}, {0, 0, 0, 1}}, "right angles");
    refuse({{0, 0, 1, 1}, {1, 0.1, 0, 2}, {0, 1, 0, 3}, {0, 0, 0, 1}}, "right angles");
    refuse({{0, 0, 1, 1}, {1, 0, 0, 2}, {0, -1, 0, 3}, {0, 0, 0, 1}}, "mirrors");
    refuse({{0, 0, 0, 1}, {0, 0, 0, 2}, {0, 0, 0, 3}, {0, 0, 0, 1}}, "degenerate");
    refuse({{0, 0, 1, 1}, {1, 0, 0, 2}}, "rows");
    refuse({{0, 0, 1, 1}, {1, 0, 0}, {0, 1, 0, 3}}, "rows of 4 finite numbers");
    refuse({{0, 0, 1, "x"}, {1, 0, 0, 2}, {0, 1, 0, 3}}, "finite number");
    refuse("text", "rows");
}

/// An angle of view is equidistant for a fisheye, and parallel rays have none.
/// The width is the whole circle, and an angle has as many pixels upright.
TEST(Transforms, RollingShutters) {
    Scene scene;
    json later = kTransformsPose;
    later[0][3] = 1.5;
    json& first = scene.model["frames"][0];
    first["rolling_shutter"] = "bottom-to-top";
    scene.refuse({"frame 0", "\"transform_matrix_start\" is missing"});
    first["transform_matrix_start"] = kTransformsPose;
    scene.refuse({"frame 0", "\"transform_matrix_end\" is missing"});
    first["transform_matrix_end"] = later;
    first.erase("transform_matrix");
    const Dataset dataset = scene.load();
    EXPECT_FALSE(dataset.frames[0].camera.readout);
    const Camera& camera = dataset.frames[1].camera;
    ASSERT_TRUE(camera.readout);
    EXPECT_EQ(camera.readout->from, ReadoutFrom::bottom);
    EXPECT_NEAR(camera.position().x, 1, 1e-12);
    const Camera end = scene::at_share(camera, 1);
    EXPECT_NEAR(end.position().x, 1.5, 1e-12);

    io::TransformsFile file;
    file.frames.push_back({"images/b.png", "", camera});
    io::write_transforms(scene.folder / "transforms.json", file);
    const Camera again = load_dataset(scene.folder.path(), {}).frames[0].camera;
    ASSERT_TRUE(again.readout);
    EXPECT_EQ(again.readout->from, ReadoutFrom::bottom);
    EXPECT_NEAR(again.position().x, 1, 1e-12);
    EXPECT_NEAR(scene::at_share(again, 1).position().x, 1.5, 1e-12);
    const json written = core::read_json_file<json>(scene.folder / "transforms.json");
    EXPECT_NEAR(written["frames"][0]["transform_matrix"][0][3].get<double>(), 1.25, 1e-12);

    first["rolling_shutter"] = "sideways";
    scene.refuse({"frame 0", "\"rolling_shutter\"", "'sideways'", "top-to-bottom"});
    first["rolling_shutter"] = "top-to-bottom";
    first["k1"] = 0.01;
    EXPECT_FALSE(scene.load().frames[1].camera.distortion.none());
    scene.write();
    expect_error<InputError>([&] { load_dataset(scene.folder.path(), {.lens = LensUse::undistort}); },
                             {"rolling shutter", "undistorted"});
    // Poses that no readout uses are named.
    first.erase("rolling_shutter");
    first["transform_matrix"] = kTransformsPose;
    ASSERT_EQ(scene.load().notes.size(), 1u);
    EXPECT_NE(scene.load().notes[0].find("transform_matrix_start"), std::string::npos);
    first["rolling_shutter"] = "global";
    EXPECT_TRUE(scene.load().notes.empty());
    // Half a turn about the camera's own axis, and an end that is too far away.
    first["rolling_shutter"] = "top-to-bottom";
    json around = later;
    for (size_t row = 0; row < 3; ++row)
        for (size_t column = 0; column < 2; ++column)
            around[row][column] = -around[row][column].get<double>();
    first["transform_matrix_end"] = around;
    scene.refuse({"frame \"", "more than 90 degrees"});
    later[0][3] = 1e300;
    first["transform_matrix_end"] = later;
    scene.refuse({"frame \"", "not a finite number"});
}

TEST(Transforms, NamesWhatIsWrong) {
    const auto refuse = [](const char* key, json value, std::initializer_list<std::string> parts) {
        Scene scene;
        scene.model[key] = std::move(value);
        scene.refuse(parts);
    };
    refuse("fl_x", 0, {"not positive"});
    refuse("fl_x", "ten", {"\"fl_x\"", "not a finite number"});
    refuse("w", 7.5, {"\"w\""});
    refuse("w", -8, {"\"w\""});
    refuse("w", 1e12, {"\"w\""});
    refuse("frames", 3, {"\"frames\""});
    refuse("frames", json::array(), {"no images"});
    refuse("frames", {3}, {"frame 0", "object"});
    refuse("frames", {{{"file_path", "a.png"}}}, {"frame 0", "transform_matrix"});
    refuse("frames", {{{"transform_matrix", kTransformsPose}}}, {"frame 0", "file_path"});
    refuse("frames", {{{"transform_matrix", kTransformsPose}, {"file_path", 3}}}, {"frame 0", "file_path"});
    refuse("k1", -3, {"folds"});
    Scene scene;
    scene.model.erase("fl_x");
    scene.refuse({"camera_angle_x"});
    scene.model["camera_angle_x"] = 4;
    scene.refuse({"camera_angle_x", "radians"});
    scene.folder.write("transforms.json", "[1, 2]");
    expect_error<InputError>([&] { load_dataset(scene.folder.path(), {}); }, {"transforms.json"});
    scene.folder.write("transforms.json", "{\"frames\": [\n  oops\n]}");
    expect_error<InputError>([&] { load_dataset(scene.folder.path(), {}); }, {"transforms.json: byte 16"});
    scene.folder.write("transforms.json", "{\"fl_x\": 1e999}");
    expect_error<InputError>([&] { load_dataset(scene.folder.path(), {}); }, {"transforms.json"});
    scene.folder.write("transforms.json", std::string(1000000, '['));
    expect_error<InputError>([&] { load_dataset(scene.folder.path(), {}); },
                             {"transforms.json", "64 levels"});
}

TEST(Transforms, NamesStayInTheFolder) {
    const TempFolder elsewhere;
    save_image(elsewhere / "secret.png", Image(8, 6, 3));
    elsewhere.write("secret.ply", "ply\n");
    const std::string absolute = (elsewhere / "secret").string();
    const std::string beside = "../" + elsewhere.path().filename().string() + "/secret";
    // What lies elsewhere is not read: paths are those of another machine.
    for (const std::string& name : {beside, absolute, std::string("images/../../secret"),
                                    std::string("..\\secret"), std::string("C:\\secret")}) {
        Scene scene;
        for (const char* extension : {"", ".png"}) {
            scene.model["frames"][1]["file_path"] = name + extension;
            EXPECT_EQ(scene.load().frames.size(), 1u);
        }
        scene.model["frames"][1]["file_path"] = "images/a.png";
        scene.model["frames"][1]["mask_path"] = name + ".png";
        for (const Frame& frame : scene.load().frames) EXPECT_EQ(frame.mask_path, "");
        scene.model["frames"][1].erase("mask_path");
        scene.model["ply_file_path"] = name + ".ply";
        scene.refuse({scene.folder.path().string(), "secret.ply: cannot be read"});
    }
    Scene scene;
    scene.model["frames"][1]["file_path"] = std::string("images/a.png\0", 13);
    scene.refuse({"transforms.json: frame 1", "has no file's name"});
    scene.model["frames"][1]["file_path"] = "images/a.png";
    scene.model["frames"][1]["mask_path"] = "..";
    scene.refuse({"transforms.json: frame 1", "\"mask_path\"", "names no file"});
}

TEST(Transforms, LinksLeadOutOfNoFolder) {
    namespace fs = std::filesystem;
    const TempFolder elsewhere;
    save_image(elsewhere / "a.png", Image(8, 6, 3));
    Scene scene;
    fs::remove(scene.folder / "images/a.png");
    fs::create_symlink(elsewhere / "a.png", scene.folder / "images/a.png");
    scene.refuse({"frame 1", "a.png\" is a link out of", "cp -rL"});
    scene.model["frames"][1]["file_path"] = "images/a";
    scene.refuse({"frame 1", "images/a", "link out of"});
    scene.model["frames"][1]["file_path"] = "images/out/a.png";
    fs::create_symlink(elsewhere.path(), scene.folder / "images/out");
    scene.refuse({"frame 1", "images/out/a.png", "link out of"});
    scene.model["frames"][1].update({{"file_path", "images/b.png"}, {"mask_path", "images/out/a.png"}});
    scene.refuse({"frame 1", "\"mask_path\"", "link out of"});
    // Masks and smaller copies that the model does not name.
    scene.model["frames"][1].erase("mask_path");
    EXPECT_EQ(scene.load().frames.size(), 2u);
    fs::create_directories(scene.folder / "masks");
    fs::create_symlink(elsewhere / "a.png", scene.folder / "masks/b.png");
    scene.refuse({"masks/b.png", "link out of"});
    fs::remove_all(scene.folder / "masks");
    fs::create_directories(scene.folder / "images_2");
    fs::create_symlink(elsewhere / "a.png", scene.folder / "images_2/b.png");
    expect_error<InputError>([&] { load_dataset(scene.folder.path(), {.downscale = 2}); },
                             {"images_2/b.png", "link out of"});
    // The folder of the pictures, and the dataset's own, may be links.
    save_image(elsewhere / "b.png", Image(8, 6, 3));
    fs::remove_all(scene.folder / "images");
    fs::create_symlink(elsewhere.path(), scene.folder / "images");
    fs::create_symlink(scene.folder.path(), elsewhere / "dataset");
    EXPECT_EQ(scene.load().missing_images, 0);
    EXPECT_EQ(load_dataset(elsewhere / "dataset", {}).missing_images, 0);
}

TEST(Transforms, EveryCutIsAnError) {
    const Scene scene;
    const auto path = scene.write();
    EXPECT_EQ(test::read_every_cut(path, scene.model.dump(), [&] { load_dataset(path, {}); }), 0u);
}

TEST(Transforms, RealScene) {
    const auto data = test::shared_data();
    if (!data) GTEST_SKIP() << "no real inputs here";
    const Dataset dataset = load_dataset(*data / "fox_nerf", {});
    EXPECT_EQ(dataset.frames.size() + size_t(dataset.missing_images), 67u);
    EXPECT_EQ(dataset.frames.size(), 50u);
    const Frame& frame = dataset.frames[0];
    EXPECT_EQ(frame.distortion.k1, 0.0578421);
    EXPECT_EQ(frame.camera.fx, frame.source.fx);
    EXPECT_NEAR(frame.camera.width, 270, 5);
    EXPECT_NE(frame.camera.cx, frame.source.cx);
    EXPECT_EQ(load_frame_image(frame).width, frame.camera.width);
}

/// Python's json writes them.
TEST(Transforms, NumbersThatAreNotFiniteCountWhereTheyAreUsed) {
    Scene scene;
    const auto with = [&](const std::string& key, const std::string& value) {
        std::string text = scene.model.dump();
        const std::string entry = "\"" + key + "\":" + value + ",";
        text.insert(text.find("\"file_path\""), entry);
        return text.insert(1, entry);
    };
    for (const char* number : {"NaN", "Infinity", "-Infinity"}) {
        scene.folder.write("transforms.json", with("sharpness", number));
        EXPECT_EQ(load_dataset(scene.folder.path(), {}).frames.size(), 2u);
        for (const char* key : {"w", "fl_x", "cx", "k1", "depth_unit_scale_factor", "is_fisheye"}) {
            scene.folder.write("transforms.json", with(key, number));
            expect_error<InputError>(
                [&] { load_dataset(scene.folder.path(), {}); },
                {"transforms.json: frame 0: \"" + std::string(key) + "\" is not a finite number"});
        }
        std::string text = scene.model.dump();
        const std::string row = "[[0,0,1,1]";
        scene.folder.write("transforms.json",
                           text.replace(text.find(row), row.size(), "[[0,0," + std::string(number) + ",1]"));
        expect_error<InputError>([&] { load_dataset(scene.folder.path(), {}); },
                                 {"\"transform_matrix\" is not 3 or 4 rows of 4 finite numbers"});
    }
}

}  // namespace
