// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <random>

#include "ewa/dataset.h"
#include "scene/dense_points.h"
#include "scene/lens.h"
#include "scene/statistics.h"
#include "shared/constants.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using test::expect_error;

PointCloud cloud(std::vector<glm::dvec3> positions) {
    PointCloud points;
    points.colors.resize(positions.size(), {128, 128, 128});
    points.positions = std::move(positions);
    return points;
}

std::vector<double> brute_force(const std::vector<glm::dvec3>& positions) {
    std::vector<double> result;
    for (size_t i = 0; i < positions.size(); ++i) {
        std::vector<double> squared;
        for (size_t j = 0; j < positions.size(); ++j)
            if (j != i) squared.push_back(glm::dot(positions[i] - positions[j], positions[i] - positions[j]));
        std::sort(squared.begin(), squared.end());
        squared.resize(std::min<size_t>(squared.size(), 3));
        double sum = 0;
        for (double v : squared) sum += v;
        result.push_back(squared.empty() ? -1 : sum / double(squared.size()));
    }
    return result;
}

TEST(Neighbors, AgainstBruteForce) {
    std::mt19937 generator(7);
    std::normal_distribution<double> normal;
    std::uniform_int_distribution<int> lattice(0, 3);
    for (int n : {1, 2, 3, 4, 5, 40, 1100}) {
        std::vector<glm::dvec3> free, crowded, far;
        for (int i = 0; i < n; ++i) {
            free.push_back({normal(generator), normal(generator), normal(generator)});
            crowded.push_back({lattice(generator), lattice(generator), 0});  // many at the same place
            far.push_back(free.back() + glm::dvec3(1e6, -2e6, 3e6));
        }
        for (const auto& positions : {free, crowded, far}) {
            const std::vector<double> expected = brute_force(positions);
            const std::vector<double> found = scene::mean_squared_neighbor_distance(positions);
            ASSERT_EQ(found.size(), expected.size());
            for (size_t i = 0; i < found.size(); ++i)
                EXPECT_NEAR(found[i], expected[i], 1e-12 * (1 + expected[i])) << n << " " << i;
        }
    }
    EXPECT_TRUE(scene::mean_squared_neighbor_distance({}).empty());
}

// A tree that holds duplicates would visit all of them for each: 10^10 steps.
TEST(Neighbors, ManyDuplicatesAreQuick) {
    std::vector<glm::dvec3> positions(100000, glm::dvec3(1, 2, 3));
    positions.resize(200000, glm::dvec3(4, 5, 6));
    positions.push_back({0, 2, 3});
    const std::vector<double> found = scene::mean_squared_neighbor_distance(positions);
    EXPECT_EQ(found.front(), 0);
    EXPECT_EQ(found.back(), 1);
}

// Four points on a line, the last one twice.
TEST(DensePoints, LieBetweenNeighbours) {
    const PointCloud line = cloud({{0, 0, 0}, {1, 0, 0}, {3, 0, 0}, {7, 0, 0}, {7, 0, 0}});
    using Pair = std::array<size_t, 2>;
    EXPECT_EQ(scene::neighbor_pairs(line.positions, 1), (std::vector<Pair>{{0, 1}, {1, 2}, {2, 3}}));
    EXPECT_EQ(scene::neighbor_pairs(line.positions, 2),
              (std::vector<Pair>{{0, 1}, {0, 2}, {1, 2}, {1, 3}, {2, 3}}));
    // Each point's nearest is the one before it. There are more points than one core takes at a time.
    std::vector<glm::dvec3> squares;
    std::vector<Pair> before;
    for (size_t i = 0; i < 3000; ++i) {
        squares.push_back({double(i * i), 0, 0});
        if (i > 0) before.push_back({i - 1, i});
    }
    EXPECT_EQ(scene::neighbor_pairs(squares, 1), before);
    EXPECT_TRUE(scene::neighbor_pairs({}, 2).empty());
    EXPECT_TRUE(scene::neighbor_pairs({{1, 2, 3}, {1, 2, 3}}, 2).empty());

    PointCloud colored = line;
    colored.colors[0] = {10, 0, 255};
    colored.colors[1] = {30, 0, 255};
    const PointCloud dense = scene::with_midpoints(colored, 100);
    ASSERT_EQ(dense.positions.size(), 10u);
    EXPECT_EQ(dense.positions[4], line.positions[4]);
    EXPECT_EQ(dense.positions[5], glm::dvec3(0.5, 0, 0));
    EXPECT_EQ(dense.colors[5], (std::array<uint8_t, 3>{20, 0, 255}));
    EXPECT_EQ(dense.positions[9], glm::dvec3(5, 0, 0));
    // The longest distances first: 6 and 4.
    const PointCloud limited = scene::with_midpoints(colored, 7);
    ASSERT_EQ(limited.positions.size(), 7u);
    EXPECT_EQ(limited.positions[5], glm::dvec3(4, 0, 0));
    EXPECT_EQ(limited.positions[6], glm::dvec3(5, 0, 0));
    EXPECT_EQ(scene::with_midpoints(colored, 3).positions.size(), 5u);
    const PointCloud left =
        scene::with_midpoints(colored, 100, [](const glm::dvec3& middle) { return middle.x < 1; });
    ASSERT_EQ(left.positions.size(), 6u);
    EXPECT_EQ(left.positions[5], glm::dvec3(0.5, 0, 0));
}

