// SPDX-License-Identifier: Apache-2.0
// OpenUSD: what its text means, what comes back, and what is refused. The layers of the tests that read are written here.
#include <algorithm>
#include <cstring>

#include "ewa/splat_edit.h"
#include "ewa/splat_files.h"
#include "support/splat_scenes.h"
#include "support/temp_folder.h"
#include "support/zip_bytes.h"

namespace {

using namespace ewa;
using test::expect_error;
using test::file_bytes;
using test::TempFolder;

/// One splat of SH degree 0 with different values everywhere.
const std::string kField = R"(
    float3[] scales = [(0.5, 0.25, 0.125)]
    quatf[] orientations = [(0.5, 0.1, 0.7, -0.5)]
    float[] opacities = [0.75]
    int radiance:sphericalHarmonicsDegree = 0
    float3[] radiance:sphericalHarmonicsCoefficients = [(0.1, 0.2, 0.3)] ( elementSize = 1 )
)";

std::string field(const std::string& positions, const std::string& rest = kField) {
    return "def ParticleField3DGaussianSplat \"A\" {\n    point3f[] positions = " + positions + rest + "}\n";
}

Gaussians read(const TempFolder& folder, const std::string& text) {
    return load_splats(folder.write("read.usda", "#usda 1.0\n" + text));
}

glm::dvec3 mean_of(const Gaussians& g) {
    return g.size() == 1 ? g.world_mean(0) : glm::dvec3(NAN);
}

TEST(Usd, ValuesOfATextByHand) {
    TempFolder folder;
    const Gaussians g = read(folder, "( upAxis = \"Y\" ) # a comment\n" + field("[(1, 2, 3)]"));
    ASSERT_EQ(g.size(), 1u);
    EXPECT_EQ(mean_of(g), glm::dvec3(1, -2, -3));  // y down, z forward
    EXPECT_FLOAT_EQ(g.log_scales[1], std::log(0.25f));
    EXPECT_NEAR(g.opacity_logits[0], std::log(3.0), 1e-6);
    EXPECT_EQ(g.sh, (std::vector<float>{0.1f, 0.2f, 0.3f}));
    // The splat's own axes, turned by 180 degrees about x: (0, 1, 0, 0) times the quaternion, up to the sign.
    const float q[4] = {-0.1f, 0.5f, 0.5f, 0.7f};
    const float sign = g.quaternions[0] < 0 ? 1.0f : -1.0f;
    for (size_t k = 0; k < 4; ++k) EXPECT_NEAR(sign * g.quaternions[k], q[k], 1e-6);
}

TEST(Usd, StagesWithZUp) {
    TempFolder folder;
    EXPECT_EQ(mean_of(read(folder, "(\n upAxis = \"Z\"\n)\n" + field("[(1, 2, 3)]"))), glm::dvec3(1, -3, 2));
}

TEST(Usd, TransformsOfParents) {
    TempFolder folder;
    const auto placed = [&](const std::string& ops) {
        const glm::dvec3 m =
            mean_of(read(folder, "def Xform \"P\" {\n" + ops + field("[(1, 2, 3)]") + "}\n"));
        return glm::dvec3(m.x, -m.y, -m.z);  // back to y up
    };
    EXPECT_EQ(placed("double3 xformOp:translate = (10, 20, 30)\n float3 xformOp:scale = (2, 2, 2)\n"
                     "uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:scale\"]\n"),
              glm::dvec3(12, 24, 36));
    EXPECT_EQ(
        placed("matrix4d xformOp:transform:a = ( (0, 1, 0, 0), (-1, 0, 0, 0), (0, 0, 1, 0), (5, 6, 7, 1) )\n"
               "uniform token[] xformOpOrder = [\"xformOp:transform:a\"]\n"),
        glm::dvec3(3, 7, 10));  // x becomes y, y becomes -x
    const auto near = [](const glm::dvec3& a, const glm::dvec3& b) { return glm::length(a - b) < 1e-5; };
    EXPECT_TRUE(
        near(placed("float xformOp:rotateZ = 90\nuniform token[] xformOpOrder = [\"xformOp:rotateZ\"]\n"),
             {-2, 1, 3}));
    // About x first: (1, 2, 3) -> (1, -3, 2) -> (3, 1, 2) by z.
    EXPECT_TRUE(near(placed("float3 xformOp:rotateXYZ = (90, 0, 90)\n"
                            "uniform token[] xformOpOrder = [\"xformOp:rotateXYZ\"]\n"),
                     {3, 1, 2}));
    EXPECT_TRUE(near(placed("quatf xformOp:orient = (0.70710678, 0, 0, 0.70710678)\n"
                            "uniform token[] xformOpOrder = [\"xformOp:orient\"]\n"),
                     {-2, 1, 3}));
}

