// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "ewa/error.h"
#include "ewa/splat_files.h"
#include "io/datasets/image_records.h"
#include "prepare/depth_points.h"
#include "run/run_input.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using namespace ewa::test;
using namespace ewa::train;

/// Cameras on a circle of radius 3 around `center`; towards: looking at it, else away from it. A focal length
/// of 10 px sees nearly all that is in front.
Dataset circle(const glm::dvec3& center, bool towards, int count = 12, double focal = 10) {
    Dataset dataset;
    for (int i = 0; i < count; ++i) {
        const double angle = 2 * 3.141592653589793 * i / count;
        const glm::dvec3 offset(3 * std::cos(angle), 3 * std::sin(angle), 0);
        const glm::dvec3 z = glm::normalize(towards ? -offset : offset), x(0, 0, 1), y = glm::cross(z, x);
        Frame frame;
        frame.camera.width = frame.camera.height = 200;
        frame.camera.fx = frame.camera.fy = focal;
        frame.camera.cx = frame.camera.cy = 100;
        frame.camera.rotation = glm::transpose(glm::dmat3(x, y, z));
        frame.camera.translation = -(frame.camera.rotation * (center + offset));
        dataset.frames.push_back(frame);
    }
    return dataset;
}

std::vector<int> every_frame(const Dataset& dataset) {
    std::vector<int> frames(dataset.frames.size());
    for (size_t i = 0; i < frames.size(); ++i) frames[i] = int(i);
    return frames;
}

void expect_near(const glm::dvec3& a, const glm::dvec3& b, double tolerance) {
    EXPECT_LT(glm::length(a - b), tolerance) << a.x << " " << a.y << " " << a.z;
}

TEST(Initialise, CamerasThatLookInwards) {
    for (const glm::dvec3 center : {glm::dvec3(0.0), glm::dvec3(1e6, -2e6, 5e5)}) {
        const Dataset dataset = circle(center, true);
        const Sphere sphere = viewed_sphere(dataset, every_frame(dataset));
        expect_near(sphere.center, center, 1e-6);
        EXPECT_NEAR(sphere.radius, 3, 1e-6);
    }
}

TEST(Initialise, CamerasThatLookOutwardsOrAlong) {
    const Dataset outwards = circle({1, 2, 3}, false);
    const Sphere around = viewed_sphere(outwards, every_frame(outwards));
    expect_near(around.center, {1, 2, 3}, 1e-9);
    EXPECT_NEAR(around.radius, 12, 1e-9);

    Dataset parallel = circle({0, 0, 0}, true);
    for (Frame& frame : parallel.frames) {
        const glm::dvec3 position = frame.camera.position();
        frame.camera.rotation = glm::dmat3(1.0);
        frame.camera.translation = -position;
    }
    EXPECT_NEAR(viewed_sphere(parallel, every_frame(parallel)).radius, 12, 1e-9);
    EXPECT_EQ(viewed_sphere(parallel, {0}).radius, 1);
}

TEST(Initialise, RandomSplatsFillTheSphereAndFollowTheSeed) {
    const Dataset dataset = circle({5, 0, 0}, true);
    const Gaussians a = random_gaussians(dataset, every_frame(dataset), 4000, 1, 2);
    ASSERT_EQ(a.size(), 4000u);
    EXPECT_EQ(a.sh_degree, 2);
    EXPECT_EQ(sh_degree_present(a), 0);
    int inner = 0;
    glm::dvec3 mean(0.0);
    for (size_t i = 0; i < a.size(); ++i) {
        const glm::dvec3 p(a.means[3 * i], a.means[3 * i + 1], a.means[3 * i + 2]);
        const double distance = glm::length(p - glm::dvec3(5, 0, 0));
        EXPECT_LT(distance, 3.0001);
        inner += distance < 1.5;
        mean += p / double(a.size());
    }
    EXPECT_NEAR(inner / 4000.0, 1 / 8.0, 0.02);  // evenly by volume; a standard deviation is 0.005
    expect_near(mean, {5, 0, 0}, 0.12);          // a standard deviation is 0.021 an axis

    const Gaussians same = random_gaussians(dataset, every_frame(dataset), 4000, 1, 2);
    const Gaussians fewer = random_gaussians(dataset, every_frame(dataset), 100, 1, 2);
    const Gaussians other = random_gaussians(dataset, every_frame(dataset), 4000, uint64_t(1) << 32, 2);
    EXPECT_EQ(a.means, same.means);
    EXPECT_TRUE(std::equal(fewer.means.begin(), fewer.means.end(), a.means.begin()));
    EXPECT_NE(a.means, other.means);
}

