// SPDX-License-Identifier: Apache-2.0
// The search for cameras: which lenses can be, which way of placing photos is taken, when a lens gets more terms, and what is doubted.
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <array>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <random>

#include "capture/doubts.h"
#include "capture/feature_database.h"
#include "capture/lens_check.h"
#include "capture/lens_refinement.h"
#include "capture/mapping.h"
#include "capture/sparse_model.h"
#include "ewa/dataset.h"
#include "scene/lens.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using capture::Grade;
using capture::SparseModel;
using capture::Station;
using capture::Way;
using test::TempFolder;

constexpr int32_t kOneRadialTerm = 2, kOpenCvLens = 4;  // COLMAP's numbers

Camera photo_lens(double fx, double fy) {
    return {.width = 800, .height = 600, .fx = fx, .fy = fy, .cx = 400, .cy = 300};
}

/// Looks along z from x, turned about y.
Camera photo_at(double x, double degrees, double z = 0) {
    Camera camera = photo_lens(700, 700);
    camera.rotation = glm::mat3_cast(glm::angleAxis(glm::radians(degrees), glm::dvec3(0, 1, 0)));
    camera.translation = -(camera.rotation * glm::dvec3(x, 0, z));
    return camera;
}

glm::dvec2 seen_at(const Camera& camera, const glm::dvec3& point) {
    const glm::dvec3 p = camera.rotation * point + camera.translation;
    const glm::dvec2 bent = scene::distort(camera.distortion, glm::dvec2(p.x / p.z, p.y / p.z));
    return {camera.fx * bent.x + camera.cx, camera.fy * bent.y + camera.cy};
}

std::vector<glm::dvec3> points_before(int count) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> side(-2, 2), depth(5, 9);
    std::vector<glm::dvec3> points;
    for (int i = 0; i < count; ++i) points.emplace_back(side(random), side(random), depth(random));
    return points;
}

/// Twelve photos of 300 points through an OPENCV lens, in a model whose lens has one radial term of 0.
SparseModel photographed(const Distortion& lens) {
    SparseModel model;
    model.cameras[1] = {kOneRadialTerm, 800, 600, {700, 400, 300, 0}};
    const std::vector<glm::dvec3> points = points_before(300);
    for (uint32_t i = 1; i <= 12; ++i) {
        Camera camera = photo_at(0.1 * i - 0.6, 0);
        camera.distortion = lens;
        capture::SparseImage& image = model.images[i];
        image.pose = {1, 0, 0, 0, camera.translation.x, camera.translation.y, camera.translation.z};
        image.camera = 1;
        image.name = "p" + std::to_string(10 + i) + ".jpg";
        for (size_t k = 0; k < points.size(); ++k) {
            image.features.push_back({seen_at(camera, points[k]), k});
            model.points[k].position = points[k];
            model.points[k].track.emplace_back(i, uint32_t(k));
        }
    }
    return model;
}

TEST(LensCheck, NamesWhatNoLensHas) {
    const auto fault = [](const Camera& lens, double expected = 0) {
        return capture::lens_fault(lens, expected);
    };
    EXPECT_EQ(fault(photo_lens(700, 702)), "");
    EXPECT_EQ(fault(photo_lens(700, 702), 690), "");
    EXPECT_EQ(fault(photo_lens(1765, 1501)), "the focal lengths are 1765 px along and 1501 px across");
    EXPECT_EQ(fault(photo_lens(1633, 1633), 778), "the focal length is 1633 px, and EXIF has 778 px");
    EXPECT_EQ(fault(photo_lens(200, 200)), "the focal length of 200 px is no camera's");
    EXPECT_EQ(fault(photo_lens(5000, 5000)), "the focal length of 5000 px is no camera's");
    Camera bent = photo_lens(700, 700);
    bent.distortion.p1 = -0.054;
    EXPECT_EQ(fault(bent), "the tangential distortion is no lens's");
    for (const double k : {-0.6, 0.9}) {
        bent.distortion = {.k1 = k};
        EXPECT_EQ(fault(bent), "the distortion is no lens's") << k;
    }
    for (const double k : {-0.2, 0.2}) {
        bent.distortion = {.k1 = k};
        EXPECT_EQ(fault(bent), "") << k;
    }
}

