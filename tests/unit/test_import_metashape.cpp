// SPDX-License-Identifier: Apache-2.0
// cameras.xml of Metashape, written as the manual's appendix "Camera models" and the files' own structure describe it.
#include <numbers>
#include <sstream>

#include "support/import_scene.h"

namespace {

using namespace ewa;
using namespace ewa::test;

/// The numbers of the calibration; f is in px, and (cx, cy) counts from the middle of the image.
struct Calibration {
    std::string type = "frame";
    double f = 43.5, cx = 0.75, cy = -1.25, b1 = 1.5, b2 = 0.4;
    double k1 = -0.11, k2 = 0.03, k3 = -0.007, k4 = 0.0013, p1 = 0.0031, p2 = -0.0047;

    /// The manual's formulas.
    glm::dvec2 pixel(const glm::dvec3& p) const {
        const glm::dvec2 q = type == "fisheye" ? angles(p) : tangents(p);
        const double r2 = glm::dot(q, q);
        const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * (k3 + r2 * k4)));
        const double x = q.x * radial + (p1 * (r2 + 2 * q.x * q.x) + 2 * p2 * q.x * q.y);
        const double y = q.y * radial + (p2 * (r2 + 2 * q.y * q.y) + 2 * p1 * q.x * q.y);
        return {kSceneWidth * 0.5 + cx + x * f + x * b1 + y * b2, kSceneHeight * 0.5 + cy + y * f};
    }
};

std::string text_of(double value) {
    std::ostringstream text;
    text.precision(17);
    text << value;
    return text.str();
}

std::string calibration_xml(const Calibration& c) {
    std::string xml =
        "<calibration type=\"" + c.type + "\" class=\"adjusted\"><resolution width=\"48\" height=\"22\"/>";
    const std::pair<const char*, double> terms[] = {{"f", c.f},   {"cx", c.cx}, {"cy", c.cy}, {"b1", c.b1},
                                                    {"b2", c.b2}, {"k1", c.k1}, {"k2", c.k2}, {"k3", c.k3},
                                                    {"k4", c.k4}, {"p1", c.p1}, {"p2", c.p2}};
    for (const auto& [name, value] : terms)
        if (value != 0) xml += std::string("<") + name + ">" + text_of(value) + "</" + name + ">";
    return xml + "</calibration>";
}

struct MetashapeScene {
    TempFolder folder;
    std::string sensor_type = "frame", calibration = calibration_xml({}), more_cameras, chunk_more;
    // The component: world = scale * rotation * p + translation.
    glm::dmat3 rotation = glm::mat3_cast(glm::dquat(glm::dvec3(0.4, -0.3, 0.9)));
    glm::dvec3 translation{0.3, -0.8, 0.5};
    double scale = 1.7;

    MetashapeScene() { write_scene_images(folder); }

    /// 16 numbers from the camera to the component.
    std::string transform(const SceneView& view) const {
        const glm::dmat3 axes = glm::transpose(rotation) * glm::transpose(view.rotation);
        const glm::dvec3 center = glm::transpose(rotation) * (view.center - translation) / scale;
        std::string text;
        for (int r = 0; r < 3; ++r) {
            for (int c = 0; c < 3; ++c) text += text_of(axes[c][r]) + " ";
            text += text_of(center[r]) + "\n ";
        }
        return text + "0 0 0 1";
    }
    std::string xml() const {
        std::string cameras, numbers;
        int id = 0;
        for (const SceneView& view : scene_views()) {
            // Metashape may leave the extension away, and put cameras into groups.
            const std::string label = id == 1 ? std::filesystem::path(view.name).stem().string() : view.name;
            const std::string camera = "<camera id=\"" + std::to_string(id) +
                                       "\" sensor_id=\"4\" component_id=\"2\" label=\"" + label +
                                       "\"><transform>" + transform(view) + "</transform></camera>";
            cameras += id == 2 ? "<group id=\"0\">" + camera + "</group>" : camera;
            ++id;
        }
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c) numbers += text_of(rotation[c][r]) + " ";
        return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<document version=\"2.0.0\"><chunk label=\"Chunk "
               "1\" enabled=\"true\">"
               "<sensors next_id=\"5\"><sensor id=\"4\" label=\"phone\" type=\"" +
               sensor_type +
               "\"><resolution width=\"48\" height=\"22\"/>"
               "<calibration type=\"frame\" class=\"initial\"><f>99</f></calibration>" +
               calibration +
               "</sensor></sensors><components next_id=\"3\"><component id=\"2\"><transform><rotation "
               "locked=\"false\">" +
               numbers + "</rotation><translation>" + text_of(translation.x) + " " + text_of(translation.y) +
               " " + text_of(translation.z) + "</translation><scale>" + text_of(scale) +
               "</scale></transform></component></components><cameras next_id=\"3\">" + cameras +
               more_cameras + "</cameras>" + chunk_more + "</chunk></document>";
    }
    Dataset load() const {
        folder.write("cameras.xml", xml());
        return load_dataset(folder.path(), {});
    }
};

