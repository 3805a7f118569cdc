// SPDX-License-Identifier: Apache-2.0
// The CPU reference's pictures are the references; the devices' pictures are compared with them.
#include <algorithm>
#include <cmath>
#include <set>

#include "ewa/renderer.h"
#include "golden/devices.h"
#include "golden/scenes.h"
#include "reference/render.h"
#include "reference/surface.h"
#include "support/temp_folder.h"

namespace ewa::test {
namespace {

Image scaled(Image image, double scale) {
    for (float& v : image.pixels) v = float(v * scale);
    return image;
}

Image to_image(const reference::Raster& raster, double scale, bool one_minus = false) {
    Image image(raster.width, raster.height, raster.channels);
    for (size_t i = 0; i < image.pixels.size(); ++i)
        image.pixels[i] = float(scale * (one_minus ? 1 - raster.values[i] : raster.values[i]));
    return image;
}

/// From -1 to 1 to what a picture can hold.
Image lifted(Image normals) {
    for (float& v : normals.pixels) v = 0.5f + 0.5f * v;
    return normals;
}

Image cpu_picture(const GoldenScene& scene) {
    const auto rendered = reference::render(scene.gaussians, scene.camera, scene.options);
    const auto surfaces = reference::surfaces(scene.gaussians, scene.camera, scene.options);
    if (scene.shown == Shown::median_depth)
        return to_image(reference::median_depth(rendered, surfaces), scene.scale);
    if (scene.shown == Shown::normal) return lifted(to_image(reference::normals(rendered, surfaces), 1));
    if (scene.shown == Shown::alpha) return to_image(rendered.blended.transmittance, scene.scale, true);
    return to_image(scene.shown == Shown::depth ? rendered.blended.depth : rendered.blended.color,
                    scene.scale);
}

Image device_picture(std::shared_ptr<gpu::Device> device, const GoldenScene& scene) {
    Renderer renderer(std::move(device), scene.gaussians, scene.options);
    if (scene.shown == Shown::normal) return lifted(renderer.render(scene.camera, Drawing::normal).normal);
    if (scene.shown == Shown::median_depth)
        return scaled(renderer.render(scene.camera, Drawing::median_depth).median_depth, scene.scale);
    Rendering rendering = renderer.render(scene.camera, scene.shown == Shown::depth);
    return scaled(scene.shown == Shown::depth   ? std::move(rendering.depth)
                  : scene.shown == Shown::alpha ? std::move(rendering.alpha)
                                                : std::move(rendering.color),
                  scene.scale);
}

class GoldenSceneTest : public testing::TestWithParam<GoldenScene> {};

TEST_P(GoldenSceneTest, ReferenceIsTheTwins) {
    EXPECT_TRUE(is_reference(GetParam().name, cpu_picture(GetParam())));
}

TEST_P(GoldenSceneTest, DevicesAgree) {
    ASSERT_FALSE(all_devices().empty());
    for (const auto& device : all_devices())
        EXPECT_TRUE(matches_golden(GetParam().name, device_picture(device, GetParam()), GetParam().tolerance,
                                   device_info(*device).name));
}

INSTANTIATE_TEST_SUITE_P(Golden, GoldenSceneTest, testing::ValuesIn(golden_scenes()),
                         [](const auto& test) { return test.param.name; });

/// On the axis a ball of radius s at depth z is a round footprint of variance (f s / z)^2 + LOW_PASS: no CPU reference
/// is needed to know the picture.
TEST(GoldenOneSplat, ReferenceIsTheClosedForm) {
    const int width = 64, height = 48;
    const double variance = std::pow(60 * 0.6 / 4, 2) + 0.3, color[] = {0.9, 0.6, 0.2};
    const double background[] = {0.1, 0.2, 0.3};
    Image expected(width, height, 3);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double dx = x + 0.5 - 30.25, dy = y + 0.5 - 21.5;
            double alpha = 0.8 * std::exp(-0.5 * (dx * dx + dy * dy) / variance);
            if (alpha < 1.0 / 255) alpha = 0;
            for (int c = 0; c < 3; ++c)
                expected.at(x, y)[c] = float(color[c] * alpha + background[c] * (1 - alpha));
        }
    EXPECT_TRUE(matches_golden("one_splat", expected, {1e-5, 1e-5, 0}, "closed form"));
}

/// What --kernel antialias is for: the mean over many rays through each pixel. The peak kernel draws sub-pixel
/// splats too large.
TEST(GoldenAntialias, IsNearerToSupersampling) {
    constexpr int kFactor = 8;
    GoldenScene fine = sub_pixel_scene(Footprint::peak);
    fine.camera.width *= kFactor;
    fine.camera.height *= kFactor;
    for (double* length : {&fine.camera.fx, &fine.camera.fy, &fine.camera.cx, &fine.camera.cy})
        *length *= kFactor;
    for (const auto& device : all_devices()) {
        const Image truth = downscale(device_picture(device, fine), kFactor);
        const double antialiased = psnr(device_picture(device, sub_pixel_scene(Footprint::antialias)), truth);
        const double peak = psnr(device_picture(device, sub_pixel_scene(Footprint::peak)), truth);
        printf("    against %d x %d rays a pixel: antialias %.2f dB, peak %.2f dB\n", kFactor, kFactor,
               antialiased, peak);
        EXPECT_GT(antialiased, 25);
        EXPECT_GT(antialiased, peak + 6);
    }
}

/// The comparer sees a wrong picture, says where, and leaves what is needed to look at it.
TEST(GoldenComparer, FailsAndLeavesPicturesAndAPage) {
    const TempFolder folder;
    const GoldenFolders folders{folder / "references", folder / "failures"};
    const GoldenFolders ours;
    const Image right = load_image(ours.references / "one_splat.png");
    std::filesystem::create_directories(folders.references);
    std::filesystem::copy_file(ours.references / "one_splat.png", folders.references / "s.png");
    const Tolerance tolerance{0.01, 1e-4, 2};
    EXPECT_TRUE(matches_golden("s", right, tolerance, "d", folders));

    Image wrong = right;
    wrong.at(5, 7)[1] += 0.02f;
    const auto one = matches_golden("s", wrong, tolerance, "d", folders);
    EXPECT_FALSE(one);
    EXPECT_NE(std::string(one.message()).find("at 5,7"), std::string::npos) << one.message();
    Image many = right;
    for (int x = 0; x < 3; ++x) many.at(x, 0)[0] += 0.005f;
    EXPECT_FALSE(matches_golden("s", many, tolerance, "d", folders));
    Image nan = right;
    nan.at(1, 1)[0] = std::nanf("");
    EXPECT_FALSE(matches_golden("s", nan, tolerance, "d", folders));
    EXPECT_FALSE(matches_golden("s", Image(9, 9, 3), tolerance, "d", folders));

    const auto absent = matches_golden("absent", right, tolerance, "d", folders);
    EXPECT_FALSE(absent);
    EXPECT_NE(std::string(absent.message()).find("golden-accept"), std::string::npos) << absent.message();
    EXPECT_TRUE(std::filesystem::exists(folder / "failures/absent@d/candidate.png"));
    const auto page = [&] { return file_bytes(folder / "failures/index.html"); };
    EXPECT_FALSE(matches_golden("s", wrong, tolerance, "d", folders));
    for (const char* picture : {"candidate", "reference", "difference"}) {
        EXPECT_TRUE(std::filesystem::exists(folder / "failures/s@d" / (std::string(picture) + ".png")))
            << picture;
        EXPECT_NE(page().find("s@d/" + std::string(picture)), std::string::npos) << picture;
    }
    // Once it passes, its pictures are gone.
    EXPECT_TRUE(matches_golden("s", right, tolerance, "d", folders));
    EXPECT_EQ(page().find("s@d"), std::string::npos);
}

TEST(GoldenReferences, AreSmallAndAllUsed) {
    std::set<std::string> expected;
    for (const GoldenScene& scene : golden_scenes()) expected.insert(scene.name);
    uintmax_t bytes = 0;
    size_t others = 0;
    for (const auto& entry : std::filesystem::directory_iterator(GoldenFolders{}.references)) {
        bytes += entry.file_size();
        const std::string name = entry.path().stem().string();
        if (expected.erase(name) == 0) {
            ++others;
            EXPECT_TRUE(name.starts_with("lens_") || name.starts_with("training_") ||
                        name.starts_with("viewer_"))
                << name << " is no scene's";
        }
        // A picture of one colour would show nothing.
        const Image image = load_image(entry.path());
        const auto [low, high] = std::minmax_element(image.pixels.begin(), image.pixels.end());
        EXPECT_GT(*high - *low, 0.2) << name;
    }
    EXPECT_TRUE(expected.empty()) << *expected.begin() << " has no reference";
    EXPECT_EQ(others, 17u);
    EXPECT_LT(bytes, 600u * 1024);
}

}  // namespace
}  // namespace ewa::test
