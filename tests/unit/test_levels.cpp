// SPDX-License-Identifier: Apache-2.0
// Streamed SOG: what is written is read back, level by level, and damaged files are errors of one line.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/text.h"
#include "ewa/error.h"
#include "ewa/splat_files.h"
#include "scene/decimate.h"
#include "support/splat_scenes.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using nlohmann::json;
using test::TempFolder;

/// Splats in a box of 80 units: a tree of several leaves.
Gaussians wide_scene(size_t count) {
    Gaussians g = test::storable_splats(21, count, 0);
    for (float& v : g.means) v *= 8;
    for (float& v : g.log_scales) v = std::fmin(v, -2.f);
    return g;
}

json read_json(const std::filesystem::path& path) {
    return json::parse(std::ifstream(path));
}

/// Calls visit(leaf) for each leaf of a node.
template <class Visit>
void visit_leaves(const json& node, const Visit& visit) {
    if (node.contains("lods")) return visit(node);
    for (const json& child : node["children"]) {
        for (size_t k = 0; k < 3; ++k) {
            EXPECT_LE(node["bound"]["min"][k], child["bound"]["min"][k]);
            EXPECT_GE(node["bound"]["max"][k], child["bound"]["max"][k]);
        }
        visit_leaves(child, visit);
    }
}