TEST(LensCheck, CountsPhotosThatCanBeRight) {
    SparseModel model = photographed({});
    EXPECT_EQ(capture::grade_of(model, {}).sound, 12);
    for (auto& [id, point] : model.points) point.error = id % 2 == 0 ? 0.5 : 1;
    EXPECT_DOUBLE_EQ(capture::grade_of(model, {}).error, 0.75);
    const Grade far = capture::grade_of(model, {{"p11.jpg", 300.0}});
    EXPECT_EQ(far.placed, 12);
    EXPECT_EQ(far.sound, 11);
    EXPECT_EQ(far.faults.begin()->first, "p11.jpg");
    model.images[3].pose = {0, 0, 1, 0, 0, 0, 0};
    EXPECT_EQ(capture::grade_of(model, {}).faults.at("p13.jpg"), "points are behind the camera");
}

/// A wrong model of all photos loses against a sound one of most.
TEST(LensCheck, SoundPhotosCountFirst) {
    const Grade wrong{.placed = 30, .sound = 0, .error = 0.1},
        right{.placed = 24, .sound = 24, .contradictions = 1, .error = 0.6},
        more{.placed = 25, .sound = 24, .contradictions = 2, .error = 1},
        consistent{.placed = 24, .sound = 24, .error = 0.9},
        exact{.placed = 24, .sound = 24, .contradictions = 1, .error = 0.5},
        jumping{.placed = 26, .sound = 26, .parted = 3};
    EXPECT_TRUE(is_better(right, wrong));
    EXPECT_FALSE(is_better(wrong, right));
    EXPECT_TRUE(is_better(more, right));
    EXPECT_TRUE(is_better(consistent, exact));
    EXPECT_TRUE(is_better(exact, right));
    EXPECT_TRUE(is_better(right, jumping));
    EXPECT_FALSE(is_enough(jumping, 30));
    const Grade two_rounds{.placed = 80, .sound = 80, .parted = 40}, one_round{.placed = 42, .sound = 42};
    EXPECT_TRUE(is_better(two_rounds, one_round));
    EXPECT_FALSE(is_better(right, right));
    EXPECT_TRUE(is_enough(right, 30));
    EXPECT_FALSE(is_enough(right, 31));
    EXPECT_FALSE(is_enough(wrong, 30));
}

TEST(Ways, BeginWithWhatCostsLeast) {
    const auto names = [](const capture::WayFacts& facts) {
        std::string text;
        for (const Way& way : capture::other_ways(facts)) text += way.name + "\n";
        return text;
    };
    const std::string exif = "with the lens by EXIF\n", own = "with a lens for each photo\n",
                      forward = "with forward motion\n";
    EXPECT_EQ(names({}), forward);
    const std::string both_names = "with the lens by EXIF and with forward motion\n";
    EXPECT_EQ(names({.exif = true}), exif + both_names + forward);
    EXPECT_EQ(names({.shared = true}),
              own + forward + "with a lens for each photo and with forward motion\n");
    EXPECT_EQ(names({.exif = true, .shared = true}), exif + both_names + forward + own);
    const Way fixed = capture::with({}, {.name = "a", .words = {"--x", "1"}}),
              both = capture::with(fixed, {.name = "b", .words = {"--y", "2"}, .own_lenses = true});
    EXPECT_EQ(both.name, "a and b");
    EXPECT_EQ(both.words, (std::vector<std::string>{"--x", "1", "--y", "2"}));
    EXPECT_TRUE(is_same(fixed, {.name = "c", .words = {"--x", "1"}}));
    EXPECT_FALSE(is_same(both, fixed));
    EXPECT_FALSE(is_same(fixed, {.name = "a", .words = {"--x", "1"}, .own_lenses = true}));
}

TEST(LensRefinement, HoldsOutATenthOfTheObservations) {
    SparseModel model = photographed({});
    for (auto& [id, point] : model.points)
        if (id < 20) point.track.resize(3);
    const SparseModel whole = model;
    const auto out = capture::hold_out(model);
    EXPECT_NEAR(double(out.size()), 0.1 * 12 * 280, 60);
    SparseModel again = whole;
    EXPECT_EQ(capture::hold_out(again), out);
    for (const auto& [id, point] : model.points) EXPECT_GE(point.track.size(), 3u);
    for (const capture::HeldOut& each : out) {
        EXPECT_GE(each.point, 20u);
        EXPECT_EQ(model.images[each.image].features[each.feature].point, capture::kNoPoint);
        for (const auto& [image, feature] : model.points[each.point].track)
            EXPECT_FALSE(image == each.image && feature == each.feature);
    }
}

