// SPDX-License-Identifier: Apache-2.0
// Polycam's raw data and Record3D's recordings, in ARKit's axes: x right, y up, z back.
#include <nlohmann/json.hpp>

#include "support/import_scene.h"

namespace {

using namespace ewa;
using namespace ewa::test;
using nlohmann::json;

glm::dvec2 pinhole(const glm::dvec3& p) {
    return {44.5 * p.x / p.z + 24.75, 43.25 * p.y / p.z + 17.125};
}

/// ARKit's axes of a view, as columns in the world.
glm::dmat3 arkit_axes(const SceneView& view) {
    const glm::dmat3 axes = glm::transpose(view.rotation);
    return {axes[0], -axes[1], -axes[2]};
}

json polycam_camera(const SceneView& view) {
    json camera{{"fx", 44.5},          {"fy", 43.25},    {"cx", 24.75},
                {"cy", 17.125},        {"width", 48},    {"height", kSceneHeight},
                {"blur_score", 120.5}, {"timestamp", 5}, {"t_20", 0.0}};
    const glm::dmat3 axes = arkit_axes(view);
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) camera["t_" + std::to_string(r) + std::to_string(c)] = axes[c][r];
        camera["t_" + std::to_string(r) + "3"] = view.center[r];
    }
    return camera;
}

struct PolycamScene {
    TempFolder folder;
    std::string cameras, images;
    explicit PolycamScene(bool corrected = true)
        : cameras(corrected ? "keyframes/corrected_cameras/" : "keyframes/cameras/"),
          images(corrected ? "keyframes/corrected_images" : "keyframes/images") {
        write_scene_images(folder, images);
        folder.write("mesh_info.json", "{\"alignmentTransform\": [1, 0, 0, 0]}");
        for (const SceneView& view : scene_views()) write(view, polycam_camera(view));
    }
    void write(const SceneView& view, const json& camera) const {
        folder.write(cameras + std::filesystem::path(view.name).stem().string() + ".json", camera.dump());
    }
};

TEST(ImportPolycam, CorrectedCamerasWin) {
    const PolycamScene scene;
    json wrong = polycam_camera(scene_views()[0]);
    wrong["fx"] = 1;
    scene.folder.write("keyframes/cameras/c.json", wrong.dump());
    const Dataset dataset = load_dataset(scene.folder.path(), {});
    EXPECT_EQ(dataset.format, "Polycam raw data");
    EXPECT_EQ(dataset.program, "Polycam");
    EXPECT_TRUE(dataset.notes.empty());
    expect_scene(dataset, pinhole);
    expect_scene(load_dataset(scene.folder / "keyframes", {}), pinhole);
}

TEST(ImportPolycam, CamerasOfThePhone) {
    const PolycamScene scene(false);
    const Dataset dataset = load_dataset(scene.folder.path(), {});
    expect_scene(dataset, pinhole);
    ASSERT_EQ(dataset.notes.size(), 1u);
    EXPECT_NE(dataset.notes[0].find("poses are those of the phone"), std::string::npos);
}

TEST(ImportPolycam, MalformedFilesAreOneLine) {
    const std::vector<std::pair<std::function<void(json&)>, std::string>> cases{
        {[](json& c) { c.erase("fy"); }, "\"fy\" is missing"},
        {[](json& c) { c["fy"] = "4"; }, "\"fy\" is not a finite number"},
        {[](json& c) { c["fx"] = 0; }, "focal length is not positive"},
        {[](json& c) { c["fx"] = -3; }, "focal length is not positive"},
        {[](json& c) { c["width"] = 48.5; }, "\"width\" is not a whole number"},
        {[](json& c) { c["height"] = 1e7; }, "\"height\" is not a whole number"},
        {[](json& c) { c.erase("t_12"); }, "\"t_12\" is missing"},
        {[](json& c) { c["t_23"] = json::array(); }, "\"t_23\" is not a finite number"},
        {[](json& c) { c["t_00"] = 9; }, "t_00 to t_22 are not a rotation"},
        {[](json& c) {
             for (const char* key : {"t_00", "t_10", "t_20"}) c[key] = -c[key].get<double>();
         },
         "it mirrors"}};
    for (const auto& [change, part] : cases) {
        const PolycamScene scene;
        json camera = polycam_camera(scene_views()[2]);
        change(camera);
        scene.write(scene_views()[2], camera);
        expect_error<InputError>([&] { load_dataset(scene.folder.path(), {}); }, {"c.json", part});
    }
    const PolycamScene scene;
    std::filesystem::remove_all(scene.folder / scene.images);
    expect_error<InputError>([&] { load_dataset(scene.folder.path(), {}); },
                             {"corrected_images: the folder of the images is missing; export"});
}

