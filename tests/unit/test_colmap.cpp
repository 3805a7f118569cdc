// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <glm/gtc/quaternion.hpp>
#include <limits>

#include "ewa/dataset.h"
#include "io/datasets/colmap_lens.h"
#include "io/datasets/image_records.h"
#include "scene/native_lens.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using test::bytes_of;
using test::expect_error;
using test::TempFolder;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::string camera(uint32_t id, int32_t lens, uint64_t width, uint64_t height,
                   const std::vector<double>& parameters) {
    std::string bytes = bytes_of(id) + bytes_of(lens) + bytes_of(width) + bytes_of(height);
    for (double v : parameters) bytes += bytes_of(v);
    return bytes;
}

std::string image(uint32_t id, const std::vector<double>& pose, uint32_t camera_id, const std::string& name,
                  int observations = 0) {
    std::string bytes = bytes_of(id);
    for (double v : pose) bytes += bytes_of(v);
    bytes += bytes_of(camera_id) + name + '\0' + bytes_of(uint64_t(observations));
    for (int i = 0; i < observations; ++i) bytes += bytes_of(1.0) + bytes_of(2.0) + bytes_of(int64_t(-1));
    return bytes;
}

std::string point(glm::dvec3 p, std::array<uint8_t, 3> color, int track = 0) {
    std::string bytes = bytes_of(uint64_t(1)) + bytes_of(p.x) + bytes_of(p.y) + bytes_of(p.z);
    for (uint8_t c : color) bytes += bytes_of(c);
    bytes += bytes_of(0.5) + bytes_of(uint64_t(track));
    for (int i = 0; i < track; ++i) bytes += bytes_of(uint32_t(1)) + bytes_of(uint32_t(2));
    return bytes;
}

std::string list(const std::vector<std::string>& entries) {
    std::string bytes = bytes_of(uint64_t(entries.size()));
    for (const std::string& entry : entries) bytes += entry;
    return bytes;
}

const std::vector<double> kPose = {0.5, -0.5, 0.5, 0.5, 1, 2, 3};

/// A model of two cameras, two images and three points, in sparse/0, with pictures.
struct Model {
    TempFolder folder;
    std::string cameras = list({camera(3, 1, 8, 6, {10, 11, 4.5, 3.5}), camera(9, 0, 4, 4, {7, 2, 2.5})});
    std::string images =
        list({image(1, kPose, 3, "b.png", 2), image(2, {0, 0, 0, -2, 0, 0, 1}, 9, "sub/a.png")});
    std::string points =
        list({point({1, 2, 3}, {4, 5, 6}, 2), point({kNan, 0, 0}, {}), point({-1, 0, 1e9}, {7, 8, 9})});

    Model() {
        write();
        std::filesystem::create_directories(folder / "images" / "sub");
        save_image(folder / "images" / "b.png", Image(8, 6, 3));
        save_image(folder / "images" / "sub" / "a.png", Image(4, 4, 3));
    }
    void write() const {
        folder.write("sparse/0/cameras.bin", cameras);
        folder.write("sparse/0/images.bin", images);
        folder.write("sparse/0/points3D.bin", points);
    }
    Dataset load(DatasetOptions options = {}) const { return load_dataset(folder.path(), options); }
    void refuse(std::initializer_list<std::string> parts) const {
        write();
        expect_error<InputError>([&] { load(); }, parts);
    }
};

