// SPDX-License-Identifier: Apache-2.0
// OpenUSD: what the written text says, and that files are not read.
#include <cmath>

#include "ewa/splat_files.h"
#include "support/splat_scenes.h"
#include "support/temp_folder.h"
#include "support/usd_values.h"
#include "support/zip_bytes.h"

namespace {

using namespace ewa;
using test::expect_error;
using test::file_bytes;
using test::TempFolder;
using test::usd_numbers;

TEST(Usd, TextAsLaidOut) {
    const TempFolder folder;
    Gaussians g;
    g.resize(1);
    g.means = {1, 2, 3};
    g.log_scales = {std::log(0.5f), std::log(0.25f), std::log(0.125f)};
    g.opacity_logits = {float(std::log(3.0))};
    g.sh = {0.1f, 0.2f, 0.3f};
    g.quaternions = {0.5f, 0.1f, 0.7f, -0.5f};
    save_splats(folder / "a.usda", g, SaveOptions{});
    const std::string text = file_bytes(folder / "a.usda");
    EXPECT_TRUE(text.starts_with("#usda 1.0\n(\n    defaultPrim = \"Splats\"\n")) << text;
    for (const char* part :
         {"    upAxis = \"Y\"\n", "\ndef ParticleField3DGaussianSplat \"Splats\" (\n",
          "    uniform token colorSpace:name = \"srgb_rec709_display\"\n",
          "    float3[] extent = [(1, -2, -3), (1, -2, -3)]\n", "    point3f[] positions = [(1, -2, -3)]\n",
          "    uniform int radiance:sphericalHarmonicsDegree = 0\n", "        elementSize = 1\n"})
        EXPECT_NE(text.find(part), std::string::npos) << part << text;
    const auto expect = [&](const char* name, const std::vector<float>& values) {
        const std::vector<float> written = usd_numbers(text, name);
        ASSERT_EQ(written.size(), values.size()) << name;
        for (size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(written[i], values[i], 1e-6) << name << i;
    };
    expect("scales", {0.5f, 0.25f, 0.125f});
    expect("opacities", {0.75f});
    expect("radiance:sphericalHarmonicsCoefficients", {0.1f, 0.2f, 0.3f});
    // The splat's own axes, turned by 180 degrees about x: (0, 1, 0, 0) times the quaternion of length 1, up to the sign.
    const std::vector<float> turned = usd_numbers(text, "orientations");
    ASSERT_EQ(turned.size(), 4u);
    const float q[4] = {-0.1f, 0.5f, 0.5f, 0.7f};
    const float sign = turned[0] < 0 ? 1.0f : -1.0f;
    for (size_t k = 0; k < 4; ++k) EXPECT_NEAR(sign * turned[k], q[k], 1e-6);
}

TEST(Usd, TextAndPackageHoldTheScene) {
    const TempFolder folder;
    const Gaussians scene = test::storable_splats(3, 50, 3);
    for (const char* name : {"a.usda", "a.usdz"}) {
        EXPECT_TRUE(save_splats(folder / name, scene, SaveOptions{}).empty());
        const Gaussians back = test::usd_splats(file_bytes(folder / name));
        EXPECT_EQ(back.means, scene.means);
        EXPECT_EQ(back.sh, scene.sh);
        const test::Largest d = test::largest_differences(scene, back);
        EXPECT_LT(d.rotation, 1e-6);
        EXPECT_LT(d.scale, 1e-6);
        EXPECT_LT(d.opacity, 1e-7);
    }
    const std::string package = file_bytes(folder / "a.usdz");
    EXPECT_EQ(package.find("#usda"), 64u);
    save_splats(folder / "b.usdz", scene, SaveOptions{});
    EXPECT_EQ(file_bytes(folder / "b.usdz"), package);
    EXPECT_EQ(save_splats(folder / "c.usda", scene, SaveOptions{.antialiased = true}).size(), 1u);
    save_splats(folder / "none.usda", Gaussians{}, SaveOptions{});
    EXPECT_NE(file_bytes(folder / "none.usda").find("positions = []\n"), std::string::npos);
}

TEST(Usd, IsNotRead) {
    const TempFolder folder;
    const Gaussians scene = test::storable_splats(3, 5, 0);
    for (const char* name : {"a.usda", "a.usdz"}) save_splats(folder / name, scene, SaveOptions{});
    EXPECT_EQ(format_of_file(folder / "a.usda"), SplatFormat::usda);
    EXPECT_EQ(format_of_file(folder / "a.usdz"), SplatFormat::usdz);
    folder.write("b.usdz", test::zipped({{"a.usdc", "PXR-USDC\1"}}));
    folder.write("b.usd", "#usda 1.0\n");
    folder.write("c.usd", "PXR-USDC\1");
    for (const char* name : {"a.usda", "a.usdz", "b.usdz", "b.usd", "c.usd"})
        expect_error<InputError>([&] { load_splats(folder / name); },
                                 {name, "ewa writes USD and does not read it"});
}

}  // namespace
