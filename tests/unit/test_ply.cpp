// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <random>

#include "ewa/splat_edit.h"
#include "ewa/splat_files.h"
#include "io/datasets/image_records.h"
#include "io/splats/formats.h"
#include "scene/splat_arrays.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using test::bytes_of;
using test::expect_error;
using test::file_bytes;
using test::TempFolder;

Gaussians random_splats(size_t n, int degree) {
    Gaussians g;
    g.sh_degree = degree;
    g.resize(n);
    std::mt19937 generator(static_cast<unsigned>(degree) + 1);
    std::normal_distribution<float> normal;
    for (auto* values : {&g.means, &g.quaternions, &g.log_scales, &g.opacity_logits, &g.sh})
        for (float& v : *values) v = normal(generator);
    return g;
}

void expect_same_bits(const std::vector<float>& a, const std::vector<float>& b) {
    ASSERT_EQ(a.size(), b.size());
    for (size_t i = 0; i < a.size(); ++i)
        EXPECT_EQ(std::bit_cast<uint32_t>(a[i]), std::bit_cast<uint32_t>(b[i])) << i;
}

void expect_same(const Gaussians& a, const Gaussians& b) {
    EXPECT_EQ(a.sh_degree, b.sh_degree);
    expect_same_bits(a.means, b.means);
    expect_same_bits(a.quaternions, b.quaternions);
    expect_same_bits(a.log_scales, b.log_scales);
    expect_same_bits(a.opacity_logits, b.opacity_logits);
    expect_same_bits(a.sh, b.sh);
}

/// Property names of a splat file of degree 0, and a value for each by its place: 1, 2, 3...
const std::vector<std::string> kNames = {"x",      "y",       "z",       "f_dc_0",  "f_dc_1",
                                         "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2",
                                         "rot_0",  "rot_1",   "rot_2",   "rot_3"};

std::string header(const std::string& format, const std::string& elements) {
    return "ply\nformat " + format + " 1.0\n" + elements + "end_header\n";
}

std::string properties(const std::vector<std::string>& names, const std::string& type = "float") {
    std::string text;
    for (const std::string& name : names) text += "property " + type + " " + name + "\n";
    return text;
}

/// The splat of kNames with values 1, 2, 3...
void expect_counting_splat(const Gaussians& g, size_t i = 0) {
    for (size_t k = 0; k < 3; ++k) {
        EXPECT_EQ(g.means[3 * i + k], 1 + k);
        EXPECT_EQ(g.sh[g.sh_stride() * i + k], 4 + k);
        EXPECT_EQ(g.log_scales[3 * i + k], 8 + k);
    }
    EXPECT_EQ(g.opacity_logits[i], 7);
    for (size_t k = 0; k < 4; ++k) EXPECT_EQ(g.quaternions[4 * i + k], 11 + k);
}

TEST(Ply, RoundTripKeepsEveryBit) {
    TempFolder folder;
    for (int degree = 0; degree <= 3; ++degree) {
        Gaussians g = random_splats(5000, degree);
        g.means[0] = NAN;
        g.log_scales[1] = INFINITY;
        g.sh[2] = -0.0f;
        save_splats(folder / "a.ply", g, {"one", "two\nlines"});
        expect_same(g, load_splats(folder / "a.ply"));
        EXPECT_EQ(io::read_ply(folder / "a.ply").comments, (std::vector<std::string>{"one", "two lines"}));
    }
    save_splats(folder / "empty.PLY", random_splats(0, 2));
    EXPECT_EQ(load_splats(folder / "empty.PLY").size(), 0u);
}