void expect_the_model(const Dataset& dataset) {
    ASSERT_EQ(dataset.frames.size(), 2u);
    const Frame& b = dataset.frames[0];
    EXPECT_EQ(b.name, "b.png");
    EXPECT_TRUE(b.image_exists);
    EXPECT_EQ(b.camera.width, 8);
    EXPECT_EQ(b.camera.height, 6);
    EXPECT_EQ(b.camera.fx, 10);
    EXPECT_EQ(b.camera.fy, 11);
    EXPECT_EQ(b.camera.cx, 4.5);
    EXPECT_EQ(b.camera.cy, 3.5);
    EXPECT_EQ(b.camera.translation, glm::dvec3(1, 2, 3));
    // Row by row, from the quaternion w x y z = (1 -1 1 1) / 2.
    const double rotation[3][3] = {{0, -1, 0}, {0, 0, 1}, {-1, 0, 0}};
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
            EXPECT_NEAR(b.camera.rotation[column][row], rotation[row][column], 1e-15) << row << column;
    const Frame& a = dataset.frames[1];
    EXPECT_EQ(a.name, "sub/a.png");
    EXPECT_EQ(a.camera.fx, 7);
    EXPECT_EQ(a.camera.fy, 7);
    EXPECT_EQ(a.camera.cx, 2);
    EXPECT_EQ(a.camera.cy, 2.5);
    EXPECT_EQ(dataset.dropped_points, 1);
    EXPECT_NE(dataset.first_dropped_point.find("points3D"), std::string::npos);
    ASSERT_EQ(dataset.points.positions.size(), 2u);
    EXPECT_EQ(dataset.points.positions[1], glm::dvec3(-1, 0, 1e9));
    EXPECT_EQ(dataset.points.colors[0], (std::array<uint8_t, 3>{4, 5, 6}));
}

TEST(Colmap, ReadsBinary) {
    expect_the_model(Model().load());
}

TEST(Colmap, ReadsText) {
    Model model;
    std::filesystem::remove_all(model.folder / "sparse");
    model.folder.write("sparse/cameras.txt",
                       "# cameras\n\n3 PINHOLE 8 6 10 11 4.5 3.5\r\n9 SIMPLE_PINHOLE 4 4 7 2 2.5\n");
    model.folder.write("sparse/images.txt",
                       "# images\n1 0.5 -0.5 0.5 0.5 1 2 3 3 b.png\n1 2 -1 1 2 -1\n"
                       "2 0 0 0 -2 0 0 1 9 sub/a.png\n\n");
    model.folder.write("sparse/points3D.txt",
                       "1 1 2 3 4 5 6 0.5 1 2 1 2\n2 nan 0 0 0 0 0 0\n3 -1 0 1e9 7 8 9 0.5\n");
    expect_the_model(model.load());
}

TEST(Colmap, ModelMayLieElsewhere) {
    Model model;
    expect_the_model(load_dataset(model.folder / "sparse" / "0", {}));
    for (const char* file : {"cameras.bin", "images.bin", "points3D.bin"})
        std::filesystem::rename(model.folder / "sparse" / "0" / file, model.folder / file);
    expect_the_model(model.load());
    std::filesystem::remove(model.folder / "points3D.bin");
    const Dataset dataset = model.load();
    EXPECT_EQ(dataset.frames.size(), 2u);
    EXPECT_TRUE(dataset.points.positions.empty());
}

TEST(Colmap, ARigsImagesHaveTheirWholePose) {
    const Model model;
    // COLMAP 4: a rig of two cameras, the second beside the first, and a frame of both.
    std::string rig = bytes_of(uint32_t(1)) + bytes_of(uint32_t(2)) + bytes_of(int32_t(0)) +
                      bytes_of(uint32_t(3)) + bytes_of(int32_t(0)) + bytes_of(uint32_t(9)) +
                      bytes_of(uint8_t(1));
    std::string frame = bytes_of(uint32_t(1)) + bytes_of(uint32_t(1));
    for (const double v : {1., 0., 0., 0., 0.25, 0., 0.}) rig += bytes_of(v);
    for (const double v : kPose) frame += bytes_of(v);
    frame += bytes_of(uint32_t(2)) + bytes_of(int32_t(0)) + bytes_of(uint32_t(3)) + bytes_of(uint64_t(1)) +
             bytes_of(int32_t(0)) + bytes_of(uint32_t(9)) + bytes_of(uint64_t(2));
    const Dataset before = model.load();
    EXPECT_EQ(before.format, "COLMAP");
    EXPECT_EQ(before.program, "");
    model.folder.write("sparse/0/rigs.bin", list({rig}));
    model.folder.write("sparse/0/frames.bin", list({frame}));
    const Dataset after = model.load();
    EXPECT_NE(after.program.find("rigs"), std::string::npos);
    ASSERT_EQ(after.frames.size(), before.frames.size());
    for (size_t i = 0; i < after.frames.size(); ++i) {
        EXPECT_EQ(after.frames[i].camera.rotation, before.frames[i].camera.rotation);
        EXPECT_EQ(after.frames[i].camera.translation, before.frames[i].camera.translation);
    }
}