TEST(GaussiansFromPoints, ByHand) {
    PointCloud points = cloud({{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}, {0, 0, 30}});
    points.colors[1] = {0, 255, 51};
    const Gaussians g = gaussians_from_points(points, 2);
    ASSERT_EQ(g.size(), 5u);
    EXPECT_EQ(g.sh_degree, 2);
    EXPECT_EQ(g.sh.size(), 5u * 27);
    EXPECT_FLOAT_EQ(g.log_scales[0], float(0.5 * std::log((1.0 + 4 + 9) / 3)));
    EXPECT_EQ(g.log_scales[0], g.log_scales[2]);
    EXPECT_EQ(g.means[5], 0);
    EXPECT_EQ(g.means[3], 1);
    for (size_t k = 0; k < 4; ++k) EXPECT_EQ(g.quaternions[k], k == 0 ? 1 : 0);
    EXPECT_NEAR(1 / (1 + std::exp(-g.opacity_logits[4])), 0.1, 1e-7);
    const double expected[3] = {0, 1, 0.2};
    for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(g.sh[27 + c] * shared::SH_C0 + 0.5, expected[c], 1e-7);
    for (size_t k = 3; k < 27; ++k) EXPECT_EQ(g.sh[27 + k], 0);
}

TEST(GaussiansFromPoints, DegenerateClouds) {
    EXPECT_EQ(gaussians_from_points(cloud({{5, 6, 7}}), 0).log_scales[0], 0);
    EXPECT_FLOAT_EQ(gaussians_from_points(cloud({{0, 0, 0}, {0, 3, 4}}), 0).log_scales[3],
                    float(std::log(5.0)));
    EXPECT_FLOAT_EQ(gaussians_from_points(cloud({{0, 0, 0}, {1, 0, 0}, {0, 2, 0}}), 0).log_scales[0],
                    float(0.5 * std::log(2.5)));
    const Gaussians same = gaussians_from_points(cloud({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}}), 0);
    for (float v : same.log_scales) EXPECT_FLOAT_EQ(v, float(0.5 * std::log(1e-7)));
    expect_error<InputError>([] { gaussians_from_points({}, 0); }, {"no points"});
    expect_error<InputError>([] { gaussians_from_points(cloud({{0, 0, 0}, {0, NAN, 0}}), 0); }, {"point 1"});
    PointCloud uncoloured = cloud({{0, 0, 0}});
    uncoloured.colors.clear();
    expect_error<InputError>([&] { gaussians_from_points(uncoloured, 0); }, {"0 colours"});
}

TEST(Gaussians, DegreePresent) {
    Gaussians g;
    g.sh_degree = 3;
    g.resize(3);
    EXPECT_EQ(sh_degree_present(g), 0);
    const size_t first[] = {0, 3, 12, 27, 48};  // of each degree, in floats
    for (int degree = 0; degree <= 3; ++degree)
        for (size_t at : {first[degree], first[degree + 1] - 1}) {
            g.sh.assign(3 * 48, 0.0f);
            g.sh[48 * 2 + at] = degree == 2 ? NAN : -1e-30f;
            EXPECT_EQ(sh_degree_present(g), degree) << at;
        }
    EXPECT_EQ(sh_degree_present({}), 0);
}

Dataset line_of_cameras(int n) {
    Dataset dataset;
    dataset.frames.resize(size_t(n));
    for (int i = 0; i < n; ++i) dataset.frames[size_t(i)].camera.translation = {double(-i), 0, 0};
    return dataset;
}

TEST(Dataset, SplitFrames) {
    Dataset dataset = line_of_cameras(10);
    EXPECT_EQ(split_frames(dataset, 4).test, (std::vector<int>{0, 4, 8}));
    EXPECT_EQ(split_frames(dataset, 4).train, (std::vector<int>{1, 2, 3, 5, 6, 7, 9}));
    EXPECT_TRUE(split_frames(dataset, 0).test.empty());
    EXPECT_EQ(split_frames(dataset, 0).train.size(), 10u);
    dataset.frames[0].split = 1;
    dataset.frames[5].split = 2;
    EXPECT_EQ(split_frames(dataset, 4).test, (std::vector<int>{4, 5, 8}));
}

