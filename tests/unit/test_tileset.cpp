// SPDX-License-Identifier: Apache-2.0
// 3D Tiles: every splat is in a tile of each level, in its box, and on the globe where it should be.
#include "io/splats/tileset.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <glm/glm.hpp>
#include <nlohmann/json.hpp>

#include "core/folders.h"
#include "ewa/error.h"
#include "ewa/splat_files.h"
#include "io/splats/part_folders.h"
#include "support/splat_scenes.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using nlohmann::json;

json read_tileset(const test::TempFolder& folder) {
    return json::parse(std::ifstream(folder / "tileset.json"));
}

/// visit(tile, depth, matrix): from the tile's frame to the world's.
using Visit = std::function<void(const json&, int, const glm::dmat4&)>;

void visit_tiles(const json& tile, int depth, const glm::dmat4& above, const Visit& visit) {
    glm::dmat4 matrix(1);
    if (tile.contains("transform"))
        for (int i = 0; i < 16; ++i) matrix[i / 4][i % 4] = tile["transform"][size_t(i)];
    matrix = above * matrix;
    visit(tile, depth, matrix);
    if (!tile.contains("children")) return;
    for (const json& child : tile["children"]) {
        EXPECT_LE(child["geometricError"], tile["geometricError"]);
        visit_tiles(child, depth + 1, matrix, visit);
    }
}

/// The centres of a tile's splats in its frame, where z is up.
std::vector<glm::dvec3> centres_of(const test::TempFolder& folder, const json& tile) {
    const Gaussians part = load_splats(folder / tile["content"]["uri"].get<std::string>());
    std::vector<glm::dvec3> centres;
    // A reader of glTF turns the older profile's values by 180 degrees about y.
    for (size_t i = 0; i < part.size(); ++i)
        centres.emplace_back(-part.means[3 * i], -part.means[3 * i + 2], -part.means[3 * i + 1]);
    return centres;
}

/// The distance of each splat of the scene to the nearest one of the finest tiles, at most.
double farthest_of_scene(const test::TempFolder& folder, const Gaussians& scene) {
    std::vector<glm::dvec3> found;
    visit_tiles(read_tileset(folder)["root"], 0, glm::dmat4(1),
                [&](const json& tile, int, const glm::dmat4& matrix) {
                    if (tile["geometricError"] > 0) return;
                    for (const glm::dvec3& centre : centres_of(folder, tile))
                        found.push_back(matrix * glm::dvec4(centre, 1));
                });
    EXPECT_EQ(found.size(), scene.size());
    double farthest = 0;
    for (size_t i = 0; i < scene.size(); ++i) {
        const glm::dvec3 ply = scene.world_mean(i), place(ply.x, ply.z, -ply.y);
        double nearest = 1e300;
        for (const glm::dvec3& one : found) nearest = std::min(nearest, glm::distance(one, place));
        farthest = std::max(farthest, nearest);
    }
    return farthest;
}

std::vector<std::string> write(const test::TempFolder& folder, const Gaussians& scene, int levels) {
    return io::write_tileset(folder / "tileset.json", scene, {.levels = levels});
}