bool in_a_frustum(const Dataset& dataset, const glm::dvec3& point) {
    for (const Frame& frame : dataset.frames) {
        const glm::dvec3 p = frame.camera.rotation * point + frame.camera.translation;
        // A float's rounding may carry a point over the border.
        const double reach = 100 / frame.camera.fx * p.z + 1e-5;
        if (p.z > 0 && std::abs(p.x) <= reach && std::abs(p.y) <= reach) return true;
    }
    return false;
}

TEST(Initialise, RandomSplatsStandWhereACameraLooks) {
    // A band 1.5 wide where the cameras look at the middle; outwards, cones that leave most of the sphere
    // dark; and frustums so thin that chance does not find them.
    for (const auto& [towards, focal] : {std::pair(true, 400.0), {false, 300.0}, {false, 1e5}}) {
        const Dataset dataset = circle({5, 0, 0}, towards, 12, focal);
        const Sphere sphere = viewed_sphere(dataset, every_frame(dataset));
        const Gaussians g = random_gaussians(dataset, every_frame(dataset), 2000, 1, 0);
        double farthest = 0;
        for (size_t i = 0; i < g.size(); ++i) {
            const glm::dvec3 p(g.means[3 * i], g.means[3 * i + 1], g.means[3 * i + 2]);
            ASSERT_TRUE(in_a_frustum(dataset, p)) << focal << ": " << p.x << " " << p.y << " " << p.z;
            farthest = std::max(farthest, glm::length(p - sphere.center));
        }
        EXPECT_GT(farthest, 0.9 * sphere.radius);
        EXPECT_LT(farthest, 1.3 * sphere.radius);
    }
}

TEST(Initialise, ShDegreeIsRaisedAndLowered) {
    Gaussians g;
    g.sh_degree = 1;
    g.resize(2);
    for (size_t i = 0; i < g.sh.size(); ++i) g.sh[i] = float(i + 1);
    TempFolder folder;
    save_splats(folder / "start.ply", g);
    const auto start_of_degree = [&](int degree) {
        RunOptions options;
        options.init = (folder / "start.ply").string();
        options.train.sh_degree = degree;
        return initial_splats(options, {}, {});
    };
    const Gaussians up = start_of_degree(3);
    EXPECT_EQ(up.sh.size(), 2 * 48u);
    EXPECT_EQ(up.sh[48], 13.0f);
    EXPECT_EQ(up.sh[12], 0.0f);
    EXPECT_EQ(start_of_degree(1).sh, g.sh);
    EXPECT_EQ(start_of_degree(0).sh, (std::vector<float>{1, 2, 3, 13, 14, 15}));
}

TEST(Initialise, StartsFromAFileOfPoints) {
    const TempFolder folder;
    const std::string header =
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty float y\n"
        "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n";
    RunOptions options;
    options.train.sh_degree = 1;
    options.init = folder.write("cloud.ply", header + "end_header\n1 2 3 255 0 0\n4 5 6 0 255 0\n").string();
    const Gaussians start = initial_splats(options, {}, {});
    EXPECT_EQ(start.means, (std::vector<float>{1, 2, 3, 4, 5, 6}));
    EXPECT_EQ(start.sh_degree, 1);
    EXPECT_GT(start.sh[0], start.sh[1]);    // the first point is red
    EXPECT_LT(start.sh[12], start.sh[13]);  // the second is green
    options.init = folder.write("nan.ply", header + "end_header\n1 2 3 255 0 0\nnan 5 6 0 255 0\n").string();
    train::StartSource source;
    EXPECT_EQ(initial_splats(options, {}, {}, &source).size(), 1u);
    EXPECT_NE(source.skipped.find("1 point of "), std::string::npos) << source.skipped;
    EXPECT_NE(source.skipped.find("nan.ply: vertex 1"), std::string::npos) << source.skipped;
    options.init = folder
                       .write("mesh.ply", header +
                                              "element face 1\nproperty list uchar int vertex_indices\n"
                                              "end_header\n1 2 3 255 0 0\n4 5 6 0 255 0\n2 0 1\n")
                       .string();
    expect_error<InputError>([&] { initial_splats(options, {}, {}); }, {"this is a mesh"});
    options.init = folder.write("cut.ply", "ply\nformat ascii 1.0\nelement vertex 2\n").string();
    expect_error<InputError>([&] { initial_splats(options, {}, {}); }, {"cut.ply"});
    for (const char* cloud : {"a.las", "b.LAZ", "c.e57"}) {
        options.init = folder.write(cloud, "LASF").string();
        expect_error<InputError>([&] { initial_splats(options, {}, {}); },
                                 {cloud, "CloudCompare", "pdal translate"});
    }
    options.init = folder.write("other.txt", "no").string();
    expect_error<InputError>([&] { initial_splats(options, {}, {}); }, {"other.txt"});
}

