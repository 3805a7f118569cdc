// SPDX-License-Identifier: Apache-2.0
// 360° photos whose cameras are searched: which photos are such, the pinhole views that COLMAP gets, and the photos' cameras from
// those of the views.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <numbers>
#include <set>
#include <sstream>

#include "capture/panoramas.h"
#include "core/file_reader.h"
#include "ewa/error.h"
#include "io/datasets/image_records.h"
#include "scene/native_lens.h"
#include "support/temp_folder.h"

namespace ewa::test {
namespace {

namespace fs = std::filesystem;
using capture::kPanoramaViews;
using capture::Pose;

Camera whole_sphere(int width, int height) {
    Camera camera{.width = width, .height = height, .distortion = {.lens = Lens::equirectangular}};
    scene::set_equirectangular(camera);
    return camera;
}

/// What lies in a direction: no rotation maps it to itself.
glm::dvec3 colour_of(const glm::dvec3& d) {
    return {0.5 + 0.4 * d.x, 0.5 + 0.3 * d.y + 0.1 * d.x * d.z, 0.5 + 0.4 * d.z};
}

Image panorama(int width, int height) {
    const Camera camera = whole_sphere(width, height);
    Image image(width, height, 3);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const glm::dvec3 colour = colour_of(scene::ray_of(camera, 0, x + 0.5, y + 0.5)->direction);
            for (int c = 0; c < 3; ++c) image.at(x, y)[c] = float(colour[c]);
        }
    return image;
}

/// The right half of a panorama, and as wide again: 2 to 1, and its borders show different things.
Image half_of(const Image& whole) {
    Image image(whole.width, whole.height, 3);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            std::copy_n(whole.at(whole.width / 2 + x / 2, y), 3, image.at(x, y));
    return image;
}

/// A thing in the middle of a grey wall that grows darker towards the floor.
Image thing_before_a_wall() {
    Image image(128, 64, 3);
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 128; ++x) {
            const bool thing = std::abs(x - 64) < 20 && std::abs(y - 32) < 20;
            for (int c = 0; c < 3; ++c)
                image.at(x, y)[c] = thing ? float((x * 7 + y * 3) % 5) / 4 : 0.9f - 0.005f * float(y);
        }
    return image;
}

TEST(Panoramas, AreTwiceAsWideAndGoAround) {
    TempFolder folder;
    save_image(folder / "a.png", panorama(128, 64));
    save_image(folder / "b.png", panorama(64, 32));
    save_image(folder / "half.png", half_of(panorama(128, 64)));
    save_image(folder / "wide.png", panorama(130, 64));
    save_image(folder / "thing.png", thing_before_a_wall());
    save_image(folder / "blank.png", Image(128, 64, 3));
    EXPECT_TRUE(capture::are_panoramas(folder.path(), {"a.png", "b.png"}));
    EXPECT_FALSE(capture::are_panoramas(folder.path(), {"a.png", "b.png", "half.png"}));
    EXPECT_FALSE(capture::are_panoramas(folder.path(), {"a.png", "wide.png"}));
    EXPECT_FALSE(capture::are_panoramas(folder.path(), {"thing.png", "thing.png"}));
    EXPECT_FALSE(capture::are_panoramas(folder.path(), {"blank.png"}));
    EXPECT_FALSE(capture::are_panoramas(folder.path(), {}));
    EXPECT_THROW(capture::are_panoramas(folder.path(), {"a.png", "missing.png"}), InputError);
}

TEST(Panoramas, AreThoseWhoseXmpSaysSo) {
    TempFolder folder;
    const Image half = half_of(panorama(128, 64));
    save_panorama(folder / "a.png", half);
    save_panorama(folder / "b.jpg", half);
    save_panorama(folder / "wide.png", panorama(130, 64));
    EXPECT_TRUE(capture::are_panoramas(folder.path(), {"a.png", "b.jpg"}));
    EXPECT_FALSE(capture::are_panoramas(folder.path(), {"a.png", "wide.png"}));
    save_image(folder / "plain.png", half);
    EXPECT_FALSE(capture::are_panoramas(folder.path(), {"a.png", "plain.png"}));
}

/// View k looks at the horizon, k / 6 of a turn to the right of the photo's middle.
TEST(Panoramas, ViewsShowWhatLiesThere) {
    const Image photo = panorama(256, 128);
    for (int k = 0; k < kPanoramaViews; ++k) {
        const Image view = capture::panorama_view(photo, k);
        ASSERT_EQ(view.width, 81);  // 256 / pi
        ASSERT_EQ(view.height, 81);
        const double turn = 2 * std::numbers::pi * k / kPanoramaViews;
        const glm::dvec3 forward(std::sin(turn), 0, std::cos(turn)),
            right(std::cos(turn), 0, -std::sin(turn));
        for (const int x : {0, 40, 80})
            for (const int y : {0, 40, 80}) {
                const glm::dvec3 d =
                    glm::normalize(forward + (x - 40) / 40.5 * right + (y - 40) / 40.5 * glm::dvec3(0, 1, 0));
                for (int c = 0; c < 3; ++c)
                    EXPECT_NEAR(view.at(x, y)[c], colour_of(d)[c], 0.002) << k << ' ' << x << ' ' << y;
                // view_rotation says the same.
                const glm::dvec3 seen = capture::view_rotation(k) * d;
                EXPECT_NEAR(seen.x / seen.z, (x - 40) / 40.5, 1e-12);
                EXPECT_NEAR(seen.y / seen.z, (y - 40) / 40.5, 1e-12);
            }
    }
}

