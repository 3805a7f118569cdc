// SPDX-License-Identifier: Apache-2.0
// Splats with values that few programs write, and files as sites and other programs give them: what is drawn, trained and said.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "cli/expect.h"
#include "ewa/image.h"
#include "ewa/splat_files.h"
#include "io/splats/archive.h"

namespace {

using namespace ewa::test;
using ewa::Gaussians;
using ewa::Image;
using Names = std::vector<std::string>;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// The mean of an image's values.
double brightness(const Image& image) {
    double sum = 0;
    for (const float v : image.pixels) sum += double(v);
    return sum / double(image.pixels.size());
}

/// A render of a file, without a warning, or with this one.
Image drawn(const Folder& folder, const std::string& path, const Names& more = {},
            const std::string& note = {}) {
    Names arguments = {"render", path, "-o", folder / "drawn.exr", "--size", "48x32"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = run_ewa(arguments);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE((outcome.out + outcome.err).find(note), std::string::npos) << outcome.out << outcome.err;
    if (note.empty()) {
        EXPECT_EQ(outcome.out.find("skipped"), std::string::npos) << outcome.out;
    }
    return ewa::load_image(folder / "drawn.exr");
}

Gaussians usual(const Folder& folder) {
    make_splats(folder / "usual.ply", 40, 0);
    return ewa::load_splats(folder / "usual.ply");
}

TEST(UnusualSplats, InfiniteOpacitiesAreDrawnAsOneAndNone) {
    const Folder folder;
    Gaussians g = usual(folder), one = g, infinite = g;
    for (size_t i = 0; i < g.size(); ++i) {
        const bool opaque = i % 2 == 0;
        one.opacity_logits[i] = opaque ? 60.0f : -60.0f;
        infinite.opacity_logits[i] = opaque ? kInfinity : -kInfinity;
    }
    ewa::save_splats(folder / "one.ply", one);
    ewa::save_splats(folder / "infinite.ply", infinite);
    for (const char* kernel : {"peak", "antialias"}) {
        const Image a = drawn(folder, folder / "one.ply", {"--kernel", kernel});
        const Image b = drawn(folder, folder / "infinite.ply", {"--kernel", kernel});
        EXPECT_GT(brightness(a), 0.05);
        EXPECT_EQ(a.pixels, b.pixels) << kernel;
    }
}

TEST(UnusualSplats, OneHugeSplatBlackensNoPicture) {
    const Folder folder;
    Gaussians g = usual(folder);
    const double before = brightness(drawn(folder, folder / "usual.ply"));
    for (size_t k = 0; k < 3; ++k) g.sh[k] = 1.5f;  // a bright veil
    for (const float huge : {60.0f, 80.0f, 3e38f})
        for (const Names& more : {Names{},
                                  {"--kernel", "antialias"},
                                  {"--kernel", "density"},
                                  {"--integrator", "ray"},
                                  {"--integrator", "fast-ray"},
                                  {"--integrator", "march"},
                                  {"--points"}}) {
            for (size_t k = 0; k < 3; ++k) g.log_scales[k] = huge;
            ewa::save_splats(folder / "huge.ply", g);
            const Image image = drawn(folder, folder / "huge.ply", more);
            for (const float v : image.pixels) ASSERT_TRUE(std::isfinite(v));
            EXPECT_GT(brightness(image), before / 2) << huge << (more.empty() ? "" : more.back());
        }
}

TEST(UnusualSplats, FlatSplatsAreDrawn) {
    const Folder folder;
    Gaussians g = usual(folder), thin = g;
    for (size_t i = 0; i < g.size(); ++i) {
        g.log_scales[3 * i + 2] = -kInfinity;
        thin.log_scales[3 * i + 2] = -60;
    }
    ewa::save_splats(folder / "flat.ply", g);
    ewa::save_splats(folder / "thin.ply", thin);
    EXPECT_EQ(drawn(folder, folder / "flat.ply").pixels, drawn(folder, folder / "thin.ply").pixels);
}

TEST(UnusualSplats, TrainingStaysFinite) {
    const Folder folder;
    make_dataset(folder / "data");
    Gaussians g = usual(folder);
    g.opacity_logits[0] = kInfinity;
    g.opacity_logits[1] = -kInfinity;
    g.log_scales[3 * 2] = -kInfinity;
    for (size_t k = 9; k < 12; ++k) g.log_scales[k] = 60;
    ewa::save_splats(folder / "s.ply", g);
    const Outcome outcome =
        run_ewa({"train", folder / "data", "-o", folder / "run", "--init", folder / "s.ply", "--steps", "20",
                 "--strategy", "none", "--test-every", "0", "--quiet"});
    expect_success(outcome);
    const auto summary = read_json(folder / "run/summary.json");
    EXPECT_EQ(summary["skipped_nonfinite"], 0);
    EXPECT_EQ(summary["dropped_updates"], 0);
    const Gaussians trained = ewa::load_splats(folder / "run/splats.ply");
    for (const auto* values : {&trained.opacity_logits, &trained.log_scales, &trained.means})
        for (const float v : *values) EXPECT_TRUE(std::isfinite(v));
}

TEST(UnusualSplats, ValuesThatAreNotFiniteAreNamed) {
    const Folder folder;
    Gaussians g = usual(folder);
    g.means[0] = std::nanf("");
    g.log_scales[3] = kInfinity;
    g.sh[6] = std::nanf("");
    ewa::save_splats(folder / "bad.ply", g);
    const std::string names = "means of 1, scales of 1, SH coefficients of 1";
    drawn(folder, folder / "bad.ply", {}, "skipped 3 splats with a value that is not finite: " + names);
    const Outcome info = run_ewa({"info", folder / "bad.ply"});
    EXPECT_NE(info.out.find(names), std::string::npos) << info.out;
    const Outcome converted = run_ewa({"convert", folder / "bad.ply", folder / "o.splat"});
    EXPECT_NE(converted.out.find(names), std::string::npos) << converted.out;
}

TEST(UnusualSplats, ZipArchivesOfSplatsAreReadByEachCommand) {
    const Folder folder;
    usual(folder);
    ewa::io::ArchiveWriter writer;
    writer.add("download/README.md", "x");
    writer.add("download/point_cloud.ply", read_file(folder / "usual.ply"));
    write_file(folder / "download.zip", writer.finish());
    EXPECT_EQ(drawn(folder, folder / "download.zip").pixels, drawn(folder, folder / "usual.ply").pixels);
    const Outcome info = run_ewa({"info", folder / "download.zip", "--json"});
    expect_success(info);
    EXPECT_EQ(nlohmann::json::parse(info.out)["splats"], 40);
    expect_success(run_ewa({"convert", folder / "download.zip", folder / "o.ply"}));
    EXPECT_EQ(read_file(folder / "o.ply"), read_file(folder / "usual.ply"));
    ewa::io::ArchiveWriter none;
    none.add("a.txt", "x");
    write_file(folder / "none.zip", none.finish());
    expect_failure(run_ewa({"render", folder / "none.zip", "-o", folder / "x.png"}), 2, "without splats");
}

TEST(UnusualSplats, CloudsWithColoursOf16BitsStartTheSameTraining) {
    const Folder folder;
    make_dataset(folder / "data");
    const auto cloud = [&](const std::string& name, const std::string& type, int scale) {
        std::string text =
            "ply\nformat ascii 1.0\nelement vertex 60\nproperty float x\nproperty float y\nproperty float "
            "z\n";
        for (const char* channel : {"red", "green", "blue"})
            text += "property " + type + " " + channel + "\n";
        text += "end_header\n";
        for (int i = 0; i < 60; ++i) {
            text += std::to_string(std::sin(i)) + " " + std::to_string(std::cos(3 * i)) + " " +
                    std::to_string(i / 60.0);
            for (int k = 0; k < 3; ++k) text += " " + std::to_string(scale * ((i * (k + 3)) % 256));
            text += "\n";
        }
        write_file(folder / (name + ".ply"), text);
        expect_success(
            run_ewa({"train", folder / "data", "-o", folder / name, "--init", folder / (name + ".ply"),
                     "--steps", "2", "--strategy", "none", "--test-every", "0", "--quiet"}));
        return read_file(folder / (name + "/splats.ply"));
    };
    EXPECT_EQ(cloud("eight", "uchar", 1), cloud("sixteen", "ushort", 257));
}

}  // namespace