TEST(Colmap, ADenseCloudStandsInForMissingPoints) {
    Model model;
    io::write_points_ply(model.folder / "fused.ply",
                         {{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}, {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}});
    expect_the_model(model.load());  // which has points of its own
    std::filesystem::remove(model.folder / "sparse/0/points3D.bin");
    const Dataset dataset = model.load();
    ASSERT_EQ(dataset.points.positions.size(), 3u);
    EXPECT_EQ(dataset.points.positions[2], glm::dvec3(7, 8, 9));
    EXPECT_EQ(dataset.points.colors[1], (std::array<uint8_t, 3>{4, 5, 6}));
    EXPECT_NE(std::ranges::find(dataset.files, model.folder / "fused.ply"), dataset.files.end());
}

TEST(Colmap, EveryCutIsAnError) {
    const Model model;
    for (const auto& [name, bytes] : {std::pair("cameras.bin", model.cameras),
                                      {"images.bin", model.images},
                                      {"points3D.bin", model.points}}) {
        const auto path = model.folder / "sparse" / "0" / name;
        EXPECT_EQ(test::read_every_cut(path, bytes, [&] { model.load(); }), 0u) << name;
    }
    expect_the_model(model.load());
}

TEST(Colmap, EveryCutOfTextIsReadOrRefused) {
    Model model;
    std::filesystem::remove_all(model.folder / "sparse");
    const std::string cameras = "3 PINHOLE 8 6 10 11 4.5 3.5\n",
                      images = "1 0.5 -0.5 0.5 0.5 1 2 3 3 b.png\n\n", points = "1 1 2 3 4 5 6 0.5 1 2\n";
    const auto path = [&](const char* name, const std::string& text) {
        return model.folder.write(std::string("sparse/0/") + name, text);
    };
    const auto c = path("cameras.txt", cameras), i = path("images.txt", images),
               p = path("points3D.txt", points);
    const auto load = [&] { load_dataset(model.folder.path(), {}); };
    EXPECT_NO_THROW(load());
    EXPECT_LE(test::read_every_cut(c, cameras, load), 3u);
    EXPECT_LE(test::read_every_cut(i, images, load), 6u) << "b is the label of b.png";
    EXPECT_GE(test::read_every_cut(p, points, load), 2u);
}

TEST(Colmap, AbsurdCountsTakeNoMemory) {
    for (uint64_t count : {uint64_t(3), uint64_t(4000000000), ~uint64_t(0), ~uint64_t(0) / 24 + 2}) {
        const std::string claim = bytes_of(count);
        for (int which = 0; which < 3; ++which) {
            Model model;
            std::string& bytes = which == 0 ? model.cameras : which == 1 ? model.images : model.points;
            if (which == 2 && count == 3) continue;  // the right count
            bytes.replace(0, 8, claim);
            model.refuse({"byte"});
        }
        Model observations, track;
        observations.images.replace(8 + 4 + 56 + 4 + 6, 8, claim);
        observations.refuse({"images.bin: byte"});
        track.points.replace(8 + 8 + 24 + 3 + 8, 8, claim);
        track.refuse({"points3D.bin: byte"});
    }
}

TEST(Colmap, LensModels) {
    Model model;
    const auto cameras = [&](int32_t lens, const std::vector<double>& parameters) {
        model.cameras = list({camera(3, lens, 8, 6, parameters), camera(9, 0, 4, 4, {7, 2, 2.5})});
    };
    cameras(99, {10, 11, 4, 3});
    model.refuse({"99", "colmap image_undistorter"});
    cameras(-1, {10, 11, 4, 3});
    model.refuse({"-1", "colmap image_undistorter"});
    cameras(18, {8, 6, 0, 0});
    model.refuse({"18", "colmap image_undistorter"});
    cameras(4, {10, 11, 4, 3, 0, 0, 0, kNan});
    model.refuse({"not finite"});
    cameras(4, {10, 11, 4, 3, -9, 0, 0, 0});
    model.refuse({"frame \"b.png\"", "folds"});
    cameras(4, {10, 11, 4, 3, 0, 0, 0, 0});
    model.write();
    EXPECT_EQ(model.load().frames[0].camera.fy, 11);
    cameras(2, {10, 4, 3, 0});
    model.write();
    EXPECT_EQ(model.load().frames[0].camera.fy, 10);
    EXPECT_EQ(model.load().frames[0].camera.cy, 3);
}