json record3d(bool per_frame) {
    json metadata{{"w", 48}, {"h", 36}, {"fps", 30}, {"poses", json::array()}};
    metadata["K"] = {44.5, 0, 0, 0, 43.25, 0, 24.75, 17.125, 1};
    if (per_frame) {
        metadata["K"] = {1, 0, 0, 0, 1, 0, 1, 1, 1};
        metadata["perFrameIntrinsicCoeffs"] = json::array();
    }
    for (const SceneView& view : scene_views()) {
        const glm::dquat q = glm::quat_cast(arkit_axes(view));
        const glm::dvec3& t = view.center;
        metadata["poses"].push_back({q.x, q.y, q.z, q.w, t.x, t.y, t.z});
        if (per_frame) metadata["perFrameIntrinsicCoeffs"].push_back({44.5, 43.25, 24.75, 17.125});
    }
    return metadata;
}

/// Images 0, 1 and 2 are the scene's views.
void expect_recording(const Dataset& dataset) {
    ASSERT_EQ(dataset.frames.size(), 3u);
    for (size_t i = 0; i < 3; ++i)
        for (const glm::dvec3& point : scene_points()) {
            const glm::dvec2 found = pixel_in(dataset.frames[i], point),
                             expected = pinhole(scene_views()[i].seen(point));
            EXPECT_NEAR(found.x, expected.x, 1e-9);
            EXPECT_NEAR(found.y, expected.y, 1e-9);
        }
}

struct Recording {
    TempFolder folder;
    std::string metadata;
    Recording(const std::string& images, const std::string& name) : metadata(name) {
        std::filesystem::create_directories(folder / images);
        for (const char* image : {"0", "1", "2"})
            save_image(folder / images / (std::string(image) + ".png"), Image(48, 36, 3));
    }
};

TEST(ImportRecord3d, ExportAndUnpackedRecording) {
    for (const bool unpacked : {false, true}) {
        const Recording recording(unpacked ? "rgbd" : "rgb", unpacked ? "metadata" : "metadata.json");
        recording.folder.write(recording.metadata, record3d(unpacked).dump());
        const Dataset dataset = load_dataset(recording.folder.path(), {});
        EXPECT_EQ(dataset.format, "Record3D");
        EXPECT_EQ(dataset.program, "Record3D");
        expect_recording(dataset);
    }
}

TEST(ImportRecord3d, MalformedFilesAreOneLine) {
    const std::vector<std::pair<std::function<void(json&)>, std::string>> cases{
        {[](json& m) { m["poses"] = 3; }, "\"poses\" is not a list"},
        {[](json& m) {
             m["poses"][1] = {1, 2, 3};
         },
         "\"poses\" 1: is not a list of 7"},
        {[](json& m) { m["poses"][2][3] = "w"; }, "is not a list of 7 finite numbers"},
        {[](json& m) { m["poses"][2][3] = 5; }, "the quaternion is not of unit length"},
        {[](json& m) { m["poses"][2] = {0, 0, 0, 0, 1, 2, 3}; }, "the quaternion is not of unit length"},
        {[](json& m) { m.erase("K"); }, "\"K\" is missing"},
        {[](json& m) { m["K"][4] = -1; }, "focal length is not positive"},
        {[](json& m) { m["K"].erase(8); }, "\"K\" is not a list of 9 finite numbers"},
        {[](json& m) { m["w"] = 0; }, "\"w\" is not a whole number"},
        {[](json& m) { m.erase("h"); }, "\"h\" is missing"},
        {[](json& m) {
             m["perFrameIntrinsicCoeffs"] = {{1, 2, 3, 4}};
         },
         "differ in length"}};
    for (const auto& [change, part] : cases) {
        const Recording recording("rgb", "metadata.json");
        json metadata = record3d(false);
        change(metadata);
        recording.folder.write("metadata.json", metadata.dump());
        expect_error<InputError>([&] { load_dataset(recording.folder.path(), {}); }, {"metadata.json", part});
    }
}

}  // namespace
