// SPDX-License-Identifier: Apache-2.0
// Meshes from depth: of a sphere, whose depth is known in closed form. Parts, files, and distances between meshes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <numbers>

#include "ewa/error.h"
#include "io/gltf/mesh.h"
#include "mesh/colors.h"
#include "mesh/depth_cache.h"
#include "mesh/distance.h"
#include "mesh/fusion.h"
#include "mesh/mesh_files.h"
#include "mesh/middle.h"
#include "mesh/parts.h"
#include "support/sphere_views.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using scene::TriangleMesh;

const glm::dvec3 kMiddle(0.3, -0.2, 0.1);
constexpr double kRadius = 0.5;

std::vector<Camera> cameras_around(int count) {
    return test::cameras_around(kMiddle, count);
}
Image sphere_depth(const Camera& camera) {
    return test::sphere_depth(camera, kMiddle, kRadius);
}

mesh::Fused fused_sphere(int views, double voxel) {
    const std::vector<Camera> cameras = cameras_around(views);
    mesh::DepthCache cache(cameras.size(), [&](size_t i) { return sphere_depth(cameras[i]); });
    const mesh::DepthOfView depth = [&](size_t i) -> const Image& { return cache.at(i); };
    mesh::Fused fused = mesh::fuse(cameras, depth, {.voxel = voxel});
    mesh::drop_small_parts(fused.mesh, 0.1);
    mesh::set_normals(fused.mesh);
    return fused;
}

TEST(Fusion, ASphereIsASphere) {
    const mesh::Fused fused = fused_sphere(20, 0.02);
    EXPECT_EQ(fused.voxel, 0.02);
    const TriangleMesh& m = fused.mesh;
    ASSERT_GT(m.triangles.size(), 5000u);
    double mean = 0;
    for (size_t i = 0; i < m.positions.size(); ++i) {
        const glm::dvec3 out = m.origin + glm::dvec3(m.positions[i]) - kMiddle;
        // Half a voxel, where all views see the surface at a grazing angle.
        EXPECT_NEAR(glm::length(out), kRadius, 0.011);
        mean += glm::length(out) / double(m.positions.size());
        EXPECT_GT(glm::dot(glm::normalize(out), glm::dvec3(m.normals[i])), 0.8);
    }
    EXPECT_NEAR(mean, kRadius, 0.002);
    const mesh::Topology topology = mesh::topology_of(m);
    EXPECT_EQ(topology.parts, 1u);
    EXPECT_TRUE(topology.watertight());
    double area = 0;
    for (const auto& t : m.triangles)
        area += glm::length(glm::cross(m.positions[t[1]] - m.positions[t[0]],
                                       m.positions[t[2]] - m.positions[t[0]])) /
                2;
    EXPECT_NEAR(area, 4 * std::numbers::pi * kRadius * kRadius, 0.03);
}

TEST(Fusion, WhatNoViewSeesStaysOpen) {
    const std::vector<Camera> cameras = {
        scene::look_at(kMiddle + glm::dvec3(0, 0, 2), kMiddle, {0, 1, 0}, 160, 120)};
    const Image depth = sphere_depth(cameras[0]);
    TriangleMesh m = mesh::fuse(cameras, [&](size_t) -> const Image& { return depth; }, {.voxel = 0.02}).mesh;
    mesh::drop_small_parts(m, 0.1);
    const mesh::Topology topology = mesh::topology_of(m);
    EXPECT_EQ(topology.parts, 1u);
    EXPECT_FALSE(topology.watertight());
    EXPECT_GT(topology.border_edges, 50u);
    for (const glm::vec3& p : m.positions) EXPECT_GT(m.origin.z + double(p.z), kMiddle.z);
}

TEST(Fusion, TheUsualVoxelIsTwoPixels) {
    const std::vector<Camera> cameras = cameras_around(6);
    std::vector<Image> depths;
    for (const Camera& camera : cameras) depths.push_back(sphere_depth(camera));
    const double voxel = mesh::usual_voxel(cameras, [&](size_t i) -> const Image& { return depths[i]; });
    // Depths are from 1.5 to 2.
    EXPECT_GT(voxel, 2 * 1.5 / cameras[0].fx);
    EXPECT_LT(voxel, 2 * 2 / cameras[0].fx);
}

