// SPDX-License-Identifier: Apache-2.0
// The hierarchy against brute force, the cameras on the dome, and what the path tracer's tables hold.
#include <gtest/gtest.h>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "core/random.h"
#include "ewa/error.h"
#include "pathtracer/packing.h"
#include "pathtracer/virtual_camera.h"
#include "reference/tracing.h"
#include "support/mesh_scenes.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;

pathtracer::FloatBox cube(float at, float size) {
    return {glm::vec3(at), glm::vec3(at + size)};
}

/// Every triangle stands in exactly one leaf, and in every box on the way to it. Returns the most nodes on a
/// way.
int check_hierarchy(const pathtracer::Hierarchy& hierarchy, const std::vector<pathtracer::FloatBox>& boxes) {
    std::vector<int> met(boxes.size());
    int deepest = 0;
    struct Place {
        uint32_t reference;
        pathtracer::FloatBox box;
        int depth;
    };
    std::vector<Place> open = {{0, {glm::vec3(-3e38f), glm::vec3(3e38f)}, 1}};
    while (!open.empty()) {
        const Place place = open.back();
        open.pop_back();
        if (place.reference & shared::LEAF_FLAG) {
            const uint32_t first = place.reference & shared::LEAF_FIRST_MASK;
            const uint32_t count = ((place.reference & ~shared::LEAF_FLAG) >> shared::LEAF_COUNT_SHIFT) + 1;
            EXPECT_LE(count, shared::TRACE_LEAF_MAX);
            for (uint32_t i = first; i < first + count; ++i) {
                ++met[hierarchy.order[i]];
                const pathtracer::FloatBox& box = boxes[hierarchy.order[i]];
                for (int axis = 0; axis < 3; ++axis)
                    EXPECT_TRUE(box.low[axis] >= place.box.low[axis] &&
                                box.high[axis] <= place.box.high[axis]);
            }
            continue;
        }
        deepest = std::max(deepest, place.depth);
        const pathtracer::Node& node = hierarchy.nodes[place.reference];
        for (size_t child = 0; child < 2; ++child)
            if (node.boxes[child].low.x <= node.boxes[child].high.x)
                open.push_back({node.references[child], node.boxes[child], place.depth + 1});
    }
    EXPECT_TRUE(std::all_of(met.begin(), met.end(), [](int n) { return n == 1; }));
    return deepest;
}

TEST(Hierarchy, HoldsEveryTriangleOnce) {
    for (const size_t count : {1u, 2u, 4u, 5u, 100u, 5000u}) {
        std::mt19937 random(7);
        std::uniform_real_distribution<float> place(-5, 5);
        std::vector<pathtracer::FloatBox> boxes;
        for (size_t i = 0; i < count; ++i) boxes.push_back(cube(place(random), 0.1f));
        check_hierarchy(pathtracer::build_hierarchy(boxes), boxes);
    }
}

TEST(Hierarchy, NeverOutgrowsTheStack) {
    // Boxes that double in size and distance: the heuristic cuts one off at a time.
    std::vector<pathtracer::FloatBox> boxes;
    for (int i = -110; i < 110; ++i)
        for (int k = 0; k < 20; ++k)
            boxes.push_back(cube(std::exp2(float(i)) * (1 + 0.01f * float(k)), std::exp2(float(i - 9))));
    const int deepest = check_hierarchy(pathtracer::build_hierarchy(boxes), boxes);
    EXPECT_LE(deepest, int(shared::TRACE_STACK));
    EXPECT_GT(deepest, 40) << "the case does not reach the limit it is meant for";
    // The same place for all: no plane divides them.
    boxes.assign(4096, cube(1, 1));
    EXPECT_LE(check_hierarchy(pathtracer::build_hierarchy(boxes), boxes), 12);
}

TEST(Tracing, TheHierarchyFindsWhatBruteForceFinds) {
    const pathtracer::PackedScene packed = pathtracer::pack(test::random_triangles(1, 3000), {});
    const auto triangles = pathtracer::device_triangles(packed);
    const auto nodes = pathtracer::device_nodes(packed);
    std::mt19937 random(2);
    std::normal_distribution<double> normal;
    int hits = 0;
    size_t deepest = 0;
    for (int i = 0; i < 3000; ++i) {
        const glm::dvec3 from = 20.0 * glm::dvec3(normal(random), normal(random), normal(random));
        reference::Ray ray{from, glm::dvec3(normal(random), normal(random), normal(random)) * 3.0 - from};
        if (i % 5 == 0) ray.direction[i % 3] = 0;  // along a plane of the axes
        if (i % 7 == 0) ray.reach = 0.9;
        const auto all = reference::nearest_of_all(ray, triangles);
        const auto found = reference::trace(ray, nodes, triangles, &deepest);
        ASSERT_EQ(all.has_value(), found.has_value()) << "ray " << i;
        if (!all) continue;
        ++hits;
        EXPECT_EQ(all->triangle, found->triangle) << "ray " << i;
        EXPECT_EQ(all->distance, found->distance) << "ray " << i;
    }
    EXPECT_GT(hits, 500);
    EXPECT_LE(deepest, size_t(shared::TRACE_STACK));
}