TEST(LensRefinement, TakesTermsThatExplainWhatWasHeldOut) {
    SparseModel simple = photographed({.k1 = 0.02, .p1 = 0.003});
    const auto out = capture::hold_out(simple);
    SparseModel full = simple;
    EXPECT_EQ(capture::give_lens(full, kOpenCvLens), 1);
    EXPECT_EQ(full.cameras[1].parameters, (std::vector<double>{700, 700, 400, 300, 0, 0, 0, 0}));
    full.cameras[1].parameters[4] = 0.02;
    full.cameras[1].parameters[6] = 0.003;
    const auto before = capture::errors_of(simple, out), after = capture::errors_of(full, out);
    EXPECT_GT(before[0], 0.1);
    for (const double error : after) EXPECT_LT(error, 1e-6);
    EXPECT_TRUE(capture::have_fallen(before, after));
    EXPECT_FALSE(capture::have_fallen(after, before));
    // What chance alone explains is no gain.
    std::mt19937 random(1);
    std::normal_distribution<double> noise(0, 1);
    std::vector<double> first, second;
    for (int i = 0; i < 300; ++i) {
        first.push_back(5 + noise(random));
        second.push_back(first.back() - 0.02 + noise(random));
    }
    EXPECT_FALSE(capture::have_fallen(first, second));
}

TEST(LensRefinement, NeedsTenPhotosOfALens) {
    SparseModel model = photographed({});
    model.cameras[2] = model.cameras[1];
    for (uint32_t i = 1; i <= 3; ++i) model.images[i].camera = 2;
    EXPECT_EQ(capture::give_lens(model, kOpenCvLens), 0);
    model.images[1].camera = 1;
    EXPECT_EQ(capture::give_lens(model, kOpenCvLens), 1);
    EXPECT_EQ(model.cameras[1].lens, kOpenCvLens);
    EXPECT_EQ(model.cameras[2].lens, kOneRadialTerm);
}

TEST(SparseModelFiles, KeepWhatTheyGot) {
    const TempFolder folder;
    SparseModel model = photographed({.k1 = 0.1});
    model.points[7].color = {1, 2, 3};
    model.points[7].error = 0.25;
    capture::write_sparse(model, folder / "a");
    capture::write_sparse(capture::read_sparse(folder / "a"), folder / "b");
    for (const char* file : {"cameras.bin", "images.bin", "points3D.bin"}) {
        const std::string bytes = test::file_bytes(folder / "a" / file);
        EXPECT_EQ(bytes, test::file_bytes(folder / "b" / file)) << file;
        folder.write(std::filesystem::path("a") / file, bytes.substr(0, bytes.size() - 1));
        EXPECT_THROW(capture::read_sparse(folder / "a"), InputError) << file;
        folder.write(std::filesystem::path("a") / file, bytes);
    }
    model.points[7].track.emplace_back(99, 0);
    capture::write_sparse(model, folder / "c");
    EXPECT_THROW(capture::read_sparse(folder / "c"), InputError);
}

TEST(Doubts, MatchesContradictWrongCameras) {
    const Camera first = photo_at(0, 0), second = photo_at(1, -10);
    std::vector<std::pair<glm::dvec2, glm::dvec2>> matches;
    for (const glm::dvec3& point : points_before(60))
        matches.emplace_back(seen_at(first, point), seen_at(second, point));
    EXPECT_FALSE(capture::contradict(first, second, matches));
    EXPECT_FALSE(capture::contradict(second, second, matches));  // nothing is known without a distance
    // As round a can with two faces: the camera is on the other side.
    EXPECT_TRUE(capture::contradict(first, photo_at(-1, 170, 14), matches));
    EXPECT_TRUE(capture::contradict(first, photo_at(0.2, 0, -1), matches));
    matches.resize(20);
    EXPECT_FALSE(capture::contradict(first, photo_at(-1, 170, 14), matches));
}