TEST(Initialise, ThinsACloudThatIsTooLarge) {
    const TempFolder folder;
    PointCloud cloud;
    for (int i = 0; i < 200; ++i) {
        // Most of them in a corner.
        cloud.positions.emplace_back(i < 150 ? 1e-3 * i : i, i % 7, i % 3);
        cloud.colors.push_back({uint8_t(i), 0, 0});
    }
    io::write_points_ply(folder / "cloud.ply", cloud);
    Dataset dataset = circle({0, 0, 0}, true);
    dataset.points = cloud;
    RunOptions options;
    options.train.sh_degree = 0;
    for (const std::string& init : {std::string("sfm"), (folder / "cloud.ply").string()}) {
        SCOPED_TRACE(init);
        options.init = init;
        options.train.max_splats = 100;
        StartSource source;
        const Gaussians start = initial_splats(options, dataset, every_frame(dataset), &source);
        EXPECT_EQ(start.size(), 100u);
        EXPECT_EQ(source.thinned, "100 of 200 points are taken, evenly");
        EXPECT_EQ(initial_splats(options, dataset, every_frame(dataset)).means, start.means);
        const auto sparse = [&] {
            size_t count = 0;
            for (size_t i = 0; i < start.size(); ++i) count += start.means[3 * i] >= 150;
            return count;
        };
        EXPECT_GE(sparse(), 45u) << "of 50, since the others are close to each other";
        options.train.max_splats = 200;
        EXPECT_EQ(initial_splats(options, dataset, every_frame(dataset), &source).size(), 200u);
        EXPECT_EQ(source.thinned, "");
    }
}