TEST(Panoramas, ViewsAreWrittenOnce) {
    TempFolder folder;
    fs::create_directories(folder / "photos/my trip");
    save_image(folder / "photos/my trip/p 1%.png", panorama(64, 32));
    save_image(folder / "photos/q.png", panorama(128, 64));
    const capture::Photos photos{folder / "photos", {"my trip/p 1%.png", "q.png"}};
    int calls = 0;
    const auto count = [&](const CaptureProgress&) { return ++calls > 0; };
    const auto views = capture::views_of_panoramas(photos, folder / "views", count);
    EXPECT_EQ(calls, 2);
    ASSERT_EQ(views.photos.names.size(), size_t(2 * kPanoramaViews));
    EXPECT_EQ(views.cameras.size(), size_t(2 * kPanoramaViews));  // two widths
    EXPECT_EQ(views.cameras.at({20, 3}).size(), 1u);
    for (const fs::path& name : views.photos.names) {
        EXPECT_EQ(name.string().find(' '), std::string::npos) << name;
        EXPECT_TRUE(fs::is_regular_file(folder / "views" / name)) << name;
    }
    EXPECT_EQ(capture::photo_of_view(views.photos.names[2].string()),
              std::pair(2, std::string("my trip/p 1%.png")));
    const fs::path first = folder / "views" / views.photos.names[0];
    std::ofstream(first) << "kept";
    fs::remove(folder / "views" / views.photos.names[1]);
    capture::views_of_panoramas(photos, folder / "views", count);
    EXPECT_EQ(core::read_text_file(first), "kept");
    EXPECT_TRUE(fs::is_regular_file(folder / "views" / views.photos.names[1]));
    EXPECT_THROW(
        capture::views_of_panoramas(photos, folder / "none", [](const CaptureProgress&) { return false; }),
        capture::Stopped);
}

TEST(Panoramas, OtherNamesAreNoViews) {
    for (const char* name :
         {"", "p.png", "ewa-view-0", "ewa-view-0/", "ewa-view-0/.pn", "ewa-view-6/p.png.png",
          "ewa-view--1/p.png.png", "ewa-view-x/p.png.png", "ewa-view-0/p%2.png", "ewa-view-0/p%zz.png"})
        EXPECT_EQ(capture::photo_of_view(name).second, "") << name;
    EXPECT_EQ(capture::photo_of_view("ewa-view-5/a/b.jpg.png"), std::pair(5, std::string("a/b.jpg")));
}

TEST(Panoramas, ViewsOfTwoPhotosAreAllCompared) {
    const std::vector<capture::ImagePair> pairs = capture::pairs_of_views({{0, 2}, {1, 2}});
    EXPECT_EQ(pairs.size(), 2u * 36);
    EXPECT_EQ(std::set(pairs.begin(), pairs.end()).size(), pairs.size());
    for (size_t i = 0; i < pairs.size(); ++i) {
        EXPECT_EQ(pairs[i].first / 6, i < 36 ? 0 : 1);
        EXPECT_EQ(pairs[i].second / 6, 2);
    }
}

Pose posed(const glm::dquat& rotation, const glm::dvec3& center) {
    return {glm::normalize(rotation), center};
}

TEST(Panoramas, StandWhereMostOfTheirViewsDo) {
    const glm::dquat turned = glm::normalize(glm::dquat(0.8, 0.1, -0.5, 0.3));
    const glm::dvec3 at(1, 2, 3), off(0.003, 0, -0.002);
    Pose pose;
    EXPECT_EQ(capture::agreed({}, 1, pose), 0);
    EXPECT_EQ(capture::agreed({posed(turned, at)}, 1, pose), 1);
    EXPECT_EQ(pose.center, at);
    // One is turned, one stands elsewhere, and one quaternion has the other sign.
    const std::vector<Pose> poses{posed({1, 0, 0, 0}, at),  posed(turned, {9, 9, 9}), posed(turned, at + off),
                                  posed(-turned, at - off), posed(turned, at),        posed(turned, at)};
    EXPECT_EQ(capture::agreed(poses, 1, pose), 4);
    EXPECT_LT(glm::distance(pose.center, at), 0.004);
    EXPECT_NEAR(std::abs(glm::dot(pose.rotation, turned)), 1, 1e-12);
    // The scale decides what is near.
    EXPECT_EQ(capture::agreed(poses, 100, pose), 5);
    EXPECT_EQ(capture::agreed(poses, 0.001, pose), 2);
}