TEST(Doubts, NameFramesFarFromTheirNeighbours) {
    std::vector<Station> walk;
    for (int i = 0; i < 12; ++i) {
        const Camera camera = photo_at(0.3 * i, 5.0 * i);
        walk.push_back({std::to_string(i), camera.position(), camera.rotation});
    }
    EXPECT_TRUE(capture::strays_among(walk).empty());
    std::vector<Station> turned = walk, moved = walk, round = walk;
    turned[5].rotation = photo_at(0, 150).rotation;
    EXPECT_EQ(capture::strays_among(turned), std::vector<std::string>{"5"});
    moved[8].center = {0, 0, 9};
    EXPECT_EQ(capture::strays_among(moved), std::vector<std::string>{"8"});
    // A second walk from another place is no stray, nor are photos in no order.
    for (size_t i = 6; i < round.size(); ++i) round[i].center += glm::dvec3(0, 8, 0);
    EXPECT_TRUE(capture::strays_among(round).empty());
    std::vector<Station> shuffled;
    for (size_t i = 0; i < walk.size(); ++i) shuffled.push_back(walk[i * 5 % walk.size()]);
    EXPECT_TRUE(capture::strays_among(shuffled).empty());
}

/// The errors and neighbours that a reader of the dataset gets: p12 sees everything 3 px to the right, and p14 sees 100 points less.
TEST(CameraSupports, AreThoseOfTheModel) {
    const TempFolder folder;
    SparseModel model = photographed({});
    for (capture::SparseFeature& feature : model.images[2].features) feature.at.x += 3;
    for (uint64_t k = 0; k < 100; ++k) {
        model.images[4].features[k].point = capture::kNoPoint;
        std::erase_if(model.points[k].track, [](const auto& entry) { return entry.first == 4; });
    }
    for (auto it = model.images.begin(); it != model.images.end();)
        it = it->first > 4 ? model.images.erase(it) : ++it;
    capture::write_sparse(model, folder / "sparse/0");
    const Dataset dataset = load_dataset(folder.path(), {.need_images = false});
    ASSERT_EQ(dataset.frames.size(), 4u);
    const std::vector<CameraSupport> supports = camera_support(dataset, 2);
    ASSERT_EQ(supports.size(), 4u);
    EXPECT_NEAR(supports[0].error, 0, 1e-3);
    EXPECT_NEAR(supports[1].error, 3, 1e-3);
    EXPECT_EQ(supports[0].points, 300u);
    EXPECT_EQ(supports[3].points, 200u);
    ASSERT_EQ(supports[0].neighbors.size(), 2u);
    EXPECT_EQ(supports[0].neighbors[0].frame, 1);
    EXPECT_EQ(supports[0].neighbors[0].points, 300u);
    EXPECT_EQ(supports[3].neighbors[0].points, 200u);
    EXPECT_EQ(support_text(dataset, supports[1]),
              "300 points, 3 px; most in common with p11.jpg (300) and p13.jpg (300)");
    EXPECT_TRUE(camera_support(Dataset{}).empty());
}

/// Photos before and after a jump that have no matches are a walk with a gap.
TEST(Doubts, NameJumpsBetweenPhotosThatMatch) {
    std::vector<Station> walk;
    for (int i = 0; i < 12; ++i) walk.push_back({std::to_string(i), {0.3 * i, 0, 0}, glm::dmat3(1)});
    std::vector<size_t> matches(12, 200);
    EXPECT_TRUE(capture::jumps_among(walk, matches).empty());
    for (size_t i = 8; i < walk.size(); ++i) walk[i].center.x += 2;
    for (size_t i = 4; i < walk.size(); ++i) walk[i].rotation = photo_at(0, 40).rotation;
    EXPECT_EQ(capture::jumps_among(walk, matches), (std::vector<size_t>{3, 7}));
    matches[7] = 10;
    EXPECT_EQ(capture::jumps_among(walk, matches), std::vector<size_t>{3});
    EXPECT_EQ(capture::parted_by({3}, 12), 4u);
    EXPECT_EQ(capture::parted_by({3, 8}, 12), 7u);
    EXPECT_EQ(capture::parted_by({9}, 12), 2u);
    EXPECT_EQ(capture::parted_by({}, 12), 0u);
}

TEST(Doubts, AreLinesWithNames) {
    const Grade grade{.placed = 3, .sound = 1, .faults = {{"a.jpg", "x"}, {"b.jpg", "x"}}};
    const auto lines = capture::doubts_of(grade, {{"c.jpg", "d.jpg", 90, true}}, {"e.jpg"}, {"f to g"});
    ASSERT_EQ(lines.size(), 4u);
    EXPECT_EQ(lines[0], "the cameras of 2 photos are probably wrong, since x: a.jpg, b.jpg");
    EXPECT_NE(lines[1].find("1 pair of photos"), std::string::npos) << lines[1];
    EXPECT_NE(lines[1].find("c.jpg with d.jpg"), std::string::npos) << lines[1];
    EXPECT_NE(lines[2].find("e.jpg"), std::string::npos) << lines[2];
    EXPECT_TRUE(lines[3].ends_with(": f to g")) << lines[3];
    EXPECT_TRUE(capture::doubts_of({}, {}, {}, {}).empty());
}

