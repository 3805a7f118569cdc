// SPDX-License-Identifier: Apache-2.0
// sfm_data.json of OpenMVG, written as its documentation describes it ("SfM Data").
#include <nlohmann/json.hpp>

#include "support/import_scene.h"

namespace {

using namespace ewa;
using namespace ewa::test;
using nlohmann::json;

json rows_of(const glm::dmat3& m) {
    json rows = json::array();
    for (int r = 0; r < 3; ++r) rows.push_back({m[0][r], m[1][r], m[2][r]});
    return rows;
}

json intrinsic(int key, int64_t id, const char* name, json data) {
    data.update({{"width", kSceneWidth}, {"height", kSceneHeight}});
    json value{{"polymorphic_id", id}, {"ptr_wrapper", {{"id", 2147483700 + key}, {"data", data}}}};
    if (name) value["polymorphic_name"] = name;
    return {{"key", key}, {"value", value}};
}

json pinhole_data() {
    return {{"focal_length", 44.5}, {"principal_point", {24.75, 17.125}}};
}

json brown_data() {
    json data = pinhole_data();
    data["disto_t2"] = {-0.11, 0.023, 0.0017, 0.0031, -0.0047};
    return data;
}

struct OpenMvgScene {
    TempFolder folder;
    json file;
    OpenMvgScene() {
        write_scene_images(folder);
        file = {{"sfm_data_version", "0.3"},
                {"root_path", "/somewhere/else"},
                {"views", json::array()},
                {"intrinsics",
                 {intrinsic(0, 2147483649, "pinhole_brown_t2", brown_data()),
                  intrinsic(7, 1, nullptr, brown_data())}},
                {"extrinsics", json::array()},
                {"structure", json::array()},
                {"control_points", json::array()}};
        int key = 0;
        for (const SceneView& view : scene_views()) {
            // Views and poses have keys of their own; views 1 and 2 have the intrinsic without a type's name.
            const json data{{"local_path", ""},       {"filename", view.name},
                            {"width", kSceneWidth},   {"height", kSceneHeight},
                            {"id_view", key},         {"id_intrinsic", key == 0 ? 0 : 7},
                            {"id_pose", 10 - 2 * key}};
            file["views"].push_back({{"key", key},
                                     {"value",
                                      {{"polymorphic_id", 1073741824},
                                       {"ptr_wrapper", {{"id", 2147483649 + key}, {"data", data}}}}}});
            const glm::dvec3& c = view.center;
            file["extrinsics"].push_back(
                {{"key", 10 - 2 * key},
                 {"value", {{"rotation", rows_of(view.rotation)}, {"center", {c.x, c.y, c.z}}}}});
            ++key;
        }
        for (const glm::dvec3& p : scene_points())
            file["structure"].push_back(
                {{"key", key++},
                 {"value",
                  {{"X", {p.x, p.y, p.z}},
                   {"observations", {{{"key", 0}, {"value", {{"id_feat", 3}, {"x", {1.5, 2.5}}}}}}}}}});
    }
    Dataset load() const {
        folder.write("sfm_data.json", file.dump());
        return load_dataset(folder.path(), {});
    }
};

TEST(ImportOpenMvg, BrownCamera) {
    const OpenMvgScene scene;
    const Dataset dataset = scene.load();
    EXPECT_EQ(dataset.format, "OpenMVG sfm_data");
    EXPECT_EQ(dataset.program, "OpenMVG");
    EXPECT_TRUE(dataset.notes.empty());
    expect_scene(dataset, [](const glm::dvec3& p) {
        const glm::dvec2 q = tangents(p);
        const double r2 = glm::dot(q, q), t1 = 0.0031, t2 = -0.0047;
        const double k = r2 * (-0.11 + r2 * (0.023 + r2 * 0.0017));
        const glm::dvec2 moved(q.x + q.x * k + t2 * (r2 + 2 * q.x * q.x) + 2 * t1 * q.x * q.y,
                               q.y + q.y * k + t1 * (r2 + 2 * q.y * q.y) + 2 * t2 * q.x * q.y);
        return 44.5 * moved + glm::dvec2(24.75, 17.125);
    });
    EXPECT_EQ(dataset.points.positions, scene_points());
}

TEST(ImportOpenMvg, EveryIntrinsic) {
    const auto with = [](const char* key, const json& terms) {
        json data = pinhole_data();
        if (key) data[key] = terms;
        return data;
    };
    struct Case {
        const char* name;
        json data;
        bool angle;
        std::vector<double> k;
    };
    const std::vector<Case> cases{
        {"pinhole", with(nullptr, {}), false, {}},
        {"pinhole_radial_k1", with("disto_k1", {-0.1}), false, {-0.1}},
        {"pinhole_radial_k3", with("disto_k3", {-0.1, 0.03, 0.002}), false, {-0.1, 0.03, 0.002}},
        {"fisheye", with("fisheye", {0.05, -0.02, 0.01, -0.003}), true, {0.05, -0.02, 0.01, -0.003}}};
    for (const Case& one : cases) {
        SCOPED_TRACE(one.name);
        OpenMvgScene scene;
        scene.file["intrinsics"] = {intrinsic(0, 2147483649, one.name, one.data),
                                    intrinsic(7, 1, nullptr, one.data)};
        expect_scene(scene.load(), [&](const glm::dvec3& p) {
            const glm::dvec2 q = one.angle ? angles(p) : tangents(p);
            double factor = 1, power = 1;
            for (const double k : one.k) factor += k * (power *= glm::dot(q, q));
            return 44.5 * factor * q + glm::dvec2(24.75, 17.125);
        });
    }
    OpenMvgScene sphere;
    const json size{{"value0", {{"width", kSceneWidth}, {"height", kSceneHeight}}}};
    sphere.file["intrinsics"] = {intrinsic(0, 2147483649, "spherical", size), intrinsic(7, 1, nullptr, size)};
    for (json& entry : sphere.file["intrinsics"])
        for (const char* key : {"width", "height"}) entry["value"]["ptr_wrapper"]["data"].erase(key);
    EXPECT_EQ(sphere.load().frames.at(0).camera.distortion.lens, Lens::equirectangular);
}

TEST(ImportOpenMvg, ViewsWithoutAPoseAreCounted) {
    OpenMvgScene scene;
    scene.file["extrinsics"].erase(1);
    const Dataset dataset = scene.load();
    EXPECT_EQ(dataset.frames.size(), 2u);
    ASSERT_EQ(dataset.notes.size(), 1u);
    EXPECT_EQ(dataset.notes[0], "1 image without a pose is skipped");
}

TEST(ImportOpenMvg, MalformedFilesAreOneLine) {
    using Change = std::function<void(json&)>;
    const auto data = [](json& f, const char* list, size_t i) -> json& {
        return f[list][i]["value"]["ptr_wrapper"]["data"];
    };
    const std::vector<std::pair<Change, std::string>> cases{
        {[](json& f) { f.erase("views"); }, "\"views\" is missing"},
        {[](json& f) { f["intrinsics"] = 1; }, "\"intrinsics\" is not a list"},
        {[](json& f) { f["extrinsics"] = json::array(); }, "no view has a pose"},
        {[](json& f) { f["intrinsics"][0]["value"]["polymorphic_name"] = "pinhole_x"; },
         "the intrinsic \"pinhole_x\" is not supported; export"},
        {[&](json& f) {
             data(f, "intrinsics", 0)["disto_t2"] = {1, 2, 3};
         },
         "\"disto_t2\" is not a list of 5 finite numbers"},
        {[&](json& f) { data(f, "intrinsics", 1)["focal_length"] = 0; }, "focal length is not positive"},
        {[&](json& f) { data(f, "intrinsics", 0)["width"] = 1.5; }, "\"width\" is not a whole number"},
        {[&](json& f) { data(f, "views", 2)["id_intrinsic"] = 5; }, "view 2: its intrinsic is not in"},
        {[&](json& f) { data(f, "views", 1).erase("filename"); }, "\"filename\" is missing"},
        {[](json& f) {
             f["extrinsics"][1]["value"]["rotation"][0] = {-1, 0, 0};
         },
         "is not a rotation"},
        {[](json& f) { f["extrinsics"][1]["value"]["center"] = "here"; }, "\"center\" is not a list of 3"},
        {[](json& f) {
             f["structure"][3]["value"]["X"] = {1, 2};
         },
         "point 3 of \"structure\""}};
    for (const auto& [change, part] : cases) {
        OpenMvgScene scene;
        change(scene.file);
        expect_error<InputError>([&] { scene.load(); }, {"sfm_data.json", part});
    }
}

TEST(ImportOpenMvg, TheBinaryFileHasAdvice) {
    const TempFolder folder;
    folder.write("sfm_data.bin", "anything");
    expect_error<InputError>([&] { load_dataset(folder.path(), {}); },
                             {"sfm_data.bin is OpenMVG's binary file", "openMVG_main_ConvertSfM_DataFormat"});
}

}  // namespace