TEST(Initialise, TakesAsManyPointsAsThePhotosShowWithoutALimit) {
    Dataset dataset = circle({0, 0, 0}, true);
    const auto frames = every_frame(dataset);
    RunOptions options;
    options.train.sh_degree = 0;
    options.dense_start = DenseStart::off;
    for (int i = 0; i < 250'000; ++i) {
        dataset.points.positions.emplace_back(i % 500, i / 500, 0);
        dataset.points.colors.push_back({0, 0, 0});
    }
    StartSource source;
    EXPECT_EQ(initial_splats(options, dataset, frames, &source).size(), 200'000u);
    EXPECT_EQ(source.thinned,
              "200000 of 250000 points are taken, evenly: the photos have detail for no more; --max-splats N "
              "sets another limit");
}

TEST(Initialise, StartsFromPointsOrRandomSplats) {
    Dataset dataset = circle({0, 0, 0}, true);
    const auto frames = every_frame(dataset);
    RunOptions options;
    options.train.sh_degree = 1;
    options.train.max_splats = 70;
    EXPECT_EQ(initial_splats(options, dataset, frames).size(), 70u);  // random, since there are no points
    dataset.points.positions = {{1, 2, 3}, {4, 5, 6}};
    dataset.points.colors = {{1, 2, 3}, {4, 5, 6}};
    EXPECT_EQ(initial_splats(options, dataset, frames).means, (std::vector<float>{1, 2, 3, 4, 5, 6}));
    // Spheres are opaque in their middle, and their radius, of two deviations, is the distance to the neighbours.
    const Gaussians round = initial_splats(options, dataset, frames);
    options.train.render.points = true;
    const Gaussians spheres = initial_splats(options, dataset, frames);
    EXPECT_NEAR(spheres.log_scales[0], round.log_scales[0] - std::log(2), 1e-6);
    EXPECT_NEAR(spheres.opacity_logits[0], std::log(99), 1e-5);
    options.train.render.points = false;
    options.init = "random";
    EXPECT_EQ(initial_splats(options, dataset, frames).size(), 70u);
    options.init = "sfm";
    options.train.max_splats = 1;
    StartSource source;
    EXPECT_EQ(initial_splats(options, dataset, frames, &source).size(), 1u);
    EXPECT_EQ(source.thinned, "1 of 2 points are taken, evenly");
}

/// A dataset without points: two images of 20 x 10 pixels, the second with a depth map, in which a column has no depth.
Dataset measured(const TempFolder& folder) {
    Dataset dataset = circle({1, 2, 3}, true, 2, 25);
    std::filesystem::create_directories(folder / "images");
    for (size_t i = 0; i < 2; ++i) {
        Frame& frame = dataset.frames[i];
        frame.camera.width = 20;
        frame.camera.height = 10;
        frame.camera.cx = 9;
        frame.camera.cy = 6;
        frame.pinhole = frame.source = frame.camera;
        frame.image_exists = true;
        frame.image_path = folder / ("images/" + std::to_string(i) + ".png");
        Image image(20, 10, 3), map(20, 10, 1);
        for (int y = 0; y < 10; ++y)
            for (int x = 0; x < 20; ++x) {
                image.at(x, y)[0] = float(x) / 255;
                image.at(x, y)[1] = float(y) / 255;
                *map.at(x, y) = x == 7 ? 0 : 2 + 0.05f * float(y);
            }
        save_image(frame.image_path, image);
        save_image(folder / "depth.exr", map);
    }
    dataset.frames[1].depth_path = folder / "depth.exr";
    return dataset;
}

TEST(Initialise, DepthMapsStandInForPoints) {
    const TempFolder folder;
    Dataset dataset = measured(folder);
    const std::vector<int> frames = every_frame(dataset);
    const PointCloud points = points_of_depth_maps(dataset, frames, 60, 5);
    ASSERT_EQ(points.positions.size(), 60u);
    std::vector<int> pixels;
    const Camera& camera = dataset.frames[1].camera;
    for (size_t i = 0; i < 60; ++i) {
        const int x = points.colors[i][0], y = points.colors[i][1];
        EXPECT_NE(x, 7);
        pixels.push_back(20 * y + x);
        const glm::dvec3 p = camera.rotation * points.positions[i] + camera.translation;
        EXPECT_NEAR(p.z, 2 + 0.05 * y, 1e-6);
        EXPECT_NEAR(25 * p.x / p.z + 9, x + 0.5, 1e-5);
        EXPECT_NEAR(25 * p.y / p.z + 6, y + 0.5, 1e-5);
    }
    EXPECT_TRUE(std::ranges::is_sorted(pixels));
    EXPECT_EQ(std::ranges::adjacent_find(pixels), pixels.end()) << "each pixel once";
    EXPECT_LT(pixels.front(), 4);
    EXPECT_GE(pixels.back(), 196);
    EXPECT_EQ(points_of_depth_maps(dataset, frames, 60, 5).positions, points.positions);
    EXPECT_NE(points_of_depth_maps(dataset, frames, 60, 6).positions, points.positions);
    EXPECT_EQ(points_of_depth_maps(dataset, frames, 1000, 5).positions.size(), 190u);

    RunOptions options;
    options.train.sh_degree = 0;
    options.train.max_splats = 150;
    EXPECT_EQ(initial_splats(options, dataset, frames).size(), 150u);
    EXPECT_TRUE(has_depth_maps(dataset, frames));
    EXPECT_FALSE(has_depth_maps(dataset, {0}));
    options.train.max_splats = 400;
    EXPECT_EQ(initial_splats(options, dataset, frames).size(), 190u);
    EXPECT_EQ(initial_splats(options, dataset, {0}).size(), 400u) << "random";
    dataset.frames[1].camera.distortion.lens = Lens::fisheye;
    dataset.frames[1].camera.distortion.k1 = 0.1;
    EXPECT_EQ(initial_splats(options, dataset, frames).size(), 400u) << "random";
}

}  // namespace
