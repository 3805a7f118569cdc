// SPDX-License-Identifier: Apache-2.0
// The XMP and CSV files of RealityScan, written as its help describes them ("XMP Camera Math", "Internal/External camera parameters").
#include <sstream>

#include "support/import_scene.h"

namespace {

using namespace ewa;
using namespace ewa::test;

constexpr double kFocal = 31.5, kU = 0.0131, kV = -0.0217;  // mm of 36 mm, and parts of the larger side
constexpr double kTerms[6] = {-0.11, 0.03, -0.007, 0.0013, 0.0031, -0.0047};

/// Brown's model with four radial and two tangential terms; the first tangential one is that of x.
glm::dvec2 brown4t2(const glm::dvec3& p) {
    const glm::dvec2 q = tangents(p);
    const double r2 = glm::dot(q, q), t1 = kTerms[4], t2 = kTerms[5];
    const double radial = 1 + r2 * (kTerms[0] + r2 * (kTerms[1] + r2 * (kTerms[2] + r2 * kTerms[3])));
    const double x = q.x * radial + t1 * (r2 + 2 * q.x * q.x) + 2 * t2 * q.x * q.y;
    const double y = q.y * radial + t2 * (r2 + 2 * q.y * q.y) + 2 * t1 * q.x * q.y;
    const double side = std::max(kSceneWidth, kSceneHeight);
    return {kFocal / 36 * side * x + kU * side + 0.5 * kSceneWidth,
            kFocal / 36 * side * y + kV * side + 0.5 * kSceneHeight};
}

std::string joined(const std::vector<double>& values, const char* between) {
    std::ostringstream text;
    text.precision(17);
    for (size_t i = 0; i < values.size(); ++i) text << (i ? between : "") << values[i];
    return text.str();
}

std::string xmp(const SceneView& view, bool as_attributes, const std::string& model = "brown4t2",
                const std::vector<double>& terms = {kTerms, kTerms + 6}) {
    std::vector<double> r;
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column) r.push_back(view.rotation[column][row]);
    const std::string parts[3] = {joined(r, " "), joined({view.center.x, view.center.y, view.center.z}, " "),
                                  joined(terms, " ")};
    const char* names[3] = {"Rotation", "Position", "DistortionCoeficients"};
    std::string attributes, elements;
    for (int i = 0; i < 3; ++i) {
        attributes += std::string(" xcr:") + names[i] + "=\"" + parts[i] + "\"";
        elements += std::string("<xcr:") + names[i] + ">" + parts[i] + "</xcr:" + names[i] + ">";
    }
    return "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\">\n <rdf:RDF "
           "xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">\n"
           "  <rdf:Description xmlns:xcr=\"http://www.capturingreality.com/ns/xcr/1.1#\" xcr:Version=\"3\" "
           "xcr:PosePrior=\"locked\" xcr:Coordinates=\"absolute\" xcr:DistortionModel=\"" +
           model + "\" xcr:FocalLength35mm=\"" + joined({kFocal}, "") +
           "\" xcr:Skew=\"0\" xcr:AspectRatio=\"1\" " + "xcr:PrincipalPointU=\"" + joined({kU}, "") +
           "\" xcr:PrincipalPointV=\"" + joined({kV}, "") + "\"" + (as_attributes ? attributes : "") + ">" +
           (as_attributes ? "" : elements) + "</rdf:Description></rdf:RDF></x:xmpmeta>\n";
}

std::string xmp_name(const SceneView& view) {
    return std::filesystem::path(view.name).replace_extension(".xmp").string();
}

TEST(ImportRealityScan, XmpBesideTheImages) {
    for (const char* inside : {"images", "."}) {
        SCOPED_TRACE(inside);
        const TempFolder folder;
        write_scene_images(folder, inside);
        bool as_attributes = false;
        for (const SceneView& view : scene_views()) {
            folder.write(std::filesystem::path(inside) / xmp_name(view), xmp(view, as_attributes));
            as_attributes = !as_attributes;
        }
        const Dataset dataset = load_dataset(folder.path(), {});
        EXPECT_EQ(dataset.format, "RealityScan XMP");
        EXPECT_EQ(dataset.program, "RealityScan");
        expect_scene(dataset, brown4t2);
    }
}

