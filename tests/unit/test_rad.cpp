// SPDX-License-Identifier: Apache-2.0
// Spark's .rad: what stays when it is written again, its ranges and trees, and damaged files. tests/cli/test_rad.py compares values with
// another reader and writer.
#include <zlib.h>

#include <cmath>
#include <fstream>
#include <glm/common.hpp>
#include <nlohmann/json.hpp>

#include "core/text.h"
#include "ewa/splat_edit.h"
#include "ewa/splat_files.h"
#include "io/splats/rad.h"
#include "support/splat_scenes.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using nlohmann::json;
using test::expect_error;
using test::file_bytes;
using test::TempFolder;

/// The JSON that begins at this byte, after its magic number, and where the next part begins.
std::pair<json, size_t> head_at(const std::string& bytes, size_t at) {
    uint32_t length = 0;
    std::memcpy(&length, &bytes[at + 4], sizeof(length));
    return {json::parse(bytes.substr(at + 8, length)), at + 8 + (length + 7) / 8 * 8};
}

std::string with_head(const char* magic, const json& value) {
    const std::string text = value.dump();
    std::string bytes = magic + test::bytes_of(uint32_t(text.size())) + text;
    bytes.resize((bytes.size() + 7) / 8 * 8, '\0');
    return bytes;
}

TEST(Rad, WrittenAgainIsTheSame) {
    const TempFolder folder;
    for (int degree = 0; degree <= 3; ++degree) {
        Gaussians g = test::storable_splats(uint64_t(degree) + 3, 3000, degree);
        g.sh[g.sh_stride() * 5] = 4;  // a colour far from all others
        if (degree > 0) g.sh[g.sh_stride() * 7 + 3] = -6;
        save_splats(folder / "a.rad", g, SaveOptions{.comments = {"x", "y"}, .antialiased = true});
        const SplatScene back = read_splats(folder / "a.rad");
        EXPECT_TRUE(back.antialiased);
        EXPECT_EQ(back.comments, (std::vector<std::string>{"x", "y"}));
        EXPECT_EQ(back.remarks, std::vector<std::string>());
        save_splats(folder / "b.rad", back.gaussians,
                    SaveOptions{.comments = back.comments, .antialiased = true});
        const Gaussians again = load_splats(folder / "b.rad");
        EXPECT_EQ(again.means, back.gaussians.means);
        EXPECT_EQ(again.log_scales, back.gaussians.log_scales);
        EXPECT_EQ(again.opacity_logits, back.gaussians.opacity_logits);
        EXPECT_LE(test::largest_differences(again, back.gaussians).rotation, 1e-6);
        EXPECT_LE(test::largest_differences(again, back.gaussians).color, 1e-6);
        EXPECT_LE(test::largest_differences(again, back.gaussians).sh, 1e-6);
    }
}

TEST(Rad, SingleValuesFarOutAreClampedAndTheOthersStayFine) {
    const TempFolder folder;
    Gaussians g = test::storable_splats(3, 3000, 1);
    g.sh[g.sh_stride() * 7 + 3] = 100;
    g.sh[g.sh_stride() * 9] = 300;
    std::string text;
    for (const std::string& line : save_splats(folder / "a.rad", g, SaveOptions{})) text += line + "\n";
    EXPECT_NE(text.find("2 colours and SH coefficients are far from all others"), std::string::npos) << text;
    select_splats(g, morton_order(g));
    const Gaussians back = load_splats(folder / "a.rad");
    size_t coarse = 0;
    for (size_t i = 0; i < g.sh.size(); ++i) coarse += std::abs(g.sh[i] - back.sh[i]) > 0.1f;
    EXPECT_EQ(coarse, 2u);
}