TEST(Usd, WhatIsSkippedIsSaid) {
    TempFolder folder;
    const std::string text =
        "#usda 1.0\n( subLayers = [ @a(1].usda@ ] )\n"
        "def Scope \"S\" ( references = @other.usda@</A> ) { rel x = </S>\n custom string y = '''it's } "
        "{'''\n"
        "dictionary d = { string a = \"]\" } }\n"
        "over \"O\" { " +
        field("[(9, 9, 9)]") + "}\nclass \"C\" { " + field("[(9, 9, 9)]") +
        "}\n"
        "def \"I\" { token visibility = \"invisible\"\n" +
        field("[(9, 9, 9)]") +
        "}\n"
        "def \"D\" ( active = false ) { " +
        field("[(9, 9, 9)]") +
        "}\n"
        "def \"V\" { variantSet \"v\" = { \"a\" { " +
        field("[(9, 9, 9)]") + "} }\n" + field("[(1, 2, 3)]") + "}\n";
    const SplatScene scene = read_splats(folder.write("a.usda", text));
    EXPECT_EQ(mean_of(scene.gaussians), glm::dvec3(1, -2, -3));
    EXPECT_EQ(scene.remarks.size(), 3u);
    EXPECT_EQ(scene.variant, "1 particle field");
}

TEST(Usd, HalfPrecisionAndLinearLight) {
    TempFolder folder;
    std::string text = field("[(1, 2, 3)]");
    text.insert(text.find("    float3[] scales"),
                "    uniform token colorSpace:name = \"lin_rec709_scene\"\n");
    for (const auto& [from, to] : {std::pair{"point3f[] positions", "point3h[] positionsh"},
                                   {"float3[] scales", "half3[] scalesh"},
                                   {"quatf[] orientations", "quath[] orientationsh"},
                                   {"float[] opacities", "half[] opacitiesh"},
                                   {"float3[] radiance:sphericalHarmonicsCoefficients",
                                    "half3[] radiance:sphericalHarmonicsCoefficientsh"}})
        text.replace(text.find(from), std::strlen(from), to);
    const Gaussians g = read(folder, text);
    EXPECT_EQ(mean_of(g), glm::dvec3(1, -2, -3));
    constexpr double kC0 = 0.28209479177387814;
    const double linear = 0.5 + 0.1 * kC0, srgb = 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
    EXPECT_NEAR(g.sh[0], (srgb - 0.5) / kC0, 1e-6);
}

TEST(Usd, ComesBackFromTextAndPackage) {
    TempFolder folder;
    const Gaussians scene = test::storable_splats(3, 50, 3);
    for (const char* name : {"a.usda", "a.usdz"}) {
        EXPECT_TRUE(save_splats(folder / name, scene, SaveOptions{}).empty());
        const Gaussians back = load_splats(folder / name);
        EXPECT_EQ(back.means, scene.means);
        EXPECT_EQ(back.sh, scene.sh);
        const test::Largest d = test::largest_differences(scene, back);
        EXPECT_LT(d.rotation, 1e-6);
        EXPECT_LT(d.scale, 1e-6);
        EXPECT_LT(d.opacity, 1e-7);
    }
    EXPECT_EQ(format_of_file(folder / "a.usdz"), SplatFormat::usdz);
    EXPECT_EQ(format_of_file(folder / "a.usda"), SplatFormat::usda);
    const std::string package = file_bytes(folder / "a.usdz");
    EXPECT_EQ(package.find("#usda"), 64u);
    save_splats(folder / "b.usdz", scene, SaveOptions{});
    EXPECT_EQ(file_bytes(folder / "b.usdz"), package);
    EXPECT_EQ(save_splats(folder / "c.usda", scene, SaveOptions{.antialiased = true}).size(), 1u);
    save_splats(folder / "none.usda", Gaussians{}, SaveOptions{});
    EXPECT_EQ(load_splats(folder / "none.usda").size(), 0u);
}