TEST(Levels, RoundTrip) {
    const TempFolder folder;
    const Gaussians scene = wide_scene(20'000);
    SaveOptions options;
    options.levels = 3;
    options.antialiased = true;
    save_splats(folder / "lod-meta.json", scene, options);
    const json meta = read_json(folder / "lod-meta.json");
    EXPECT_EQ(meta["version"], 1);
    EXPECT_EQ(meta["counts"], json({20'000, 10'000, 5'000}));
    EXPECT_EQ(meta["count"], 35'000);
    EXPECT_EQ(meta["lodLevels"], 3);
    EXPECT_EQ(meta["filenames"], json({"0_0/meta.json", "1_0/meta.json", "2_0/meta.json"}));
    EXPECT_EQ(read_json(folder / "1_0/meta.json")["count"], 10'000);

    for (const size_t level : {0u, 1u, 2u}) {
        const SplatScene back = read_splat_level(folder / "lod-meta.json", level);
        EXPECT_EQ(back.format, SplatFormat::sog_levels);
        EXPECT_TRUE(back.antialiased);
        EXPECT_EQ(back.gaussians.size(), meta["counts"][level]);
        size_t leaves = 0, next = 0;
        visit_leaves(meta["tree"], [&](const json& leaf) {
            const json& rows = leaf["lods"][std::to_string(level)];
            ++leaves;
            EXPECT_EQ(rows["file"], level);
            EXPECT_EQ(rows["offset"], next);
            for (size_t i = 0; i < rows["count"].get<size_t>(); ++i, ++next)
                for (size_t k = 0; k < 3; ++k) {
                    const double place = back.gaussians.means[3 * next + k];
                    ASSERT_GE(place, leaf["bound"]["min"][k].get<double>() - 0.01);
                    ASSERT_LE(place, leaf["bound"]["max"][k].get<double>() + 0.01);
                }
        });
        EXPECT_EQ(next, back.gaussians.size());
        EXPECT_EQ(leaves, 4u);
    }
    // Level 0 is the scene, in another order.
    const Gaussians finest = load_splats(folder / "lod-meta.json");
    double sum = 0, expected = 0;
    for (size_t i = 0; i < scene.means.size(); ++i) {
        sum += std::abs(finest.means[i]);
        expected += std::abs(scene.means[i]);
    }
    EXPECT_NEAR(sum, expected, 1e-4 * expected);
    EXPECT_NE(read_splats(folder / "lod-meta.json").variant.find("level 0 of 3 with 20000, 10000, 5000"),
              std::string::npos);
}

/// The error of a level is that of its merges, as a part of the light of the leaf.
TEST(Levels, ErrorsOfLeaves) {
    const TempFolder folder;
    Gaussians scene = wide_scene(20'000);
    // Pairs of one shape. On one side of the scene they are at one place too, so that merging them changes nothing.
    for (size_t i = 0; i < scene.size(); i += 2) {
        const bool same = i < scene.size() / 2;
        for (size_t k = 0; k < 3; ++k) {
            scene.means[3 * i + k] = (same ? -1.f : 1.f) * (std::abs(scene.means[3 * i + k]) + 1);
            scene.means[3 * (i + 1) + k] = scene.means[3 * i + k] + (same ? 0.f : 0.1f);
            scene.log_scales[3 * (i + 1) + k] = scene.log_scales[3 * i + k] = -2;
        }
        for (size_t k = 0; k < 4; ++k) scene.quaternions[4 * (i + 1) + k] = scene.quaternions[4 * i + k];
        scene.opacity_logits[i] = scene.opacity_logits[i + 1] = 0;
    }
    SaveOptions options;
    options.levels = 3;
    save_splats(folder / "lod-meta.json", scene, options);
    const json meta = read_json(folder / "lod-meta.json");
    EXPECT_EQ(meta["lodErrors"], true);
    const Gaussians finest = load_splats(folder / "lod-meta.json");
    std::vector<double> low, high;
    double sum = 0;
    visit_leaves(meta["tree"], [&](const json& leaf) {
        const size_t first = leaf["lods"]["0"]["offset"], count = leaf["lods"]["0"]["count"];
        double light = 0;
        for (size_t i = first; i < first + count; ++i) light += scene::squared_light(finest, i);
        sum += light * leaf["errors"][2].get<double>();
        ASSERT_EQ(leaf["errors"].size(), 3u);
        EXPECT_EQ(leaf["errors"][0], 0);
        EXPECT_LE(leaf["errors"][1], leaf["errors"][2]);
        (leaf["bound"]["min"][0] < 0 ? low : high).push_back(leaf["errors"][1]);
    });
    ASSERT_FALSE(low.empty() || high.empty());
    EXPECT_LT(*std::ranges::max_element(low), 0.5 * *std::ranges::min_element(high));
    // The errors are those of all merges.
    std::vector<float> errors;
    Gaussians left = scene;
    scene::decimate_traced(left, 10'000, errors);
    scene::decimate_traced(left, 5'000, errors);
    double expected = 0;
    for (const float error : errors) expected += error;
    EXPECT_NEAR(sum, expected, 0.02 * expected);
    options.levels = 1;
    save_splats(folder / "lod-meta.json", scene, options);
    EXPECT_FALSE(read_json(folder / "lod-meta.json").contains("lodErrors"));
}

TEST(Levels, TheSameBytesTwice) {
    const TempFolder folder;
    SaveOptions options;
    options.levels = 2;
    for (const char* name : {"a", "b"}) {
        std::filesystem::create_directory(folder / name);
        save_levels(folder / name / "lod-meta.json", wide_scene(3000), options);
    }
    for (const char* file : {"lod-meta.json", "1_0/meta.json", "1_0/means_l.webp", "0_0/quats.webp"})
        EXPECT_EQ(test::file_bytes(folder / "a" / file), test::file_bytes(folder / "b" / file)) << file;
}

TEST(Levels, AnEarlierOneIsReplacedAtOnce) {
    namespace fs = std::filesystem;
    const TempFolder folder;
    SaveOptions options;
    options.levels = 2;
    fs::create_directory(folder / "0_0");
    folder.write("0_0/meta.json", "somebody's");
    folder.write("0_0/quats.webp", "somebody's");
    const auto save = [&](size_t splats) {
        save_splats(folder / "lod-meta.json", wide_scene(splats), options);
        EXPECT_EQ(load_splats(folder / "lod-meta.json").size(), splats);
        for (const char* name : {"0_0/meta.json", "0_0/quats.webp"})
            EXPECT_EQ(test::file_bytes(folder / name), "somebody's") << name;
    };
    const auto names = [&] { return read_json(folder / "lod-meta.json")["filenames"]; };
    save(300);
    EXPECT_EQ(names(), json({"0_0-2/meta.json", "1_0/meta.json"}));
    save(200);
    EXPECT_EQ(names(), json({"0_0-3/meta.json", "1_0-2/meta.json"}));
    save(100);
    EXPECT_EQ(names(), json({"0_0-2/meta.json", "1_0/meta.json"}));
    EXPECT_EQ(test::files_in(folder.path()), 4u);
    // The chunks of another program's file, and a chunk that somebody has replaced.
    folder.write("1_0/meta.json", "somebody's");
    save(100);
    EXPECT_EQ(test::file_bytes(folder / "1_0/meta.json"), "somebody's");
    EXPECT_FALSE(fs::exists(folder / "0_0-2"));
    json other = read_json(folder / "lod-meta.json");
    const std::string chunk = other["filenames"][0];
    other["asset"]["generator"] = "another program";
    folder.write("lod-meta.json", other.dump());
    save(100);
    EXPECT_EQ(read_json(folder / chunk)["count"], 100);
}

TEST(Levels, WhatAKilledOrFailedWritingLeftIsRemoved) {
    namespace fs = std::filesystem;
    const TempFolder folder;
    for (const char* name : {"0_0", "1_0"}) {
        fs::create_directory(folder / name);
        folder.write(std::string(name) + "/means_l.webp", "left");
        folder.write(std::string(name) + "/.ewa-unfinished", "0_0\n");
    }
    fs::create_directory(folder / "lod-meta.json");
    EXPECT_THROW(save_splats(folder / "lod-meta.json", wide_scene(100)), RunError);
    EXPECT_EQ(test::files_in(folder.path()), 3u);
    fs::remove(folder / "lod-meta.json");
    save_splats(folder / "lod-meta.json", wide_scene(100));
    EXPECT_EQ(test::files_in(folder.path()), 2u);
    EXPECT_EQ(load_splats(folder / "lod-meta.json").size(), 100u);
}

TEST(Levels, SmallScenesHaveOneLevel) {
    const TempFolder folder;
    save_splats(folder / "lod-meta.json", wide_scene(100));
    EXPECT_EQ(read_json(folder / "lod-meta.json")["counts"], json({100}));
    Gaussians none;
    test::expect_error<InputError>([&] { save_splats(folder / "lod-meta.json", none); }, {"without splats"});
}

TEST(Levels, DamagedFilesAreErrorsOfOneLine) {
    const TempFolder folder;
    SaveOptions options;
    options.levels = 2;
    const auto path = folder / "lod-meta.json";
    save_splats(path, wide_scene(300), options);
    const json whole = read_json(path);
    const auto refuse = [&](const char* text, const auto& damage) {
        json meta = whole;
        damage(meta);
        std::ofstream(path) << meta;
        try {
            read_splats(path);
            FAIL() << text;
        } catch (const InputError& error) {
            const std::string what = error.what();
            EXPECT_NE(what.find(text), std::string::npos) << what;
            EXPECT_EQ(what, core::one_line(what));
        }
    };
    const auto lods = [](json& m) -> json& { return m["tree"]["lods"]["0"]; };
    refuse("unknown", [](json& m) { m["version"] = 2; });
    refuse("\"lodLevels\" is missing; it is damaged", [](json& m) { m.erase("lodLevels"); });
    refuse("whole number of 1 to 32", [](json& m) { m["lodLevels"] = 0; });
    refuse("whole number of 1 to 32", [](json& m) { m["lodLevels"] = 1000; });
    refuse("\"filenames\" is missing", [](json& m) { m.erase("filenames"); });
    refuse("\"tree\" is missing", [](json& m) { m.erase("tree"); });
    refuse("not a list", [](json& m) { m["filenames"] = "0_0/meta.json"; });
    refuse("not in its folder", [](json& m) { m["filenames"][0] = "../0_0/meta.json"; });
    refuse("not in its folder", [](json& m) { m["filenames"][0] = "/etc/passwd"; });
    refuse("not in its folder", [](json& m) { m["filenames"][0] = 5; });
    refuse("twice", [](json& m) { m["filenames"][1] = "./0_0/meta.json"; });
    refuse("0_7", [](json& m) { m["filenames"][0] = "0_7/meta.json"; });
    refuse("rows of file 9", [&](json& m) { lods(m)["file"] = 9; });
    refuse("has 300", [&](json& m) { lods(m)["offset"] = 1; });
    refuse("has 300", [&](json& m) { lods(m)["count"] = 301; });
    refuse("\"count\" is not a whole", [&](json& m) { lods(m)["count"] = -1; });
    refuse("\"offset\" is not a whole", [&](json& m) { lods(m)["offset"] = 1e300; });
    refuse("\"lods\": \"0\": \"file\" is missing", [&](json& m) { lods(m).erase("file"); });
    refuse("\"tree\" is not a JSON object", [](json& m) { m["tree"] = 3; });
    refuse("a node of \"tree\": is not a JSON object", [](json& m) { m["tree"]["children"] = json({1}); });
    refuse("not a list", [](json& m) { m["tree"]["children"] = 1; });
    refuse("the level \"5\"", [&](json& m) { m["tree"]["lods"]["5"] = lods(m); });
    refuse("the same rows", [&](json& m) { m["tree"]["children"] = json({m["tree"]}); });
    std::ofstream(path) << "[]";
    test::expect_error<InputError>([&] { read_splats(path); }, {"not a JSON object"});
    std::ofstream(path) << whole;
    test::expect_error<InputError>([&] { read_splat_level(path, 2); }, {"the last is 1"});
    save_splats(folder / "s.ply", wide_scene(3));
    test::expect_error<InputError>([&] { read_splat_level(folder / "s.ply", 1); }, {"has no levels"});
}

}  // namespace