/// A database as COLMAP 3.8 writes it: three photos that share a camera, in the order in which threads have finished.
void write_shared_camera(const std::string& file) {
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
    const char* sql =
        "CREATE TABLE cameras (camera_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, model INTEGER NOT NULL, "
        "width "
        "INTEGER NOT NULL, height INTEGER NOT NULL, params BLOB, prior_focal_length INTEGER NOT NULL);"
        "CREATE TABLE images (image_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, name TEXT NOT NULL "
        "UNIQUE, "
        "camera_id INTEGER NOT NULL);"
        "CREATE TABLE keypoints (image_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER, cols INTEGER, data "
        "BLOB);"
        "CREATE TABLE descriptors (image_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER, cols INTEGER, data "
        "BLOB);"
        "CREATE TABLE matches (pair_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER, cols INTEGER, data BLOB);"
        "CREATE TABLE two_view_geometries (pair_id INTEGER PRIMARY KEY NOT NULL, rows INTEGER, cols INTEGER, "
        "data "
        "BLOB, config INTEGER);"
        // 800 and 400 as float64.
        "INSERT INTO cameras VALUES (4, 2, 800, 600, X'00000000000089400000000000007940', 1);"
        "INSERT INTO cameras VALUES (5, 2, 800, 600, X'00000000000089400000000000007940', 0);"
        "INSERT INTO images VALUES (1, 'c.jpg', 4), (2, 'a.jpg', 4), (7, 'b.jpg', 5);"
        "INSERT INTO keypoints VALUES (1, 1, 1, X'01'), (2, 2, 1, X'0202'), (7, 3, 1, X'030303');"
        "INSERT INTO descriptors VALUES (1, 1, 128, ZEROBLOB(128)), (2, 0, 128, NULL), (7, 0, 128, NULL);"
        "INSERT INTO two_view_geometries VALUES (2147483649, 1, 2, X'0100000003000000', 2);";
    char* error = nullptr;
    ASSERT_EQ(sqlite3_exec(database, sql, nullptr, nullptr, &error), SQLITE_OK) << error;
    sqlite3_close(database);
}

TEST(DatabaseOfPhotos, NumbersThemByNameAndPartsTheirLenses) {
    const TempFolder folder;
    const std::string file = (folder / "database.db").string();
    write_shared_camera(file);
    capture::FeatureDatabase database(file);
    ASSERT_TRUE(database.has_cameras());
    EXPECT_FALSE(database.has_rigs());
    EXPECT_EQ(database.expected_focal_lengths(),
              (std::map<std::string, double>{{"a.jpg", 800}, {"c.jpg", 800}}));
    EXPECT_TRUE(database.has_shared_cameras());
    size_t pairs = 0;
    database.visit_verified([&](std::int64_t first, std::int64_t second, const auto& matches) {
        ++pairs;
        EXPECT_EQ(std::pair(first, second), std::pair(std::int64_t(1), std::int64_t(2)));
        ASSERT_EQ(matches.size(), 1u);
        EXPECT_EQ(matches[0], (capture::FeatureMatch{1, 3}));
    });
    EXPECT_EQ(pairs, 1u);
    database.remove_verified(2, 1);
    database.visit_verified([&](std::int64_t, std::int64_t, const auto&) { ++pairs; });
    EXPECT_EQ(pairs, 1u);

    EXPECT_EQ(database.descriptors(1).size(), 128u);
    database.number_by_name();
    EXPECT_EQ(database.images(),
              (std::map<std::string, std::int64_t>{{"a.jpg", 1}, {"b.jpg", 2}, {"c.jpg", 3}}));
    EXPECT_EQ(database.descriptors(3).size(), 128u);
    EXPECT_TRUE(database.descriptors(1).empty());

    database.give_own_cameras();
    EXPECT_FALSE(database.has_shared_cameras());
    EXPECT_EQ(database.expected_focal_lengths(),
              (std::map<std::string, double>{{"a.jpg", 800}, {"c.jpg", 800}}));
    database.remove_descriptors();
    EXPECT_TRUE(database.descriptors(3).empty());
}