TEST(Fusion, RefusesWhatItCannotHold) {
    const std::vector<Camera> cameras = cameras_around(1);
    const Image depth = sphere_depth(cameras[0]), empty(cameras[0].width, cameras[0].height, 1);
    const auto fuse = [&](const Image& image, const mesh::FusionOptions& options) {
        return mesh::fuse(
            cameras, [&](size_t) -> const Image& { return image; }, options);
    };
    EXPECT_THROW(fuse(empty, {}), InputError);
    EXPECT_THROW(fuse(depth, {.voxel = 1e-8}), InputError);
    // Known before the blocks are there.
    test::expect_error<InputError>([&] { fuse(depth, {.voxel = 1e-5, .most_bytes = 1 << 20}); },
                                   {"voxels of 1e-05 are too small", "22.1 MB or more, of at most 1.05 MB"});
    EXPECT_THROW(fuse(depth, {.voxel = 0.02, .most_bytes = 100000}), InputError);
}

TEST(Fusion, TheSameTwice) {
    const mesh::Fused a = fused_sphere(5, 0.03), b = fused_sphere(5, 0.03);
    EXPECT_EQ(a.mesh.positions, b.mesh.positions);
    EXPECT_EQ(a.mesh.triangles, b.mesh.triangles);
}

TEST(Fusion, ColorsAreThoseOfThePictures) {
    TriangleMesh m = fused_sphere(12, 0.04).mesh;
    const std::vector<Camera> cameras = cameras_around(12);
    std::vector<Image> depths;
    for (const Camera& camera : cameras) depths.push_back(sphere_depth(camera));
    // Each picture shows at each pixel where the surface is.
    const auto picture = [&](size_t i) {
        const Camera& c = cameras[i];
        Image image(c.width, c.height, 3);
        for (int y = 0; y < c.height; ++y)
            for (int x = 0; x < c.width; ++x) {
                const glm::dvec3 ray((x + 0.5 - c.cx) / c.fx, (y + 0.5 - c.cy) / c.fy, 1);
                const glm::dvec3 at =
                    glm::transpose(c.rotation) * (double(*depths[i].at(x, y)) * ray - c.translation) -
                    kMiddle;
                const bool shown = *depths[i].at(x, y) > 0;
                for (int k = 0; k < 3; ++k) image.at(x, y)[k] = shown ? float(0.5 + 0.9 * at[k]) : 0.5f;
            }
        return image;
    };
    mesh::set_colors(
        m, cameras, [&](size_t i) -> const Image& { return depths[i]; }, picture,
        [](const glm::dvec3&) { return 0.05; });
    ASSERT_EQ(m.colors.size(), m.positions.size());
    size_t wrong = 0;
    for (size_t i = 0; i < m.colors.size(); ++i)
        for (int k = 0; k < 3; ++k) {
            const double at = m.origin[k] + double(m.positions[i][k]) - kMiddle[k];
            wrong += std::abs(m.colors[i][size_t(k)] / 255.0 - (0.5 + 0.9 * at)) > 0.03;
        }
    EXPECT_LE(wrong, m.colors.size() / 100);
}