// The bytes, from the layout's own description.
TEST(Ply, WritesInriasLayout) {
    TempFolder folder;
    Gaussians g;
    g.sh_degree = 1;
    g.resize(1);
    g.means = {1, 2, 3};
    g.sh = {10, 20, 30, 11, 21, 31, 12, 22, 32, 13, 23, 33};
    g.opacity_logits = {4};
    g.log_scales = {5, 6, 7};
    g.quaternions = {8, 9, 10, 11};
    save_splats(folder / "a.ply", g);
    std::string expected = "ply\nformat binary_little_endian 1.0\nelement vertex 1\n";
    expected += properties({"x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"});
    for (int i = 0; i < 9; ++i) expected += "property float f_rest_" + std::to_string(i) + "\n";
    expected += properties({"opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"});
    expected += "end_header\n";
    for (float v :
         {1, 2, 3, 0, 0, 0, 10, 20, 30, 11, 12, 13, 21, 22, 23, 31, 32, 33, 4, 5, 6, 7, 8, 9, 10, 11})
        expected += bytes_of(v);
    EXPECT_EQ(test::file_bytes(folder / "a.ply"), expected);
}

TEST(Ply, ReadsByName) {
    TempFolder folder;
    // Reversed, with others between, doubles, and two elements before, one with a list.
    std::vector<std::string> names;
    for (size_t i = kNames.size(); i-- > 0;) {
        names.push_back(kNames[i]);
        names.push_back("extra_" + std::to_string(i));
    }
    std::string bytes = header("binary_little_endian",
                               "comment made by hand\nobj_info none\nelement camera 2\nproperty short a\n"
                               "element face 2\nproperty list uchar int vertex_indices\nproperty float b\n"
                               "element vertex 2\n" +
                                   properties(names, "double") + "element tail 1\nproperty int t\n");
    bytes += bytes_of(int16_t(1)) + bytes_of(int16_t(2));
    bytes += bytes_of(uint8_t(2)) + bytes_of(5) + bytes_of(6) + bytes_of(0.5f) + bytes_of(uint8_t(0)) +
             bytes_of(0.5f);
    for (int row = 0; row < 2; ++row)
        for (size_t i = kNames.size(); i-- > 0;) bytes += bytes_of(double(i + 1)) + bytes_of(-1.0);
    const auto path = folder.write("a.ply", bytes);
    const Gaussians g = load_splats(path);
    ASSERT_EQ(g.size(), 2u);
    expect_counting_splat(g, 0);
    expect_counting_splat(g, 1);
}

TEST(Ply, ReadsAsciiAndBigEndian) {
    TempFolder folder;
    std::string text = header("ascii", "element vertex 1\n" + properties(kNames)), big;
    big = header("binary_big_endian", "element vertex 1\n" + properties(kNames, "float32"));
    for (size_t i = 1; i <= kNames.size(); ++i) {
        text += std::to_string(i) + (i % 5 ? " " : ".0e0\t");
        std::string value = bytes_of(float(i));
        std::reverse(value.begin(), value.end());
        big += value;
    }
    expect_counting_splat(load_splats(folder.write("text.ply", text)));
    expect_counting_splat(load_splats(folder.write("big.ply", big)));
    std::string windows;
    for (char c : text) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
    expect_counting_splat(load_splats(folder.write("windows.ply", windows + "\r\n")));
    expect_counting_splat(load_splats(folder.write("marked.ply", "\xEF\xBB\xBF" + text)));
}

TEST(Ply, ReadsEveryScalarType) {
    TempFolder folder;
    const auto value = [](const std::string& type, int v) {
        if (type == "char" || type == "uint8") return bytes_of(int8_t(v));
        if (type == "int16" || type == "ushort") return bytes_of(int16_t(v));
        if (type == "int" || type == "uint32") return bytes_of(int32_t(v));
        return type == "float32" ? bytes_of(float(v)) : bytes_of(double(v));
    };
    const char* types[] = {"char", "uint8", "int16", "ushort", "int", "uint32", "float32", "float64"};
    std::string declared, row;
    for (size_t i = 0; i < kNames.size(); ++i) {
        declared += std::string("property ") + types[i % 8] + " " + kNames[i] + "\n";
        row += value(types[i % 8], int(i) + 1);
    }
    expect_counting_splat(load_splats(
        folder.write("a.ply", header("binary_little_endian", "element vertex 1\n" + declared) + row)));
}

