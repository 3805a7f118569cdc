// SPDX-License-Identifier: Apache-2.0
// reconstruction.json of OpenSfM, written as opensfm.org's "Dataset Structure" and "Camera Models" describe it.
#include <nlohmann/json.hpp>
#include <numbers>

#include "support/import_scene.h"

namespace {

using namespace ewa;
using namespace ewa::test;
using nlohmann::json;

/// Axis times angle.
json axis_angle(const glm::dmat3& rotation) {
    const glm::dquat q = glm::quat_cast(rotation);
    const glm::dvec3 v = glm::angle(q) * glm::axis(q);
    return {v.x, v.y, v.z};
}

json reconstruction(const json& camera) {
    json shots = json::object(), points = json::object();
    for (const SceneView& view : scene_views()) {
        const glm::dvec3 t = view.translation();
        shots[view.name] = {{"rotation", axis_angle(view.rotation)},
                            {"translation", {t.x, t.y, t.z}},
                            {"camera", "v2 phone 48 36"},
                            {"orientation", 1},
                            {"capture_time", 12.5}};
    }
    int number = 0;
    for (const glm::dvec3& p : scene_points()) {
        points[std::to_string(number)] = {{"coordinates", {p.x, p.y, p.z}},
                                          {"color", {10.0 + number, 20.0, 30.0}}};
        ++number;
    }
    return {{"cameras", {{"v2 phone 48 36", camera}}}, {"shots", shots}, {"points", points}};
}

json brown() {
    return {{"projection_type", "brown"},
            {"width", kSceneWidth},
            {"height", kSceneHeight},
            {"focal_x", 0.91},
            {"focal_y", 0.87},
            {"c_x", 0.013},
            {"c_y", -0.021},
            {"k1", -0.11},
            {"k2", 0.023},
            {"p1", 0.0031},
            {"p2", -0.0047},
            {"k3", 0.0017}};
}

struct OpenSfmScene {
    TempFolder folder;
    json file = json::array({reconstruction(brown())});
    OpenSfmScene() { write_scene_images(folder); }
    Dataset load(const std::string& inside = "reconstruction.json") const {
        folder.write(inside, file.dump());
        return load_dataset(folder.path(), {});
    }
};

/// Pixels from the first one's centre, in OpenSfM's convention, are half a pixel less than from its corner.
glm::dvec2 pixel_of_normalized(glm::dvec2 p) {
    const double size = std::max(kSceneWidth, kSceneHeight);
    return p * size + 0.5 * glm::dvec2(kSceneWidth - 1, kSceneHeight - 1) + 0.5;
}

TEST(ImportOpenSfm, BrownCamera) {
    const OpenSfmScene scene;
    const Dataset dataset = scene.load();
    EXPECT_EQ(dataset.format, "OpenSfM reconstruction");
    EXPECT_EQ(dataset.program, "OpenSfM");
    expect_scene(dataset, [](const glm::dvec3& p) {
        const glm::dvec2 q = tangents(p);
        const double r2 = glm::dot(q, q);
        const double radial = 1 + r2 * (-0.11 + r2 * (0.023 + r2 * 0.0017));
        const double x = q.x * radial + 2 * 0.0031 * q.x * q.y - 0.0047 * (r2 + 2 * q.x * q.x);
        const double y = q.y * radial - 2 * 0.0047 * q.x * q.y + 0.0031 * (r2 + 2 * q.y * q.y);
        return pixel_of_normalized({0.91 * x + 0.013, 0.87 * y - 0.021});
    });
    ASSERT_EQ(dataset.points.positions.size(), 4u);
    for (size_t i = 0; i < 4; ++i) EXPECT_EQ(dataset.points.positions[i], scene_points()[i]);
    EXPECT_EQ(dataset.points.colors[3], (std::array<uint8_t, 3>{13, 20, 30}));
}

TEST(ImportOpenSfm, EveryProjectionType) {
    struct Case {
        json camera;
        std::function<glm::dvec2(const glm::dvec3&)> normalized;
    };
    const auto polynomial = [](double r2, const std::vector<double>& k) {
        double sum = 1, power = 1;
        for (const double term : k) sum += term * (power *= r2);
        return sum;
    };
    const json two{{"focal_x", 0.91}, {"focal_y", 0.87}, {"c_x", 0.013}, {"c_y", -0.021}};
    const auto with = [](json camera, const json& more) {
        camera.update(more);
        return camera;
    };
    const glm::dvec2 f(0.91, 0.87), c(0.013, -0.021);
    const std::vector<double> six{0.03, -0.02, 0.01, -0.004, 0.002, -0.001};
    const json six_terms{{"k1", 0.03},   {"k2", -0.02}, {"k3", 0.01},
                         {"k4", -0.004}, {"k5", 0.002}, {"k6", -0.001}};
    const auto tangential = [](glm::dvec2 q) {
        const double r2 = glm::dot(q, q);
        return glm::dvec2(2 * 0.003 * q.x * q.y - 0.002 * (r2 + 2 * q.x * q.x),
                          -2 * 0.002 * q.x * q.y + 0.003 * (r2 + 2 * q.y * q.y));
    };
    const std::vector<Case> cases{
        {{{"projection_type", "perspective"}, {"focal", 0.9}, {"k1", -0.1}, {"k2", 0.02}},
         [&](const glm::dvec3& p) {
             const glm::dvec2 q = tangents(p);
             return 0.9 * q * polynomial(glm::dot(q, q), {-0.1, 0.02});
         }},
        {{{"projection_type", "fisheye"}, {"focal", 0.9}, {"k1", -0.1}, {"k2", 0.02}},
         [&](const glm::dvec3& p) {
             const glm::dvec2 q = angles(p);
             return 0.9 * q * polynomial(glm::dot(q, q), {-0.1, 0.02});
         }},
        {with(two, {{"projection_type", "simple_radial"}, {"k1", -0.1}}),
         [&](const glm::dvec3& p) {
             const glm::dvec2 q = tangents(p);
             return f * q * polynomial(glm::dot(q, q), {-0.1}) + c;
         }},
        {with(two, {{"projection_type", "radial"}, {"k1", -0.1}, {"k2", 0.02}}),
         [&](const glm::dvec3& p) {
             const glm::dvec2 q = tangents(p);
             return f * q * polynomial(glm::dot(q, q), {-0.1, 0.02}) + c;
         }},
        {with(two, {{"projection_type", "fisheye_opencv"},
                    {"k1", 0.03},
                    {"k2", -0.02},
                    {"k3", 0.01},
                    {"k4", -0.004}}),
         [&](const glm::dvec3& p) {
             const glm::dvec2 q = angles(p);
             return f * q * polynomial(glm::dot(q, q), {0.03, -0.02, 0.01, -0.004}) + c;
         }},
        {with(with(two, six_terms), {{"projection_type", "fisheye62"}, {"p1", 0.003}, {"p2", -0.002}}),
         [&](const glm::dvec3& p) {
             const glm::dvec2 q = angles(p);
             return f * (q * polynomial(glm::dot(q, q), six) + tangential(q)) + c;
         }},
        {with(with(two, six_terms), {{"projection_type", "fisheye624"},
                                     {"p1", 0.003},
                                     {"p2", -0.002},
                                     {"s0", 0.004},
                                     {"s1", -0.003},
                                     {"s2", 0.002},
                                     {"s3", -0.005}}),
         [&](const glm::dvec3& p) {
             const glm::dvec2 q = angles(p);
             const double r2 = glm::dot(q, q);
             return f * (q * polynomial(r2, six) + tangential(q) +
                         r2 * glm::dvec2(0.004 - 0.003 * r2, 0.002 - 0.005 * r2)) +
                    c;
         }},
        {{{"projection_type", "spherical"}}, [](const glm::dvec3& p) {
             const double lon = std::atan2(p.x, p.z), lat = std::atan2(-p.y, std::hypot(p.x, p.z));
             return glm::dvec2(lon, -lat) / (2 * std::numbers::pi);
         }}};
    for (const Case& one : cases) {
        SCOPED_TRACE(one.camera.at("projection_type").get<std::string>());
        OpenSfmScene scene;
        json camera = one.camera;
        camera.update({{"width", kSceneWidth}, {"height", kSceneHeight}});
        scene.file = json::array({reconstruction(camera)});
        const Dataset dataset = scene.load();
        expect_scene(dataset, [&](const glm::dvec3& p) { return pixel_of_normalized(one.normalized(p)); });
    }
}

TEST(ImportOpenSfm, OpenDroneMapAndTheLargestOfSeveral) {
    OpenSfmScene scene;
    json small = reconstruction(brown());
    for (const char* name : {"a2.png", "c.png"}) small["shots"].erase(name);
    scene.file = json::array({small, scene.file[0]});
    const Dataset dataset = scene.load("opensfm/reconstruction.json");
    EXPECT_EQ(dataset.frames.size(), 3u);
    EXPECT_EQ(dataset.program, "OpenDroneMap");
    ASSERT_EQ(dataset.notes.size(), 1u);
    EXPECT_NE(dataset.notes[0].find("2 reconstructions"), std::string::npos);
    const Dataset named = load_dataset(scene.folder / "opensfm/reconstruction.json", {});
    EXPECT_EQ(named.frames.size(), 3u);
    EXPECT_EQ(named.frames[0].image_path, dataset.frames[0].image_path);
}

TEST(ImportOpenSfm, MalformedFilesAreOneLine) {
    const std::vector<std::pair<std::function<void(json&)>, std::string>> cases{
        {[](json& f) { f = json::array({"cameras"}); }, "is not a JSON object"},
        {[](json& f) { f[0]["shots"] = 3; }, "\"shots\" is not a JSON object"},
        {[](json& f) { f[0].erase("cameras"); }, "\"cameras\" is missing"},
        {[](json& f) { f[0]["cameras"]["v2 phone 48 36"]["projection_type"] = "dual"; },
         "the projection_type \"dual\" is not supported; use"},
        {[](json& f) { f[0]["cameras"]["v2 phone 48 36"].erase("focal_y"); }, "\"focal_y\" is missing"},
        {[](json& f) { f[0]["cameras"]["v2 phone 48 36"]["focal_x"] = -1; }, "focal length is not positive"},
        {[](json& f) { f[0]["cameras"]["v2 phone 48 36"]["width"] = 1e9; },
         "\"width\" is not a whole number"},
        {[](json& f) { f[0]["shots"]["c.png"]["camera"] = "other"; }, "shot \"c.png\": its camera is not in"},
        {[](json& f) {
             f[0]["shots"]["c.png"]["rotation"] = {1, 2};
         },
         "\"rotation\" is not a list of 3 finite numbers"},
        {[](json& f) { f[0]["shots"]["c.png"].erase("translation"); }, "\"translation\" is missing"},
        {[](json& f) {
             f[0]["points"]["2"]["coordinates"] = {1, 2, "x"};
         },
         "point 2 has no three finite coordinates"},
        {[](json& f) { f[0]["shots"][".."] = f[0]["shots"]["c.png"]; }, "has no file's name"}};
    for (const auto& [change, part] : cases) {
        OpenSfmScene scene;
        change(scene.file);
        expect_error<InputError>([&] { scene.load(); }, {"reconstruction.json", part});
    }
}

TEST(ImportOpenSfm, TwoImagesOfOneName) {
    const OpenSfmScene scene;
    std::filesystem::create_directories(scene.folder / "images/east");
    for (const char* name : {"images/east/a2.png"})
        save_image(scene.folder / name, Image(kSceneWidth, kSceneHeight, 3));
    // The path in the file says which.
    EXPECT_EQ(scene.load().frames.size(), 3u);
    std::filesystem::create_directories(scene.folder / "images/west");
    std::filesystem::rename(scene.folder / "images/a2.png", scene.folder / "images/west/a2.png");
    expect_error<InputError>([&] { scene.load(); }, {"\"a2.png\" is one of 2 images", "different names"});
}

TEST(ImportOpenSfm, LinksLeadOutOfNoFolder) {
    namespace fs = std::filesystem;
    const OpenSfmScene scene;
    const TempFolder elsewhere;
    fs::rename(scene.folder / "images", elsewhere / "photos");
    fs::create_directory_symlink(elsewhere / "photos", scene.folder / "images");
    EXPECT_EQ(scene.load().frames.size(), 3u);
    const fs::path image = elsewhere / "photos/a2.png";
    fs::rename(image, elsewhere / "a2.png");
    fs::create_symlink(elsewhere / "a2.png", image);
    expect_error<InputError>([&] { scene.load(); }, {"\"a2.png\" is a link out of the dataset's folder"});
}

TEST(ImportOpenSfm, ImagesAreFoundByOtherNames) {
    // A path of another system, another extension, and images that lie beside the file.
    OpenSfmScene scene;
    json& shots = scene.file[0]["shots"];
    shots["C:\\photos\\A2.PNG"] = shots["a2.png"];
    shots.erase("a2.png");
    shots["c.tif"] = shots["c.png"];
    shots.erase("c.png");
    shots["/home/me/b 1.png"] = shots["b 1.png"];
    shots.erase("b 1.png");
    EXPECT_EQ(scene.load().frames.size(), 3u);
    std::filesystem::rename(scene.folder / "images", scene.folder / "photos");
    const Dataset dataset = scene.load();
    EXPECT_EQ(dataset.frames.size(), 3u);
    EXPECT_EQ(dataset.missing_images, 0);
    std::filesystem::remove(scene.folder / "photos/c.png");
    EXPECT_EQ(scene.load().missing_images, 1);
}

}  // namespace
