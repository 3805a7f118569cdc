// SPDX-License-Identifier: Apache-2.0
// What a caller of libewa gives with arrays of a wrong length is an error, at every function that takes it.
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/text.h"
#include "ewa/appearance.h"
#include "ewa/dataset.h"
#include "ewa/error.h"
#include "ewa/metrics.h"
#include "ewa/render_options.h"
#include "ewa/sky_map.h"
#include "ewa/splat_edit.h"
#include "ewa/splat_files.h"
#include "support/temp_folder.h"
#include "support/wrong_lengths.h"

namespace {

using namespace ewa;
using test::expect_error;

void expect_refused(const std::function<void()>& call, const std::string& part) {
    expect_error<InputError>(call, {part});
}

TEST(Lengths, OfSplatsAreChecked) {
    const test::TempFolder folder;
    const Gaussians right = test::storable_splats(1, 9, 0);
    const SkyMap sky{1, {0, 0, 0}};
    using Call = std::function<void(Gaussians)>;
    std::vector<std::pair<std::string, Call>> calls{
        {"check", [](const Gaussians& g) { check(g); }},
        {"sh_degree_present", [](const Gaussians& g) { sh_degree_present(g); }},
        {"set_world_means", [](Gaussians g) { set_world_means(g, std::vector<glm::dvec3>(g.size())); }},
        {"settle_origin", [](Gaussians g) { settle_origin(g); }},
        {"drawable", [](const Gaussians& g) { drawable(g, 0); }},
        {"transform_splats", [](Gaussians g) { transform_splats(g, glm::dmat4(2.0)); }},
        {"select_splats", [](Gaussians g) { select_splats(g, {0}); }},
        {"keep_splats", [](Gaussians g) { keep_splats(g, {0}); }},
        {"set_sh_degree", [](Gaussians g) { set_sh_degree(g, 3); }},
        {"decimate_splats", [](Gaussians g) { decimate_splats(g, 5); }},
        {"append_splats", [&](Gaussians g) { append_splats(g, right); }},
        {"append_splats of it",
         [&](const Gaussians& g) {
             Gaussians all = right;
             append_splats(all, g);
         }},
        {"sky_splats", [&](const Gaussians& g) { sky_splats(sky, g); }},
        {"fit_opacities", [](Gaussians g) { fit_opacities(g, true); }},
        {"morton_order", [](const Gaussians& g) { morton_order(g); }},
        {"sog_bytes",
         [&](const Gaussians& g) {
             std::vector<std::string> remarks;
             sog_bytes("a.sog", g, {}, remarks);
         }},
        {"save_levels", [&](const Gaussians& g) { save_levels(folder / "lod-meta.json", g, {}); }}};
    for (const char* name : {"a.ply", "a.compressed.ply", "a.splat", "a.spz", "a.sog", "meta.json",
                             "lod-meta.json", "a.glb", "a.gltf", "a.usda", "a.usdz"}) {
        calls.emplace_back(
            name, [&folder, name](const Gaussians& g) { save_splats(folder / name, g, SaveOptions{}); });
        calls.emplace_back(name, [&folder, name](const Gaussians& g) { save_splats(folder / name, g); });
    }
    for (const auto& [name, call] : calls)
        for (const auto& [wrong, part] : test::wrong_splats()) {
            SCOPED_TRACE(name + ": " + part);
            expect_refused([&call = call, &wrong = wrong] { call(wrong); }, part);
        }
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(Lengths, ErrorsNameArrayAndNeed) {
    Gaussians g;
    g.resize(40715);
    g.means.resize(3);
    expect_refused([&] { check(g); }, "means has 3 values; 40,715 splats need 122,145");
    g.resize(40715);
    g.sh_degree = 3;
    expect_refused([&] { check(g); }, "sh has 122,145 values; 40,715 splats of sh_degree 3 need 1,954,320");
    g.sh_degree = 7;
    expect_refused([&] { check(g); }, "sh_degree is 7; it can be 0 to 3");
    g.sh_degree = 0;
    g.opacity_logits.clear();
    expect_refused([&] { check(g); }, "opacity_logits has 0 values; 40,715 splats need 40,715");
    for (const size_t n : {0, 1, 2}) {
        g.resize(n);
        EXPECT_NO_THROW(check(g));
    }
    EXPECT_EQ(core::grouped(0), "0");
    EXPECT_EQ(core::grouped(999), "999");
    EXPECT_EQ(core::grouped(1000), "1,000");
    EXPECT_EQ(core::grouped(12345678), "12,345,678");
    EXPECT_EQ(core::grouped(1, "splat"), "1 splat");
    EXPECT_EQ(core::grouped(1000, "splat"), "1,000 splats");
}

TEST(Lengths, IndicesAndDegreesAreChecked) {
    Gaussians g = test::storable_splats(1, 9, 1);
    expect_refused([&] { select_splats(g, {0, 9}); }, "no splat 9 in a scene of 9");
    expect_refused([&] { keep_splats(g, {0, 9}); }, "no splat 9 in a scene of 9");
    expect_refused([&] { keep_splats(g, {3, 3}); }, "ascending");
    expect_refused([&] { keep_splats(g, {3, 2}); }, "ascending");
    expect_refused([&] { drawable(g, 9); }, "no splat 9 in a scene of 9");
    expect_refused([&] { set_sh_degree(g, 4); }, "an SH degree of 4");
    expect_refused([&] { set_sh_degree(g, -1); }, "an SH degree of -1");
    expect_refused([&] { set_world_means(g, std::vector<glm::dvec3>(8)); }, "8 positions for 9 splats");
    expect_refused([] { gaussians_from_points({{glm::dvec3(0)}, {{1, 2, 3}}}, 7); }, "sh_degree is 7");
    expect_refused([] { gaussians_from_points({{glm::dvec3(0)}, {}}, 0); }, "1 points have 0 colours");
    EXPECT_EQ(g.size(), 9u);
    append_splats(g, g);
    EXPECT_EQ(g.size(), 18u);
    EXPECT_NO_THROW(check(g));
}

TEST(Lengths, OfImagesAreChecked) {
    const test::TempFolder folder;
    const Image right(8, 6, 3), grey(8, 6, 1);
    const Meter meter({"ms_ssim", "flip", "cc_psnr", "cc2_ssim", "psnr_4px", "ssim_valid"});
    const std::vector<std::pair<std::string, std::function<void(const Image&)>>> calls{
        {"check", [](const Image& a) { check(a); }},
        {"oriented", [](const Image& a) { oriented(a, 6); }},
        {"save_image", [&](const Image& a) { save_image(folder / "a.png", a); }},
        {"save_image", [&](const Image& a) { save_image(folder / "a.jpg", a); }},
        {"save_image", [&](const Image& a) { save_image(folder / "a.exr", a); }},
        {"save_panorama", [&](const Image& a) { save_panorama(folder / "a.png", a); }},
        {"downscale", [](const Image& a) { downscale(a, 2); }},
        {"reduced", [](const Image& a) { reduced(a, 2, 2); }},
        {"over_background",
         [](const Image& a) {
             over_background(a, {0, 0, 0});
         }},
        {"with_alpha", [&](const Image& a) { with_alpha(a, grey); }},
        {"with_alpha", [&](const Image& a) { with_alpha(right, a); }},
        {"psnr", [&](const Image& a) { psnr(a, right); }},
        {"psnr", [&](const Image& a) { psnr(right, a); }},
        {"psnr", [&](const Image& a) { psnr(right, right, a); }},
        {"ssim", [&](const Image& a) { ssim(a, right); }},
        {"ssim", [&](const Image& a) { ssim(right, right, a); }},
        {"compare_images", [&](const Image& a) { compare_images(a, right); }},
        {"measure", [&](const Image& a) { meter.measure(a, right); }},
        {"measure", [&](const Image& a) { meter.measure(right, a); }},
        {"measure", [&](const Image& a) { meter.measure(right, right, a); }},
        {"with_appearance", [](const Image& a) { with_appearance(a, Ppisp{}); }},
        {"with_appearance", [](const Image& a) { with_appearance(a, ColorGrid{}); }}};
    std::vector<Image> wrong(5, right);
    wrong[0].pixels.resize(5);
    wrong[1].pixels.clear();
    wrong[2].width = 9;
    wrong[3].channels = 4;
    wrong[4].height = -6;
    for (const auto& [name, call] : calls)
        for (const Image& image : wrong) {
            SCOPED_TRACE(name);
            expect_refused([&call = call, &image] { call(image); }, "an image of ");
        }
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
    expect_refused([&] { check(wrong[0]); },
                   "pixels has 5 values; an image of 8 x 6 px and 3 channels needs 144");
    EXPECT_NO_THROW(check(Image()));
}

TEST(Lengths, ImagesOfAnotherKindAreRefused) {
    const Image color(8, 6, 3), grey(8, 6, 1);
    expect_refused([&] { downscale(color, 0); }, "a factor of 1 or more, not 0");
    expect_refused([&] { downscale(Camera{.width = 8, .height = 6}, 0); }, "a factor of 1 or more, not 0");
    expect_refused([&] { reduced(color, 9, 6); }, "cannot be reduced to 9 x 6");
    expect_refused([&] { reduced(color, 0, 6); }, "cannot be reduced to 0 x 6");
    expect_refused([&] { downscale(Image(), 2); }, "cannot be reduced");
    expect_refused([&] { over_background(grey, {0, 0, 0}); }, "neither RGB nor RGBA");
    expect_refused([&] { with_alpha(color, color); }, "gets no alpha");
    expect_refused([&] { with_alpha(color, Image(8, 5, 1)); }, "gets no alpha");
    expect_refused([&] { oriented(color, 9); }, "orientations 1 to 8, not 9");
    expect_refused([&] { with_appearance(grey, kIdentityExposure); }, "no colours");
    expect_refused([&] { compare_images(Image(8, 6, 5), color); }, "5 and 3 channels");
}

TEST(Lengths, OfSkiesAndAppearancesAreChecked) {
    const test::TempFolder folder;
    const Gaussians scene = test::storable_splats(1, 9, 0);
    for (const SkyMap& sky : {SkyMap{2, {0, 0, 0}}, SkyMap{0, {}}, SkyMap{-1, {}}, SkyMap{1 << 20, {}}}) {
        expect_refused([&] { sky_splats(sky, scene); }, "texels");
        expect_refused([&] { save_sky(folder / "sky.json", sky); }, "texels");
        const RenderOptions options{.sky = std::make_shared<const SkyMap>(sky)};
        expect_refused([&] { check(options); }, "texels");
    }
    const ColorGrid few{std::vector<float>(5)};
    const auto path = folder / "appearance.json";
    expect_refused([&] { with_appearance(Image(8, 6, 3), few); }, "cells has 5 values");
    expect_refused([&] { NewViewAppearance({few}); }, "cells has 5 values");
    expect_refused([&] { NewViewAppearance({Ppisp{}, ColorGrid{}}); }, "several models");
    expect_refused(
        [&] {
            NewViewAppearance({Ppisp{}, Ppisp{}}, {glm::dvec3(0)});
        },
        "1 centre for 2 appearances");
    expect_refused([&] { NewViewAppearance({Ppisp{}}, {glm::dvec3(0, std::nan(""), 0)}); }, "not finite");
    expect_refused([&] { save_appearances(path, {"a"}, {few}); }, "cells has 5 values");
    expect_refused([&] { save_appearances(path, {"a"}, {Ppisp{}, Ppisp{}}); }, "1 name for 2 appearances");
    expect_refused([&] { save_appearances(path, {"a", "b"}, {Ppisp{}, ColorGrid{}}); }, "several models");
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(Lengths, FramesAreOfTheDataset) {
    Dataset dataset;
    dataset.frames.resize(3);
    for (const std::vector<int>& frames : {std::vector{0, 3}, std::vector{-1}}) {
        expect_refused([&] { check(dataset, frames); }, "in a dataset of 3");
        expect_refused([&] { scene_extent(dataset, frames); }, "in a dataset of 3");
    }
    const test::TempFolder folder;
    save_image(folder / "a.png", Image(8, 6, 3));
    Frame frame;
    frame.name = "a.png";
    frame.image_path = folder / "a.png";
    frame.source.width = 8;
    frame.source.height = 6;
    Image mask(4, 3, 1);
    mask.pixels.resize(5);
    for (const Image& wrong : {Image(), Image(8, 6, 3), mask}) {
        frame.left_out = std::make_shared<const Image>(wrong);
        EXPECT_THROW(load_frame_image(frame), InputError);
    }
    frame.left_out = std::make_shared<const Image>(4, 3, 1);
    EXPECT_EQ(load_frame_image(frame).channels, 4);
}

}  // namespace