TEST(Ply, DegreeFourIsCutToThree) {
    TempFolder folder;
    std::vector<std::string> names = kNames;
    for (int i = 0; i < 72; ++i) names.push_back("f_rest_" + std::to_string(i));
    std::string bytes = header("binary_little_endian", "element vertex 1\n" + properties(names));
    for (size_t i = 1; i <= kNames.size(); ++i) bytes += bytes_of(float(i));
    for (int i = 0; i < 72; ++i) bytes += bytes_of(float(100 + i));
    const auto path = folder.write("a.ply", bytes);
    EXPECT_EQ(io::read_ply(path).file_sh_degree, 4);
    const Gaussians g = load_splats(path);
    EXPECT_EQ(g.sh_degree, 3);
    expect_counting_splat(g);
    for (size_t k = 0; k < 15; ++k)
        for (size_t channel = 0; channel < 3; ++channel)
            EXPECT_EQ(g.sh[3 + 3 * k + channel], 100 + channel * 24 + k);
}

TEST(Ply, CommentsMarksAndExtraProperties) {
    TempFolder folder;
    std::vector<std::string> names = kNames;
    names.push_back("confidence");
    std::string text = header(
        "ascii", "comment SplatRenderMode: mip\ncomment by hand\nelement vertex 1\n" + properties(names));
    for (size_t i = 1; i <= names.size(); ++i) text += std::to_string(i) + " ";
    const SplatScene scene = read_splats(folder.write("a.ply", text));
    EXPECT_TRUE(scene.antialiased);
    EXPECT_EQ(scene.variant, "ascii");
    EXPECT_EQ(scene.comments, std::vector<std::string>{"by hand"});
    ASSERT_EQ(scene.remarks.size(), 1u);
    EXPECT_NE(scene.remarks[0].find("confidence"), std::string::npos);
}

/// In both kinds of PLY, which SuperSplat and splat-transform mark alike.
TEST(Ply, TheMarkOfAntialiasing) {
    TempFolder folder;
    const Gaussians splats = random_splats(3, 1);
    struct Marked {
        std::vector<std::string> comments;
        bool antialiased;
    };
    const Marked cases[] = {{{"by hand"}, false},
                            {{"SplatRenderMode: mip", "by hand"}, true},
                            {{"by hand", "  SPLATRENDERMODE:  MIP  "}, true},
                            {{"by hand", "SplatRenderMode: default"}, false},
                            {{"by hand", "SplatRenderMode: banana"}, false},
                            {{"antialiased 1", "by hand"}, true},
                            {{"by hand", "antialiased 0"}, false},
                            {{"antialiased 1", "SplatRenderMode: default", "by hand"}, false},
                            {{"SplatRenderMode: default", "antialiased 1", "by hand"}, true}};
    for (const char* name : {"a.ply", "a.compressed.ply"})
        for (const Marked& c : cases) {
            SCOPED_TRACE(std::string(name) + ", " + c.comments.back());
            save_splats(folder / name, splats, SaveOptions{.comments = {"HERE"}});
            std::string text = file_bytes(folder / name), marks;
            for (const std::string& comment : c.comments) marks += "comment " + comment + "\n";
            text.replace(text.find("comment HERE\n"), 13, marks);
            const SplatScene scene = read_splats(folder.write(name, text));
            EXPECT_EQ(scene.antialiased, c.antialiased);
            EXPECT_EQ(scene.comments.back(),
                      c.comments.back() == "SplatRenderMode: banana" ? c.comments.back() : "by hand");
            EXPECT_TRUE(scene.remarks.empty());
            // As others read it: one mark in Brush's spelling, none where there is nothing to mark.
            save_splats(folder / name, scene.gaussians,
                        SaveOptions{.comments = c.comments, .antialiased = scene.antialiased});
            const std::string saved = file_bytes(folder / name);
            const size_t at = saved.find("comment SplatRenderMode: mip\n");
            EXPECT_EQ(at != std::string::npos, c.antialiased);
            EXPECT_EQ(saved.find("antialiased"), std::string::npos);
            EXPECT_EQ(saved.find("default"), std::string::npos);
            EXPECT_EQ(read_splats(folder / name).antialiased, c.antialiased);
        }
    save_splats(folder / "b.ply", splats, SaveOptions{.comments = {"HERE"}});
    std::string text = file_bytes(folder / "b.ply");
    text.replace(text.find("HERE"), 4, "SplatRenderMode: 2dgs");
    const SplatScene flat = read_splats(folder.write("b.ply", text));
    EXPECT_FALSE(flat.antialiased);
    ASSERT_EQ(flat.remarks.size(), 1u);
    EXPECT_NE(flat.remarks[0].find("2DGS"), std::string::npos);
}

