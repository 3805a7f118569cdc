// SPDX-License-Identifier: Apache-2.0
// The lenses of transforms.json, and numbers that no lens has.
#include <cmath>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <numbers>

#include "ewa/dataset.h"
#include "io/datasets/image_records.h"
#include "scene/lens.h"
#include "support/transforms_scene.h"

namespace {

using namespace ewa;
using nlohmann::json;
using Scene = test::TransformsScene;

TEST(TransformsLenses, NerfstudiosListOfTerms) {
    Scene scene;
    scene.model["camera_model"] = "OPENCV_FISHEYE";
    scene.model["distortion_params"] = {0.04, -0.01, 0.003, -0.001, 0, 0};
    scene.model["frames"][0].update(
        {{"camera_model", "OPENCV"}, {"distortion_params", {-0.1, 0.02, 0.001, 0, 0.003, -0.002}}});
    const Dataset dataset = scene.load();
    EXPECT_EQ(dataset.frames[0].distortion,
              (Distortion{.k1 = 0.04, .k2 = -0.01, .k3 = 0.003, .k4 = -0.001, .lens = Lens::fisheye}));
    EXPECT_EQ(dataset.frames[1].distortion,
              (Distortion{.k1 = -0.1, .k2 = 0.02, .p1 = 0.003, .p2 = -0.002, .k3 = 0.001}));
    scene.model["frames"][0]["distortion_params"] = {0.1, 0.2, 0.3, 0.4, 0, 0};
    scene.refuse({"the distortion term k4 is not supported"});
    scene.model["frames"][0]["distortion_params"] = {0.1, 0.2};
    scene.refuse({"frame 0", "\"distortion_params\" is not a list of 6 finite numbers"});
    scene.model["frames"][0]["distortion_params"] = {0.1, 0.2, 0, 0, 0, "x"};
    scene.refuse({"\"distortion_params\" is not a list of 6 finite numbers"});
}

TEST(TransformsLenses, Fisheye624IsProjectArias) {
    Scene scene;
    scene.model["camera_model"] = "FISHEYE624";
    scene.model["fisheye_crop_radius"] = 700;
    scene.refuse({"\"distortion_params\" is missing"});
    scene.model["distortion_params"] = {0.03,   -0.02, 0.01,  -0.004, 0.002, -0.001,
                                        0.0031, 0.002, 0.004, -0.003, 0.005, -0.006};
    const Dataset dataset = scene.load();
    ASSERT_EQ(dataset.notes.size(), 1u);
    EXPECT_NE(dataset.notes[0].find("fisheye_crop_radius"), std::string::npos);
    const Distortion& lens = dataset.frames[0].distortion;
    const glm::dvec2 ray(0.4, -0.3);
    const glm::dvec2 q = ray * (std::atan(0.5) / 0.5);
    const double w = glm::dot(q, q);
    const glm::dvec2 p =
        q * (1 + w * (0.03 + w * (-0.02 + w * (0.01 + w * (-0.004 + w * (0.002 + w * -0.001))))));
    // Aria: p + 2 (p . t) p + |p|^2 t with t = (p0, p1), then the thin prism of |p|^2.
    const glm::dvec2 t(0.0031, 0.002);
    const double p2 = glm::dot(p, p);
    const glm::dvec2 expected =
        p + 2 * glm::dot(p, t) * p + p2 * t + p2 * glm::dvec2(0.004 - 0.003 * p2, 0.005 - 0.006 * p2);
    EXPECT_NEAR(glm::length(scene::distort(lens, ray) - expected), 0, 1e-15);
}

TEST(TransformsLenses, ModelsOfNerfstudioThatAreNoLens) {
    Scene scene;
    scene.model["camera_model"] = "ORTHOPHOTO";
    EXPECT_EQ(scene.load().frames[0].camera.distortion.lens, Lens::orthographic);
    for (const char* model : {"OMNIDIRECTIONALSTEREO_L", "VR180_R"}) {
        scene.model["camera_model"] = model;
        scene.refuse({"the camera model", model, "another place for each direction; export"});
    }
}

TEST(TransformsLenses, Lenses) {
    Scene scene;
    scene.model.update({{"k1", 0.01}, {"k2", 0.02}, {"k3", 0.03}, {"p1", 0.001}, {"p2", 0.002}});
    Distortion expected{0.01, 0.02, 0.001, 0.002, 0.03};
    EXPECT_EQ(scene.load().frames[0].distortion, expected);
    scene.model["camera_model"] = "FULL_OPENCV";
    scene.model.update({{"k4", 0.04}, {"k5", 0.05}, {"k6", 0.06}});
    expected.k4 = 0.04, expected.k5 = 0.05, expected.k6 = 0.06;
    EXPECT_EQ(scene.load().frames[0].distortion, expected);
    scene.model.update({{"s1", 0.001}, {"s2", -0.002}, {"s3", 0.003}, {"s4", -0.004}});
    expected.s1 = 0.001, expected.s2 = -0.002, expected.s3 = 0.003, expected.s4 = -0.004;
    const Frame prism = scene.load().frames[0];
    EXPECT_EQ(prism.distortion, expected);
    Camera through = prism.source;
    through.distortion = expected;
    io::TransformsFile file;
    file.frames.push_back({"images/b.png", "", through});
    io::write_transforms(scene.folder / "transforms.json", file);
    EXPECT_EQ(load_dataset(scene.folder.path(), {}).frames[0].distortion, expected);
    for (const char* how : {"camera_model", "is_fisheye"}) {
        Scene fisheye;
        fisheye.model.update({{"k1", 0.01}, {"k2", 0.02}, {"k3", 0.03}, {"k4", 0.04}});
        fisheye.model[how] = std::string(how) == "is_fisheye" ? json(true) : json("OPENCV_FISHEYE");
        const Frame frame = fisheye.load().frames[0];
        EXPECT_EQ(frame.distortion,
                  (Distortion{.k1 = 0.01, .k2 = 0.02, .k3 = 0.03, .k4 = 0.04, .lens = Lens::fisheye}));
        EXPECT_GT(frame.camera.width, frame.source.width - 2);
    }
}

TEST(TransformsLenses, OnlyAFisheyeIsAFisheye) {
    Scene scene;
    scene.model["k1"] = 0.01;
    for (const json& flag : {json(false), json(0)}) {
        scene.model["is_fisheye"] = flag;
        EXPECT_EQ(scene.load().frames[0].distortion.lens, Lens::brown);
    }
    for (const json& flag : {json("false"), json("true"), json::array()}) {
        scene.model["is_fisheye"] = flag;
        scene.refuse({"frame 0", "\"is_fisheye\" is neither true nor false"});
    }
}

TEST(TransformsLenses, AnglesOfViewAreThoseOfTheLens) {
    Scene scene;
    scene.model.erase("fl_x");
    scene.model.erase("fl_y");
    scene.model["camera_angle_x"] = 4.0;
    scene.model["camera_angle_y"] = 3.0;
    scene.model["camera_model"] = "OPENCV_FISHEYE";
    const Camera camera = scene.load().frames[0].source;
    EXPECT_NEAR(camera.fx, 8 / 4.0, 1e-12);
    EXPECT_NEAR(camera.fy, 6 / 3.0, 1e-12);
    scene.model["camera_angle_x"] = 7.0;
    scene.refuse({"\"camera_angle_x\"", "2 pi"});
    scene.model["camera_model"] = "ORTHOGRAPHIC";
    scene.refuse({"\"camera_angle_x\" says nothing of parallel rays", "\"fl_x\""});
    scene.model.erase("camera_angle_x");
    scene.refuse({"\"fl_x\" is missing, the pixels per world unit"});
}

TEST(TransformsLenses, PanoramasThatAreNot2To1) {
    Scene scene;
    scene.model["camera_model"] = "EQUIRECTANGULAR";
    scene.refuse({"frame 0", "8 x 6 pixels is higher than half its width"});
    for (const char* name : {"a.png", "b.png"}) save_image(scene.folder / "images" / name, Image(8, 4, 3));
    scene.model["h"] = 4;
    const Dataset whole = scene.load();
    EXPECT_TRUE(whole.notes.empty());
    EXPECT_NEAR(whole.frames[0].camera.fy, 4 / std::numbers::pi, 1e-12);
    for (const char* name : {"a.png", "b.png"}) save_image(scene.folder / "images" / name, Image(8, 2, 3));
    scene.model["h"] = 2;
    const Dataset part = scene.load();
    EXPECT_NEAR(part.frames[0].camera.fx, 8 / (2 * std::numbers::pi), 1e-12);
    EXPECT_EQ(part.frames[0].camera.fy, part.frames[0].camera.fx);
    ASSERT_EQ(part.notes.size(), 1u);
    EXPECT_NE(part.notes[0].find("8 x 2"), std::string::npos);
    EXPECT_NE(part.notes[0].find("90 degrees upright"), std::string::npos);
}

TEST(TransformsLenses, NumbersOfNoCamera) {
    const auto refuse = [](const char* model, const char* key, double value, const char* part) {
        SCOPED_TRACE(std::string(model) + " " + key);
        Scene scene;
        scene.model["camera_model"] = model;
        scene.model[key] = value;
        scene.refuse({"frame \"", part});
    };
    for (const char* model : {"PINHOLE", "OPENCV_FISHEYE", "ORTHOGRAPHIC"}) {
        for (const double focal : {1e30, 1e-30}) {
            refuse(model, "fl_x", focal, "a focal length of 1e");
            refuse(model, "fl_y", focal, "does not fit an image of 8 x 6 pixels");
        }
        refuse(model, "cx", 1e30, "the principal point (1e+30, 2.5) is too far outside");
        refuse(model, "cy", -1e30, "the principal point (4.5, -1e+30) is too far outside");
    }
    refuse("OPENCV", "k1", 1e30, "the distortion term k1 of 1e+30 is far beyond");
    refuse("OPENCV_FISHEYE", "k4", -1e30, "the distortion term k4 of -1e+30 is far beyond");
    Scene scene;
    scene.model.update({{"fl_x", -10}, {"fl_y", 10}});
    scene.refuse({"frame 0", "not positive"});
    // A tile of a larger image.
    Scene tile;
    tile.model["cx"] = 100;
    EXPECT_EQ(tile.load().frames[0].camera.cx, 100);
    tile.model["k1"] = 0.01;
    tile.refuse({"the principal point lies outside the image"});
    // A good distortion folds where the focal length is of another size.
    Scene wrong;
    wrong.model["k1"] = -0.2;
    EXPECT_NO_THROW(wrong.load());
    wrong.model.update({{"fl_x", 1}, {"fl_y", 1}});
    wrong.refuse({"folds", "focal length", "principal point"});
}

TEST(TransformsLenses, OtherLensesAreNamed) {
    Scene other;
    other.model["camera_model"] = "FTHETA";
    other.refuse({"frame 0", "FTHETA", "undistort"});
    // No pinhole shows these.
    for (const auto& [model, lens] :
         {std::pair{"EQUIRECTANGULAR", Lens::equirectangular}, {"ORTHOGRAPHIC", Lens::orthographic}}) {
        Scene scene;
        scene.model.update({{"camera_model", model}, {"h", 4}});
        for (const char* name : {"a.png", "b.png"})
            save_image(scene.folder / "images" / name, Image(8, 4, 3));
        const Frame frame = scene.load().frames[0];
        EXPECT_EQ(frame.camera.distortion.lens, lens);
        EXPECT_TRUE(frame.distortion.none());
    }
    for (const char* key : {"k4", "k5", "ftheta_p0"}) {
        Scene scene;
        scene.model[key] = 0.0;
        EXPECT_NO_THROW(scene.load());
        scene.model["frames"][1][key] = 0.1;
        scene.refuse({"frame 1", key});
    }
    Scene fisheye;
    fisheye.model.update({{"is_fisheye", true}, {"k5", 0.1}});
    fisheye.refuse({"frame 0", "k5"});
}

}  // namespace