TEST(ImportMetashape, FrameCamera) {
    MetashapeScene scene;
    scene.more_cameras = "<camera id=\"9\" sensor_id=\"4\" label=\"d\"></camera>";
    const Dataset dataset = scene.load();
    EXPECT_EQ(dataset.format, "Metashape XML");
    EXPECT_EQ(dataset.program, "Agisoft Metashape (file version 2.0.0)");
    ASSERT_EQ(dataset.notes.size(), 1u);
    EXPECT_EQ(dataset.notes[0], "1 image without a pose is skipped");
    expect_scene(dataset, [](const glm::dvec3& p) { return Calibration().pixel(p); });
    EXPECT_EQ(dataset.frames[0].distortion.lens, Lens::radial4);
    EXPECT_TRUE(dataset.frames[0].camera.distortion.none());
    expect_scene(load_dataset(scene.folder / "cameras.xml", {}),
                 [](const glm::dvec3& p) { return Calibration().pixel(p); });
}

TEST(ImportMetashape, WithoutTheLastTermsItIsOpenCvsLens) {
    MetashapeScene scene;
    Calibration calibration;
    calibration.k4 = calibration.b2 = 0;
    scene.calibration = calibration_xml(calibration);
    const Dataset dataset = scene.load();
    expect_scene(dataset, [&](const glm::dvec3& p) { return calibration.pixel(p); });
    EXPECT_TRUE(scene::is_native(dataset.frames[0].distortion));
}

TEST(ImportMetashape, FisheyeAndSphere) {
    MetashapeScene scene;
    Calibration calibration;
    calibration.type = scene.sensor_type = "fisheye";
    scene.calibration = calibration_xml(calibration);
    expect_scene(scene.load(), [&](const glm::dvec3& p) { return calibration.pixel(p); });
    scene.sensor_type = "spherical";
    scene.calibration.clear();
    expect_scene(scene.load(), [](const glm::dvec3& p) {
        const double f = kSceneWidth / (2 * std::numbers::pi);
        return glm::dvec2(f * std::atan2(p.x, p.z) + kSceneWidth * 0.5,
                          f * std::atan2(p.y, std::hypot(p.x, p.z)) + kSceneHeight * 0.5);
    });
}

TEST(ImportMetashape, PointsOfAPlyBesideIt) {
    MetashapeScene scene;
    const std::string ply =
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float "
        "z\nend_header\n1 2 3\n";
    scene.folder.write("cloud.ply", ply);
    EXPECT_EQ(scene.load().points.positions, (std::vector<glm::dvec3>{{1, 2, 3}}));
    scene.folder.write("other.ply", ply);
    const Dataset two = scene.load();
    EXPECT_TRUE(two.points.positions.empty());
    ASSERT_EQ(two.notes.size(), 1u);
    EXPECT_NE(two.notes[0].find("--init FILE"), std::string::npos);
}

TEST(ImportMetashape, MalformedFilesAreOneLine) {
    const auto replaced = [](std::string text, const std::string& from, const std::string& to) {
        const size_t at = text.find(from);
        EXPECT_NE(at, std::string::npos) << from;
        return at == std::string::npos ? text : text.replace(at, from.size(), to);
    };
    const std::vector<std::array<std::string, 3>> cases{
        {"</chunk></document>", "", "not valid XML"},
        {"<cameras next_id=\"3\">", "<cameras_ next_id=\"3\">", "not valid XML"},
        {"id=\"4\" label=\"phone\"", "id=\"5\" label=\"phone\"", "its sensor is not in the list"},
        {"label=\"phone\" type=\"frame\"", "type=\"rpc\"",
         "a sensor of type \"rpc\" is not supported; export"},
        {"<f>43.5", "<f>-43.5", "focal length is not positive"},
        {"<f>43.5", "<f>nan", "<f>: is not a finite number"},
        {"<f>43.5</f>", "", "<f> is missing"},
        {"</k1>", "</k1><p3>0.1</p3>", "this calibration is of PhotoScan"},
        {"resolution width=\"48\"", "resolution width=\"0\"", "its width is not a whole number"},
        {" 0 0 0 1</transform>", "</transform>", "is not a list of 16 finite numbers"},
        {"<scale>1.7", "<scale>-1.7", "is not a rotation"},
        {"label=\"b 1.png\"", "label=\"..\"", "has no file's name"}};
    for (const auto& [from, to, part] : cases) {
        const MetashapeScene scene;
        scene.folder.write("cameras.xml", replaced(scene.xml(), from, to));
        expect_error<InputError>([&] { load_dataset(scene.folder / "cameras.xml", {}); },
                                 {"cameras.xml", part});
    }
}

TEST(ImportMetashape, EntitiesReadNothing) {
    MetashapeScene scene;
    scene.folder.write("secret", "43.5");
    std::string xml = scene.xml();
    xml.replace(0, xml.find('\n'), "<!DOCTYPE d [<!ENTITY f SYSTEM \"secret\">]>");
    xml.replace(xml.find("<f>43.5"), 7, "<f>&f;");
    scene.folder.write("cameras.xml", xml);
    expect_error<InputError>([&] { load_dataset(scene.folder.path(), {}); }, {"<f>: is not a finite number"});
}

}  // namespace