TEST(Packing, NormalsSurviveTheirPacking) {
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 1000; ++i) {
        const glm::dvec3 n = glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
        const uint32_t bits = scene::pack_normal(3.0 * n);
        const double x = int16_t(bits & 0xffff) / 32767.0, y = int16_t(bits >> 16) / 32767.0;
        glm::dvec3 back(x, y, 1 - std::abs(x) - std::abs(y));
        if (back.z < 0) {
            back.x = (1 - std::abs(y)) * (x >= 0 ? 1 : -1);
            back.y = (1 - std::abs(x)) * (y >= 0 ? 1 : -1);
        }
        EXPECT_LT(glm::length(glm::normalize(back) - n), 1e-4);
    }
    for (const glm::dvec3& none : {glm::dvec3(0), glm::dvec3(NAN, 0, 1), glm::dvec3(INFINITY, 0, 1)})
        EXPECT_EQ(scene::pack_normal(none), scene::kNoNormal);
    EXPECT_NE(scene::pack_normal({-1, 0, 0}), scene::kNoNormal);
}

TEST(Packing, EmptyScenesAndTooManyTexelsAreRefused) {
    test::expect_error<InputError>([] { pathtracer::pack({}, {}); }, {"no triangles"});
    scene::MeshScene scene = test::random_triangles(1, 1);
    test::expect_error<InputError>(
        [&] {
            pathtracer::pack(scene, {Image(8192, 4096, 3), Image(8192, 4097, 3)});
        },
        {"texels"});
}

TEST(LightTable, DrawsByPower) {
    const std::vector<double> wanted = {0.5, 0.05, 0.25, 0.0, 0.2};
    const pathtracer::AliasTable table = pathtracer::alias_table(wanted);
    std::vector<double> found(wanted.size());
    for (size_t i = 0; i < wanted.size(); ++i) {
        found[i] += table.threshold[i] / double(wanted.size());
        found[table.alias[i]] += (1 - table.threshold[i]) / double(wanted.size());
    }
    for (size_t i = 0; i < wanted.size(); ++i) EXPECT_NEAR(found[i], wanted[i], 1e-12);
}

TEST(Dome, LooksAtTheSceneFromAllSides) {
    const scene::Box box{{-1, 2, -3}, {3, 4, 5}};
    const auto cameras = pathtracer::dome_cameras(box, 48, 320, 200);
    ASSERT_EQ(cameras.size(), 48u);
    glm::dvec3 sum(0);
    for (const Camera& camera : cameras) {
        const glm::dvec3 middle = camera.rotation * box.center() + camera.translation;
        EXPECT_NEAR(camera.fx * middle.x / middle.z, 0, 1e-9);
        EXPECT_NEAR(camera.fy * middle.y / middle.z, 0, 1e-9);
        // All corners lie in the picture, and one of them on its edge.
        double farthest = 0;
        for (int corner = 0; corner < 8; ++corner) {
            const glm::dvec3 at((corner & 1 ? box.low : box.high).x, (corner & 2 ? box.low : box.high).y,
                                (corner & 4 ? box.low : box.high).z);
            const glm::dvec3 p = camera.rotation * at + camera.translation;
            farthest = std::max(
                {farthest, std::abs(camera.fx * p.x / p.z) / 160, std::abs(camera.fy * p.y / p.z) / 100});
        }
        EXPECT_NEAR(farthest, 1, 1e-9);
        EXPECT_LT((camera.rotation * glm::dvec3(0, 1, 0)).y, 0) << "up in the world is up in the picture";
        sum += glm::normalize(camera.position() - box.center());
    }
    EXPECT_LT(std::hypot(sum.x, sum.z) / 48, 0.05);
    EXPECT_NEAR(glm::determinant(cameras[7].rotation), 1, 1e-12);
}

TEST(LowDiscrepancy, EveryBlockIsANet) {
    // A (0, 5, 2)-net: each of the 32 pairs has each elementary box of area 1/32 to itself.
    for (const uint32_t seed : {1u, 77u, 123456u})
        for (const uint32_t block : {0u, 32u, 96u})
            for (int wide = 0; wide <= 5; ++wide) {
                std::set<std::pair<int, int>> boxes;
                for (uint32_t i = 0; i < 32; ++i) {
                    const auto u = core::sobol_pair(block + i, {seed, seed * 7919u + 1, ~seed});
                    boxes.insert({int(u[0] * (1 << wide)), int(u[1] * (1 << (5 - wide)))});
                }
                EXPECT_EQ(boxes.size(), 32u) << "seed " << seed << ", block " << block << ", 2^" << wide;
            }
}

}  // namespace