TEST(Tileset, EachLevelIsTheWholeScene) {
    const test::TempFolder folder;
    const Gaussians scene = test::storable_splats(5, 4000, 1);
    write(folder, scene, 3);
    const json top = read_tileset(folder);
    EXPECT_EQ(top["asset"]["version"], "1.1");
    EXPECT_EQ(top["extensions"]["3DTILES_content_gltf"]["extensionsUsed"],
              json({"KHR_gaussian_splatting", "KHR_gaussian_splatting_compression_spz_2"}));
    EXPECT_EQ(top["root"]["refine"], "REPLACE");
    EXPECT_GE(top["geometricError"], top["root"]["geometricError"]);
    std::vector<size_t> counts(3), tiles(3);
    glm::dvec3 sum(0);
    visit_tiles(top["root"], 0, glm::dmat4(1), [&](const json& tile, int depth, const glm::dmat4& matrix) {
        const std::vector<glm::dvec3> centres = centres_of(folder, tile);
        counts[size_t(depth)] += centres.size();
        ++tiles[size_t(depth)];
        const json& box = tile["boundingVolume"]["box"];
        for (const glm::dvec3& centre : centres) {
            for (int k = 0; k < 3; ++k)
                ASSERT_LE(std::abs(centre[k] - box[k].get<double>()), box[3 + 4 * k].get<double>() + 1e-3);
            if (depth == 2) sum += glm::dvec3(matrix * glm::dvec4(centre, 1));
        }
        EXPECT_EQ(tile["geometricError"] == 0, depth == 2);
    });
    EXPECT_EQ(counts, (std::vector<size_t>{1000, 2000, 4000}));
    EXPECT_EQ(tiles, (std::vector<size_t>{1, 2, 4}));
    glm::dvec3 expected(0);
    for (size_t i = 0; i < scene.size(); ++i) expected += scene.world_mean(i);
    EXPECT_LT(glm::distance(sum, glm::dvec3(expected.x, expected.z, -expected.y)) / 4000, 1e-3);
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
    io::write_tileset(folder / "tileset.json", scene, {.earth = glm::dmat4(1)});
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

TEST(Tileset, SplatsFarFromTheOriginKeepTheirPlaces) {
    const test::TempFolder folder;
    // Two groups 100 km apart: one SPZ of both would have steps of 1/64.
    Gaussians scene = test::storable_splats(6, 2000, 0);
    for (size_t i = 0; i < 1000; ++i) scene.means[3 * i] += 65536;
    write(folder, scene, 2);
    EXPECT_LT(farthest_of_scene(folder, scene), 0.01);  // float32 has steps of 1/128 there
}

TEST(Tileset, TellsWhatAllTilesLose) {
    const test::TempFolder folder;
    Gaussians scene = test::storable_splats(7, 4000, 0);
    // The first tiles alone have colours outside SPZ's range.
    for (size_t i = 0; i < scene.size(); ++i)
        if (scene.means[3 * i] < 0) scene.sh[3 * i] = 30;
    std::string all;
    for (const std::string& remark : write(folder, scene, 1)) all += remark + "\n";
    size_t expected = 0;
    for (size_t i = 0; i < scene.size(); ++i) expected += scene.means[3 * i] < 0;
    EXPECT_NE(all.find(std::to_string(expected) + " scales, colours"), std::string::npos) << all;
    for (const std::string& remark : write(folder, scene, 2))
        if (remark.find("are clamped") != std::string::npos) {
            EXPECT_GT(std::stoul(remark), expected);
            return;
        }
    ADD_FAILURE() << "no remark on clamped values";
}

TEST(Tileset, TilesHaveAThousandSplats) {
    const test::TempFolder folder;
    const std::vector<std::string> remarks = write(folder, test::storable_splats(5, 5000, 0), 20);
    EXPECT_EQ(remarks.at(0), "7 tiles of levels with 5000, 2500, 1250 splats");
    EXPECT_EQ(remarks.at(1), "3 of 20 levels: more would have tiles of fewer than 1000 splats");
    visit_tiles(
        read_tileset(folder)["root"], 0, glm::dmat4(1),
        [&](const json& tile, int, const glm::dmat4&) { EXPECT_GE(centres_of(folder, tile).size(), 1000u); });
}

TEST(Tileset, AnEarlierOneIsReplacedAtOnce) {
    namespace fs = std::filesystem;
    const test::TempFolder folder;
    const Gaussians first = test::storable_splats(5, 4000, 0), second = test::storable_splats(6, 1000, 0);
    write(folder, first, 3);
    const std::vector<fs::path> before = io::tile_files(folder / "tileset.json");
    EXPECT_EQ(before.size(), 7u);
    std::ofstream(folder / "tiles/mine.txt") << "somebody's";

    // While it cannot be finished, the earlier one is whole.
    Gaussians broken = second;
    broken.means[0] = 3e7f;
    broken.means[3] = -3e7f;
    EXPECT_THROW(write(folder, broken, 1), InputError);
    EXPECT_EQ(io::tile_files(folder / "tileset.json"), before);
    EXPECT_FALSE(fs::exists(folder / "tiles-2"));
    EXPECT_LT(farthest_of_scene(folder, first), 1e-3);

    write(folder, second, 1);
    EXPECT_LT(farthest_of_scene(folder, second), 1e-3);
    for (const fs::path& tile : before) EXPECT_FALSE(fs::exists(tile)) << tile;
    EXPECT_TRUE(fs::exists(folder / "tiles/mine.txt"));
    EXPECT_TRUE(fs::exists(folder / "tiles-2"));
    fs::remove_all(folder / "tiles");
    write(folder, second, 1);
    EXPECT_TRUE(fs::exists(folder / "tiles"));
    EXPECT_FALSE(fs::exists(folder / "tiles-2"));
}

TEST(Tileset, TilesOfKilledProcessesAreRemoved) {
    namespace fs = std::filesystem;
    const test::TempFolder folder;
    const Gaussians scene = test::storable_splats(6, 10, 0);
    for (const char* name : {"tiles", "tiles-2", "tiles-3", "tiles-4", "tiles-5", "tiles-old"}) {
        fs::create_directories(folder / name);
        std::ofstream(folder / name / "0_0.glb") << "left";
        std::ofstream(folder / name / io::kUnfinished) << name << "\n";
    }
    std::ofstream(folder / "tiles-3/mine.txt") << "somebody's";
    std::ofstream(folder / "kept.json") << R"({"root": {"content": {"uri": "tiles-4\/0_0.glb"}}})";
    {
        const core::FolderLock used(folder / "tiles-5");
        write(folder, scene, 1);
    }
    for (const char* name : {"tiles", "tiles-2"}) EXPECT_FALSE(fs::exists(folder / name)) << name;
    for (const char* name : {"tiles-3/mine.txt", "tiles-4/0_0.glb", "tiles-5", "tiles-6", "tiles-old"})
        EXPECT_TRUE(fs::exists(folder / name)) << name;
    EXPECT_FALSE(fs::exists(folder / "tiles-3/0_0.glb"));
    write(folder, scene, 1);
    EXPECT_TRUE(fs::exists(folder / "tiles/0_0.glb"));
    for (const char* name : {"tiles-5", "tiles-6"}) EXPECT_FALSE(fs::exists(folder / name)) << name;
}

TEST(Tileset, FoldersOfOtherProgramsStay) {
    namespace fs = std::filesystem;
    const test::TempFolder folder;
    const Gaussians scene = test::storable_splats(6, 10, 0);
    std::ofstream(folder / "tileset.json")
        << R"({"asset": {"generator": "other"}, "root": {"content": {"uri": "tiles/0_0.glb"}}})";
    const std::vector<std::string> theirs = {"tiles/0_0.glb", "tiles/5_7.glb", "tiles-2/1_0.glb"};
    for (const std::string& name : theirs) {
        fs::create_directories((folder / name).parent_path());
        std::ofstream(folder / name) << "mine";
    }
    for (int again = 0; again < 3; ++again) {
        write(folder, scene, 1);
        for (const std::string& name : theirs) EXPECT_EQ(test::file_bytes(folder / name), "mine") << name;
        EXPECT_EQ(test::files_in(folder.path()), 4u);  // two of theirs, one of ewa's and the tileset.json
    }
    // A tile that somebody has put in the place of one of ewa's, and a tileset that names ewa's in another way.
    const fs::path tile = io::tile_files(folder / "tileset.json").at(0);
    std::ofstream(tile) << "mine";
    write(folder, scene, 1);
    EXPECT_EQ(test::file_bytes(tile), "mine");
    const fs::path shared = io::tile_files(folder / "tileset.json").at(0);
    const std::string own = shared.parent_path().filename().string();
    std::ofstream(folder / "city.json") << R"({"root": {"contents": [{"uri": ")" << own
                                        << R"(/0_0.glb"}]}, "uri": ")" << own << R"(/{level}_{x}.glb"})";
    write(folder, scene, 1);
    EXPECT_TRUE(fs::exists(shared));
}

