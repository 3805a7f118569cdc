// SPDX-License-Identifier: Apache-2.0
// Every splat format: what comes back, what the bytes are, and what is refused.
#include <zlib.h>

#include <algorithm>
#include <array>

#include "ewa/splat_edit.h"
#include "ewa/splat_files.h"
#include "scene/splat_arrays.h"
#include "support/splat_scenes.h"
#include "support/temp_folder.h"
#include "support/usd_values.h"

namespace {

using namespace ewa;
using test::bytes_of;
using test::expect_error;
using test::Largest;
using test::largest_differences;
using test::storable_splats;
using test::TempFolder;

std::string gzipped(const std::string& bytes) {
    z_stream stream{};
    EXPECT_EQ(deflateInit2(&stream, 6, Z_DEFLATED, 16 + MAX_WBITS, 8, Z_DEFAULT_STRATEGY), Z_OK);
    std::string out(compressBound(uLong(bytes.size())) + 64, '\0');
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream.avail_in = uInt(bytes.size());
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = uInt(out.size());
    EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
    out.erase(out.size() - stream.avail_out);
    deflateEnd(&stream);
    return out;
}

struct SplatFileCase {
    const char* name;
    int spz_version;
    Largest quantum;  // SH in that of the formats' own units
    bool reordered, view_dependent;
};

/// Half a step of each, as the layouts say; a compressed PLY's box is at most the scene.
const SplatFileCase kSplatFileCases[] = {
    {"a.ply", 3, {0, 2e-7, 0, 0, 0, 0}, false, true},
    {"a.glb", 3, {0, 2e-7, 1e-6, 1e-7, 0, 0}, false, true},
    {"a.gltf", 3, {0, 2e-7, 1e-6, 1e-7, 0, 0}, false, true},
    {"a.spz",
     3,
     {1.3e-4, 0.0024, 1.001 / 32, 1.001 / 510, 0.5001 / 38.25, 1.001 * (8.0 + 0.5) / 128},
     false,
     true},
    {"a.spz",
     4,
     {1.3e-4, 0.0024, 1.001 / 32, 1.001 / 510, 0.5001 / 38.25, 1.001 * (8.0 + 0.5) / 128},
     false,
     true},
    {"a.splat", 3, {0, 0.009, 1e-6, 1.001 / 510, 1.001 / 510 / 0.282, 0}, false, false},
    {"a.compressed.ply",
     3,
     {0.5001 * 10 / 1023, 0.0024, 0.5001 * 9 / 1023, 1.001 / 510, 0.5001 * 3 / 255, 1.001 / 64},
     true,
     true},
    // Half a step of the logarithm of 6; of the tables a 256th of the range, as tests/unit/test_sog.cpp has exactly.
    {"a.sog",
     3,
     {6 * 0.5001 * 3.6 / 65535, 0.0083, 9.0 / 256, 1.001 / 510, 3.0 / 256, 1.8 / 256},
     true,
     true}};

TEST(SplatFormats, RoundTripWithinTheQuantum) {
    TempFolder folder;
    for (const SplatFileCase& c : kSplatFileCases)
        for (int degree = 0; degree <= 3; ++degree) {
            SCOPED_TRACE(std::string(c.name) + " version " + std::to_string(c.spz_version) + " degree " +
                         std::to_string(degree));
            Gaussians g = storable_splats(uint64_t(degree) + 7, 5000, degree);
            save_splats(folder / c.name, g, SaveOptions{.spz_version = c.spz_version});
            const SplatScene back = read_splats(folder / c.name);
            EXPECT_EQ(back.format, format_of_name(c.name));
            if (c.reordered) select_splats(g, morton_order(g));
            if (!c.view_dependent) set_sh_degree(g, 0);
            const Largest d = largest_differences(g, back.gaussians);
            EXPECT_LE(d.mean, c.quantum.mean);
            EXPECT_LE(d.rotation, c.quantum.rotation);
            EXPECT_LE(d.scale, c.quantum.scale);
            EXPECT_LE(d.opacity, c.quantum.opacity);
            EXPECT_LE(d.color, c.quantum.color);
            EXPECT_LE(d.sh, c.quantum.sh);
            // What is quantised once stays.
            if (c.reordered) continue;
            save_splats(folder / (std::string("b-") + c.name), back.gaussians,
                        SaveOptions{.spz_version = c.spz_version});
            const Largest again =
                largest_differences(back.gaussians, load_splats(folder / (std::string("b-") + c.name)));
            EXPECT_LE(again.mean + again.opacity + again.color + again.sh, 1e-6);
        }
}

TEST(SplatFormats, SaysWhatIsLost) {
    TempFolder folder;
    const auto all = [&](const char* name, const Gaussians& g, const SaveOptions& options) {
        std::string text;
        for (const std::string& line : save_splats(folder / name, g, options)) text += line + "\n";
        return text;
    };
    Gaussians g = storable_splats(1, 10, 2);
    EXPECT_EQ(all("a.ply", g, {.comments = {"x"}, .antialiased = true}), "");
    EXPECT_NE(
        all("a.splat", g, {.comments = {"x"}, .antialiased = true}).find("SH degrees 1 to 2 are dropped"),
        std::string::npos);
    EXPECT_NE(all("a.splat", g, {.comments = {"x"}}).find("comments are dropped"), std::string::npos);
    EXPECT_NE(all("a.glb", g, {.antialiased = true}).find("anti-aliased is dropped"), std::string::npos);
    for (const char* name : {"a.spz", "a.compressed.ply", "a.sog", "meta.json"}) {
        EXPECT_EQ(all(name, g, {.antialiased = true}).find("anti-aliased"), std::string::npos) << name;
        EXPECT_TRUE(read_splats(folder / name).antialiased) << name;
    }
    EXPECT_EQ(all("a.spz", g, {.antialiased = true}).find("anti-aliased"), std::string::npos);
    EXPECT_TRUE(read_splats(folder / "a.spz").antialiased);
    EXPECT_EQ(all("a.spz", g, {}).find("clamped to -1..1\n1"), std::string::npos);
    g.sh[3] = 1.5f;
    EXPECT_NE(all("a.spz", g, {}).find("1 scales, colours and SH coefficients are outside SPZ's range"),
              std::string::npos);
    g.means[0] = NAN;
    g.quaternions[7] = g.quaternions[6] = g.quaternions[5] = g.quaternions[4] = 0;
    for (const char* name : {"a.splat", "a.spz", "a.glb", "a.gltf", "a.compressed.ply", "a.sog"}) {
        EXPECT_NE(all(name, g, {}).find("2 splats have a value that is not finite"), std::string::npos)
            << name;
        EXPECT_EQ(load_splats(folder / name).size(), 8u) << name;
    }
    EXPECT_EQ(all("a.ply", g, {}), "");
    EXPECT_EQ(load_splats(folder / "a.ply").size(), 10u);
}

/// What a scene does not have costs nothing after a round trip either.
TEST(SplatFormats, AbsentDegreesStayAbsent) {
    TempFolder folder;
    Gaussians g = storable_splats(1, 2000, 3);
    const size_t stride = g.sh_stride();
    for (size_t i = 0; i < g.size(); ++i) std::fill_n(&g.sh[stride * i + 12], stride - 12, 0.0f);
    ASSERT_EQ(sh_degree_present(g), 1);
    for (const char* name : {"a.ply", "a.compressed.ply", "a.spz", "a.glb", "a.gltf", "a.sog", "meta.json"}) {
        save_splats(folder / name, g);
        const Gaussians back = load_splats(folder / name);
        EXPECT_EQ(sh_degree_present(back), 1) << name;
        EXPECT_EQ(back.sh_degree, name == std::string("a.compressed.ply") ? 1 : 3) << name;
    }
}

TEST(SplatFormats, NoSplats) {
    TempFolder folder;
    Gaussians none;
    none.sh_degree = 1;
    for (const char* name : {"a.ply", "a.splat", "a.spz", "a.compressed.ply", "a.sog"}) {
        save_splats(folder / name, none);
        EXPECT_EQ(load_splats(folder / name).size(), 0u) << name;
    }
    save_splats(folder / "a.spz", none, SaveOptions{.spz_version = 4});
    EXPECT_EQ(load_splats(folder / "a.spz").size(), 0u);
    expect_error<InputError>([&] { save_splats(folder / "a.glb", none); }, {"a.glb", "without splats"});
}

TEST(SplatFormats, FoundByTheirFirstBytes) {
    TempFolder folder;
    const Gaussians g = storable_splats(1, 40, 1);
    for (const char* name : {"a.ply", "a.compressed.ply", "a.spz", "a.glb", "a.sog"}) {
        save_splats(folder / name, g);
        for (const char* other : {"b", "b.ply", "b.spz", "b.gltf", "b.data"}) {
            folder.write(other, test::file_bytes(folder / name));
            EXPECT_EQ(format_of_file(folder / other), format_of_name(name)) << name << " as " << other;
            EXPECT_EQ(load_splats(folder / other).size(), 40u);
        }
    }
    save_splats(folder / "a.spz", g, SaveOptions{.spz_version = 4});
    EXPECT_EQ(read_splats(folder / "a.spz").variant, "version 4");
    // The first coordinate of a .splat may be any bytes.
    std::string bytes(64, '\0');
    bytes.replace(0, 4, "ply\n");
    EXPECT_EQ(format_of_file(folder.write("x.splat", bytes)), SplatFormat::splat);
}

TEST(SplatFormats, OtherExtensionsAreRefused) {
    TempFolder folder;
    for (const char* name : {"a.obj", "ply", "a"}) {
        expect_error<InputError>([&] { load_splats(folder / name); }, {name, "supported: .ply"});
        expect_error<InputError>([&] { save_splats(folder / name, Gaussians()); }, {name, "supported: .ply"});
    }
    expect_error<InputError>([&] { load_splats(folder.write("b", "nothing known")); }, {"supported: .ply"});
    expect_error<InputError>([&] { load_splats(folder / "none.ply"); }, {"none.ply"});
    const Gaussians g = storable_splats(1, 2, 0);
    for (const char* name : {"a.ply", "a.compressed.ply", "a.splat", "a.spz", "a.glb", "a.gltf", "a.sog"})
        expect_error<RunError>([&] { save_splats(folder / "none" / name, g); }, {"none/a."});
    EXPECT_EQ(test::files_in(folder.path()), 1u);
}

TEST(SplatFormats, EveryCutIsAnError) {
    TempFolder folder;
    const Gaussians g = storable_splats(3, 3, 1);
    for (const SplatFileCase& c : kSplatFileCases) {
        if (std::string(c.name) == "a.gltf") continue;  // text; its buffer is a file of its own
        save_splats(folder / c.name, g, SaveOptions{.spz_version = c.spz_version});
        const std::string whole = test::file_bytes(folder / c.name);
        const size_t read =
            test::read_every_cut(folder / c.name, whole, [&] { load_splats(folder / c.name); });
        // Of a .splat two, one and no splats are whole files. The last bytes of an archive are the length of a
        // comment that it does not have.
        const std::string name = c.name;
        EXPECT_LE(read, name == "a.splat" || name == "a.sog" ? 3u : 0u) << name;
    }
}

TEST(SplatFormats, FlippedBytesAreReadOrRefused) {
    TempFolder folder;
    const Gaussians g = storable_splats(3, 5, 1);
    for (const SplatFileCase& c : kSplatFileCases) {
        save_splats(folder / c.name, g, SaveOptions{.spz_version = c.spz_version});
        const std::string whole = test::file_bytes(folder / c.name);
        for (size_t i = 0; i < whole.size(); i += std::max<size_t>(5, whole.size() / 200))
            for (const int flip : {0x04, 0xff}) {
                std::string damaged = whole;
                damaged[i] = char(damaged[i] ^ flip);
                folder.write(c.name, damaged);
                try {
                    load_splats(folder / c.name);
                } catch (const InputError& error) {
                    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
                }
            }
    }
}

TEST(Splat, BytesAsLaidOut) {
    TempFolder folder;
    Gaussians g;
    g.resize(1);
    g.means = {1, 2, 3};
    g.log_scales = {0, float(std::log(2.0)), float(std::log(4.0))};
    g.sh = {0, float(0.5 / 0.28209479177387814), -100};
    g.opacity_logits = {0};
    g.quaternions = {0, 0.6f, 0, -0.8f};
    save_splats(folder / "a.splat", g);
    const std::string expected = bytes_of(1.0f) + bytes_of(2.0f) + bytes_of(3.0f) + bytes_of(1.0f) +
                                 bytes_of(2.0f) + bytes_of(4.0f) + "\x80\xff" + std::string(1, '\0') +
                                 "\x80" + "\x80\xcd\x80\x1a";
    EXPECT_EQ(test::file_bytes(folder / "a.splat"), expected);
    expect_error<InputError>([&] { load_splats(folder.write("b.splat", expected + "123")); },
                             {"b.splat", "byte 32", "splat 1", "35 bytes"});
}

/// One splat of degree 0 in the layout of a version, with the bytes of its blocks.
std::string spz(uint32_t version, uint8_t degree, const std::string& blocks, uint32_t count = 1) {
    constexpr uint32_t kMagic = 0x5053474e;  // "NGSP"
    return bytes_of(kMagic) + bytes_of(version) + bytes_of(count) + bytes_of(degree) + bytes_of(uint8_t(12)) +
           std::string(2, '\0') + blocks;
}

TEST(Spz, VersionsOneToThree) {
    TempFolder folder;
    const std::string rest("\xff\x80\x80\x80\xa0\xa0\xb0");
    // 1 - 2 and 0.5 in the file's frame: y and z change their signs.
    const std::string halves =
        bytes_of(uint16_t(0x3c00)) + bytes_of(uint16_t(0xc000)) + bytes_of(uint16_t(0x3800));
    const std::string fixed =
        std::string("\x00\x10\x00", 3) + std::string("\x00\xe0\xff", 3) + std::string("\x00\x08\x00", 3);
    const std::string first_three = "\xff\x80\x80";  // x = 1, so w = 0
    for (const uint32_t version : {1u, 2u, 3u}) {
        // Largest is x (index 0), the others zero.
        const std::string rotation = version == 3 ? std::string(4, '\0') : first_three;
        const Gaussians g = load_splats(folder.write(
            "a.spz", gzipped(spz(version, 0, (version == 1 ? halves : fixed) + rest + rotation))));
        ASSERT_EQ(g.size(), 1u);
        EXPECT_EQ(g.means, (std::vector<float>{1, 2, -0.5f})) << version;
        EXPECT_EQ(g.log_scales, (std::vector<float>{0, 0, 1}));
        EXPECT_NEAR(g.sh[0], 0.5 / 38.25, 1e-6);
        EXPECT_NEAR(g.quaternions[1], 1, 1e-5);
        EXPECT_NEAR(g.quaternions[0], 0, 0.01);
        EXPECT_GT(g.opacity_logits[0], 6);
    }
}

TEST(Spz, UnpackedFilesAreRead) {
    const TempFolder folder;
    std::string blocks(20, '\0');
    for (size_t i = 0; i < blocks.size(); ++i) blocks[i] = char(7 * i + 1);
    for (const uint32_t version : {2u, 3u}) {
        const std::string bytes = spz(version, 0, blocks.substr(0, version == 2 ? 19 : 20));
        const Gaussians plain = load_splats(folder.write("a.spz", bytes));
        const Gaussians packed = load_splats(folder.write("b.spz", gzipped(bytes)));
        EXPECT_EQ(plain.means, packed.means);
        EXPECT_EQ(plain.quaternions, packed.quaternions);
    }
    // The flag of extensions, which are skipped.
    std::string extended = spz(3, 0, blocks + "more");
    extended[14] = 2;
    const SplatScene scene = read_splats(folder.write("c.spz", gzipped(extended)));
    EXPECT_EQ(scene.remarks, std::vector<std::string>{"bytes after the splats (extensions) are skipped"});
}

// Coefficients of zero take next to nothing in the file, and as much as any others in memory.
TEST(Spz, LargeScenesThatPackWell) {
    TempFolder folder;
    Gaussians g = storable_splats(5, 400000, 0);
    set_sh_degree(g, 3);
    for (const int version : {3, 4}) {
        save_splats(folder / "a.spz", g, SaveOptions{.spz_version = version});
        EXPECT_EQ(load_splats(folder / "a.spz").size(), g.size());
    }
}

TEST(Spz, TurnsTheFrame) {
    // (x, y, z) -> (x, -y, -z) is half a turn round x; the stored SH must give the same colour in the turned
    // direction.
    TempFolder folder;
    Gaussians g = storable_splats(5, 20, 3);
    save_splats(folder / "a.spz", g);
    Gaussians turned = load_splats(folder / "a.spz");
    const Gaussians back = turned;
    glm::dmat4 half_turn(1.0);
    half_turn[1][1] = half_turn[2][2] = -1;
    transform_splats(turned, half_turn);
    const std::array<float, 15> signs = {-1, -1, 1, -1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, 1};
    for (size_t i = 0; i < back.size(); ++i)
        for (size_t k = 1; k < 16; ++k)
            EXPECT_EQ(turned.sh[48 * i + 3 * k], signs[k - 1] * back.sh[48 * i + 3 * k]);
}

TEST(Spz, RefusesWithTheReason) {
    TempFolder folder;
    const auto refuse = [&](const std::string& bytes, std::initializer_list<std::string> parts) {
        const auto path = folder.write("a.spz", bytes);
        expect_error<InputError>([&] { load_splats(path); }, parts);
    };
    const std::string blocks(20, '\0');
    refuse(gzipped(spz(9, 0, blocks)), {"a.spz", "byte", "version 9"});
    refuse(gzipped(spz(4, 0, blocks)), {"version 4 is not packed with gzip"});
    refuse(gzipped(spz(3, 0, blocks + std::string(20, '\0'))), {"a.spz", "after the 1 splats", "wrong"});
    refuse(spz(2, 0, blocks), {"a.spz", "after the 1 splats"});  // version 2 has one byte less
    refuse(spz(3, 0, blocks.substr(1)), {"ends inside"});
    refuse(gzipped(spz(3, 7, blocks)), {"SH degree 7"});
    refuse(gzipped(spz(3, 0, blocks, 2)), {"the packed data ends inside the colours"});
    refuse(gzipped(spz(3, 0, blocks, 4000000000u)), {"byte", "claims 4000000000 splats"});
    refuse(gzipped(std::string(40, 'x')), {"NGSP"});
    refuse("", {"less than 2 bytes"});
    std::string damaged = gzipped(spz(3, 0, std::string(2000, '\7'), 100));
    damaged[damaged.size() / 2] ^= 0x55;
    refuse(damaged, {"byte"});
    Gaussians far = storable_splats(1, 3, 0);
    far.means[4] = 3e6f;
    EXPECT_NE(save_splats(folder / "b.spz", far, SaveOptions{})[0].find("1/2,"), std::string::npos);
    EXPECT_EQ(load_splats(folder / "b.spz").means[4], 3e6f);
    far.means[4] = 3e7f;
    expect_error<InputError>([&] { save_splats(folder / "c.spz", far); }, {"c.spz", "splat 1", "30000000"});
}

TEST(CompressedPly, WordsAsLaidOut) {
    TempFolder folder;
    std::string text = "ply\nformat binary_little_endian 1.0\ncomment made by hand\nelement chunk 1\n";
    const char* box[] = {"min_x",       "min_y",       "min_z",       "max_x",
                         "max_y",       "max_z",       "min_scale_x", "min_scale_y",
                         "min_scale_z", "max_scale_x", "max_scale_y", "max_scale_z"};
    for (const char* name : box) text += std::string("property float ") + name + "\n";
    text += "element vertex 1\n";
    for (const char* name : {"position", "rotation", "scale", "color"})
        text += std::string("property uint packed_") + name + "\n";
    text += "end_header\n";
    for (const float v : {0, 0, 0, 2047, 1023, 2047, -2, -2, -2, 2, 2, 2}) text += bytes_of(v);
    text += bytes_of(uint32_t(5u << 21 | 6u << 11 | 7u));
    text += bytes_of(uint32_t(2u << 30 | 1023u << 20));  // y largest; w = 1/sqrt(2), x and z = -1/sqrt(2)
    text += bytes_of(uint32_t(2047u << 21 | 0u << 11 | 2047u));
    text += bytes_of(uint32_t(255u << 24 | 0u << 16 | 51u << 8 | 51u));
    const SplatScene scene = read_splats(folder.write("a.ply", text));
    EXPECT_EQ(scene.format, SplatFormat::compressed_ply);
    EXPECT_EQ(scene.comments, std::vector<std::string>{"made by hand"});
    const Gaussians& g = scene.gaussians;
    EXPECT_EQ(g.means, (std::vector<float>{5, 6, 7}));
    EXPECT_EQ(g.log_scales, (std::vector<float>{2, -2, 2}));
    EXPECT_NEAR(g.quaternions[0], std::sqrt(0.5), 1e-6);
    EXPECT_NEAR(g.quaternions[1], -std::sqrt(0.5), 1e-6);
    EXPECT_NEAR(g.sh[0], 0.5 / 0.28209479177387814, 1e-5);
    EXPECT_NEAR(g.sh[2], -0.3 / 0.28209479177387814, 1e-5);
    EXPECT_NEAR(g.opacity_logits[0], std::log(0.25), 1e-6);

    const auto replaced = [&](const std::string& from, const std::string& to) {
        std::string changed = text;
        changed.replace(changed.find(from), from.size(), to);
        return folder.write("b.ply", changed);
    };
    expect_error<InputError>([&] { load_splats(replaced("max_scale_x", "max_scale_q")); },
                             {"\"max_scale_x\""});
    expect_error<InputError>([&] { load_splats(replaced("uint packed_scale", "int packed_scale")); },
                             {"\"packed_scale\"", "uint"});
    expect_error<InputError>([&] { load_splats(replaced("element vertex 1", "element vertex 0")); },
                             {"0 splats", "chunk"});
}

TEST(CompressedPly, RealFile) {
    const auto data = test::shared_data();
    if (!data) GTEST_SKIP() << "no folder of real inputs";
    const SplatScene scene = read_splats(*data / "splats/guitar.compressed.ply");
    EXPECT_EQ(scene.gaussians.size(), 90854u);
    EXPECT_EQ(scene.comments.at(0), "Generated by SuperSplat 2.7.1");
    for (size_t i = 0; i < scene.gaussians.size(); ++i) EXPECT_TRUE(drawable(scene.gaussians, i));
}

/// A .ksplat of one section. `data`: sizes of partly filled buckets, middles of buckets, splats.
std::string ksplat(uint16_t level, uint16_t degree, const std::array<uint32_t, 6>& counts,
                   const std::string& data) {
    std::string head(4096, '\0'), section(1024, '\0');
    const auto put = [](std::string& bytes, size_t at, const auto& value) {
        bytes.replace(at, sizeof(value), bytes_of(value));
    };
    head[1] = 1;
    put(head, 4, uint32_t(1));
    put(head, 20, level);
    put(head, 36, -2.0f);
    put(head, 40, 3.1f);
    const auto& [splats, room, bucket_size, buckets, full, partial] = counts;
    put(section, 0, splats);
    put(section, 4, room);
    put(section, 8, bucket_size);
    put(section, 12, buckets);
    put(section, 16, 4.0f);  // width
    put(section, 20, uint16_t(12));
    put(section, 24, uint32_t(1000));  // range
    put(section, 32, full);
    put(section, 36, partial);
    put(section, 40, degree);
    return head + section + data;
}

/// The SH of degree 2 by coefficient, RGB inner, for values 0, 1, 2 ... in the order of the file.
std::vector<float> ksplat_sh(const std::vector<float>& values) {
    std::vector<float> sh;
    for (size_t k = 0; k < 8; ++k)
        for (size_t channel = 0; channel < 3; ++channel)
            sh.push_back(values[k < 3 ? 3 * channel + k : 9 + 5 * channel + k - 3]);
    return sh;
}

TEST(Ksplat, BytesAsLaidOut) {
    TempFolder folder;
    const std::string color = std::string("\0\x80\xff\x33", 4);
    std::string exact;
    for (const float v : {1.0f, 2.0f, -3.0f, 1.0f, 2.0f, 0.5f, 0.5f, 0.5f, -0.5f, 0.5f}) exact += bytes_of(v);
    exact += color;
    std::vector<float> sh(24);
    for (size_t i = 0; i < sh.size(); ++i) exact += bytes_of(sh[i] = float(i) / 8);
    const SplatScene scene = read_splats(folder.write("a", ksplat(0, 2, {1, 1, 0, 0, 0, 0}, exact)));
    EXPECT_EQ(scene.format, SplatFormat::ksplat);
    EXPECT_EQ(scene.variant, "compression level 0");
    const Gaussians& g = scene.gaussians;
    ASSERT_EQ(g.size(), 1u);
    ASSERT_EQ(g.sh_degree, 2);
    EXPECT_EQ(g.means, (std::vector<float>{1, 2, -3}));
    EXPECT_EQ(g.log_scales, (std::vector<float>{0, float(std::log(2.0)), float(std::log(0.5))}));
    EXPECT_EQ(g.quaternions, (std::vector<float>{0.5f, 0.5f, -0.5f, 0.5f}));
    EXPECT_NEAR(g.opacity_logits[0], std::log(0.2 / 0.8), 1e-5);
    EXPECT_NEAR(g.sh[0], -0.5 / 0.28209479177387814, 1e-6);
    EXPECT_NEAR(g.sh[2], 0.5 / 0.28209479177387814, 1e-6);
    EXPECT_EQ(std::vector<float>(g.sh.begin() + 3, g.sh.end()), ksplat_sh(sh));

    // Four splats: two in a full bucket, one in each of the partly filled ones, of which another is empty.
    const auto half = [](uint16_t bits) { return bytes_of(bits); };
    std::string data = bytes_of(1u) + bytes_of(0u) + bytes_of(1u);
    for (const float v : {0, 0, 0, 10, 20, 30, -1, -1, -1, 100, 200, 300}) data += bytes_of(v);
    for (int level = 1; level <= 2; ++level) {
        std::string packed = data;
        for (uint16_t splat = 0; splat < 4; ++splat) {
            for (const int v : {1000, 2000, 500 * splat}) packed += bytes_of(uint16_t(v));
            for (const int bits : {0x3c00, 0x4000, 0x3800}) packed += half(uint16_t(bits));  // 1, 2, 0.5
            for (const int bits : {0x3800, 0x3800, 0xb800, 0x3800})
                packed += half(uint16_t(bits));  // as above
            packed += color;
            for (int k = 0; k < 24; ++k)
                packed += level == 1 ? half(uint16_t(0x3c00 + 64 * k)) : std::string(1, char(k));
        }
        const SplatScene read =
            read_splats(folder.write("a.ksplat", ksplat(uint16_t(level), 2, {4, 4, 2, 4, 1, 3}, packed)));
        const Gaussians& b = read.gaussians;
        ASSERT_EQ(b.size(), 4u);
        // Steps of 4 / 2 / 1000.
        const double means[] = {0, 2, -2, 0, 2, -1, 10, 22, 30, 100, 202, 301};
        for (size_t i = 0; i < 12; ++i) EXPECT_NEAR(b.means[i], means[i], 1e-4) << i;
        EXPECT_EQ(std::vector<float>(b.log_scales.begin(), b.log_scales.begin() + 3), g.log_scales);
        EXPECT_EQ(std::vector<float>(b.quaternions.begin(), b.quaternions.begin() + 4), g.quaternions);
        EXPECT_EQ(b.opacity_logits[3], g.opacity_logits[0]);
        for (size_t i = 0; i < sh.size(); ++i)
            sh[i] = level == 1 ? (i < 16 ? 1 + float(i) / 16 : 2 + float(i - 16) / 8)
                               : float(double(-2.0f) + (double(3.1f) + 2) * (double(i) / 255));
        EXPECT_EQ(std::vector<float>(b.sh.end() - 24, b.sh.end()), ksplat_sh(sh));
    }
}

TEST(Ksplat, RefusesWithTheReason) {
    TempFolder folder;
    const auto refuse = [&](const std::string& bytes, std::initializer_list<std::string> parts) {
        const auto path = folder.write("a.ksplat", bytes);
        expect_error<InputError>([&] { load_splats(path); }, parts);
    };
    const std::string splat(44, '\0'), packed(24, '\0');
    refuse("", {"a.ksplat", "byte 0", "the header"});
    refuse(std::string(4096, '\0'), {"ksplat version 0.0"});
    refuse(ksplat(3, 0, {1, 1, 0, 0, 0, 0}, splat), {"byte", "compression level 3"});
    refuse(ksplat(0, 4, {1, 1, 0, 0, 0, 0}, splat), {"byte", "SH degree 4"});
    refuse(ksplat(0, 0, {2, 1, 0, 0, 0, 0}, splat), {"byte", "2 splats, and room for 1"});
    refuse(ksplat(0, 0, {2, 2, 0, 0, 0, 0}, splat), {"byte", "claims 2 splats"});
    refuse(ksplat(0, 1, {1, 1, 0, 0, 0, 0}, splat), {"byte", "claims 1 splats of at least 80 bytes"});
    refuse(ksplat(0, 0, {4000000000u, 4000000000u, 0, 0, 0, 0}, splat), {"byte", "claims 4000000000 splats"});
    refuse(ksplat(1, 0, {1, 1, 2, 0, 0, 0}, packed), {"splat 0 is in no bucket"});
    refuse(ksplat(1, 0, {1, 1, 2, 4000000000u, 1, 0}, packed), {"byte", "claims 4000000000 buckets"});
    refuse(ksplat(1, 0, {1, 1, 2, 1, 0, 4000000000u}, packed), {"byte", "claims 4000000000 sizes"});
    refuse(ksplat(1, 0, {1, 1, 0, 1, 1, 0}, std::string(12, '\0') + packed), {"splat 0 is in no bucket"});
    const std::string whole = ksplat(1, 0, {1, 1, 1, 1, 1, 0}, std::string(12, '\0') + packed);
    EXPECT_EQ(load_splats(folder.write("a.ksplat", whole)).size(), 1u);
    EXPECT_EQ(test::read_every_cut(folder / "a.ksplat", whole, [&] { load_splats(folder / "a.ksplat"); }),
              0u);
    expect_error<InputError>([&] { save_splats(folder / "b.ksplat", Gaussians()); },
                             {"b.ksplat", "does not write"});
}

/// Opacities that hide all or are never seen, flat splats, and one that is larger than any scene.
Gaussians unusual_splats() {
    Gaussians g = storable_splats(4, 400, 1);
    g.opacity_logits[0] = INFINITY;
    g.opacity_logits[1] = -INFINITY;
    g.log_scales[3 * 2] = -INFINITY;
    for (const size_t k : {9u, 10u, 11u}) g.log_scales[k] = 60;
    for (const size_t k : {12u, 13u, 14u}) g.log_scales[k] = 1e30f;
    return g;
}

TEST(SplatFormats, UnusualValuesMeanWhatTheyMean) {
    const TempFolder folder;
    const Gaussians g = unusual_splats();
    for (size_t i = 0; i < 5; ++i) EXPECT_TRUE(drawable(g, i)) << i;
    for (const char* name : {"a.ply", "a.splat", "a.spz", "a.compressed.ply", "a.sog", "meta.json", "a.glb",
                             "a.gltf", "a.usda", "a.usdz"}) {
        SCOPED_TRACE(name);
        save_splats(folder / name, g);
        const std::string text = name;
        const bool usd = text.starts_with("a.usd");
        const Gaussians back =
            usd ? test::usd_splats(test::file_bytes(folder / name)) : load_splats(folder / name);
        ASSERT_EQ(back.size(), g.size());
        std::vector<uint32_t> order(g.size());
        for (uint32_t i = 0; i < order.size(); ++i) order[i] = i;
        if (text.find("compressed") != text.npos || text == "a.sog" || text == "meta.json")
            order = morton_order(g);
        double farthest = 0;
        for (size_t at = 0; at < order.size(); ++at) {
            const uint32_t i = order[at];
            EXPECT_TRUE(drawable(back, at));
            if (i == 0) {
                EXPECT_GT(back.opacity_logits[at], 6);
            }
            if (i == 1) {
                EXPECT_LT(back.opacity_logits[at], -6);
            }
            if (i == 2) {
                EXPECT_LT(back.log_scales[3 * at], -9.9);
            }
            if (i == 3 || i == 4) {
                EXPECT_GT(back.log_scales[3 * at + 1], 5.8);
            }
            if (i < 5) continue;
            for (size_t k = 0; k < 3; ++k)
                farthest = std::max(farthest,
                                    std::abs(double(g.log_scales[3 * i + k]) - back.log_scales[3 * at + k]));
        }
        EXPECT_LT(farthest, 0.2);  // the others do not suffer
    }
    const Gaussians exact = load_splats(folder / "a.ply");
    EXPECT_EQ(exact.opacity_logits, g.opacity_logits);
    EXPECT_EQ(exact.log_scales, g.log_scales);
}

TEST(SplatFormats, SkippedSplatsAreNamedByTheirValues) {
    const TempFolder folder;
    Gaussians g = storable_splats(4, 20, 1);
    EXPECT_EQ(scene::undrawable_text(g), "");
    g.means[0] = g.means[3] = NAN;
    g.quaternions[4 * 2] = INFINITY;
    std::fill_n(&g.quaternions[4 * 3], 4, 0.0f);
    g.log_scales[3 * 4] = INFINITY;
    g.opacity_logits[5] = NAN;
    g.sh[g.sh_stride() * 6 + 5] = -INFINITY;
    const std::string text =
        "means of 2, quaternions of 1, zero quaternions of 1, scales of 1, opacities of 1, "
        "SH coefficients of 1";
    EXPECT_EQ(scene::undrawable_text(g), text);
    EXPECT_NE(save_splats(folder / "a.splat", g, SaveOptions{})[0].find(
                  "7 splats have a value that is not finite or a zero quaternion and are skipped: " + text),
              std::string::npos);
}

}  // namespace
