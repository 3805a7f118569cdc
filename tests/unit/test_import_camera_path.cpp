// SPDX-License-Identifier: Apache-2.0
// camera_path.json of nerfstudio's viewer. Its cameras have no images.
#include <nlohmann/json.hpp>
#include <numbers>

#include "support/import_scene.h"

namespace {

using namespace ewa;
using namespace ewa::test;
using nlohmann::json;

constexpr double kPathFov = 37.5;  // degrees, vertical
const double kPathFocal = 0.5 * kSceneHeight / std::tan(0.5 * kPathFov * std::numbers::pi / 180);

json path_json(const std::string& type = "perspective") {
    json cameras = json::array();
    for (const SceneView& view : scene_views()) {
        const glm::dmat3 axes = glm::transpose(view.rotation);  // right, down, forward
        json values = json::array();
        for (int r = 0; r < 3; ++r)
            values.insert(values.end(), {axes[0][r], -axes[1][r], -axes[2][r], view.center[r]});
        values.insert(values.end(), {0, 0, 0, 1});
        cameras.push_back({{"camera_to_world", values}, {"fov", kPathFov}, {"aspect", 1.25}});
    }
    return {{"camera_type", type},
            {"render_width", kSceneWidth},
            {"render_height", kSceneHeight},
            {"fps", 12.5},
            {"seconds", 4},
            {"camera_path", cameras},
            {"crop", nullptr},
            {"smoothness_value", NAN}};
}

Dataset load_path(const TempFolder& folder, const json& path, LensUse lens = LensUse::automatic) {
    DatasetOptions options;
    options.need_images = false;
    options.lens = lens;
    return load_dataset(folder.write("path.json", path.dump()), options);
}

void expect_path_views(const Dataset& dataset, const std::function<glm::dvec2(const glm::dvec3&)>& pixel) {
    const auto views = scene_views();
    ASSERT_EQ(dataset.frames.size(), views.size());
    for (size_t i = 0; i < views.size(); ++i) {
        EXPECT_EQ(dataset.frames[i].name, "0000" + std::to_string(i));
        for (const glm::dvec3& point : scene_points()) {
            const glm::dvec2 expected = pixel(views[i].seen(point)),
                             found = pixel_in(dataset.frames[i], point);
            if (expected.x > kSceneWidth) continue;  // beyond the image, where a fisheye shows nothing
            EXPECT_NEAR(found.x, expected.x, 1e-9);
            EXPECT_NEAR(found.y, expected.y, 1e-9);
        }
    }
}

TEST(ImportCameraPath, Perspective) {
    const TempFolder folder;
    const glm::dvec2 middle(0.5 * kSceneWidth, 0.5 * kSceneHeight);
    const Dataset dataset = load_path(folder, path_json());
    EXPECT_EQ(dataset.format, "nerfstudio camera path");
    EXPECT_EQ(dataset.frame_rate, 12.5);
    EXPECT_EQ(dataset.missing_images, 0);
    expect_path_views(dataset, [&](const glm::dvec3& p) { return kPathFocal * tangents(p) + middle; });
    json path = path_json();
    path.erase("camera_type");
    path.erase("fps");
    EXPECT_EQ(load_path(folder, path).frame_rate, 0.75);  // three cameras in four seconds
    path.erase("seconds");
    EXPECT_EQ(load_path(folder, path).frame_rate, 30);
}

TEST(ImportCameraPath, OtherLenses) {
    const TempFolder folder;
    const glm::dvec2 middle(0.5 * kSceneWidth, 0.5 * kSceneHeight);
    // As nerfstudio's fisheye: equidistant, with the focal length of the pinhole.
    expect_path_views(load_path(folder, path_json("fisheye")),
                      [&](const glm::dvec3& p) { return kPathFocal * angles(p) + middle; });
    json path = path_json("equirectangular");
    for (json& camera : path["camera_path"]) camera.erase("fov");
    expect_path_views(load_path(folder, path), [&](const glm::dvec3& p) {
        return middle + glm::dvec2(kSceneWidth * std::atan2(p.x, p.z) / (2 * std::numbers::pi),
                                   kSceneHeight * std::asin(p.y / glm::length(p)) / std::numbers::pi);
    });
    EXPECT_FALSE(load_path(folder, path).frames[0].camera.distortion.none());
    EXPECT_TRUE(
        load_path(folder, path_json("fisheye"), LensUse::undistort).frames[0].camera.distortion.none());
}

TEST(ImportCameraPath, ErrorsNameTheCamera) {
    const TempFolder folder;
    const auto refuse = [&](const std::string& text, const auto& damage) {
        json path = path_json();
        damage(path);
        expect_error<InputError>([&] { load_path(folder, path); }, {"path.json", text});
    };
    refuse("camera 1: \"fov\" is missing", [](json& p) { p["camera_path"][1].erase("fov"); });
    refuse("camera 1: \"fov\" is not between 0 and 180", [](json& p) { p["camera_path"][1]["fov"] = 180; });
    refuse("camera 2: \"camera_to_world\" is not 3 or 4 rows of 4 finite numbers",
           [](json& p) { p["camera_path"][2]["camera_to_world"] = {1}; });
    refuse("camera 0: \"camera_to_world\" is not a rotation",
           [](json& p) { p["camera_path"][0]["camera_to_world"][0] = 7; });
    refuse("\"camera_path\" is empty", [](json& p) { p["camera_path"] = json::array(); });
    refuse("the camera_type \"vr180\" is not supported", [](json& p) { p["camera_type"] = "VR180"; });
    refuse("\"render_width\" is missing", [](json& p) { p.erase("render_width"); });
    json path = path_json();
    expect_error<InputError>([&] { load_dataset(folder.write("path.json", path.dump()), {}); },
                             {"is a path of cameras without images; ewa render --cameras takes it"});
}

/// A folder of photos with a path in it is no dataset for that.
TEST(ImportCameraPath, OnlyAFileThatIsNamed) {
    const TempFolder folder;
    folder.write("camera_path.json", path_json().dump());
    expect_error<InputError>([&] { load_dataset(folder.path(), {}); }, {"not a dataset"});
}

}  // namespace
