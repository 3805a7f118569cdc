// SPDX-License-Identifier: Apache-2.0
// SOG: what its bytes mean, how near a scene comes back, and what is refused. The archives and images of the
// tests that read are made here, not by ewa's writer.
#include <webp/decode.h>
#include <webp/encode.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "ewa/splat_edit.h"
#include "ewa/splat_files.h"
#include "io/splats/clusters.h"
#include "support/splat_scenes.h"
#include "support/temp_folder.h"
#include "support/zip_bytes.h"

namespace {

using namespace ewa;
using nlohmann::json;
using test::bytes_of;
using test::expect_error;
using test::TempFolder;
using test::ZipEntry;

using Files = std::map<std::string, std::string>;

/// A WebP of pixels that are not transparent.
std::string webp(int width, int height, const std::vector<uint8_t>& rgba, bool lossless = true) {
    EXPECT_EQ(rgba.size(), size_t(4 * width * height));
    uint8_t* bytes = nullptr;
    const size_t size = lossless ? WebPEncodeLosslessRGBA(rgba.data(), width, height, 4 * width, &bytes)
                                 : WebPEncodeRGBA(rgba.data(), width, height, 4 * width, 90, &bytes);
    std::string text(reinterpret_cast<const char*>(bytes), size);
    WebPFree(bytes);
    return text;
}

/// 4×1 pixels, of which two are splats.
std::string two_pixels(const std::array<uint8_t, 4>& a, const std::array<uint8_t, 4>& b) {
    std::vector<uint8_t> rgba(16, 255);
    std::copy(a.begin(), a.end(), rgba.begin());
    std::copy(b.begin(), b.end(), rgba.begin() + 4);
    return webp(4, 1, rgba);
}

std::string zipped(const Files& files, uint16_t method = 0) {
    std::vector<ZipEntry> entries;
    for (const auto& [name, content] : files) entries.push_back({name, content, method});
    return test::zipped(entries);
}

/// 256 values in a table: `first`, then zeros.
json table(std::vector<double> first) {
    first.resize(256);
    return first;
}

/// Two splats of SH degree 1, version 2.
Files two_splats() {
    const json meta = {
        {"version", 2},
        {"count", 2},
        {"antialias", true},
        {"asset", {{"generator", "a test"}}},
        {"means", {{"mins", {-2, 0, 0}}, {"maxs", {2, 1, 0}}, {"files", {"l.webp", "u.webp"}}}},
        {"scales", {{"codebook", table({-4, -3, -2})}, {"files", {"scales.webp"}}}},
        {"quats", {{"files", {"quats.webp"}}}},
        {"sh0", {{"codebook", table({0.5, -0.5, 1.25})}, {"files", {"sh0.webp"}}}},
        {"shN",
         {{"count", 2},
          {"bands", 1},
          {"codebook", table({0, 0.1, 0.2})},
          {"files", {"c.webp", "labels.webp"}}}}};
    std::vector<uint8_t> palette(size_t(4 * 64 * 3), 255);
    for (int k = 0; k < 3; ++k) {
        // Row 0: red 0.1 in each coefficient. Row 1: blue 0.2 in coefficient k = 2.
        palette[size_t(4 * k)] = 1;
        palette[size_t(4 * k + 1)] = palette[size_t(4 * k + 2)] = 0;
        palette[size_t(12 + 4 * k)] = palette[size_t(12 + 4 * k + 1)] = 0;
        palette[size_t(12 + 4 * k + 2)] = k == 2 ? 2 : 0;
    }
    return {{"meta.json", meta.dump()},
            {"l.webp", two_pixels({0, 255, 0, 255}, {255, 0, 9, 255})},
            {"u.webp", two_pixels({0, 255, 0, 255}, {255, 0, 9, 255})},
            {"scales.webp", two_pixels({0, 1, 2, 255}, {2, 2, 2, 255})},
            // The largest is w, x y z are 0.5 / sqrt(2) ...; the largest is y.
            {"quats.webp", two_pixels({255, 128, 128, 252}, {0, 255, 128, 254})},
            {"sh0.webp", two_pixels({0, 1, 2, 51}, {2, 2, 2, 255})},
            {"c.webp", webp(192, 1, palette)},
            {"labels.webp", two_pixels({0, 0, 0, 255}, {1, 0, 0, 255})}};
}

void expect_two_splats(const SplatScene& scene) {
    const Gaussians& g = scene.gaussians;
    ASSERT_EQ(g.size(), 2u);
    ASSERT_EQ(g.sh_degree, 1);
    EXPECT_TRUE(scene.antialiased);
    EXPECT_TRUE(scene.remarks.empty()) << scene.remarks[0];
    const double far = std::exp(2.0) - 1;
    const double means[] = {-far, std::exp(1.0) - 1, 0, far, 0, 0};
    for (size_t i = 0; i < 6; ++i) EXPECT_NEAR(g.means[i], means[i], 1e-6) << i;
    EXPECT_EQ(g.log_scales, (std::vector<float>{-4, -3, -2, -2, -2, -2}));
    const double half = std::sqrt(0.5), middle = (128 / 255.0 - 0.5) * std::sqrt(2.0);
    const double w = std::sqrt(1 - half * half - 2 * middle * middle);
    const double y = std::sqrt(1 - 2 * half * half - middle * middle + 1e-300);
    const double quaternions[] = {w, half, middle, middle, -half, half, std::isfinite(y) ? y : 0, middle};
    for (size_t i = 0; i < 8; ++i) EXPECT_NEAR(g.quaternions[i], quaternions[i], 1e-6) << i;
    EXPECT_NEAR(g.opacity_logits[0], std::log(0.2 / 0.8), 1e-5);
    EXPECT_GT(g.opacity_logits[1], 6);
    const float red = 0.1f, blue = 0.2f;
    EXPECT_EQ(g.sh, (std::vector<float>{0.5f,  -0.5f, 1.25f, red, 0, 0, red, 0, 0, red, 0, 0,
                                        1.25f, 1.25f, 1.25f, 0,   0, 0, 0,   0, 0, 0,   0, blue}));
}

TEST(Sog, PixelsAsLaidOut) {
    TempFolder folder;
    for (const uint16_t method : {uint16_t(0), uint16_t(8)}) {
        const SplatScene scene = read_splats(folder.write("a.sog", zipped(two_splats(), method)));
        EXPECT_EQ(scene.format, SplatFormat::sog);
        EXPECT_EQ(scene.variant, "version 2");
        expect_two_splats(scene);
    }
    for (const auto& [name, content] : two_splats()) folder.write("unpacked/" + name, content);
    const SplatScene scene = read_splats(folder / "unpacked/meta.json");
    EXPECT_EQ(scene.format, SplatFormat::sog_meta);
    EXPECT_EQ(scene.variant, "version 2, unpacked");
    expect_two_splats(scene);
}

TEST(Sog, VersionOneHasRangesInsteadOfTables) {
    TempFolder folder;
    Files files = two_splats();
    json meta = json::parse(files["meta.json"]);
    meta.erase("version");
    meta.erase("count");
    meta["means"]["shape"] = {2, 3};
    meta["scales"] = {{"mins", {-5, -5, -5}}, {"maxs", {250, -5, 505}}, {"files", {"scales.webp"}}};
    meta["sh0"] = {{"mins", {0, 0, 0, -5.1}}, {"maxs", {255, 255, 510, 0}}, {"files", {"sh0.webp"}}};
    meta["shN"] = {{"mins", -1}, {"maxs", 254}, {"quantization", 8}, {"files", {"c.webp", "labels.webp"}}};
    files["meta.json"] = meta.dump();
    const SplatScene scene = read_splats(folder.write("a.sog", zipped(files)));
    EXPECT_EQ(scene.variant, "version 1");
    const Gaussians& g = scene.gaussians;
    ASSERT_EQ(g.size(), 2u);
    EXPECT_EQ(g.log_scales, (std::vector<float>{-5, -5, -1, -3, -5, -1}));
    EXPECT_EQ(g.sh[0], 0);
    EXPECT_EQ(g.sh[1], 1);
    EXPECT_EQ(g.sh[2], 4);
    EXPECT_NEAR(g.opacity_logits[0], -5.1 + 5.1 * 51 / 255, 1e-6);
    EXPECT_EQ(g.opacity_logits[1], 0);
    EXPECT_EQ(g.sh[3], 0);   // -1 + 1
    EXPECT_EQ(g.sh[23], 1);  // -1 + 2
}

TEST(Sog, IsKnownByItsContent) {
    TempFolder folder;
    folder.write("b.ply", zipped(two_splats()));
    EXPECT_EQ(format_of_file(folder / "b.ply"), SplatFormat::sog);
    for (const auto& [name, content] : two_splats()) folder.write(name, content);
    std::filesystem::copy_file(folder / "meta.json", folder / "other.gltf");
    EXPECT_EQ(format_of_file(folder / "other.gltf"), SplatFormat::sog_meta);
    EXPECT_EQ(load_splats(folder / "other.gltf").size(), 2u);
    EXPECT_EQ(format_of_name("some/META.JSON"), SplatFormat::sog_meta);
    expect_error<InputError>([&] { format_of_name("some/xmeta.json"); }, {"supported: .ply"});
    EXPECT_EQ(format_of_file(folder.write("x.gltf", R"({"asset": {"version": "2.0"}})")), SplatFormat::gltf);
}

/// The scene in the order in which it is written.
Gaussians in_order(Gaussians g) {
    select_splats(g, morton_order(g));
    return g;
}

/// The largest distance of a value from the nearest of a table, which may not be exceeded.
double distance(const json& codebook, double value) {
    double least = INFINITY;
    for (const double code : codebook) least = std::min(least, std::abs(code - value));
    return least;
}

TEST(Sog, EachValueIsTheNearestThatTheFormatHas) {
    TempFolder folder;
    for (int degree = 0; degree <= 3; ++degree) {
        SCOPED_TRACE(degree);
        Gaussians g = test::storable_splats(uint64_t(degree) + 3, 3000, degree);
        g.means[0] = 4000;  // the logarithm keeps the others exact
        g.opacity_logits[1] = -20;
        g = in_order(g);
        const std::string name = "a" + std::to_string(degree);
        std::filesystem::create_directory(folder / name);
        save_splats(folder / name / "meta.json", g, SaveOptions{.antialiased = degree == 2});
        const SplatScene scene = read_splats(folder / name / "meta.json");
        const Gaussians& back = scene.gaussians;
        const json meta = json::parse(test::file_bytes(folder / name / "meta.json"));
        ASSERT_EQ(back.size(), g.size());
        ASSERT_EQ(back.sh_degree, degree);
        EXPECT_EQ(scene.antialiased, degree == 2);
        const test::Largest d = test::largest_differences(g, back);
        // Half a step of 1/255 in sqrt(2); the one left out adds up to all three of them.
        EXPECT_LE(d.rotation, 3.1 * 0.5 * std::sqrt(2.0) / 255);
        EXPECT_LE(d.opacity, 1.001 / 510);
        for (size_t i = 0; i < g.means.size(); ++i) {
            const double low = meta["means"]["mins"][i % 3], high = meta["means"]["maxs"][i % 3];
            const double step = (high - low) / 65535, v = std::abs(double(g.means[i]));
            // A step of the logarithm at the outer end of the half step, and float32's rounding.
            EXPECT_LE(std::abs(back.means[i] - g.means[i]), (1 + v) * std::expm1(step * 0.5001) + 2e-7 * v)
                << i;
        }
        const auto near = [](const json& codebook, float stored, float value) {
            return std::abs(double(stored) - double(value)) <= distance(codebook, value) + 1e-6;
        };
        for (size_t i = 0; i < g.log_scales.size(); ++i)
            ASSERT_TRUE(near(meta["scales"]["codebook"], back.log_scales[i], g.log_scales[i])) << i;
        for (size_t i = 0; i < g.sh.size(); ++i) {
            const json& codebook = meta[i % g.sh_stride() < 3 ? "sh0" : "shN"]["codebook"];
            ASSERT_TRUE(near(codebook, back.sh[i], g.sh[i])) << i;
        }
        // 256 values in a range of 3 or 9 leave gaps of about a 256th of it.
        EXPECT_LE(d.color, 1.0 * 3 / 256);
        EXPECT_LE(d.scale, 1.0 * 9 / 256);
        EXPECT_LE(d.sh, 1.0 * 1.8 / 256);
    }
}

TEST(Sog, SameBytesAndQuantisedOnce) {
    TempFolder folder;
    const Gaussians g = test::storable_splats(9, 5000, 3);
    save_splats(folder / "a.sog", g);
    save_splats(folder / "b.sog", g);
    EXPECT_EQ(test::file_bytes(folder / "a.sog"), test::file_bytes(folder / "b.sog"));
    const Gaussians once = load_splats(folder / "a.sog");
    save_splats(folder / "c.sog", once);
    const Gaussians twice = load_splats(folder / "c.sog");
    const test::Largest d = test::largest_differences(in_order(once), twice);
    EXPECT_LE(d.mean, 2e-6);
    EXPECT_LE(d.scale + d.opacity + d.color + d.sh, 1e-6);
    EXPECT_LE(d.rotation, 0.01);  // another component may be the largest, after rounding
    // The colour of a splat without opacity stays.
    Gaussians clear = test::storable_splats(2, 40, 0);
    std::fill(clear.opacity_logits.begin(), clear.opacity_logits.end(), -30.0f);
    save_splats(folder / "d.sog", clear);
    EXPECT_LE(test::largest_differences(in_order(clear), load_splats(folder / "d.sog")).color, 1e-6);
}

TEST(Sog, LargeAndEmptyScenes) {
    TempFolder folder;
    Gaussians none;
    none.sh_degree = 2;
    save_splats(folder / "none.sog", none);
    EXPECT_EQ(load_splats(folder / "none.sog").size(), 0u);
    // More splats than a palette has rows, in 500 groups of one colour each.
    Gaussians g = test::storable_splats(5, 70000, 1);
    const Gaussians groups = test::storable_splats(6, 500, 1);
    for (size_t i = 0; i < g.size(); ++i) std::copy_n(&groups.sh[12 * (i % 500) + 3], 9, &g.sh[12 * i + 3]);
    const std::vector<std::string> remarks = save_splats(folder / "a.sog", g, SaveOptions{});
    EXPECT_NE(remarks.back().find("sets of them stand for"), std::string::npos) << remarks.back();
    EXPECT_LE(test::largest_differences(in_order(g), load_splats(folder / "a.sog")).sh, 1.8 / 256);
}

TEST(Sog, RefusesWithTheReason) {
    TempFolder folder;
    const auto refuse = [&](const Files& files, std::initializer_list<std::string> parts) {
        expect_error<InputError>([&] { load_splats(folder.write("a.sog", zipped(files))); }, parts);
    };
    const auto changed = [](const auto& change) {
        Files files = two_splats();
        json meta = json::parse(files["meta.json"]);
        change(meta);
        files["meta.json"] = meta.dump();
        return files;
    };
    const auto with = [](const std::string& name, const std::string& content) {
        Files files = two_splats();
        files[name] = content;
        return files;
    };
    refuse({}, {"a.sog", "not a zip archive"});
    refuse({{"x", "y"}}, {"a.sog: an archive without splats"});
    refuse(with("meta.json", "{"), {"a.sog", "byte", "ends too early"});
    refuse(with("meta.json", "[]"), {"the JSON is not an object"});
    refuse(changed([](json& meta) { meta["version"] = 3; }), {"SOG version 3"});
    refuse(changed([](json& meta) { meta["count"] = -1; }), {"\"count\" is not a whole number"});
    refuse(changed([](json& meta) { meta["count"] = 200000000; }), {"claims 200000000 splats"});
    refuse(changed([](json& meta) { meta["count"] = 5; }), {"l.webp", "4×1 pixels", "5 splats"});
    refuse(changed([](json& meta) { meta.erase("quats"); }), {"\"quats\" is missing; it is damaged"});
    refuse(changed([](json& meta) {
               meta["means"]["mins"] = {0, 0};
           }),
           {"\"means\": \"mins\" is not a list of 3 finite numbers"});
    refuse(changed([](json& meta) { meta["means"]["mins"] = {0, 0, nullptr}; }), {"\"means\": \"mins\""});
    refuse(changed([](json& meta) { meta["sh0"]["codebook"] = json::array(); }),
           {"\"sh0\": \"codebook\" is not a list of 1 to 256 finite numbers"});
    refuse(changed([](json& meta) { meta["sh0"]["files"] = "a"; }), {"\"sh0\": \"files\" is not a list"});
    refuse(changed([](json& meta) { meta["shN"]["bands"] = 2; }), {"c.webp", "192×1"});
    refuse(changed([](json& meta) { meta["shN"]["count"] = 1; }),
           {"splat 1", "row 1", "\"shN\", which has 1"});
    refuse(changed([](json& meta) { meta["sh0"]["files"][0] = "../sh0.webp"; }),
           {"\"../sh0.webp\" is not in"});
    refuse(changed([](json& meta) { meta["sh0"]["files"][0] = "none.webp"; }),
           {"\"none.webp\" is not in the archive"});
    refuse(with("sh0.webp", "no image"), {"\"sh0.webp\": not a WebP"});
    refuse(with("sh0.webp", webp(2, 2, std::vector<uint8_t>(16, 255))), {"sh0.webp", "2×2", "4×1"});
    refuse(with("sh0.webp", two_splats()["sh0.webp"].substr(0, 40)), {"sh0.webp", "damaged or truncated"});
    EXPECT_EQ(
        read_splats(
            folder.write("a.sog", zipped(with("sh0.webp", webp(4, 1, std::vector<uint8_t>(16, 255), false)))))
            .remarks.size(),
        1u);
    const SplatScene turned = read_splats(
        folder.write("a.sog", zipped(with("quats.webp", two_pixels({1, 2, 3, 251}, {128, 128, 128, 255})))));
    ASSERT_EQ(turned.remarks.size(), 1u);
    EXPECT_NE(turned.remarks[0].find("1 rotations"), std::string::npos);
    EXPECT_EQ(turned.gaussians.quaternions[0], 1);
}

TEST(Sog, RefusesHostileArchives) {
    TempFolder folder;
    const auto refuse = [&](const ZipEntry& entry, std::initializer_list<std::string> parts) {
        std::vector<ZipEntry> entries;
        for (const auto& [name, content] : two_splats())
            if (name != entry.name) entries.push_back({name, content});
        entries.push_back(entry);
        expect_error<InputError>([&] { load_splats(folder.write("a.sog", test::zipped(entries))); }, parts);
    };
    const std::string meta = two_splats()["meta.json"], image = two_splats()["sh0.webp"];
    refuse({.name = "meta.json", .content = meta, .flags = 1}, {"\"meta.json\" is encrypted"});
    refuse({.name = "meta.json", .content = meta, .method = 12}, {"\"meta.json\" is packed with method 12"});
    refuse({.name = "meta.json", .content = meta, .sum = 1}, {"\"meta.json\" is damaged or cut off"});
    refuse({.name = "sh0.webp", .content = image, .claimed = 4000000000u},
           {"a.sog: claims to unpack from", "4 GB"});
    // Zeros that pack a thousand times.
    refuse({.name = "sh0.webp", .content = image + std::string(100 << 20, '\0'), .method = 8},
           {"a.sog: claims to unpack"});
    refuse({.name = "meta.json", .content = meta + std::string(2 << 20, ' ')}, {"\"meta.json\"", "1048576"});
    // An image of a gigabyte in a few hundred bytes.
    refuse({.name = "l.webp", .content = webp(16000, 2000, std::vector<uint8_t>(128000000, 255))},
           {"l.webp", "16000×2000", "2 splats"});
}

TEST(Sog, NamesStayInTheFolder) {
    TempFolder folder;
    const auto unpack = [&](const std::string& name) {
        Files files = two_splats();
        json meta = json::parse(files["meta.json"]);
        meta["sh0"]["files"][0] = name;
        files["meta.json"] = meta.dump();
        for (const auto& [file, content] : files) folder.write("in/" + file, content);
        return folder / "in/meta.json";
    };
    const std::filesystem::path outside = folder.write("outside.webp", two_splats()["sh0.webp"]);
    for (const std::string& name : {std::string("../outside.webp"), outside.string(), std::string(".."),
                                    std::string(), std::string("a/../../b")})
        expect_error<InputError>([&] { load_splats(unpack(name)); }, {"meta.json", "is not in its folder"});
    std::filesystem::create_symlink(folder / "outside.webp", folder / "in/link.webp");
    expect_error<InputError>([&] { load_splats(unpack("link.webp")); },
                             {"\"link.webp\"", "is not in its folder"});
    expect_error<InputError>([&] { load_splats(unpack("none.webp")); },
                             {"meta.json", "\"none.webp\" is missing"});
    EXPECT_EQ(load_splats(unpack("./sh0.webp")).size(), 2u);
}

TEST(Sog, LeavesImagesOfOthersAlone) {
    TempFolder folder;
    const Gaussians g = test::storable_splats(1, 40, 0);
    folder.write("quats.webp", "somebody's");
    folder.write("sh0-3.webp", "somebody's");
    folder.write("meta.json", "{}");
    const auto save = [&] {
        save_splats(folder / "meta.json", g);
        EXPECT_EQ(load_splats(folder / "meta.json").size(), 40u);
        for (const char* other : {"quats.webp", "sh0-3.webp"})
            EXPECT_EQ(test::file_bytes(folder / other), "somebody's");
        EXPECT_EQ(test::files_in(folder.path()), 8u);
    };
    for (int again = 0; again < 3; ++again) save();  // its own it replaces
    EXPECT_TRUE(std::filesystem::exists(folder / "quats-2.webp"));
    // Images that another meta.json names too.
    std::filesystem::copy_file(folder / "meta.json", folder / "other.json");
    save_splats(folder / "meta.json", g);
    EXPECT_EQ(load_splats(folder / "other.json").size(), 40u);
}

/// PlayCanvas' specification has "antialias", splat-transform writes "model".
TEST(Sog, TheMarkOfAntialiasing) {
    TempFolder folder;
    const std::pair<const char*, bool> cases[] = {{"{}", false},
                                                  {R"({"antialias": true})", true},
                                                  {R"({"model": "antialiased"})", true},
                                                  {R"({"antialias": false, "model": "antialiased"})", true},
                                                  {R"({"antialias": true, "model": "default"})", false},
                                                  {R"({"antialias": true, "model": "new"})", true},
                                                  {R"({"antialias": 1, "model": 2})", false}};
    Files files = two_splats();
    json meta = json::parse(files["meta.json"]);
    meta.erase("antialias");
    for (const auto& [marks, antialiased] : cases) {
        json marked = meta;
        marked.update(json::parse(marks));
        files["meta.json"] = marked.dump();
        const SplatScene scene = read_splats(folder.write("a.sog", zipped(files, 0)));
        EXPECT_EQ(scene.antialiased, antialiased) << marks;
        EXPECT_TRUE(scene.remarks.empty()) << marks;
    }
    meta["model"] = "2dgs";
    files["meta.json"] = meta.dump();
    const SplatScene flat = read_splats(folder.write("a.sog", zipped(files, 0)));
    ASSERT_EQ(flat.remarks.size(), 1u);
    EXPECT_NE(flat.remarks[0].find("2DGS"), std::string::npos);
    for (const bool antialiased : {false, true}) {
        save_splats(folder / "meta.json", flat.gaussians, SaveOptions{.antialiased = antialiased});
        const json written = json::parse(test::file_bytes(folder / "meta.json"));
        EXPECT_EQ(written["antialias"], antialiased);
        EXPECT_EQ(written.contains("model"), antialiased) << "as splat-transform, which marks nothing else";
        EXPECT_EQ(written.value("model", ""), antialiased ? "antialiased" : "");
    }
}

TEST(Clusters, ACodebookIsNear) {
    test::Random random(3);
    std::vector<float> values(100000);
    for (float& v : values) v = float(random.normal());
    values[0] = 1000;  // one far value takes one code
    const auto codes = io::make_codebook(values);
    EXPECT_TRUE(std::is_sorted(codes.begin(), codes.end()));
    double error = 0, worst = 0;
    for (const float v : values) {
        const double e = std::abs(double(v) - codes[io::nearest(codes, v)]);
        for (const float code : codes) ASSERT_LE(e, std::abs(double(v) - code));
        error += e * e / double(values.size());
        worst = std::max(worst, e);
    }
    // The best of 256 codes for normal values have about 2.7 / 256^2 (Panter and Dite).
    EXPECT_LT(error, 1.3 * 2.72 / (256 * 256));
    EXPECT_LT(worst, 1);
    std::vector<float> few = {3, 1, 2, 1};
    const auto exact = io::make_codebook(few);
    for (const float v : few) EXPECT_EQ(exact[io::nearest(exact, v)], v);
}

TEST(Clusters, APaletteIsNear) {
    test::Random random(4);
    constexpr size_t kCount = 20000, kStride = 11, kDimensions = 9;
    std::vector<float> values(kCount * kStride);
    for (float& v : values) v = float(random.uniform(-1, 1));
    for (size_t i = 0; i < kCount; i += 2)
        std::fill_n(&values[i * kStride], kDimensions, 0.5f);  // half are equal
    const io::VectorTable table{values.data(), kCount, kStride, kDimensions};
    const io::Palette palette = io::make_palette(table, 1024);
    const size_t rows = palette.rows.size() / kDimensions;
    EXPECT_LE(rows, 1024u);
    EXPECT_GT(rows, 1000u);
    double error = 0;
    for (size_t i = 0; i < kCount; ++i) {
        ASSERT_LT(palette.labels[i], rows);
        const float* row = &palette.rows[palette.labels[i] * kDimensions];
        for (size_t d = 0; d < kDimensions; ++d) {
            const double e = std::pow(double(table[i][d]) - row[d], 2);
            error += e / kCount;
            ASSERT_TRUE(i % 2 == 1 || e < 1e-4) << i;
        }
    }
    // Half of the vectors fill a cube of variance 9 / 3. 1,024 rows in 9 dimensions leave 1,024^(-2/9) = 0.21 of it.
    EXPECT_LT(error, 1.5 * 0.21 * 3 / 2);
    const io::Palette exact = io::make_palette(table, kCount);
    EXPECT_EQ(exact.labels.size(), kCount);
    for (size_t i = 0; i < kCount; ++i)
        ASSERT_TRUE(std::equal(table[i], table[i] + kDimensions, &exact.rows[exact.labels[i] * kDimensions]));
}

}  // namespace