TEST(Colmap, LensNamesInAnyCase) {
    EXPECT_EQ(io::colmap_lens("pinhole"), io::colmap_lens("PINHOLE"));
    EXPECT_NE(io::colmap_lens("Simple_Radial"), nullptr);
}

TEST(Colmap, RefusesImpossibleCameras) {
    const std::vector<std::pair<std::string, const char*>> cases = {
        {camera(3, 1, 0, 6, {1, 1, 0, 0}), "0 x 6"},
        {camera(3, 1, 8, ~uint64_t(0), {1, 1, 0, 0}), "invalid size"},
        {camera(3, 1, 8, 6, {0, 1, 0, 0}), "not positive"},
        {camera(3, 1, 8, 6, {1, -1, 0, 0}), "not positive"},
        {camera(3, 1, 8, 6, {kNan, 1, 0, 0}), "finite"},
        {camera(3, 1, 8, 6, {1, 1, HUGE_VAL, 0}), "finite"},
        {camera(9, 1, 8, 6, {1, 1, 0, 0}), "twice"}};
    for (const auto& [bytes, part] : cases) {
        Model model;
        model.cameras = list({bytes, camera(9, 0, 4, 4, {7, 2, 2.5})});
        model.refuse({"cameras.bin: byte", part});
    }
}

TEST(Colmap, RefusesImpossibleImages) {
    const std::vector<std::pair<std::string, const char*>> cases = {
        {image(1, {0, 0, 0, 0, 1, 2, 3}, 3, "b.png"), "quaternion"},
        {image(1, {1, 0, kNan, 0, 1, 2, 3}, 3, "b.png"), "not finite"},
        {image(1, {1, 0, 0, 0, 1, HUGE_VAL, 3}, 3, "b.png"), "not finite"},
        {image(1, kPose, 4, "b.png"), "camera 4"},
        {image(1, kPose, 3, ".."), "no file's name"},
        {image(1, kPose, 3, "images/"), "no file's name"},
        {image(1, kPose, 3, ""), "no file's name"},
        {image(1, kPose, 3, std::string(5000, 'n')), "longer"}};
    for (const auto& [bytes, part] : cases) {
        Model model;
        model.images = list({bytes});
        model.refuse({"images.bin: byte", part});
    }
    // Paths of other machines are names in the folder.
    for (const char* name : {"/etc/passwd", "../../passwd", "C:\\passwd"}) {
        Model outside;
        outside.images = list({image(1, kPose, 3, name)});
        outside.refuse({"none of the 1 images exists", "images/passwd"});
    }
    Model inside;
    inside.images = list({image(1, {1e-200, 0, 0, 0, 1, 2, 3}, 3, "sub/../b.png")});
    inside.write();
    EXPECT_EQ(inside.load().frames[0].camera.rotation, glm::dmat3(1.0));
}

TEST(Colmap, LinksLeadOutOfNoFolder) {
    namespace fs = std::filesystem;
    const TempFolder elsewhere;
    save_image(elsewhere / "b.png", Image(8, 6, 3));
    Model model;
    model.images = list({image(1, kPose, 3, "out/b.png")});
    model.write();
    fs::create_symlink(elsewhere.path(), model.folder / "images/out");
    model.refuse({"images.bin: ", "out/b.png", "link out of the dataset's folder"});
    model.images = list({image(1, kPose, 3, "b.png")});
    fs::remove(model.folder / "images/b.png");
    fs::create_symlink(elsewhere / "b.png", model.folder / "images/b.png");
    model.refuse({"images.bin: ", "b.png", "link out of the dataset's folder"});
    fs::remove_all(model.folder / "images");
    fs::create_symlink(elsewhere.path(), model.folder / "images");
    EXPECT_EQ(model.load().missing_images, 0);
}