TEST(Usd, RefusesWithTheReason) {
    TempFolder folder;
    const auto refuse = [&](const std::string& text, std::initializer_list<std::string> parts) {
        const auto path = folder.write("a.usda", text);
        expect_error<InputError>([&] { load_splats(path); }, parts);
    };
    const std::string head = "#usda 1.0\n";
    refuse("PXR-USDC\1\2", {"a.usda", "binary", "usdcat"});
    refuse("#usdc 1.0", {"#usda 1.0"});
    refuse(head + "def Mesh \"m\" {}", {"no prim has the type", "usdcat --flatten"});
    refuse(head + field("[(1, 2)]"), {"a.usda: line 3", "','"});
    refuse(head + field("[(1, 2, x)]"), {"line 3", "a number is missing"});
    refuse(head + field("[(1, 2, 1e99999)]"), {"line 3", "too large"});
    refuse(head + field("[(1, 2, 3), (4, 5, 6)]"), {"line 2", "2 positions and 1 opacities"});
    refuse(head + "def ParticleField3DGaussianSplat \"A\" {}", {"A has no positions"});
    refuse(head + "def ParticleField3DGaussianSplat \"A\" { point3f[] positions.timeSamples = { 0: [] } }",
           {"change with time"});
    refuse(head + "def \"A\" { ", {"'}' is missing"});
    refuse(head + "def \"A\" { int x = [1, (2] }", {"')' is missing"});
    refuse(head + "def \"A", {"has no end"});
    refuse(head + "int x = 3", {"outside of a prim"});
    refuse(head + std::string(5000, '('), {"nested too deeply"});
    std::string deep;
    for (int i = 0; i < 5000; ++i) deep += "def \"a\" { ";
    refuse(head + deep, {"nested too deeply"});
    std::string wrong = field("[(1, 2, 3)]");
    wrong.replace(wrong.find("Degree = 0"), 10, "Degree = 1");
    refuse(head + wrong, {"1 SH coefficients for 1 splats of SH degree 1"});
    wrong.replace(wrong.find("Degree = 1"), 10, "Degree = -");
    refuse(head + wrong, {"line"});
    refuse(head + "def \"P\" { uniform token[] xformOpOrder = [\"xformOp:matrix\"] " + field("[(1, 2, 3)]") +
               "}",
           {"xformOp:matrix has no value"});
    refuse(head + "def \"P\" { float xformOp:spin = 1\n uniform token[] xformOpOrder = [\"xformOp:spin\"] " +
               field("[(1, 2, 3)]") + "}",
           {"xformOp:spin is not supported"});
    folder.write("b.usdz", "PK\3\4");
    expect_error<InputError>([&] { load_splats(folder / "b.usdz"); }, {"b.usdz", "zip archive"});
    // Every damaged text is read or refused, and nothing worse.
    save_splats(folder / "c.usda", test::storable_splats(1, 1, 0), SaveOptions{});
    const std::string text = file_bytes(folder / "c.usda");
    for (size_t i = 0; i < text.size(); ++i) {
        std::string damaged = text;
        if (i % 2 == 0)
            damaged.resize(i);
        else
            damaged[i] = "()[]{}\"'#,=@<-x"[i % 15];
        try {
            load_splats(folder.write("d.usda", damaged));
        } catch (const InputError&) {
        }
    }
}

TEST(Usd, ListsThatAreEmptyAreErrors) {
    const TempFolder folder;
    const auto refuse = [&](const std::string& text, std::initializer_list<std::string> parts) {
        const auto path = folder.write("a.usda", "#usda 1.0\n" + text);
        expect_error<InputError>([&] { load_splats(path); }, parts);
    };
    for (const char* list : {"[]", "[\"inherited\", \"invisible\"]"})
        refuse(field("[(1, 2, 3)]", std::string("\n    token visibility = ") + list + kField),
               {"a.usda: line 4", "visibility is one text"});
    refuse(field("[(1, 2, 3)]", "\n    uniform token colorSpace:name = []" + kField),
           {"line 4", "colorSpace:name"});
    EXPECT_EQ(read(folder, field("[(1, 2, 3)]", "\n    token visibility = [\"inherited\"]" + kField)).size(),
              1u);
    std::string ops;
    for (int i = 0; i < 300; ++i) ops += "\"xformOp:translate:a\", ";
    refuse("def \"P\" { float3 xformOp:translate:a = (0, 0, 0)\n uniform token[] xformOpOrder = [" + ops +
               "]\n" + field("[(1, 2, 3)]") + "}",
           {"line 3", "more than 256 transforms"});
}

TEST(Usd, PackagesThatPeopleMake) {
    const TempFolder folder;
    const std::string layer = "#usda 1.0\n" + field("[(1, 2, 3)]");
    const auto package = [&](const std::vector<test::ZipEntry>& entries) {
        return folder.write("a.usdz", test::zipped(entries));
    };
    const SplatScene scene = read_splats(package(
        {{.name = "scene/", .content = ""}, {.name = "scene/a.usda", .content = layer, .method = 8}}));
    EXPECT_EQ(scene.format, SplatFormat::usdz);
    EXPECT_EQ(mean_of(scene.gaussians), glm::dvec3(1, -2, -3));
    const std::string volume = "#usda 1.0\ndef Volume \"g\" { def OmniNuRecFieldAsset \"d\" {} }";
    const std::string over = "#usda 1.0\n( subLayers = [@./gauss.usda@] )\n";
    for (const auto& path : {package({{"default.usda", over}, {"gauss.usda", volume}, {"x.nurec", "x"}}),
                             folder.write("b.usda", volume)})
        expect_error<InputError>([&] { load_splats(path); },
                                 {"NuRec", "ParticleField3DGaussianSplat", "PLY"});
    expect_error<InputError>(
        [&] {
            load_splats(package({{"a.usdc", "PXR-USDC\1"}}));
        },
        {"a.usdz: \"a.usdc\"", "usdcat --flatten"});
    expect_error<InputError>([&] { load_splats(package({{"a/", ""}})); }, {"a.usdz", "empty"});
}

TEST(Usd, OpacitiesBeyondOneAreNoted) {
    const TempFolder folder;
    std::string text = field("[(1, 2, 3)]");
    text.replace(text.find("0.75"), 4, "-7.5");
    const SplatScene scene = read_splats(folder.write("a.usda", "#usda 1.0\n" + text));
    ASSERT_EQ(scene.remarks.size(), 1u);
    EXPECT_NE(scene.remarks[0].find("1 opacities outside of 0..1 are clamped"), std::string::npos);
}

}  // namespace