TEST(Ply, ADensityIsSavedAsOthersShowItAndReadAsItWas) {
    TempFolder folder;
    Gaussians density = random_splats(30, 1);
    density.density = true;
    save_splats(folder / "a.ply", density, SaveOptions{.comments = {"by hand"}});
    const SplatScene scene = read_splats(folder / "a.ply");
    EXPECT_TRUE(scene.gaussians.density);
    EXPECT_EQ(scene.comments, (std::vector<std::string>{"by hand"}));
    for (size_t i = 0; i < density.size(); ++i)
        EXPECT_NEAR(scene.gaussians.opacity_logits[i], density.opacity_logits[i], 1e-5);

    // Without the comment, a reader sees the fitted opacities.
    std::string bytes = test::file_bytes(folder / "a.ply");
    const std::string comment = "comment ewa kernel density\n";
    const size_t at = bytes.find(comment);
    ASSERT_NE(at, std::string::npos);
    folder.write("b.ply", bytes.erase(at, comment.size()));
    const Gaussians shown = load_splats(folder / "b.ply");
    EXPECT_FALSE(shown.density);
    Gaussians fitted = density;
    fit_opacities(fitted, false);
    EXPECT_EQ(shown.opacity_logits, fitted.opacity_logits);

    // The other formats hold these, too, and say so.
    const auto remarks = save_splats(folder / "c.spz", density, SaveOptions{});
    ASSERT_FALSE(remarks.empty());
    EXPECT_NE(remarks.front().find("--kernel density"), std::string::npos) << remarks.front();
    EXPECT_FALSE(load_splats(folder / "c.spz").density);
}

TEST(Ply, EveryCutIsAnError) {
    TempFolder folder;
    save_splats(folder / "a.ply", random_splats(2, 1));
    const std::string binary = test::file_bytes(folder / "a.ply");
    EXPECT_EQ(test::read_every_cut(folder / "a.ply", binary, [&] { load_splats(folder / "a.ply"); }), 0u);
    std::string text =
        header("ascii", "element face 1\nproperty list uchar int v\nelement vertex 1\n" + properties(kNames));
    text += "3 1 2 3\n";
    for (size_t i = 1; i <= kNames.size(); ++i) text += std::to_string(i) + " ";
    const auto path = folder.write("text.ply", text);
    // Without the last digit ("1" for "14") and without the blank behind it a text is still whole.
    EXPECT_EQ(test::read_every_cut(path, text, [&] { load_splats(path); }), 2u);
}

TEST(Ply, ClaimsAreCheckedBeforeMemoryIsTaken) {
    TempFolder folder;
    for (const char* count : {"4000000000", "18446744073709551615", "1000000000000000"})
        for (const char* format : {"binary_little_endian", "ascii"}) {
            const auto path = folder.write(
                "a.ply",
                header(format, std::string("element vertex ") + count + "\n" + properties(kNames)) + "12 13");
            expect_error<InputError>([&] { load_splats(path); }, {"a.ply", "byte", count, "5 bytes follow"});
        }
    const auto before = folder.write(
        "b.ply", header("ascii", "element face 4000000000\nproperty list uchar int v\nelement vertex 0\n" +
                                     properties(kNames)));
    expect_error<InputError>([&] { load_splats(before); }, {"4000000000 rows of \"face\""});
    const auto list = folder.write("c.ply", header("binary_little_endian",
                                                   "element face 1\nproperty list uint double v\n"
                                                   "element vertex 0\n" +
                                                       properties(kNames)) +
                                                "\xff\xff\xff\xff");
    expect_error<InputError>([&] { load_splats(list); }, {"c.ply", "the list \"v\""});
    const auto nothing = folder.write(
        "d.ply",
        header("ascii", "element none 18446744073709551615\nelement vertex 0\n" + properties(kNames)));
    EXPECT_EQ(load_splats(nothing).size(), 0u);
}