TEST(ImportRealityScan, DivisionIsColmapsOrAPinhole) {
    for (const double k : {0.0, -0.31}) {
        const TempFolder folder;
        write_scene_images(folder);
        for (const SceneView& view : scene_views())
            folder.write("images/" + xmp_name(view), xmp(view, true, "division", {k, 0, 0, 0, 0, 0}));
        const Dataset dataset = load_dataset(folder.path(), {});
        EXPECT_EQ(dataset.frames[0].distortion.none(), k == 0);
        expect_scene(dataset, [&](const glm::dvec3& p) {
            // The image d of the ray u has u = d / (1 + k |d|^2): the smaller root along the radius.
            const glm::dvec2 u = tangents(p);
            const double r = glm::length(u),
                         d = k == 0 ? r : (1 - std::sqrt(1 - 4 * k * r * r)) / (2 * k * r);
            const double side = std::max(kSceneWidth, kSceneHeight);
            return kFocal / 36 * side * (r > 0 ? d / r * u : u) + side * glm::dvec2(kU, kV) +
                   0.5 * glm::dvec2(kSceneWidth, kSceneHeight);
        });
    }
}

TEST(ImportRealityScan, XmpOfOthersAreNoCameras) {
    const TempFolder folder;
    write_scene_images(folder);
    folder.write("images/c.xmp",
                 "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\"><rdf:RDF xmlns:rdf=\"r\"><rdf:Description "
                 "xmlns:crs=\"http://ns.adobe.com/camera-raw-settings/1.0/\"/></rdf:RDF></x:xmpmeta>");
    expect_error<InputError>([&] { load_dataset(folder.path(), {}); }, {"not a dataset"});
}

TEST(ImportRealityScan, MalformedXmpIsOneLine) {
    const std::vector<std::array<std::string, 3>> cases{
        {"</rdf:RDF>", "", "not valid XML"},
        {"FocalLength35mm=\"31.5\"", "FocalLength35mm=\"x\"", "FocalLength35mm is not 1 finite numbers"},
        {"FocalLength35mm=\"31.5\"", "FocalLength35mm=\"-1\"", "focal length is not positive"},
        {"xcr:FocalLength35mm=\"31.5\"", "", "FocalLength35mm is not 1 finite numbers"},
        {"brown4t2", "division", "the DistortionModel \"division\" is not supported; align"},
        {"Skew=\"0\"", "Skew=\"0.1\"", "a Skew other than 0"},
        {"AspectRatio=\"1\"", "AspectRatio=\"1.1\"", "export as COLMAP"},
        {"<xcr:Position>", "<xcr:Position>7 ", "Position is not 3 finite numbers"},
        {"<xcr:Rotation>", "<xcr:Rotation>nan ", "Rotation is not 9 finite numbers"},
        {"<xcr:Rotation>", "<xcr:Rotation>0 0 0 0 0 0 0 0 0</xcr:Rotation><xcr:Rotation>", "it mirrors"},
        {"<xcr:DistortionCoeficients>", "<xcr:DistortionCoeficients>1 ", "DistortionCoeficients is not 6"}};
    for (const auto& [from, to, part] : cases) {
        const TempFolder folder;
        write_scene_images(folder);
        for (const SceneView& view : scene_views()) {
            std::string text = xmp(view, false);
            const size_t at = text.find(from);
            ASSERT_NE(at, std::string::npos) << from;
            folder.write("images/" + xmp_name(view), text.replace(at, from.size(), to));
        }
        expect_error<InputError>([&] { load_dataset(folder.path(), {}); }, {".xmp", part});
    }
}