TEST(Rad, FlatSplatsStayFlat) {
    const TempFolder folder;
    Gaussians g = test::storable_splats(3, 50, 0);
    for (size_t i = 0; i < g.size(); ++i) g.log_scales[3 * i] = i % 2 ? -70.f : -29.f;
    save_splats(folder / "a.rad", g);
    select_splats(g, morton_order(g));
    const Gaussians back = load_splats(folder / "a.rad");
    for (size_t i = 0; i < g.size(); ++i) {
        EXPECT_LT(back.log_scales[3 * i], g.log_scales[3 * i] < -50 ? -80.f : -19.f);
        for (const size_t k : {1u, 2u})
            EXPECT_NEAR(back.log_scales[3 * i + k], g.log_scales[3 * i + k], 0.045);
    }
}

TEST(Rad, TreesStandForTheScene) {
    const Gaussians g = test::storable_splats(9, 5000, 1);
    const io::RadTree tree = io::build_rad_tree(g, 5);
    ASSERT_EQ(tree.coarser.size(), 5u);
    EXPECT_EQ(tree.coarser[0].size(), 2500u);
    EXPECT_EQ(tree.coarser[3].size(), 313u);
    EXPECT_EQ(tree.coarser[4].size(), 1u);
    const auto place_of = [&](const io::RadNode& node) {
        return (node.level == 0 ? g : tree.coarser[node.level - 1u]).world_mean(node.index);
    };
    std::vector<int> parents(tree.nodes.size());
    std::vector<uint32_t> leaves;
    size_t inner = 0;
    for (size_t i = 0; i < tree.nodes.size(); ++i) {
        const io::RadNode& node = tree.nodes[i];
        EXPECT_EQ(node.child_count == 0, node.level == 0);
        if (node.child_count == 0) leaves.push_back(node.index);
        inner += node.child_count > 0;
        EXPECT_NE(node.child_count, 1) << i;
        glm::dvec3 low(INFINITY), high(-INFINITY);
        for (size_t child = node.child_start; child < size_t(node.child_start) + node.child_count; ++child) {
            ASSERT_GT(child, i);
            ASSERT_LT(child, tree.nodes.size());
            EXPECT_LT(tree.nodes[child].level, node.level);
            ++parents[child];
            low = glm::min(low, place_of(tree.nodes[child]));
            high = glm::max(high, place_of(tree.nodes[child]));
        }
        for (int axis = 0; axis < 3 && node.child_count > 0; ++axis) {
            EXPECT_GE(place_of(node)[axis], low[axis] - 1e-5);
            EXPECT_LE(place_of(node)[axis], high[axis] + 1e-5);
        }
    }
    EXPECT_EQ(parents, [&] {
        std::vector<int> once(tree.nodes.size(), 1);
        once[0] = 0;
        return once;
    }());
    std::ranges::sort(leaves);
    for (size_t i = 0; i < leaves.size(); ++i) ASSERT_EQ(leaves[i], i);
    EXPECT_EQ(leaves.size(), g.size());
    EXPECT_LT(inner, g.size() * 3 / 4);
    EXPECT_EQ(tree.nodes[0].child_count, 313);

    const TempFolder folder;
    for (const char* name : {"a.rad", "b.rad"}) save_splats(folder / name, g, SaveOptions{.levels = 5});
    EXPECT_EQ(file_bytes(folder / "a.rad"), file_bytes(folder / "b.rad"));
    const SplatScene back = read_splats(folder / "a.rad");
    EXPECT_EQ(back.variant, "tree of " + std::to_string(tree.nodes.size()) + " splats");
    Gaussians leaf_order = g, plain = back.gaussians;
    select_splats(leaf_order, morton_order(g));
    select_splats(plain, morton_order(plain));
    EXPECT_EQ(plain.means, leaf_order.means);
    EXPECT_LT(test::largest_differences(plain, leaf_order).opacity, 1.01 / 510);
}