TEST(Ply, NamesWhatIsWrong) {
    TempFolder folder;
    const auto refuse = [&](const std::string& bytes, std::initializer_list<std::string> parts) {
        const auto path = folder.write("a.ply", bytes);
        expect_error<InputError>([&] { load_splats(path); }, parts);
    };
    const std::string vertex = "element vertex 0\n", all = vertex + properties(kNames);
    for (size_t i = 0; i < kNames.size(); ++i) {
        if (kNames[i] == "scale_2") continue;  // of flat splats
        std::vector<std::string> names = kNames;
        names.erase(names.begin() + std::ptrdiff_t(i));
        refuse(header("ascii", vertex + properties(names)), {"a.ply", "\"" + kNames[i] + "\""});
    }
    refuse(header("ascii", vertex + properties({"x", "y", "z", "red", "green", "blue"})), {"point cloud"});
    refuse(header("ascii", vertex + properties({"packed_position", "packed_rotation"}, "uint")),
           {"no element \"chunk\""});
    std::string many;
    for (int i = 0; i < 1100; ++i) many += "property char p" + std::to_string(i) + "\n";
    refuse(header("ascii", vertex + many), {"more than 1024 properties"});
    refuse(header("ascii", all + properties({"f_rest_0", "f_rest_1"})), {"2 properties f_rest_*"});
    refuse(header("ascii", all + properties({"f_rest_1", "f_rest_2", "f_rest_3", "f_rest_4", "f_rest_5",
                                             "f_rest_6", "f_rest_7", "f_rest_8", "f_rest_9"})),
           {"\"f_rest_0\""});
    refuse(header("ascii", vertex + "property list uchar float x\n"), {"\"x\"", "list"});
    refuse(header("ascii", all + "property float x\n"), {"\"x\" is declared twice"});
    refuse(header("ascii", "element face 0\n"), {"no element \"vertex\""});
    refuse(header("ascii", vertex + "property half x\n"), {"\"half\""});
    refuse(header("ascii", vertex + "property list float float x\n"), {"length"});
    refuse(header("ascii", "element vertex -1\n"), {"\"-1\""});
    refuse(header("ascii", "property float x\n"), {"precedes the first element"});
    refuse(header("binary_middle_endian", all), {"binary_middle_endian"});
    refuse("ply\n" + all + "end_header\n", {"format"});
    refuse("ply\nformat ascii 1.0\nnonsense\n", {"nonsense"});
    refuse("solid\n", {"not a PLY"});
    refuse("", {"not a PLY"});
    refuse(header("ascii", "element vertex 1\n" + properties(kNames)) + "1 2 x 4 5 6 7 8 9 10 11 12 13 14",
           {"\"x\"", "byte"});
    refuse("ply" + std::string(100000, 'x'), {"longer"});
}

TEST(PointsPly, ReadsPositionsAndColours) {
    TempFolder folder;
    const std::string rows = "1 2 3 10 20 300\nnan 0 0 1 1 1\n1e300 0 0 1 1 1\n-1 -2 -3.5 0 255 -7\n";
    const auto path =
        folder.write("a.ply", header("ascii", "element vertex 4\n" + properties({"x", "y", "z"}) +
                                                  properties({"red", "green", "blue"}, "int")) +
                                  rows);
    const io::PlyPoints read = io::read_points_ply(path);
    EXPECT_EQ(read.dropped.count, 2);
    ASSERT_EQ(read.points.positions.size(), 2u);
    EXPECT_EQ(read.points.positions[1], glm::dvec3(-1, -2, -3.5));
    EXPECT_EQ(read.points.colors[0], (std::array<uint8_t, 3>{10, 20, 255}));
    EXPECT_EQ(read.points.colors[1], (std::array<uint8_t, 3>{0, 255, 0}));
}