/// Heading, pitch and roll (degrees) of a camera. Its axes x right, y up, z back are turned by roll about y, then by pitch about x,
/// then by heading clockwise about z.
glm::dvec3 heading_pitch_roll(const SceneView& view) {
    glm::dmat3 axes = glm::transpose(view.rotation);
    axes[1] = -axes[1];
    axes[2] = -axes[2];
    // m = Rz(-h) Rx(p) Ry(r): the last row is (-cos p sin r, sin p, cos p cos r), the second column (sin h cos p, cos h cos p, sin p).
    const double pitch = std::asin(axes[1][2]);
    const double roll = std::atan2(-axes[0][2], axes[2][2]), heading = std::atan2(axes[1][0], axes[1][1]);
    return glm::degrees(glm::dvec3(heading, pitch, roll));
}

std::string csv(const std::string& head = "#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2") {
    std::string text = head + "\n";
    for (const SceneView& view : scene_views()) {
        const glm::dvec3 turn = heading_pitch_roll(view), &c = view.center;
        std::vector<double> values{c.x, c.y, c.z, turn.x, turn.y, turn.z, kFocal, kU, kV};
        values.insert(values.end(), kTerms, kTerms + 6);
        text += view.name + "," + joined(values, ",") + "\n";
    }
    return text;
}

TEST(ImportRealityScan, Csv) {
    const TempFolder folder;
    write_scene_images(folder);
    folder.write("registration.csv", csv());
    const Dataset dataset = load_dataset(folder.path(), {});
    EXPECT_EQ(dataset.format, "RealityScan CSV");
    expect_scene(dataset, brown4t2, 1e-8);
    expect_scene(load_dataset(folder / "registration.csv", {}), brown4t2, 1e-8);
}

TEST(ImportRealityScan, CsvOfOtherVersions) {
    const std::string columns = "f,px,py,k1,k2,k3,k4,t1,t2";
    std::string semicolons = csv();
    std::replace(semicolons.begin(), semicolons.end(), ',', ';');
    for (const std::string& text :
         {"#cameras 3\n" + csv(),
          "\xef\xbb\xbf#cameras 3\r\n" + csv("#name,x,y,alt,yaw,pitch,roll," + columns),
          csv("Label, X, Y, Z, Yaw, Pitch, Roll, " + columns), semicolons}) {
        const TempFolder folder;
        write_scene_images(folder);
        folder.write("registration.csv", text);
        expect_scene(load_dataset(folder.path(), {}), brown4t2, 1e-8);
    }
}

TEST(ImportRealityScan, CsvThatIsNearlyOneIsNamed) {
    const TempFolder folder;
    write_scene_images(folder);
    folder.write("cams.csv", csv("#name,x,y,alt,omega,phi,kappa,f,px,py,k1,k2,k3,k4,t1,t2"));
    for (const std::filesystem::path& path : {folder.path(), folder / "cams.csv"})
        expect_error<InputError>([&] { load_dataset(path, {}); },
                                 {"cams.csv lacks the column heading of RealityScan's"});
    // Ground control points are no cameras.
    folder.write("cams.csv", "name,x,y,z\na,1,2,3\n");
    expect_error<InputError>([&] { load_dataset(folder.path(), {}); }, {"not a dataset; expected"});
}

TEST(ImportRealityScan, ASecondFileOfCamerasIsNoted) {
    const TempFolder folder;
    write_scene_images(folder);
    folder.write("a.csv", csv());
    EXPECT_TRUE(load_dataset(folder.path(), {}).notes.empty());
    folder.write("b.csv", csv());
    const Dataset dataset = load_dataset(folder.path(), {});
    ASSERT_EQ(dataset.notes.size(), 1u);
    EXPECT_EQ(dataset.notes[0], "b.csv has cameras, too: name it to use it in place of a.csv");
    EXPECT_TRUE(load_dataset(folder / "b.csv", {}).notes.empty());
    std::filesystem::remove(folder / "b.csv");
    folder.write("images/c.xmp", xmp(scene_views()[2], true));
    EXPECT_EQ(load_dataset(folder.path(), {}).notes.size(), 1u);
}