/// A model of views of photos at a, and what is made of it.
class Rig : public testing::Test {
  protected:
    void view(int k, const std::string& photo, const glm::dquat& rotation, const glm::dvec3& center) {
        io::ImageRecord view;
        view.name = capture::view_name(k, photo).string();
        view.camera = {.width = 20, .height = 20, .fx = 10, .fy = 10, .cx = 10, .cy = 10};
        view.camera.rotation = capture::view_rotation(k) * glm::mat3_cast(glm::normalize(rotation));
        view.camera.translation = -(view.camera.rotation * center);
        views_.push_back(view);
    }
    fs::path model() {
        PointCloud points;
        points.positions = {{4, 5, 6}};
        points.colors = {{1, 2, 3}};
        io::write_colmap(folder_ / "views", views_, points);
        return folder_ / "views";
    }
    TempFolder folder_;
    std::vector<io::ImageRecord> views_;
};

TEST_F(Rig, DropsViewsAndPhotosThatDisagree) {
    const glm::dquat turned(0.8, 0.1, -0.5, 0.3);
    for (int k = 0; k < kPanoramaViews; ++k) {
        view(k, "a.png", turned, {0, 0, 0});
        view(k, "b.png", turned, k == 5 ? glm::dvec3(0, 3, 0) : glm::dvec3(1, 0, 0));
    }
    view(0, "c.png", turned, {2, 0, 0});
    view(1, "c.png", turned, {7, 0, 0});
    view(2, "d.png", turned, {3, 0, 0});
    const capture::RigPoses poses = capture::rig_poses(model());
    EXPECT_EQ(poses.views, 15);
    EXPECT_EQ(poses.dropped, 3);
    EXPECT_FALSE(poses.photos.contains("c.png"));
    ASSERT_EQ(poses.photos.size(), 3u);
    EXPECT_LT(glm::distance(poses.photos.at("b.png").center, glm::dvec3(1, 0, 0)), 1e-12);
    EXPECT_LT(glm::distance(poses.photos.at("d.png").center, glm::dvec3(3, 0, 0)), 1e-12);
}

/// The rig has all views of the placed photos, and the views give the photos' poses again.
TEST_F(Rig, HasAllViewsOfAPhoto) {
    const glm::dquat turned = glm::normalize(glm::dquat(0.8, 0.1, -0.5, 0.3));
    fs::create_directories(folder_ / "photos");
    for (const char* name : {"a.png", "b.png", "c.png"})
        save_image(folder_ / "photos" / name, panorama(64, 32));
    const capture::Photos photos{folder_ / "photos", {"a.png", "b.png", "c.png"}};
    const auto views =
        capture::views_of_panoramas(photos, folder_ / "cut", [](const CaptureProgress&) { return true; });
    const std::map<std::string, Pose> poses{{"a.png", posed(turned, {1, 2, 3})},
                                            {"c.png", posed({1, 0, 0, 0}, {0, 1, 0})}};
    capture::write_rig(poses, views, folder_ / "rig", folder_ / "rig.json");
    const io::ImageRecords written = io::read_colmap(io::colmap_model_in(folder_ / "rig"));
    EXPECT_EQ(written.images.size(), size_t(2 * kPanoramaViews));
    for (const io::ImageRecord& image : written.images) EXPECT_EQ(image.camera.fx, 10.0) << image.name;
    const capture::RigPoses again = capture::rig_poses(folder_ / "rig");
    ASSERT_EQ(again.photos.size(), 2u);
    EXPECT_EQ(again.dropped, 0);
    for (const auto& [name, pose] : poses) {
        EXPECT_LT(glm::distance(again.photos.at(name).center, pose.center), 1e-12) << name;
        EXPECT_NEAR(std::abs(glm::dot(again.photos.at(name).rotation, pose.rotation)), 1, 1e-12) << name;
    }
    view(0, "a.png", turned, {1, 2, 3});
    capture::join_views(poses, model(), photos, folder_ / "model");
    const io::ImageRecords joined = io::read_colmap(io::colmap_model_in(folder_ / "model"));
    ASSERT_EQ(joined.images.size(), 2u);
    ASSERT_EQ(joined.points.positions.size(), 1u);
    for (const io::ImageRecord& image : joined.images) {
        EXPECT_EQ(image.distortion.lens, Lens::equirectangular);
        EXPECT_EQ(image.camera.width, 64);
        EXPECT_LT(glm::distance(image.camera.position(), poses.at(image.name).center), 1e-12) << image.name;
    }
}

}  // namespace
}  // namespace ewa::test