TEST(PointsPly, FloatColoursAndNone) {
    TempFolder folder;
    const std::string xyz = "element vertex 1\n" + properties({"x", "y", "z"});
    const auto floats =
        folder.write("f.ply", header("ascii", xyz + properties({"red", "green", "blue"})) + "1 2 3 0.2 1 0");
    EXPECT_EQ(io::read_points_ply(floats).points.colors[0], (std::array<uint8_t, 3>{51, 255, 0}));
    const auto grey = folder.write("g.ply", header("ascii", xyz) + "1 2 3");
    EXPECT_EQ(io::read_points_ply(grey).points.colors[0], (std::array<uint8_t, 3>{128, 128, 128}));
    const auto flat =
        folder.write("h.ply", header("ascii", "element vertex 1\n" + properties({"x", "y"})) + "1 2");
    expect_error<InputError>([&] { io::read_points_ply(flat); }, {"\"z\""});
}

/// A PLY of these columns, with their values in the rows.
template <class Color>
std::string ply_with_colors(const std::array<const char*, 3>& names, const char* type, bool splats,
                            const std::vector<std::array<Color, 3>>& colors) {
    std::vector<std::string> before = {"x", "y", "z"};
    if (splats) before.insert(before.end(), kNames.begin() + 6, kNames.end());
    std::string bytes = header("binary_little_endian", "element vertex " + std::to_string(colors.size()) +
                                                           "\n" + properties(before) +
                                                           properties({names[0], names[1], names[2]}, type));
    for (size_t i = 0; i < colors.size(); ++i) {
        for (size_t k = 0; k < before.size(); ++k) bytes += bytes_of(float(k == 10 || k == 0 ? i + 1 : 0.5));
        for (const Color v : colors[i]) bytes += bytes_of(v);
    }
    return bytes;
}

constexpr std::array<std::array<const char*, 3>, 4> kColorNames = {
    {{"red", "green", "blue"},
     {"diffuse_red", "diffuse_green", "diffuse_blue"},
     {"r", "g", "b"},
     {"R", "G", "B"}}};

TEST(Ply, ColorsOfPointsHaveTheirScale) {
    const TempFolder folder;
    const std::vector<std::array<uint8_t, 3>> expected = {{0, 51, 255}, {102, 1, 200}};
    const auto check = [&](const std::string& bytes) {
        EXPECT_EQ(io::read_points_ply(folder.write("a.ply", bytes)).points.colors, expected);
    };
    for (const auto& names : kColorNames) {
        check(ply_with_colors<uint8_t>(names, "uchar", false, {{0, 51, 255}, {102, 1, 200}}));
        check(ply_with_colors<uint16_t>(names, "ushort", false, {{0, 13107, 65535}, {26214, 257, 51400}}));
        check(ply_with_colors<uint16_t>(names, "uint16", false, {{0, 51, 255}, {102, 1, 200}}));
        check(ply_with_colors<uint32_t>(names, "uint", false, {{0, 51, 255}, {102, 1, 200}}));
        check(ply_with_colors<float>(names, "float", false, {{0, 51, 255}, {102, 1, 200}}));
        check(ply_with_colors<float>(names, "float", false, {{0, 0.2f, 1}, {0.4f, 1 / 255.f, 200 / 255.f}}));
        check(ply_with_colors<double>(names, "double", false, {{0, 0.2, 1}, {0.4, 1 / 255.0, 200 / 255.0}}));
        check(ply_with_colors<double>(names, "double", false, {{0, 13107, 65535}, {26214, 257, 51400}}));
    }
    // Two of three are no colours.
    EXPECT_EQ(
        io::read_points_ply(folder.write("b.ply", ply_with_colors<uint8_t>({"red", "green", "x2"}, "uchar",
                                                                           false, {{1, 2, 3}})))
            .points.colors[0],
        (std::array<uint8_t, 3>{128, 128, 128}));
}