TEST(Colmap, TextErrorsNameTheLine) {
    Model model;
    std::filesystem::remove_all(model.folder / "sparse");
    const std::string camera_line = "1 PINHOLE 8 6 10 11 4 3\n", image_line = "1 1 0 0 0 0 0 0 1 b.png\n\n";
    const auto refuse = [&](const std::string& cameras, const std::string& images, const std::string& points,
                            std::initializer_list<std::string> parts) {
        model.folder.write("sparse/0/cameras.txt", cameras);
        model.folder.write("sparse/0/images.txt", images);
        model.folder.write("sparse/0/points3D.txt", points);
        expect_error<InputError>([&] { model.load(); }, parts);
    };
    refuse("# c\n1 PINHOLE 8 six 10 11 4 3\n", image_line, "", {"cameras.txt:2:", "height", "\"six\""});
    refuse("1 PINHOLE 8 6 10 11 4\n", image_line, "", {"cameras.txt:1:"});
    refuse("1 PINHOLE 8 6 10 11 4 3 0\n", image_line, "", {"cameras.txt:1:", "too many"});
    refuse("1 OPENCV 8 6 10 11 4 3\n", image_line, "",
           {"cameras.txt:1:", "model OPENCV has 8 parameters after its size, and here are 4"});
    refuse("1 " + std::string(3000, 'X') + " 8 6 10 11 4 3\n", image_line, "",
           {"cameras.txt:1:", "unknown lens model \"" + std::string(60, 'X') + "\";"});
    refuse("1 FOO 8 6 10 11 4 3\n", image_line, "", {"cameras.txt:1:", "FOO", "image_undistorter"});
    refuse(camera_line, image_line + "2 1 0 0 zero 0 0 0 1 c.png\n\n", "", {"images.txt:3:", "\"zero\""});
    refuse(camera_line, "1 1 0 0 0 0 0 0 1\n\n", "", {"images.txt:1:", "no name"});
    refuse(camera_line, "1 1 0 0 0 0 0 0 7 b.png\n\n", "", {"images.txt:1:", "camera 7"});
    refuse(camera_line, image_line, "# p\n\n1 1 2 3 4 5 256 0.5\n", {"points3D.txt:3:", "colour"});
    refuse(camera_line, "# none\n", "", {"no images"});
}

TEST(Colmap, TracksSayWhichPointsAnImageSees) {
    Model model;
    model.points = list({point({1, 2, 3}, {}, 1), point({kNan, 0, 0}, {}, 1), point({-1, 0, 1}, {}, 1)});
    model.write();
    const Dataset dataset = model.load();
    EXPECT_EQ(*dataset.frames[0].seen, (std::vector<uint32_t>{0, 1})) << "without the dropped one";
    EXPECT_FALSE(dataset.frames[1].seen);
}