TEST(Rad, SmallTrees) {
    const TempFolder folder;
    for (const size_t count : {1u, 2u, 3u, 10u}) {
        save_splats(folder / "a.rad", test::storable_splats(1, count, 0), SaveOptions{.levels = 32});
        const SplatScene back = read_splats(folder / "a.rad");
        EXPECT_EQ(back.gaussians.size(), count);
        EXPECT_EQ(back.variant.empty(), count == 1) << back.variant;
    }
    // Several chunks, and more splats than one parent may have.
    save_splats(folder / "a.rad", test::storable_splats(1, 70'000, 0), SaveOptions{.levels = 2});
    EXPECT_EQ(load_splats(folder / "a.rad").size(), 70'000u);
    EXPECT_EQ(head_at(file_bytes(folder / "a.rad"), 0).first["chunks"].size(), 2u);
}

/// The opacity of parents may be above 1, that of leaves becomes 1.
TEST(Rad, LeavesThatAreTooOpaqueAreTold) {
    const TempFolder folder;
    save_splats(folder / "a.rad", test::storable_splats(4, 500, 0), SaveOptions{.levels = 3});
    const std::string whole = file_bytes(folder / "a.rad");
    const auto [head, begin] = head_at(whole, 0);
    auto [chunk, payload] = head_at(whole, begin);
    const auto alpha = std::ranges::find(chunk["properties"], json("alpha"),
                                         [](const json& property) { return property["property"]; });
    ASSERT_EQ((*alpha)["encoding"], "r8");
    const double limit = 25.5 / 255 * (*alpha)["max"].get<double>();
    size_t expected = 0;
    for (const float logit : load_splats(folder / "a.rad").opacity_logits)
        expected += 1 / (1 + std::exp(-double(logit))) > limit;
    ASSERT_TRUE(expected > 0 && expected < 500);
    (*alpha)["max"] = 10;
    folder.write("b.rad", whole.substr(0, begin) + with_head("RADC", chunk) + whole.substr(payload));
    EXPECT_EQ(read_splats(folder / "b.rad").remarks,
              std::vector{"the opacity of " + std::to_string(expected) + " splats above 1 becomes 1"});
}

/// The same bytes must not let a file claim more splats each time that a chunk names them.
TEST(Rad, ChunksThatNameOneFileCountItOnce) {
    const TempFolder folder;
    std::ofstream(folder / "big.radc") << std::string(200'000, 'x');
    json head = {{"version", 1},      {"type", "gsplat"}, {"count", 10'000'000},
                 {"chunkSize", 1000}, {"maxSh", 0},       {"chunks", json::array()}};
    std::vector<std::string> names = {"a.rad", "big.radc", "./big.radc"};
    for (int i = 0; i < 100; ++i) {
        names.push_back(std::to_string(i) + ".radc");
        std::filesystem::create_hard_link(folder / "big.radc", folder / names.back());
    }
    for (size_t i = 0; i < 10'000; ++i)
        head["chunks"].push_back({{"offset", 0}, {"filename", names[i % names.size()]}});
    folder.write("a.rad", with_head("RAD0", head));
    expect_error<InputError>([&] { read_splats(folder / "a.rad"); }, {"claims 10000000 splats"});
    // A chunk's own size limits it too.
    std::ofstream(folder / "big.radc") << std::string(20'000'000, 'x');
    for (json& chunk : head["chunks"]) chunk["bytes"] = 9;
    folder.write("a.rad", with_head("RAD0", head));
    expect_error<InputError>([&] { read_splats(folder / "a.rad"); }, {"claims 10000000 splats"});
}

/// Chunks of one splat each, whose properties are all in the same bytes at the end: a deflated table of codes is one of them.
std::string rad_of_shared_bytes(size_t chunks, size_t codes) {
    const std::string zeros(9 * codes, '\0');
    std::string table(zeros.size() / 100 + 100, '\0');
    z_stream stream{};
    EXPECT_EQ(deflateInit2(&stream, 9, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY), Z_OK);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(zeros.data()));
    stream.avail_in = uInt(zeros.size());
    stream.next_out = reinterpret_cast<Bytef*>(table.data());
    stream.avail_out = uInt(table.size());
    EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
    table.resize(stream.total_out);
    deflateEnd(&stream);
    const std::string numbers(16, '\0'), shared = numbers + table;
    constexpr size_t kHead = 1200;  // of each chunk, with its length of the payload
    json head = {{"version", 1}, {"type", "gsplat"},     {"count", chunks},        {"chunkSize", 1},
                 {"maxSh", 1},   {"shCodeCount", codes}, {"chunks", json::array()}};
    std::string bytes;
    for (size_t i = 0; i < chunks; ++i) {
        head["chunks"].push_back({{"offset", i * kHead}, {"bytes", kHead}});
        const size_t at = (chunks - i - 1) * kHead;  // of the shared bytes in the payload
        json properties = json::array();
        const auto add = [&](const char* name, const char* encoding, size_t offset, size_t size) {
            properties.push_back({{"property", name},
                                  {"encoding", encoding},
                                  {"offset", at + offset},
                                  {"bytes", size},
                                  {"max", 1.0},
                                  {"min", 0.0}});
        };
        for (const char* name : {"center", "rgb", "scales", "orientation"}) add(name, "f32", 0, 12);
        add("alpha", "f32", 0, 4);
        add("sh_label", "u16", 0, 2);
        add("sh1_code", "s8", numbers.size(), table.size());
        properties.back()["compression"] = "gz";
        json chunk = {{"version", 1}, {"base", i}, {"count", 1}, {"properties", properties}, {"pad", ""}};
        chunk["pad"] = std::string(kHead - 16 - chunk.dump().size(), 'x');
        bytes += with_head("RADC", chunk) + test::bytes_of(uint64_t(at + shared.size()));
        EXPECT_EQ(bytes.size(), (i + 1) * kHead);
    }
    return with_head("RAD0", head) + bytes + shared;
}

TEST(Rad, ChunksThatShareBytesDoNotUnpackToAnySize) {
    const TempFolder folder;
    EXPECT_EQ(load_splats(folder.write("a.rad", rad_of_shared_bytes(20, 1000))).size(), 20u);
    expect_error<InputError>([&] { load_splats(folder.write("b.rad", rad_of_shared_bytes(3000, 100'000))); },
                             {"b.rad", "sh1_code", "all properties together unpack to more than 64 times"});
}

TEST(Rad, OneHugeSplatLeavesTheOthersTheirSteps) {
    const TempFolder folder;
    Gaussians g = test::storable_splats(3, 500, 0);
    for (size_t k = 0; k < 3; ++k) g.log_scales[3 * 7 + k] = 25;
    save_splats(folder / "a.rad", g);
    select_splats(g, morton_order(g));
    const Gaussians back = load_splats(folder / "a.rad");
    for (size_t i = 0; i < g.log_scales.size(); ++i)
        if (g.log_scales[i] < 20) {
            EXPECT_NEAR(back.log_scales[i], g.log_scales[i], 0.05);
        }
}

TEST(Rad, DamagedFilesAreErrorsOfOneLine) {
    const TempFolder folder;
    const auto path = folder / "a.rad";
    save_splats(path, test::storable_splats(1, 300, 1));
    const std::string whole = file_bytes(path);
    const std::pair<json, size_t> file_head = head_at(whole, 0),
                                  chunk_head = head_at(whole, file_head.second);
    const json &head = file_head.first, &chunk = chunk_head.first;
    const size_t begin = file_head.second, payload = chunk_head.second;
    using Parts = std::initializer_list<std::string>;
    const auto refuse = [&](const std::string& bytes, Parts parts) {
        folder.write("a.rad", bytes);
        expect_error<InputError>([&] { read_splats(path); }, parts);
    };
    const auto refuse_head = [&](Parts parts, const auto& damage) {
        json value = head;
        damage(value);
        refuse(with_head("RAD0", value) + whole.substr(begin), parts);
    };
    const auto refuse_chunk = [&](Parts parts, const auto& damage) {
        json value = chunk;
        damage(value);
        refuse(whole.substr(0, begin) + with_head("RADC", value) + whole.substr(payload), parts);
    };
    refuse_head({"a.rad: byte ", "\"version\"", "unknown"}, [](json& h) { h["version"] = 2; });
    refuse_head({"\"type\""}, [](json& h) { h["type"] = "mesh"; });
    refuse_head({"\"type\" is not a text"}, [](json& h) { h.erase("type"); });
    refuse_head({"\"count\" is not a whole number"}, [](json& h) { h["count"] = -1; });
    refuse_head({"\"chunks\" has 1 chunk of 65536 for 70000 splats"}, [](json& h) { h["count"] = 70000; });
    refuse_head({"claims 4000000000 splats"}, [](json& h) { h["count"] = h["chunkSize"] = 4'000'000'000; });
    refuse_head({"\"maxSh\""}, [](json& h) { h["maxSh"] = 4; });
    refuse_head({"\"chunks\" has 1 chunk of 0"}, [](json& h) { h["chunkSize"] = 0; });
    refuse_head({"\"chunks\" is not a list"}, [](json& h) { h["chunks"] = 1; });
    refuse_head({"not an object"}, [](json& h) { h["chunks"] = json({1}); });
    refuse_head({"the file ends before a chunk"}, [](json& h) { h["chunks"][0]["offset"] = 1'000'000'000; });
    refuse_head({"does not begin with \"RADC\""}, [](json& h) { h["chunks"][0]["offset"] = 8; });
    refuse_head({"not in its folder"}, [](json& h) { h["chunks"][0]["filename"] = "../a.radc"; });
    refuse_head({"b.radc"}, [](json& h) { h["chunks"][0]["filename"] = "b.radc"; });
    refuse_head({"no property \"child_count\""}, [](json& h) { h["lodTree"] = true; });
    refuse_head({"no property \"sh2\""}, [](json& h) { h["maxSh"] = 2; });
    refuse_chunk({"a chunk does not have the splats 0 to 299"}, [](json& c) { c["base"] = 1; });
    refuse_chunk({"a chunk does not have the splats 0 to 299"}, [](json& c) { c["count"] = 301; });
    refuse_chunk({"\"properties\" is not a list"}, [](json& c) { c.erase("properties"); });
    const auto first = [](json& c) -> json& { return c["properties"][0]; };
    refuse_chunk({"\"center\" in the encoding \"oct88r8\""},
                 [&](json& c) { first(c)["encoding"] = "oct88r8"; });
    refuse_chunk({"\"middle\""}, [&](json& c) { first(c)["property"] = "middle"; });
    refuse_chunk({"\"compression\""}, [&](json& c) { first(c)["compression"] = "zstd"; });
    refuse_chunk({"\"bytes\""}, [&](json& c) { first(c)["bytes"] = 1u << 30; });
    refuse_chunk({"\"center\" comes twice"}, [&](json& c) { c["properties"].push_back(first(c)); });
    refuse_chunk({"no property \"center\""}, [&](json& c) { c["properties"].erase(0); });
    refuse_chunk({"\"center\" has 5 bytes"}, [&](json& c) {
        first(c).erase("compression");
        first(c)["bytes"] = 5;
    });
    refuse_chunk({"ends inside"}, [&](json& c) { first(c)["bytes"] = 100; });
    refuse_chunk({"ends inside"}, [&](json& c) { c["properties"][1]["encoding"] = "f32"; });
    refuse_chunk({"unpacks to more than 300 bytes"}, [&](json& c) {
        for (const char* key : {"offset", "bytes"}) c["properties"][1][key] = c["properties"][2][key];
    });
    refuse_chunk({"\"min\" of a property"}, [&](json& c) { c["properties"][2].erase("min"); });
    refuse_chunk({"\"max\" of a property"}, [&](json& c) { c["properties"][2]["max"] = 1e300; });
    refuse("RAD0" + test::bytes_of(uint32_t(0xffffffff)), {"claims 4294967295 bytes of JSON"});
    refuse(with_head("RAD0", json::array()), {"not an object"});
    std::string wrong = whole;
    wrong[payload + 8 + 2] = char(~wrong[payload + 8 + 2]);
    folder.write("a.rad", wrong);
    expect_error<InputError>([&] { read_splats(path); }, {"a.rad: byte "});
}

}  // namespace