TEST(Ply, ColorsStandForTheFirstCoefficients) {
    const TempFolder folder;
    for (const auto& names : kColorNames) {
        const SplatScene scene = read_splats(folder.write(
            "a.ply", ply_with_colors<uint8_t>(names, "uchar", true, {{0, 51, 255}, {102, 1, 200}})));
        EXPECT_EQ(scene.remarks, std::vector<std::string>());
        const Gaussians& g = scene.gaussians;
        ASSERT_EQ(g.size(), 2u);
        EXPECT_NEAR(g.sh[1] * 0.28209479177387814 + 0.5, 0.2, 1e-6);
        EXPECT_NEAR(g.sh[2] * 0.28209479177387814 + 0.5, 1, 1e-6);
        EXPECT_NEAR(g.sh[3] * 0.28209479177387814 + 0.5, 0.4, 1e-6);
        const Gaussians wide = load_splats(folder.write(
            "b.ply",
            ply_with_colors<uint16_t>(names, "ushort", true, {{0, 13107, 65535}, {26214, 257, 51400}})));
        for (size_t k = 0; k < 6; ++k) EXPECT_NEAR(wide.sh[k], g.sh[k], 1e-6);
    }
    // A cloud with colours is still none.
    expect_error<InputError>(
        [&] {
            load_splats(
                folder.write("c.ply", ply_with_colors<uint8_t>(kColorNames[0], "uchar", false, {{1, 2, 3}})));
        },
        {"f_dc_0", "point cloud"});
}

TEST(Ply, TheFilterOfMipSplattingIsFolded) {
    const TempFolder folder;
    const auto written = [&](const std::vector<float>& filters) {
        std::vector<std::string> names = kNames;
        names.push_back("filter_3D");
        std::string bytes =
            header("binary_little_endian",
                   "element vertex " + std::to_string(filters.size()) + "\n" + properties(names));
        for (const float filter : filters) {
            for (const float v :
                 {1.f, 2.f, 3.f, .1f, .2f, .3f, .4f, -1.f, -2.f, -3.f, 1.f, 0.f, 0.f, 0.f, filter})
                bytes += bytes_of(v);
        }
        return folder.write("a.ply", bytes);
    };
    const SplatScene scene = read_splats(written({0.15f, 0, NAN}));
    ASSERT_EQ(scene.remarks.size(), 1u);
    EXPECT_NE(scene.remarks[0].find("filter_3D"), std::string::npos);
    const Gaussians& g = scene.gaussians;
    double opacity = 1 / (1 + std::exp(-0.4));
    for (int k = 0; k < 3; ++k) {
        const double variance = std::exp(-2.0 * (k + 1)), wide = variance + 0.15 * 0.15;
        EXPECT_NEAR(g.log_scales[size_t(k)], std::log(wide) / 2, 1e-6);
        opacity *= std::sqrt(variance / wide);
    }
    EXPECT_NEAR(g.opacity_logits[0], std::log(opacity / (1 - opacity)), 1e-6);
    EXPECT_EQ(g.log_scales[3], -1);
    EXPECT_EQ(g.opacity_logits[1], 0.4f);
    EXPECT_EQ(scene::undrawable_text(g), "scales of 1");
}

TEST(Ply, SurfelsAreFlatEllipsoids) {
    const TempFolder folder;
    std::vector<std::string> names = kNames;
    std::erase(names, "scale_2");
    std::string bytes = header("binary_big_endian", "element vertex 1\n" + properties(names));
    for (size_t i = 0; i < names.size(); ++i) {
        std::string value = bytes_of(float(i) / 2);
        bytes += std::string(value.rbegin(), value.rend());
    }
    const SplatScene scene = read_splats(folder.write("a.ply", bytes));
    ASSERT_EQ(scene.remarks.size(), 1u);
    EXPECT_NE(scene.remarks[0].find("2DGS"), std::string::npos);
    EXPECT_EQ(scene.gaussians.log_scales[1], 4);
    EXPECT_NEAR(scene.gaussians.log_scales[2], 4 - std::log(1e6), 1e-4);
    EXPECT_EQ(scene.gaussians.quaternions[0], 4.5f);
}

}  // namespace