/// What is written is read back: every kind of lens, names with spaces, and points.
TEST(ColmapWriter, WhatIsWrittenIsReadBack) {
    TempFolder folder;
    std::vector<io::ImageRecord> images;
    const auto add = [&](const std::string& name, const Distortion& distortion) {
        io::ImageRecord& image = images.emplace_back();
        image.name = name;
        image.camera = {.width = 640, .height = 480, .fx = 500.1, .fy = 499.9, .cx = 321.5, .cy = 239.25};
        image.camera.rotation =
            glm::mat3_cast(glm::normalize(glm::dquat(0.9, 0.1, -0.2, 0.1 * double(images.size()))));
        image.camera.translation = {1.0 / 3, -2, double(images.size())};
        image.distortion = distortion;
    };
    add("a b.jpg", {});
    add("c.jpg", {});
    add("d.jpg", {.k1 = 0.1, .p2 = 0.01});
    add("e.jpg", {.k1 = 0.1, .k6 = 0.02});
    add("f.jpg", {.k1 = 0.1, .k4 = 0.01, .lens = Lens::fisheye});
    add("g.jpg", {.k1 = 0.1, .s1 = 0.01, .lens = Lens::fisheye});
    add("h.jpg", {.k1 = 0.1, .k6 = 0.01, .s4 = 0.02, .lens = Lens::fisheye624});
    add("i.jpg", {.k1 = 0.9, .lens = Lens::fov});
    add("j.jpg", {.k1 = -0.1, .lens = Lens::division});
    add("k.jpg", {.k1 = 0.5, .k2 = 1.1, .lens = Lens::unified});
    add("l.jpg", {.lens = Lens::equirectangular});
    scene::set_equirectangular(images.back().camera);
    const PointCloud points{{{1, 2, 3}, {-4.5, 1e-3, 7}}, {{1, 2, 3}, {255, 0, 128}}};
    io::write_colmap(folder / "sparse/0", images, points);
    const io::ImageRecords read = io::read_colmap({folder / "sparse/0"});
    ASSERT_EQ(read.images.size(), images.size());
    for (size_t i = 0; i < images.size(); ++i) {
        SCOPED_TRACE(images[i].name);
        const Camera &is = read.images[i].camera, &was = images[i].camera;
        EXPECT_EQ(read.images[i].name, images[i].name);
        EXPECT_TRUE(read.images[i].distortion == images[i].distortion);
        EXPECT_EQ(is.width, was.width);
        EXPECT_EQ(is.height, was.height);
        for (const auto value : {&Camera::fx, &Camera::fy, &Camera::cx, &Camera::cy})
            EXPECT_EQ(is.*value, was.*value);
        EXPECT_EQ(is.translation, was.translation);
        for (int k = 0; k < 3; ++k) EXPECT_LT(glm::length(is.rotation[k] - was.rotation[k]), 1e-14);
    }
    EXPECT_EQ(read.points.positions, points.positions);
    EXPECT_EQ(read.points.colors, points.colors);
    // The camera with the fewest parameters, alone.
    io::write_colmap(folder / "one", {images.back()}, {});
    EXPECT_EQ(io::read_colmap({folder / "one"}).images.size(), 1u);
}

TEST(Dataset, MissingImages) {
    Model model;
    std::filesystem::remove(model.folder / "images" / "b.png");
    EXPECT_EQ(model.load().frames.size(), 1u);
    EXPECT_EQ(model.load().missing_images, 1);
    DatasetOptions cameras_only;
    cameras_only.need_images = false;
    const Dataset all = model.load(cameras_only);
    EXPECT_EQ(all.frames.size(), 2u);
    EXPECT_FALSE(all.frames[0].image_exists);
    EXPECT_EQ(all.missing_images, 1);
    std::filesystem::remove(model.folder / "images" / "sub" / "a.png");
    model.refuse({"none of the 2 images", "images/b.png"});
    std::filesystem::remove_all(model.folder / "images");
    model.refuse({"/images", "missing"});
    EXPECT_EQ(model.load(cameras_only).frames.size(), 2u);
}

TEST(Dataset, ImageSizeHasToFit) {
    Model model;
    save_image(model.folder / "images" / "b.png", Image(6, 8, 3));
    model.refuse({"\"b.png\"", "6 x 8", "8 x 6"});
    save_image(model.folder / "images" / "b.png", Image(8, 7, 3));
    model.refuse({"\"b.png\"", "8 x 7", "8 x 6"});
    // Half the size: the camera is scaled with it.
    save_image(model.folder / "images" / "b.png", Image(4, 3, 3));
    const Frame half = model.load().frames[0];
    EXPECT_EQ(half.camera.width, 4);
    EXPECT_EQ(half.camera.height, 3);
    EXPECT_EQ(half.camera.fx, 5);
    EXPECT_EQ(half.camera.fy, 5.5);
    EXPECT_EQ(half.camera.cx, 2.25);
    EXPECT_EQ(half.camera.cy, 1.75);
    EXPECT_EQ(load_frame_image(half).width, 4);
    save_image(model.folder / "images" / "b.png", Image(8, 6, 3));
    expect_error<InputError>([&] { load_frame_image(half); }, {"b.png", "8 x 6", "4 x 3"});
}