TEST(Dataset, SceneExtent) {
    const Dataset dataset = line_of_cameras(5);
    EXPECT_NEAR(scene_extent(dataset, {0, 1, 2, 3, 4}), 1.1 * 2, 1e-12);
    EXPECT_NEAR(scene_extent(dataset, {0, 1, 4}), 1.1 * (4 - 5.0 / 3), 1e-12);
    EXPECT_EQ(scene_extent(dataset, {3}), 0);
    EXPECT_EQ(scene_extent(dataset, {}), 0);
}

Camera wide_camera() {
    Camera camera;
    camera.width = 160;
    camera.height = 120;
    camera.fx = 130;
    camera.fy = 125;
    camera.cx = 82;
    camera.cy = 57;
    return camera;
}

const Distortion kLenses[] = {{0.0578421, -0.0805099, -0.000980296, 0.00015575},
                              {-0.2, 0.05, 0.002, -0.001},
                              {0.15, 0.02, -0.003, 0.004},
                              {.k1 = 0.05, .k2 = -0.01, .lens = Lens::fisheye},
                              {.k1 = 0.9, .lens = Lens::fov}};

TEST(Undistort, FormulaByHand) {
    const glm::dvec2 p = scene::distort({0.1, 0.01, 0.001, 0.002}, {0.1, 0.2});
    EXPECT_NEAR(p.x, 0.1006825, 1e-15);
    EXPECT_NEAR(p.y, 0.201215, 1e-15);
    for (const Distortion& lens : kLenses)
        for (double x : {-0.6, 0.0, 0.4})
            for (double y : {-0.4, 0.1, 0.45}) {
                const auto ray = scene::undistort(lens, scene::distort(lens, {x, y}));
                ASSERT_TRUE(ray);
                EXPECT_NEAR(ray->x, x, 1e-12);
                EXPECT_NEAR(ray->y, y, 1e-12);
            }
}

/// A smooth scene for images.
double scenery(glm::dvec2 ray, int channel) {
    return 0.5 + 0.4 * std::sin(5 * ray.x + channel) * std::cos(4 * ray.y - channel);
}

TEST(Undistort, ResamplesToThePinholePicture) {
    const Camera source = wide_camera();
    for (const Distortion& lens : kLenses) {
        Image image(source.width, source.height, 4);
        for (int y = 0; y < image.height; ++y)
            for (int x = 0; x < image.width; ++x) {
                const auto ray = scene::undistort(
                    lens, {(x + 0.5 - source.cx) / source.fx, (y + 0.5 - source.cy) / source.fy});
                ASSERT_TRUE(ray);
                for (int c = 0; c < 4; ++c) image.at(x, y)[c] = float(scenery(*ray, c));
            }
        const Camera camera = scene::undistorted_camera(source, lens);
        const Image result = scene::undistort_image(image, source, lens, camera);
        double largest = 0;
        for (int y = 0; y < result.height; ++y)
            for (int x = 0; x < result.width; ++x)
                for (int c = 0; c < 4; ++c) {
                    const glm::dvec2 ray{(x + 0.5 - camera.cx) / camera.fx,
                                         (y + 0.5 - camera.cy) / camera.fy};
                    largest = std::max(largest, std::abs(double(result.at(x, y)[c]) - scenery(ray, c)));
                }
        // Bilinear interpolation of it is off by (5 / 130)^2 / 8 * 0.8 at most, a fisheye's by more towards
        // its side; a pixel's shift would be 1.5e-2.
        EXPECT_LT(largest, lens.lens == Lens::brown ? 6e-4 : 1.2e-3);
    }
}

TEST(Undistort, TheNewBorderTouchesTheOldAndNeverLeavesIt) {
    const Camera source = wide_camera();
    for (const Distortion& lens : kLenses) {
        const Camera camera = scene::undistorted_camera(source, lens);
        EXPECT_EQ(camera.fx, source.fx);
        EXPECT_EQ(camera.fy, source.fy);
        double x_gap = 1e9, y_gap = 1e9;  // distance to the source's edges
        for (int y = 0; y < camera.height; ++y)
            for (int x = 0; x < camera.width; ++x) {
                const glm::dvec2 p = scene::distort(
                    lens, {(x + 0.5 - camera.cx) / camera.fx, (y + 0.5 - camera.cy) / camera.fy});
                const glm::dvec2 q{source.fx * p.x + source.cx, source.fy * p.y + source.cy};
                x_gap = std::min({x_gap, q.x, source.width - q.x});
                y_gap = std::min({y_gap, q.y, source.height - q.y});
            }
        for (double gap : {x_gap, y_gap}) {
            EXPECT_GT(gap, 0);
            EXPECT_LT(gap, 2);
        }
    }
    EXPECT_EQ(scene::undistorted_camera(source, {}).width, source.width);
}

TEST(Undistort, FoldsAreRefused) {
    for (const Distortion& lens : {Distortion{-3, 0, 0, 0}, {0, 0, 5, 0}, {NAN, 0, 0, 0}, {-1.1, 0.2, 0, 0}})
        expect_error<InputError>([&] { scene::undistorted_camera(wide_camera(), lens); }, {"folds"});
}

}  // namespace
