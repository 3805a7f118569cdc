// SPDX-License-Identifier: Apache-2.0
// Depths and points from images alone: of planes with a texture, seen by cameras side by side.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "ewa/error.h"
#include "prepare/stereo_points.h"
#include "run/run_input.h"
#include "scene/plane_sweep.h"

#include "support/temp_folder.h"

namespace ewa::test {
namespace {

constexpr int kWidth = 96, kHeight = 80;

/// A plane z = at + slope x in the world, with colours that vary over about 0.1 units.
struct Wall {
    double at = 2, slope = 0;
    double contrast = 0.12;

    glm::dvec3 hit(const glm::dvec3& from, const glm::dvec3& along) const {
        return from + (at + slope * from.x - from.z) / (along.z - slope * along.x) * along;
    }
    double shade(const glm::dvec3& p) const {
        return 0.5 + contrast * (std::sin(41 * p.x + 3 * p.y) + std::sin(37 * p.y - 11 * p.x) +
                                 std::sin(17 * p.x * p.y + 23 * p.y));
    }
};

Camera camera_at(const glm::dvec3& position) {
    Camera camera;
    camera.width = kWidth;
    camera.height = kHeight;
    camera.fx = camera.fy = 110;
    camera.cx = 0.5 * kWidth + 2;
    camera.cy = 0.5 * kHeight - 1;
    // Looks at the point (0, 0, 2), with the world's y downwards.
    const glm::dvec3 forward = glm::normalize(glm::dvec3(0, 0, 2) - position);
    const glm::dvec3 right = glm::normalize(glm::cross(glm::dvec3(0, 1, 0), forward));
    camera.rotation = glm::transpose(glm::dmat3(right, glm::cross(forward, right), forward));
    camera.translation = -(camera.rotation * position);
    return camera;
}

/// Each pixel is the mean of 4 x 4 samples.
Image image_of(const Wall& wall, const Camera& camera, int channels) {
    Image image(camera.width, camera.height, channels);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            double sum = 0;
            for (int k = 0; k < 16; ++k) {
                const glm::dvec3 ray((x + (k % 4 + 0.5) / 4 - camera.cx) / camera.fx,
                                     (y + (k / 4 + 0.5) / 4 - camera.cy) / camera.fy, 1);
                sum += wall.shade(wall.hit(camera.position(), glm::transpose(camera.rotation) * ray)) / 16;
            }
            for (int c = 0; c < channels; ++c) image.at(x, y)[c] = float(sum);
        }
    return image;
}

const std::vector<glm::dvec3> kPlaces{{0, 0, 0},      {0.24, 0, 0},  {-0.24, 0.02, 0},
                                      {0, 0.24, 0.1}, {0, -0.24, 0}, {0.2, 0.2, -0.1}};

scene::SweptDepths swept(const Wall& wall, size_t others, const scene::SweepPlanes& planes) {
    std::vector<scene::SweptImage> images;
    for (size_t i = 0; i <= others; ++i)
        images.push_back({image_of(wall, camera_at(kPlaces[i]), 1), camera_at(kPlaces[i])});
    std::vector<const scene::SweptImage*> seen;
    for (size_t i = 1; i < images.size(); ++i) seen.push_back(&images[i]);
    return scene::sweep_planes(images[0], seen, planes);
}

/// The share of the pixels at least 12 px from the border whose inverse depth is that of the wall to 1 %.
double share_right(const Wall& wall, const scene::SweptDepths& depths) {
    const Camera camera = camera_at(kPlaces[0]);
    int right = 0, all = 0;
    for (int y = 12; y < kHeight - 12; ++y)
        for (int x = 12; x < kWidth - 12; ++x) {
            const glm::dvec3 ray((x + 0.5 - camera.cx) / camera.fx, (y + 0.5 - camera.cy) / camera.fy, 1);
            const double z = wall.hit({0, 0, 0}, ray).z;
            right += std::abs(double(depths.inverse[size_t(y * kWidth + x)]) * z - 1) < 0.01;
            ++all;
        }
    return double(right) / all;
}

TEST(PlaneSweep, FindsWallsAcrossAndAslant) {
    for (const Wall& wall : {Wall{2, 0}, Wall{1.7, 0.4}, Wall{2.4, -0.6}})
        for (const size_t others : {1u, 4u})
            EXPECT_GT(share_right(wall, swept(wall, others, {1.2, 41})), 0.93)
                << wall.slope << " with " << others;
}

TEST(PlaneSweep, FindsNothingWithoutTextureOrOutsideTheOtherImages) {
    // The second wall varies by less than a level of 8 bits.
    for (const double contrast : {0.0, 0.002}) {
        SCOPED_TRACE(contrast);
        const scene::SweptDepths nothing = swept({2, 0, contrast}, 4, {1.2, 41});
        for (size_t i = 0; i < nothing.score.size(); ++i) {
            ASSERT_EQ(nothing.score[i], -1);
            ASSERT_EQ(nothing.inverse[i], 0);
        }
    }
    // A camera that looks the other way sees none of it.
    scene::SweptImage own{image_of({}, camera_at(kPlaces[0]), 1), camera_at(kPlaces[0])};
    scene::SweptImage away{image_of({}, camera_at(kPlaces[1]), 1), camera_at(kPlaces[1])};
    const glm::dmat3 back(-1, 0, 0, 0, 1, 0, 0, 0, -1);
    away.camera.rotation = back * away.camera.rotation;
    away.camera.translation = back * away.camera.translation;
    const scene::SweptImage* const others[] = {&away};
    for (const float score : scene::sweep_planes(own, others, {1.2, 41}).score) ASSERT_EQ(score, -1);
}

class StereoPoints : public testing::Test {
  protected:
    /// A dataset of images of the wall, without points.
    const Dataset& photographed(const Wall& wall) {
        dataset_ = {};
        for (size_t i = 0; i < kPlaces.size(); ++i) {
            Frame frame;
            frame.name = std::to_string(i) + ".png";
            frame.image_path = folder_ / frame.name;
            frame.camera = frame.pinhole = frame.source = camera_at(kPlaces[i]);
            save_image(frame.image_path, image_of(wall, frame.camera, 3));
            dataset_.frames.push_back(frame);
        }
        return dataset_;
    }
    PointCloud points(const std::vector<int>& frames = {0, 1, 2, 3, 4, 5}) const {
        return train::points_by_stereo(dataset_, frames, {}, 2000, 1).cloud;
    }
    const std::vector<int> frames_{0, 1, 2, 3, 4, 5};
    TempFolder folder_;
    Dataset dataset_;
};

TEST_F(StereoPoints, LieOnTheWallInItsColours) {
    const Wall wall{1.8, 0.3};
    const auto [points, images] = train::points_by_stereo(photographed(wall), frames_, {}, 2000, 1);
    EXPECT_EQ(images, 6u);
    ASSERT_GT(points.positions.size(), 1000u);
    ASSERT_LE(points.positions.size(), 2000u);
    size_t near = 0, alike = 0;
    for (size_t i = 0; i < points.positions.size(); ++i) {
        const glm::dvec3& p = points.positions[i];
        near += std::abs(p.z - (wall.at + wall.slope * p.x)) < 0.03;
        alike += std::abs(points.colors[i][0] / 255.0 - wall.shade(p)) < 0.1;
    }
    EXPECT_GT(near, points.positions.size() * 97 / 100);
    EXPECT_GT(alike, points.positions.size() * 9 / 10);
    EXPECT_EQ(this->points().positions, points.positions);
    EXPECT_NE(train::points_by_stereo(dataset_, frames_, {}, 2000, 2).cloud.positions, points.positions);
}

TEST_F(StereoPoints, NeedTwoImagesFromDifferentPlaces) {
    photographed({1.8, 0.3});
    const PointCloud two = points({0, 1});
    ASSERT_GT(two.positions.size(), 1000u);
    for (const glm::dvec3& p : two.positions) EXPECT_NEAR(p.z, 1.8 + 0.3 * p.x, 0.1);
    EXPECT_TRUE(points({0}).positions.empty());
    for (Frame& frame : dataset_.frames) frame.camera = camera_at(kPlaces[0]);
    EXPECT_TRUE(points().positions.empty()) << "all from one place";
}

TEST_F(StereoPoints, LieWhereTheImagesAreOpaque) {
    photographed({});
    for (const Frame& frame : dataset_.frames) {
        const Image color = load_image(frame.image_path);
        Image alpha(kWidth, kHeight, 1);
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x) {
                const glm::dvec3 ray((x + 0.5 - frame.camera.cx) / frame.camera.fx,
                                     (y + 0.5 - frame.camera.cy) / frame.camera.fy, 1);
                const glm::dvec3 at =
                    Wall().hit(frame.camera.position(), glm::transpose(frame.camera.rotation) * ray);
                *alpha.at(x, y) = at.x > 0 ? 1.0f : 0.0f;
            }
        save_image(frame.image_path, with_alpha(color, alpha));
    }
    const PointCloud opaque = points();
    ASSERT_GT(opaque.positions.size(), 1000u);
    for (const glm::dvec3& p : opaque.positions) EXPECT_GT(p.x, -0.01);
}