/// As COLMAP 3.12 and later write it: each image is a frame of its camera's rig.
TEST(DatabaseOfPhotos, GivesEachARigOfItsOwn) {
    const TempFolder folder;
    const std::string file = (folder / "database.db").string();
    write_shared_camera(file);
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
    const char* sql =
        "CREATE TABLE rigs (rig_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, ref_sensor_id INTEGER NOT "
        "NULL, ref_sensor_type INTEGER NOT NULL);"
        "CREATE TABLE frames (frame_id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, rig_id INTEGER NOT NULL);"
        "CREATE TABLE frame_data (frame_id INTEGER NOT NULL, data_id INTEGER NOT NULL, sensor_id INTEGER NOT "
        "NULL, sensor_type INTEGER NOT NULL);"
        "INSERT INTO rigs VALUES (1, 4, 0), (2, 5, 0);"
        "INSERT INTO frames VALUES (11, 1), (12, 1), (17, 2);"
        "INSERT INTO frame_data VALUES (11, 1, 4, 0), (12, 2, 4, 0), (17, 7, 5, 0);";
    ASSERT_EQ(sqlite3_exec(database, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(database);
    capture::FeatureDatabase found(file);
    ASSERT_TRUE(found.has_cameras() && found.has_rigs());
    EXPECT_EQ(found.expected_focal_lengths(),
              (std::map<std::string, double>{{"a.jpg", 800}, {"c.jpg", 800}}));
    found.give_own_cameras();
    found.commit();
    EXPECT_FALSE(found.has_shared_cameras());
    // Each image's camera is that of its frame, and of its frame's rig, which no other frame has.
    sqlite3_stmt* row = nullptr;
    ASSERT_EQ(sqlite3_prepare_v2(database,
                                 "SELECT COUNT(DISTINCT rig_id) FROM images JOIN frame_data ON data_id = "
                                 "image_id AND sensor_id = camera_id JOIN frames USING (frame_id) JOIN rigs "
                                 "USING (rig_id) WHERE ref_sensor_id = camera_id AND ref_sensor_type = 0",
                                 -1, &row, nullptr),
              SQLITE_OK)
        << sqlite3_errmsg(database);
    ASSERT_EQ(sqlite3_step(row), SQLITE_ROW);
    EXPECT_EQ(sqlite3_column_int(row, 0), 3);
    sqlite3_finalize(row);
    sqlite3_close(database);
}

TEST(DatabaseOfPhotos, ClearsDescriptorsThatWereNeverWritten) {
    const TempFolder folder;
    const std::string file = (folder / "database.db").string();
    write_shared_camera(file);
    // x, y and the columns of a turned scale of 2: inside, at the lower border, at the right one.
    const std::array<float, 18> features{790, 590, 0, -2,    2,   0, 100, 597.5, 0,
                                         -2,  2,   0, 797.5, 300, 2, 0,   0,     2};
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
    sqlite3_stmt* row = nullptr;
    ASSERT_EQ(
        sqlite3_prepare_v2(database, "UPDATE keypoints SET rows = 3, cols = 6, data = ? WHERE image_id = 1",
                           -1, &row, nullptr),
        SQLITE_OK);
    sqlite3_bind_blob(row, 1, features.data(), sizeof(features), SQLITE_TRANSIENT);
    ASSERT_EQ(sqlite3_step(row), SQLITE_DONE);
    sqlite3_finalize(row);
    ASSERT_EQ(sqlite3_prepare_v2(database, "UPDATE descriptors SET rows = 3, data = ? WHERE image_id = 1", -1,
                                 &row, nullptr),
              SQLITE_OK);
    const std::vector<std::uint8_t> values(3 * capture::kDescriptorSize, 7);
    sqlite3_bind_blob(row, 1, values.data(), int(values.size()), SQLITE_TRANSIENT);
    ASSERT_EQ(sqlite3_step(row), SQLITE_DONE);
    sqlite3_finalize(row);
    sqlite3_close(database);

    capture::FeatureDatabase found(file);
    found.clear_unwritten_descriptors();
    const capture::Descriptors cleared = found.descriptors(1);
    ASSERT_EQ(cleared.size(), values.size());
    for (size_t i = 0; i < cleared.size(); ++i)
        EXPECT_EQ(cleared[i], i < capture::kDescriptorSize ? 7 : 0) << i;
}

}  // namespace