TEST(Tileset, FindsTheTilesOfAVeryLargeOne) {
    const test::TempFolder folder;
    std::filesystem::create_directories(folder / "tiles");
    std::ofstream(folder / "tiles/0_0.glb") << "a tile";
    // Objects and values of 200,000 tiles.
    std::string text = R"({"root": {"children": [)";
    for (int i = 0; i < 1'200'000; ++i) text += "{},";
    text += R"({"content": {"uri": "tiles/0_0.glb"}, "transform": [)";
    for (int i = 0; i < 4'300'000; ++i) text += "0,";
    std::ofstream(folder / "tileset.json") << text + "0]}]}}";
    EXPECT_EQ(io::tile_files(folder / "tileset.json").size(), 1u);
}

TEST(Tileset, LeavesFilesOfOthersAlone) {
    namespace fs = std::filesystem;
    const test::TempFolder folder;
    fs::create_directories(folder / "models");
    std::ofstream(folder / "models/0_0.glb") << "somebody's";
    std::ofstream(folder / "tileset.json")
        << R"({"root": {"content": {"uri": "models/0_0.glb"}, "children": [{"content": {"uri": "../0_0.glb"}}, 7]}})";
    EXPECT_EQ(io::tile_files(folder / "tileset.json").size(), 1u);
    write(folder, test::storable_splats(5, 10, 0), 1);
    EXPECT_TRUE(fs::exists(folder / "models/0_0.glb"));
    std::ofstream(folder / "tileset.json") << "{";
    write(folder, test::storable_splats(5, 10, 0), 1);
    EXPECT_EQ(io::tile_files(folder / "tileset.json").size(), 1u);
}

TEST(Tileset, WithoutSplatsThereIsNone) {
    const test::TempFolder folder;
    test::expect_error<InputError>([&] { io::write_tileset(folder / "tileset.json", {}, {}); },
                                   {"without splats"});
}

}  // namespace