TEST_F(StereoPoints, AreTheSameFarFromTheOrigin) {
    photographed({1.8, 0.3});
    const PointCloud here = points();
    const glm::dvec3 far(5e6, -4e6, 3e5);
    for (Frame& frame : dataset_.frames) frame.camera.translation -= frame.camera.rotation * far;
    const PointCloud there = points();
    EXPECT_NEAR(double(there.positions.size()), double(here.positions.size()), 20);
    for (const glm::dvec3& p : there.positions) EXPECT_NEAR(p.z - far.z, 1.8 + 0.3 * (p.x - far.x), 0.1);
}

TEST_F(StereoPoints, AreTheStartOfADatasetWithoutPoints) {
    photographed({});
    RunOptions options;
    options.train.sh_degree = 0;
    options.train.max_splats = 1500;
    train::StartSource source;
    const Gaussians start = train::initial_splats(options, dataset_, frames_, &source);
    EXPECT_EQ(source.from, train::StartsFrom::stereo);
    EXPECT_EQ(source.points, start.size());
    EXPECT_EQ(source.images, 6u);
    EXPECT_GT(start.size(), 1000u);
    options.init = "random";
    train::initial_splats(options, dataset_, frames_, &source);
    EXPECT_EQ(source.from, train::StartsFrom::random);
    EXPECT_EQ(source.images, 0u);
    // Points come before, unless stereo is asked for.
    dataset_.points.positions = {{1, 2, 3}, {4, 5, 6}};
    dataset_.points.colors = {{1, 2, 3}, {4, 5, 6}};
    options.init = "sfm";
    train::initial_splats(options, dataset_, frames_, &source);
    EXPECT_EQ(source.from, train::StartsFrom::points);
    options.init = "stereo";
    EXPECT_EQ(train::initial_splats(options, dataset_, frames_, &source).means, start.means);
    EXPECT_EQ(source.from, train::StartsFrom::stereo);
}

TEST_F(StereoPoints, NeedTextureAndPinholes) {
    RunOptions options;
    options.train.sh_degree = 0;
    options.init = "stereo";
    photographed({2, 0, 0});
    expect_error<InputError>([&] { train::initial_splats(options, dataset_, frames_); }, {"--init stereo"});
    photographed({});
    for (Frame& frame : dataset_.frames) frame.camera.distortion.lens = Lens::fisheye;
    expect_error<InputError>([&] { train::initial_splats(options, dataset_, frames_); }, {"--init stereo"});
    // The usual start falls back on random splats.
    options.init = "sfm";
    options.train.max_splats = 50;
    train::StartSource source;
    EXPECT_EQ(train::initial_splats(options, dataset_, frames_, &source).size(), 50u);
    EXPECT_EQ(source.from, train::StartsFrom::random);
}

}  // namespace
}  // namespace ewa::test