TEST(Dataset, Downscale) {
    Model model;
    DatasetOptions options;
    options.downscale = 2;
    Image picture(8, 6, 4);
    for (size_t i = 0; i < picture.pixels.size(); ++i) picture.pixels[i] = float(i % 5) / 5;
    save_image(model.folder / "images" / "b.png", picture);
    const Frame frame = model.load(options).frames[0];
    EXPECT_EQ(frame.camera.width, 4);
    EXPECT_EQ(frame.camera.fx, 5);
    EXPECT_EQ(frame.source.width, 8);
    const Image image = load_frame_image(frame);
    EXPECT_EQ(image.channels, 4);
    EXPECT_EQ(image.pixels, downscale(load_image(frame.image_path), 2).pixels);
    options.downscale = 0;
    expect_error<InputError>([&] { model.load(options); }, {"downscale"});
}

TEST(Dataset, ImagesWiderThanTheLimitAreReduced) {
    Model model;
    Image picture(8, 6, 3);
    for (size_t i = 0; i < picture.pixels.size(); ++i) picture.pixels[i] = float(i % 5) / 5;
    save_image(model.folder / "images" / "b.png", picture);
    const Image stored = load_image(model.folder / "images" / "b.png");
    const Frame whole = model.load().frames[0];
    const Frame frame = model.load({.max_width = 6}).frames[0];
    EXPECT_EQ(frame.camera.width, 6);
    EXPECT_EQ(frame.camera.height, 5);  // 4.5, rounded
    EXPECT_DOUBLE_EQ(frame.camera.fx, whole.camera.fx * 6 / 8);
    EXPECT_DOUBLE_EQ(frame.camera.cy, whole.camera.cy * 5 / 6);
    EXPECT_EQ(load_frame_image(frame).pixels, reduced(stored, 6, 5).pixels);
    // Others stay as they are.
    EXPECT_EQ(load_frame_image(model.load({.max_width = 8}).frames[0]).pixels, stored.pixels);
    // The limit is that of the downscaled image.
    EXPECT_EQ(model.load({.downscale = 2, .max_width = 4}).frames[0].camera.width, 4);
    const Frame both = model.load({.downscale = 2, .max_width = 3}).frames[0];
    EXPECT_EQ(both.camera.width, 3);
    EXPECT_EQ(load_frame_image(both).pixels, downscale(reduced(stored, 6, 5), 2).pixels);
    // Without the file, the camera alone is reduced.
    std::filesystem::remove(model.folder / "images" / "b.png");
    EXPECT_EQ(model.load({.need_images = false, .max_width = 3}).frames[0].camera.width, 3);
}

TEST(Dataset, SaysWhatItLookedFor) {
    TempFolder folder;
    expect_error<InputError>([&] { load_dataset(folder.path(), {}); },
                             {"sparse/0", "transforms.json", "transforms_train.json"});
    expect_error<InputError>([&] { load_dataset(folder / "none", {}); }, {"none", "no such file"});
    const auto text = folder.write("a.txt", "text");
    expect_error<InputError>([&] { load_dataset(text, {}); }, {"a.txt", "not a dataset"});
}

TEST(Dataset, RealColmapModel) {
    const auto data = test::shared_data();
    if (!data) GTEST_SKIP() << "no real inputs here";
    const Dataset dataset = load_dataset(*data / "fox_270", {});
    EXPECT_EQ(dataset.frames.size(), 50u);
    EXPECT_EQ(dataset.points.positions.size(), 13778u);
    EXPECT_EQ(dataset.dropped_points, 0);
    EXPECT_EQ(dataset.missing_images, 0);
    EXPECT_EQ(split_frames(dataset, 8).test.size(), 7u);
    // Points stand in front of the cameras that look at them, and most of them in the picture.
    size_t inside = 0;
    const Camera& camera = dataset.frames[0].camera;
    for (const glm::dvec3& p : dataset.points.positions) {
        const glm::dvec3 q = camera.rotation * p + camera.translation;
        const double x = camera.fx * q.x / q.z + camera.cx, y = camera.fy * q.y / q.z + camera.cy;
        inside += q.z > 0 && x > 0 && y > 0 && x < camera.width && y < camera.height;
    }
    EXPECT_GT(inside, dataset.points.positions.size() / 3);
    EXPECT_EQ(load_frame_image(dataset.frames[0]).height, 480);
}

}  // namespace
