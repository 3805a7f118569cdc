// SPDX-License-Identifier: Apache-2.0
// ewa cameras of 360° photos, with a program in the place of COLMAP. The last test runs the real one.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <filesystem>
#include <glm/gtc/quaternion.hpp>
#include <numbers>

#include "cli/expect.h"
#include "core/process.h"
#include "ewa/dataset.h"
#include "ewa/image.h"
#include "io/datasets/image_records.h"
#include "scene/native_lens.h"

namespace {

using namespace ewa::test;
namespace fs = std::filesystem;

constexpr int kViews = 6;

glm::dmat3 turned_right(int sixths) {
    return glm::mat3_cast(glm::angleAxis(-2 * std::numbers::pi * sixths / kViews, glm::dvec3(0, 1, 0)));
}

/// Where photo i stands.
glm::dvec3 place_of(int i) {
    return {0.4 * i, 0.1 * i * i, -0.2 * i};
}

class PanoramaCameras : public testing::Test {
  protected:
    void SetUp() override {
        fs::create_directories(folder_ / "photos");
        fs::create_directories(folder_ / "bin");
        for (int i = 0; i < 4; ++i)
            ewa::save_panorama(folder_ / ("photos/photo " + std::to_string(i) + ".png"),
                               ewa::Image(64, 32, 3));
        // The stand-in says what it was called with. Its mapper copies models, and its other programs copy what they get.
        const std::string program = folder_ / "bin/colmap";
        write_file(program, R"sh(#!/bin/sh
case "$*" in
*rig_bundle_adjuster*--help*) [ -z "$NO_RIG" ] && echo "  --rig_config_path arg"; exit 0;;
*--help*) echo "  --SiftExtraction.use_gpu arg (=1)"; exit 0;;
esac
echo "$1" >> "$CALLS"
previous=
for word; do
    if [ "$previous" = --output_path ]; then output=$word; fi
    if [ "$previous" = --input_path ]; then input=$word; fi
    previous=$word
done
if [ "$FAIL" = "$1" ]; then exit 1; fi
case $1 in
feature_extractor) touch "$3";;
mapper) cp -r "$MODELS"/. "$output";;
point_triangulator|rig_bundle_adjuster) cp "$input"/* "$output";;
esac
)sh");
        chmod(program.c_str(), 0755);
    }

    void view(int photo, int k, const glm::dvec3& place) {
        ewa::io::ImageRecord view;
        view.name = "ewa-view-" + std::to_string(k) + "/photo%20" + std::to_string(photo) + ".png.png";
        view.camera = {.width = 20, .height = 20, .fx = 10, .fy = 10, .cx = 10, .cy = 10};
        view.camera.rotation = turned_right(k);
        view.camera.translation = -(view.camera.rotation * place);
        views_.push_back(view);
    }

    Outcome cameras(Circumstances circumstances = {}) {
        ewa::io::write_colmap(folder_ / "models/0", views_, {});
        for (const auto& [name, value] :
             std::vector<std::pair<std::string, std::string>>{{"PATH", folder_ / "bin" + ":/usr/bin:/bin"},
                                                              {"CALLS", folder_ / "calls"},
                                                              {"MODELS", folder_ / "models"}})
            circumstances.environment.emplace_back(name, value);
        return run_ewa({"cameras", folder_ / "photos", "-o", folder_ / "dataset"}, circumstances);
    }

    std::string calls() {
        const std::string all = read_file(folder_ / "calls");
        fs::remove(folder_ / "calls");
        return all;
    }

    Folder folder_;
    std::vector<ewa::io::ImageRecord> views_;
};

const std::string kSearched =
    "feature_extractor\nfeature_extractor\nfeature_extractor\nfeature_extractor\nfeature_extractor\nfeature_"
    "extractor\n"
    "matches_importer\n";
const std::string kRound = "point_triangulator\nrig_bundle_adjuster\n";

TEST_F(PanoramaCameras, FollowFromThoseOfTheirViews) {
    for (int photo = 0; photo < 3; ++photo)
        for (int k = 0; k < kViews; ++k)
            view(photo, k, k == 4 && photo == 1 ? glm::dvec3(7) : place_of(photo));
    const Outcome outcome = cameras();
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    for (const char* text :
         {"COLMAP has placed 18 of their 24 views", "1 view disagrees with others of the same photo",
          "could not be placed, and are not used: photo 3.png", "3 of 4 photos have cameras"})
        EXPECT_NE(outcome.out.find(text), std::string::npos) << text << outcome.out;
    EXPECT_EQ(calls(), kSearched + "mapper\n" + kRound + kRound);
    EXPECT_EQ(read_json(folder_ / "dataset/colmap/rig.json").at(0).at("cameras").size(), size_t(kViews));
    const ewa::Dataset dataset = ewa::load_dataset(folder_ / "dataset", {});
    ASSERT_EQ(dataset.frames.size(), 3u);
    for (int i = 0; i < 3; ++i) {
        const ewa::Camera& camera = dataset.frames[size_t(i)].camera;
        EXPECT_EQ(camera.distortion.lens, ewa::Lens::equirectangular);
        EXPECT_EQ(camera.width, 64);
        EXPECT_LT(glm::distance(camera.position(), place_of(i)), 1e-9);
        EXPECT_NEAR(camera.rotation[0][0] + camera.rotation[1][1] + camera.rotation[2][2], 3, 1e-9);
    }
}

TEST_F(PanoramaCameras, NeedNoRigAdjuster) {
    for (int photo = 0; photo < 4; ++photo)
        for (int k = 0; k < kViews; ++k) view(photo, k, place_of(photo));
    const Outcome outcome = cameras({.environment = {{"NO_RIG", "1"}}});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("4 of 4 photos have cameras"), std::string::npos) << outcome.out;
    EXPECT_EQ(calls(), kSearched + "mapper\npoint_triangulator\n");
}

TEST_F(PanoramaCameras, ASearchGoesOn) {
    for (int photo = 0; photo < 4; ++photo)
        for (int k = 0; k < kViews; ++k) view(photo, k, place_of(photo));
    expect_failure(cameras({.environment = {{"FAIL", "matches_importer"}}}), 1,
                   "colmap matches_importer failed");
    calls();
    expect_failure(cameras({.environment = {{"FAIL", "rig_bundle_adjuster"}}}), 1,
                   "colmap rig_bundle_adjuster failed");
    EXPECT_EQ(calls(), "matches_importer\nmapper\n" + kRound);
    EXPECT_FALSE(fs::exists(folder_ / "dataset/sparse/0"));
    expect_success(cameras());
    EXPECT_EQ(calls(), "mapper\n" + kRound + kRound);
}

TEST_F(PanoramaCameras, ViewsThatAllDisagreeAreAnError) {
    for (int photo = 0; photo < 4; ++photo)
        for (int k = 0; k < kViews; ++k) view(photo, k, glm::dvec3(10.0 * k * k, photo, 0));
    expect_failure(cameras(), 2, "COLMAP has placed the views of the 360° photos inconsistently");
    EXPECT_FALSE(fs::exists(folder_ / "dataset/sparse/0"));
}

/// A room of coloured tiles, no two alike.
glm::dvec3 tile(int wall, double u, double v) {
    glm::dvec3 colour(0);
    for (const double size : {0.3, 0.09}) {
        auto seed = uint64_t(wall) * 0x9e3779b97f4a7c15ull +
                    uint64_t(int64_t(std::floor(u / size)) + 500) * 7919 +
                    uint64_t(int64_t(std::floor(v / size)) + 500) * 104729 + uint64_t(1000 * size);
        for (int c = 0; c < 3; ++c) {
            seed = (seed ^ (seed >> 31)) * 0xbf58476d1ce4e5b9ull;
            colour[c] += 0.5 * double(seed >> 40) / double(1 << 24);
        }
    }
    return colour;
}

glm::dvec3 room(const glm::dvec3& from, const glm::dvec3& along) {
    const glm::dvec3 half(2.2, 1.3, 1.8);
    double nearest = 1e9;
    int axis = 0;
    for (int i = 0; i < 3; ++i) {
        const double distance = ((along[i] > 0 ? half[i] : -half[i]) - from[i]) / along[i];
        if (distance < nearest) nearest = distance, axis = i;
    }
    const glm::dvec3 at = from + nearest * along;
    return tile(2 * axis + (along[axis] > 0), at[(axis + 1) % 3], at[(axis + 2) % 3]);
}

ewa::Camera photographed(int i) {
    ewa::Camera camera{.width = 512, .height = 256, .distortion = {.lens = ewa::Lens::equirectangular}};
    ewa::scene::set_equirectangular(camera);
    const double a = 0.55 * i;
    camera.rotation = glm::mat3_cast(glm::angleAxis(0.7 * i, glm::normalize(glm::dvec3(0.1, 1, -0.05 * i))));
    camera.translation =
        -(camera.rotation * glm::dvec3(0.8 * std::cos(a), 0.15 * std::sin(3 * a), 0.8 * std::sin(a)));
    return camera;
}

void photograph(const ewa::Camera& camera, const std::string& path) {
    ewa::Image image(camera.width, camera.height, 3);
    const glm::dmat3 back = glm::transpose(camera.rotation);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            for (const glm::dvec2& part :
                 {glm::dvec2(0.25, 0.25), {0.75, 0.25}, {0.25, 0.75}, {0.75, 0.75}}) {
                const auto ray = ewa::scene::ray_of(camera, 0, x + part.x, y + part.y);
                const glm::dvec3 colour = room(camera.position(), back * ray->direction);
                for (int c = 0; c < 3; ++c) image.at(x, y)[c] += float(colour[c] / 4);
            }
    ewa::save_image(path, image);
}

/// The cameras of 360° photos of a room are found up to a similarity, which keeps ratios of lengths and relative rotations.
TEST(RealCapture, OfPanoramasFindsTheirCameras) {
    if (ewa::core::find_program("colmap").empty()) GTEST_SKIP() << "no COLMAP";
    const Folder folder;
    constexpr int kPhotos = 6;
    fs::create_directories(folder / "photos");
    for (int i = 0; i < kPhotos; ++i)
        photograph(photographed(i), folder / ("photos/" + std::to_string(i) + ".png"));
    const Outcome outcome = run_ewa({"cameras", folder / "photos", "-o", folder / "dataset"});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("6 of 6 photos have cameras"), std::string::npos) << outcome.out;
    const ewa::Dataset dataset = ewa::load_dataset(folder / "dataset", {});
    ASSERT_EQ(dataset.frames.size(), size_t(kPhotos));
    const auto& frames = dataset.frames;
    const double scale = glm::distance(frames[0].camera.position(), frames[3].camera.position()) /
                         glm::distance(photographed(0).position(), photographed(3).position());
    for (int i = 1; i < kPhotos; ++i) {
        const ewa::Camera &before = frames[size_t(i) - 1].camera, &now = frames[size_t(i)].camera;
        const ewa::Camera true_before = photographed(i - 1), true_now = photographed(i);
        EXPECT_NEAR(glm::distance(before.position(), now.position()) / scale,
                    glm::distance(true_before.position(), true_now.position()), 0.01)
            << i;
        const glm::dmat3 turn = now.rotation * glm::transpose(before.rotation),
                         truth = true_now.rotation * glm::transpose(true_before.rotation),
                         apart = turn * glm::transpose(truth);
        EXPECT_GT(apart[0][0] + apart[1][1] + apart[2][2], 3 - 1e-4) << i;  // half a degree or so
    }
}

}  // namespace