TEST(ImportRealityScan, CsvLooksDownWithoutTurns) {
    const TempFolder folder;
    write_scene_images(folder);
    folder.write("a.csv",
                 "#name,x,y,alt,heading,pitch,roll,f\nc.png,1,2,3,0,0,0,36\na2.png,1,2,3,90,0,0,36\n");
    const Dataset dataset = load_dataset(folder.path(), {});
    ASSERT_EQ(dataset.frames.size(), 2u);
    // North (y) is up in the image; with a heading of 90 degrees east (x) is.
    for (const auto& [frame, up] : {std::pair(1, glm::dvec3(0, 1, 0)), std::pair(0, glm::dvec3(1, 0, 0))}) {
        const Camera& camera = dataset.frames[size_t(frame)].camera;
        EXPECT_NEAR(glm::length(camera.rotation * glm::dvec3(0, 0, -1) - glm::dvec3(0, 0, 1)), 0, 1e-12);
        EXPECT_NEAR(glm::length(camera.rotation * up - glm::dvec3(0, -1, 0)), 0, 1e-12);
        EXPECT_NEAR(glm::length(camera.position() - glm::dvec3(1, 2, 3)), 0, 1e-12);
    }
}

TEST(ImportRealityScan, CsvOfASpreadsheetHasDecimalCommas) {
    const TempFolder folder;
    write_scene_images(folder);
    folder.write("a.csv", "#name;x;y;alt;heading;pitch;roll;f\nc.png;1,5;2;-3,25;0;0;0;36,0\n");
    const Dataset dataset = load_dataset(folder.path(), {});
    ASSERT_EQ(dataset.frames.size(), 1u);
    EXPECT_NEAR(glm::length(dataset.frames[0].camera.position() - glm::dvec3(1.5, 2, -3.25)), 0, 1e-12);
}

/// Photos in a folder that a workspace's pictures usually are in.
TEST(ImportRealityScan, PhotosAreInUndistorted) {
    const TempFolder folder;
    write_scene_images(folder);
    std::filesystem::rename(folder / "images", folder / "undistorted");
    folder.write("a.csv", csv());
    EXPECT_EQ(load_dataset(folder.path(), {}).missing_images, 0);
}

TEST(ImportRealityScan, MalformedCsvIsOneLine) {
    const auto changed = [](const std::string& from, const std::string& to) {
        std::string text = csv();
        const size_t at = text.find(from);
        EXPECT_NE(at, std::string::npos) << from;
        return text.replace(at, from.size(), to);
    };
    const std::vector<std::pair<std::string, std::string>> cases{
        {changed("#name,x,", "#name,east,"), ":1: the column x is missing; export"},
        {changed(",roll,f,", ",roll,focal,"), ":1: the column f is missing"},
        {changed("\nb 1.png,", "\nb 1.png,,"), ":2: x: \"\" is not a finite number"},
        {changed("a2.png,-1.2", "a2.png,nan"), ":3: x: \"nan\" is not a finite number"},
        {changed("a2.png,-1.2", "a2.png,1e999"), ":3: x: \"1e999\""},
        {changed("c.png,0.5", "c.png,0x5"), ":4: x: "},
        {changed("c.png,", "c.png;"), ":4: has 15 of 16 values"},
        {changed(",31.5,", ",-31.5,"), ":2: a focal length is not positive"},
        {changed("c.png", ".."), ":4: the image \"..\" has no file's name"},
        {"#name,x,x,y,alt,heading,pitch,roll,f\nc.png,1,2,3,4,5,6,7\n", ":2: has 8 of 9 values"},
        {"#name,x,y,alt,heading,pitch,roll,f\n", "the dataset has no images"}};
    for (const auto& [text, part] : cases) {
        const TempFolder folder;
        write_scene_images(folder);
        folder.write("a.csv", text);
        expect_error<InputError>([&] { load_dataset(folder.path(), {}); }, {part});
    }
}

}  // namespace