/// A square of two triangles at this height, and another whose corners are its own.
TriangleMesh square(float side, float z) {
    TriangleMesh m;
    for (int i = 0; i < 4; ++i) m.positions.emplace_back(i % 2 ? side : 0, i / 2 ? side : 0, z);
    m.triangles = {{0, 1, 2}, {1, 3, 2}};
    return m;
}
void add(TriangleMesh& m, const TriangleMesh& other) {
    const auto first = uint32_t(m.positions.size());
    m.positions.insert(m.positions.end(), other.positions.begin(), other.positions.end());
    for (const auto& t : other.triangles) m.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

TEST(MeshParts, SmallOnesAreDropped) {
    TriangleMesh m = square(1, 0);
    add(m, square(0.1f, 3));
    m.triangles.push_back({5, 5, 6});
    EXPECT_EQ(mesh::topology_of(m).parts, 2u);
    EXPECT_EQ(mesh::drop_small_parts(m, 0.5), 1u);
    EXPECT_EQ(m.positions.size(), 4u);
    ASSERT_EQ(m.triangles.size(), 2u);
    const mesh::Topology topology = mesh::topology_of(m);
    EXPECT_EQ(topology.parts, 1u);
    EXPECT_EQ(topology.border_edges, 4u);
    EXPECT_EQ(topology.crowded_edges, 0u);
    m.triangles.push_back({0, 1, 3});
    m.triangles.push_back({1, 2, 0});
    EXPECT_GT(mesh::topology_of(m).crowded_edges, 0u);
}

TEST(MeshParts, HolesAreMeasured) {
    TriangleMesh m = square(1, 0);
    add(m, square(3, 5));
    const mesh::Topology two = mesh::topology_of(m);
    EXPECT_EQ(two.holes, 2u);
    EXPECT_NEAR(two.largest_hole, 3 * std::sqrt(2.0), 1e-6);
    EXPECT_EQ(mesh::watertight_text(two), "not watertight: 2 holes of 8 edges, the largest 4.24 across");
    m = fused_sphere(12, 0.04).mesh;
    ASSERT_EQ(mesh::watertight_text(mesh::topology_of(m)), "watertight");
    m.triangles.erase(m.triangles.begin() + 50);
    const mesh::Topology open = mesh::topology_of(m);
    EXPECT_EQ(open.holes, 1u);
    EXPECT_EQ(open.border_edges, 3u);
    EXPECT_GT(open.largest_hole, 0);
    EXPECT_LT(open.largest_hole, 0.1);
    m.triangles = {{0, 1, 2}, {0, 1, 2}, {0, 1, 2}};
    EXPECT_EQ(mesh::watertight_text(mesh::topology_of(m)),
              "not watertight: 3 edges of more than two triangles");
}

TEST(MeshParts, NormalsHaveALengthOfOneEverywhere) {
    TriangleMesh m = square(1, 0);
    // A triangle without an area beside the square, and one that is alone.
    m.positions.insert(m.positions.end(), {{1, 1, 0}, {7, 7, 7}, {7, 7, 7}, {7, 7, 7}});
    m.triangles.push_back({3, 4, 3});
    m.triangles.push_back({5, 6, 7});
    mesh::set_normals(m);
    ASSERT_EQ(m.normals.size(), 8u);
    for (const glm::vec3& n : m.normals) EXPECT_EQ(n, glm::vec3(0, 0, 1));
    std::swap(m.triangles[0][0], m.triangles[0][1]);
    std::swap(m.triangles[1][0], m.triangles[1][1]);
    mesh::set_normals(m);
    EXPECT_EQ(m.normals[4], glm::vec3(0, 0, -1)) << "that of its neighbour";
    EXPECT_EQ(m.normals[5], glm::vec3(0, 0, 1)) << "any";
}

TEST(MeshParts, FewerTriangles) {
    TriangleMesh m = fused_sphere(8, 0.03).mesh;
    const mesh::Topology before = mesh::topology_of(m);
    ASSERT_GT(m.triangles.size(), 2000u);
    mesh::simplify(m, 500);
    EXPECT_LE(m.triangles.size(), 500u);
    EXPECT_GT(m.triangles.size(), 300u);
    EXPECT_LT(m.positions.size(), 400u);
    EXPECT_EQ(mesh::topology_of(m).watertight(), before.watertight());
    for (const glm::vec3& p : m.positions)
        EXPECT_NEAR(glm::length(m.origin + glm::dvec3(p) - kMiddle), kRadius, 0.03);
}

TEST(MeshFiles, AGlbIsReadAgain) {
    const test::TempFolder folder;
    TriangleMesh m = fused_sphere(4, 0.05).mesh;
    m.colors.assign(m.positions.size(), {255, 0, 128});
    mesh::save_mesh(folder / "a.glb", m);
    const scene::MeshScene read = io::read_gltf_mesh(folder / "a.glb");
    ASSERT_EQ(read.triangles.size(), m.triangles.size());
    for (size_t i = 0; i < read.triangles.size(); ++i)
        for (size_t k = 0; k < 3; ++k)
            EXPECT_LT(
                glm::length(read.triangles[i].corners[k] -
                            glm::dvec3(-1, -1, 1) * (m.origin + glm::dvec3(m.positions[m.triangles[i][k]]))),
                1e-12)
                << "y is up in a glTF";
    EXPECT_EQ(read.triangles[0].colors[0] & 0xff00ffu, 0x3700ffu);  // 128 in sRGB is 0.216 in linear light
    EXPECT_TRUE(read.materials[read.triangles[0].material].unlit);
    EXPECT_EQ(mesh::topology_of(mesh::joined(read)).parts, 1u);
    EXPECT_THROW(mesh::save_mesh(folder / "a.stl", m), InputError);
}

scene::MeshScene scene_of(const TriangleMesh& m) {
    scene::MeshScene out;
    for (const auto& t : m.triangles) {
        auto& triangle = out.triangles.emplace_back();
        for (size_t k = 0; k < 3; ++k) triangle.corners[k] = glm::dvec3(m.positions[t[k]]);
    }
    return out;
}

TEST(MeshDistance, OfParallelSquares) {
    const mesh::Surface a(scene_of(square(1, 0))), b(scene_of(square(1, 0.25f)));
    const mesh::SurfaceDifference d = mesh::difference(a, b, {0.2, 1000, 1000});
    EXPECT_NEAR(d.accuracy, 0.25, 1e-6);
    EXPECT_NEAR(d.completeness, 0.25, 1e-6);
    EXPECT_NEAR(d.normal_error, 0, 1e-4);
    EXPECT_EQ(d.f_score(), 0);
    EXPECT_NEAR(mesh::difference(a, b, {0.3, 1000, 1000}).f_score(), 1, 1e-9);
    // Half of B is there, and all of A is right.
    TriangleMesh two = square(1, 0);
    TriangleMesh far = square(1, 10);
    add(two, far);
    const mesh::SurfaceDifference half =
        mesh::difference(a, mesh::Surface(scene_of(two)), {0.01, 1000, 1000});
    EXPECT_NEAR(half.precision, 1, 1e-9);
    EXPECT_NEAR(half.recall, 0.5, 0.01);
    EXPECT_NEAR(half.completeness, 5, 0.1);
    EXPECT_THROW(mesh::Surface{scene::MeshScene()}, InputError);
}

TEST(MeshDistance, FromAScan) {
    // Two points above the square, and one that is far from it.
    const mesh::Surface a(scene_of(square(1, 0)));
    const mesh::Surface scan(std::vector<glm::dvec3>{{0.25, 0.5, 0.25}, {0.75, 0.5, 0.25}, {0.5, 0.5, 30}});
    EXPECT_EQ(scan.size(), 3u);
    const mesh::SurfaceDifference found =
        mesh::difference(a, scan, {.threshold = 0.3, .points_a = 1000, .points_b = 3});
    EXPECT_NEAR(found.completeness, (0.25 + 0.25 + 30) / 3, 1e-9);
    EXPECT_NEAR(found.recall, 2.0 / 3, 1e-9);
    EXPECT_TRUE(std::isnan(found.normal_error));
    // From the square to the nearer of two points.
    EXPECT_NEAR(found.accuracy, 0.38, 0.02);
}

TEST(MeshDistance, IsThatToTheNearestTriangle) {
    const scene::MeshScene sphere = scene_of(fused_sphere(6, 0.06).mesh);
    const mesh::Surface surface(sphere);
    for (uint32_t i = 0; i < 50; ++i) {
        const glm::dvec3 point = 0.8 * (surface.sample(i, 50, 7).position + glm::dvec3(0.01 * i));
        double least = 1e300;  // to the corners: an upper bound that is tight to a triangle's side
        for (const auto& t : sphere.triangles)
            for (const auto& corner : t.corners) least = std::min(least, glm::length(corner - point));
        const double distance = surface.nearest(point).distance;
        EXPECT_LE(distance, least);
        EXPECT_GT(distance, least - 0.06);
    }
}

}  // namespace
