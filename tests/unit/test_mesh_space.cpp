// SPDX-License-Identifier: Apache-2.0
// Meshes of scenes with a background: contracted space, its middle, and fusion in it. Closed meshes.
#include <gtest/gtest.h>

#include <algorithm>
#include <glm/common.hpp>

#include "mesh/fusion.h"
#include "mesh/middle.h"
#include "mesh/parts.h"
#include "support/sphere_views.h"

namespace {

using namespace ewa;

TEST(MeshSpace, IsContractedBeyondTheRadius) {
    const mesh::Space space{{1, -2, 3}, 2};
    for (const double far : {0.1, 0.99, 1.01, 1.5, 4.0, 100.0})
        for (const glm::dvec3& direction : {glm::dvec3(1, 0, 0), glm::dvec3(-0.3, 0.4, 0.9)}) {
            const glm::dvec3 x = 2 * far * glm::normalize(direction), at = space.contracted(space.middle + x);
            EXPECT_NEAR(glm::length(at), far < 1 ? 2 * far : 2 * (2 - 1 / far), 1e-12);
            EXPECT_LT(glm::length(space.expanded(at) - x), 1e-9 * far * far);
            for (const glm::dvec3& along : {glm::dvec3(1, 0, 0), glm::dvec3(0.2, -0.5, 0.3)}) {
                constexpr double kStep = 1e-5;
                const glm::dvec3 moved = (space.contracted(space.middle + x + kStep * along) -
                                          space.contracted(space.middle + x - kStep * along)) /
                                         (2 * kStep);
                EXPECT_LT(glm::length(space.contracted_direction(space.middle + x, along) - moved), 1e-8);
            }
            const glm::dvec3 across = glm::normalize(glm::cross(x, {0.3, 1, 0.1}));
            EXPECT_NEAR(glm::length(space.contracted_direction(space.middle + x, across)) *
                            space.growth(space.middle + x),
                        1, 1e-9);
            EXPECT_NEAR(glm::length(space.contracted_direction(space.middle + x, glm::normalize(x))) *
                            space.outward_growth(space.middle + x),
                        1, 1e-9);
        }
    const mesh::Space plain;
    EXPECT_EQ(plain.contracted({1e9, 2, 3}), glm::dvec3(1e9, 2, 3));
    EXPECT_EQ(plain.expanded({1e9, 2, 3}), glm::dvec3(1e9, 2, 3));
}

/// A ball in the middle, and a sphere around it and the cameras.
struct SphereScene {
    static constexpr double kBall = 0.5, kBackground = 6;
    const glm::dvec3 middle{0.3, -0.2, 0.1};
    const std::vector<Camera> cameras = test::cameras_around(middle, 20);
    std::vector<Image> depths;
    SphereScene() {
        for (const Camera& camera : cameras) {
            const Image ball = test::sphere_depth(camera, middle, kBall);
            Image depth = test::sphere_depth(camera, middle, kBackground);
            for (size_t i = 0; i < depth.pixels.size(); ++i)
                if (ball.pixels[i] > 0) depth.pixels[i] = ball.pixels[i];
            depths.push_back(std::move(depth));
        }
    }
    mesh::DepthOfView depth() const {
        return [this](size_t i) -> const Image& { return depths[i]; };
    }
    mesh::Fused fused(const mesh::FusionOptions& options) const {
        return mesh::fuse(cameras, depth(), options);
    }
};

TEST(MeshSpace, IsAboutWhatTheCamerasLookAt) {
    const SphereScene scene;
    const mesh::Space space = mesh::space_of_views(scene.cameras, scene.depth());
    EXPECT_LT(glm::length(space.middle - scene.middle), 0.02);
    EXPECT_NEAR(space.radius, 2, 0.05);
    // Two pixels on the ball, not on the background.
    const double voxel = mesh::usual_voxel(scene.cameras, scene.depth(), space);
    EXPECT_GT(voxel, 2 * 1.5 / scene.cameras[0].fx);
    EXPECT_LT(voxel, 2 * 2 / scene.cameras[0].fx);

    // Axes that are parallel meet nowhere: the middle is at the median depth.
    std::vector<Camera> parallel;
    for (const double x : {-1.0, 0.0, 1.0})
        parallel.push_back(scene::look_at({x, 0, -4}, {x, 0, 0}, {0, -1, 0}, 160, 120));
    Image wall(160, 120, 1);
    std::ranges::fill(wall.pixels, 5.0f);
    const mesh::Space ahead = mesh::space_of_views(parallel, [&](size_t) -> const Image& { return wall; });
    EXPECT_LT(glm::length(ahead.middle - glm::dvec3(0, 0, 1)), 1e-6);
    EXPECT_NEAR(ahead.radius, std::sqrt(26), 1e-6);
    // Cameras that look out from one place: the radius reaches the walls, whatever a few pixels show.
    std::fill_n(wall.pixels.begin(), wall.pixels.size() / 20, 0.5f);
    std::vector<Camera> outward;
    for (const glm::dvec3& to : {glm::dvec3(1, 0, 0), glm::dvec3(0, 0, 1), glm::dvec3(-1, 0, -1)})
        outward.push_back(scene::look_at(0.1 * to, to, {0, -1, 0}, 160, 120));
    EXPECT_GT(mesh::space_of_views(outward, [&](size_t) -> const Image& { return wall; }).radius, 4.5);
}

TEST(UnboundedFusion, HasTheMiddleAndTheBackground) {
    const SphereScene scene;
    const mesh::Fused unbounded = scene.fused({.voxel = 0.06, .unbounded = true, .least_part = 8});
    const scene::TriangleMesh& m = unbounded.mesh;
    const double outward = unbounded.voxel_at(scene.middle + glm::dvec3(SphereScene::kBackground, 0, 0));
    EXPECT_NEAR(outward, 0.06 * 9, 0.03);
    size_t near = 0, far = 0;
    double ball = 0, background = 0;
    for (const glm::vec3& p : m.positions) {
        const double at = glm::length(m.origin + glm::dvec3(p) - scene.middle);
        if (at < 2) {
            ++near;
            ball += std::abs(at - SphereScene::kBall);
            EXPECT_NEAR(at, SphereScene::kBall, 0.04);
        } else {
            ++far;
            background += std::abs(at - SphereScene::kBackground);
            EXPECT_NEAR(at, SphereScene::kBackground, outward);
        }
    }
    EXPECT_GT(near, 1000u);
    EXPECT_GT(far, 1000u);
    EXPECT_LT(ball / double(near), 0.01);
    EXPECT_LT(background / double(far), 0.1 * outward);
    const mesh::Topology topology = mesh::topology_of(m);
    EXPECT_EQ(topology.parts, 2u);

    const mesh::Fused again = scene.fused({.voxel = 0.06, .unbounded = true, .least_part = 8});
    EXPECT_EQ(again.mesh.positions, m.positions);
    EXPECT_EQ(again.mesh.triangles, m.triangles);
}

TEST(UnboundedFusion, WhatIsAlmostInfinitelyFarIsLeftOut) {
    SphereScene scene;
    for (Image& depth : scene.depths)
        for (float& z : depth.pixels)
            if (z > 2) z = 1e6f;
    const mesh::FusionOptions options{.voxel = 0.06, .unbounded = true, .least_part = 8};
    const mesh::Fused fused = scene.fused(options);
    for (Image& depth : scene.depths)
        for (float& z : depth.pixels)
            if (z > 2) z = 0;
    EXPECT_EQ(fused.blocks, scene.fused(options).blocks) << "it takes memory";
    ASSERT_FALSE(fused.mesh.positions.empty());
    for (const glm::vec3& p : fused.mesh.positions)
        EXPECT_LT(glm::length(fused.mesh.origin + glm::dvec3(p) - scene.middle), 0.6);
}

TEST(ClosedFusion, HasABackWhereNoViewLooks) {
    const glm::dvec3 middle(0.3, -0.2, 0.1);
    const std::vector<Camera> cameras = {
        scene::look_at(middle + glm::dvec3(0, 0, 2), middle, {0, 1, 0}, 160, 120)};
    const Image depth = test::sphere_depth(cameras[0], middle, 0.5);
    const auto fuse = [&](const mesh::FusionOptions& options) {
        return mesh::fuse(
                   cameras, [&](size_t) -> const Image& { return depth; }, options)
            .mesh;
    };
    const scene::TriangleMesh closed = fuse({.voxel = 0.03, .closed = true, .least_part = 16});
    const mesh::Topology topology = mesh::topology_of(closed);
    EXPECT_EQ(topology.parts, 1u);
    EXPECT_TRUE(topology.watertight());
    EXPECT_FALSE(mesh::topology_of(fuse({.voxel = 0.03, .least_part = 16})).watertight());
    const scene::TriangleMesh few =
        fuse({.voxel = 0.03, .closed = true, .least_part = 16, .most_triangles = 300});
    EXPECT_LE(few.triangles.size(), 300u);
    EXPECT_EQ(mesh::topology_of(few).border_edges, 0u);
    // Twice as coarse.
    const auto usual = fuse({.least_part = 16}), coarse = fuse({.coarser = 2, .least_part = 8});
    EXPECT_GT(usual.triangles.size(), 3 * coarse.triangles.size());
}

}  // namespace
