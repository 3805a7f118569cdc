// SPDX-License-Identifier: Apache-2.0
// 3D Tiles: every splat is in a tile of each level, in its box, and on the globe where it should be.
#include "io/splats/tileset.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <glm/glm.hpp>
#include <nlohmann/json.hpp>

#include "ewa/error.h"
#include "ewa/splat_files.h"
#include "support/splat_scenes.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using nlohmann::json;

json read_tileset(const test::TempFolder& folder) {
    return json::parse(std::ifstream(folder / "tileset.json"));
}

void visit_tiles(const json& tile, int depth, const std::function<void(const json&, int)>& visit) {
    visit(tile, depth);
    if (!tile.contains("children")) return;
    for (const json& child : tile["children"]) {
        EXPECT_LE(child["geometricError"], tile["geometricError"]);
        visit_tiles(child, depth + 1, visit);
    }
}

TEST(Tileset, EachLevelIsTheWholeScene) {
    const test::TempFolder folder;
    const Gaussians scene = test::storable_splats(5, 4000, 1);
    io::write_tileset(folder / "tileset.json", scene, {.save = {.levels = 3}, .earth = {}});
    const json top = read_tileset(folder);
    EXPECT_EQ(top["asset"]["version"], "1.1");
    EXPECT_EQ(top["extensions"]["3DTILES_content_gltf"]["extensionsUsed"],
              json({"KHR_gaussian_splatting", "KHR_gaussian_splatting_compression_spz_2"}));
    EXPECT_EQ(top["root"]["refine"], "REPLACE");
    EXPECT_FALSE(top["root"].contains("transform"));
    EXPECT_GE(top["geometricError"], top["root"]["geometricError"]);
    std::vector<size_t> counts(3), tiles(3);
    glm::dvec3 sum(0);
    visit_tiles(top["root"], 0, [&](const json& tile, int depth) {
        const Gaussians part = load_splats(folder / tile["content"]["uri"].get<std::string>());
        counts[size_t(depth)] += part.size();
        ++tiles[size_t(depth)];
        const json& box = tile["boundingVolume"]["box"];
        for (size_t i = 0; i < part.size(); ++i) {
            // A reader of glTF turns the older profile's values by 180 degrees about y. Up is z in a tile.
            const glm::dvec3 ply(-part.means[3 * i], part.means[3 * i + 1], -part.means[3 * i + 2]);
            const glm::dvec3 place(ply.x, ply.z, -ply.y);
            for (int k = 0; k < 3; ++k)
                ASSERT_LE(std::abs(place[k] - box[k].get<double>()), box[3 + 4 * k].get<double>() + 1e-3);
            if (depth == 2) sum += ply;
        }
        EXPECT_EQ(tile["geometricError"] == 0, depth == 2);
    });
    EXPECT_EQ(counts, (std::vector<size_t>{1000, 2000, 4000}));
    EXPECT_EQ(tiles, (std::vector<size_t>{1, 2, 4}));
    glm::dvec3 expected(0);
    for (size_t i = 0; i < scene.size(); ++i) expected += scene.world_mean(i);
    EXPECT_LT(glm::distance(sum, expected) / 4000, 1e-3);
}

TEST(Tileset, TheSceneIsAtItsPlace) {
    // WGS 84: where the equator meets the prime meridian, and the north pole.
    const glm::dmat4 zero = io::earth_of_place({0, 0, 10, 0}), pole = io::earth_of_place({90, 0, 0, 0});
    EXPECT_LT(glm::distance(glm::dvec3(zero[3]), glm::dvec3(6378147, 0, 0)), 1e-6);
    EXPECT_LT(glm::distance(glm::dvec3(pole[3]), glm::dvec3(0, 0, 6356752.314245)), 1e-5);
    EXPECT_LT(glm::distance(glm::dvec3(zero * glm::dvec4(1, 0, 0, 0)), glm::dvec3(0, 1, 0)), 1e-12) << "east";
    EXPECT_LT(glm::distance(glm::dvec3(zero * glm::dvec4(0, -1, 0, 0)), glm::dvec3(1, 0, 0)), 1e-12) << "up";
    EXPECT_LT(glm::distance(glm::dvec3(zero * glm::dvec4(0, 0, 1, 0)), glm::dvec3(0, 0, 1)), 1e-12)
        << "north";
    // A heading of 90 degrees is east.
    const glm::dmat4 east = io::earth_of_place({0, 0, 0, 90});
    EXPECT_LT(glm::distance(glm::dvec3(east * glm::dvec4(0, 0, 1, 0)), glm::dvec3(0, 1, 0)), 1e-12);

    // Far from the origin, the transform has the whole of the distance.
    const test::TempFolder folder;
    Gaussians scene = test::storable_splats(5, 50, 0);
    scene.origin = {4279807, 642676, 4670024};
    io::write_tileset(folder / "tileset.json", scene, {.save = {}, .earth = glm::dmat4(1)});
    const json root = read_tileset(folder)["root"];
    glm::dmat4 transform;
    for (int i = 0; i < 16; ++i) transform[i / 4][i % 4] = root["transform"][size_t(i)];
    glm::dvec3 low(1e9), high(-1e9);
    for (size_t i = 0; i < scene.size(); ++i) {
        low = glm::min(low, scene.world_mean(i));
        high = glm::max(high, scene.world_mean(i));
    }
    const json& box = root["boundingVolume"]["box"];
    const glm::dvec3 middle = transform * glm::dvec4(box[0], box[1], box[2], 1);
    EXPECT_LT(glm::distance(middle, 0.5 * (low + high)), 3);
    EXPECT_EQ(read_tileset(folder)["root"]["children"].size(), 0u);
}

TEST(Tileset, WithoutSplatsThereIsNone) {
    const test::TempFolder folder;
    test::expect_error<InputError>([&] { io::write_tileset(folder / "tileset.json", {}, {}); },
                                   {"without splats"});
}

}  // namespace
