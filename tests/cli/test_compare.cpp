// SPDX-License-Identifier: Apache-2.0
// ewa compare: figures, heat maps, and the exit status that scripts go by.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "cli/expect.h"
#include "ewa/image.h"

namespace {

using namespace ewa::test;
using ewa::Image;
namespace fs = std::filesystem;
using Names = std::vector<std::string>;

Image plain(float value, int width = 20, int height = 12, int channels = 3) {
    Image image(width, height, channels);
    for (float& v : image.pixels) v = value;
    return image;
}

void save(const std::string& path, const Image& image) {
    fs::create_directories(fs::path(path).parent_path());
    ewa::save_image(path, image);
}

TEST(Compare, EqualPicturesAreIdentical) {
    const Folder folder;
    save(folder / "a.png", plain(0.5f));
    const Outcome outcome = run_ewa(
        {"compare", folder / "a.png", folder / "a.png", "--threshold", "99", "--json", folder / "j.json"});
    expect_success(outcome);
    EXPECT_EQ(outcome.out, "PSNR inf dB  SSIM 1.00000  max error 0\n");
    const auto json = read_json(folder / "j.json");
    EXPECT_TRUE(json["psnr"].is_null());
    EXPECT_EQ(json["pictures"][0]["identical"], true);
    EXPECT_EQ(json["passed"], true);
}

TEST(Compare, OneWrongPixel) {
    const Folder folder;
    const Image a = plain(0.25f);
    Image b = a;
    b.at(7, 3)[1] += 0.5f;
    save(folder / "a.exr", a);
    save(folder / "b.exr", b);
    // One of 720 values off by a half: 10 log10(720 / 0.25) = 34.594 dB.
    const double expected = 10 * std::log10(20 * 12 * 3 / 0.25);
    const auto compare = [&](const std::string& threshold) {
        return run_ewa({"compare", folder / "a.exr", folder / "b.exr", "--json", folder / "j.json",
                        "--heat-map", folder / "maps/m.png", "--threshold", threshold});
    };
    const Outcome good = compare("34.59"), bad = compare("34.60");
    expect_success(good);
    EXPECT_NE(good.out.find("PSNR 34.594 dB"), std::string::npos) << good.out;
    EXPECT_NE(good.out.find("max error 0.5 at 7,3"), std::string::npos) << good.out;
    EXPECT_EQ(bad.status, 1);
    EXPECT_EQ(bad.err, "");
    EXPECT_NE(bad.out.find("under 34.6 dB"), std::string::npos) << bad.out;
    const auto json = read_json(folder / "j.json");
    EXPECT_NEAR(json["psnr"].get<double>(), expected, 1e-6);
    EXPECT_NEAR(json["max_error"].get<double>(), 0.5, 1e-7);
    EXPECT_EQ(json["worst"]["max_error_at"], nlohmann::json({7, 3}));
    EXPECT_EQ(json["passed"], false);
    const Image map = ewa::load_image(folder / "maps/m.png");
    EXPECT_GT(map.at(7, 3)[0], 0.5f);
    EXPECT_LT(map.at(6, 3)[0], 0.05f);
}

TEST(Compare, FoldersPairByName) {
    const Folder folder;
    save(folder / "a/one.png", plain(0.5f));
    save(folder / "a/deep/two.png", plain(0.5f));
    save(folder / "b/one.exr", plain(0.5f));  // another extension: paired by its stem
    save(folder / "b/deep/two.png", plain(0.6f));
    write_file(folder / "b/notes.md", "no picture");
    const Names command{"compare",         folder / "a", folder / "b",   "--json",
                        folder / "j.json", "--heat-map", folder / "maps"};
    const Outcome outcome = run_ewa(command);
    expect_success(outcome);
    EXPECT_NE(outcome.out.find("mean of 2 pictures"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("worst: deep/two"), std::string::npos) << outcome.out;
    EXPECT_EQ(files_below(folder / "maps"), (Names{"deep/two.png", "one.png"}));
    const auto json = read_json(folder / "j.json");
    EXPECT_EQ(json["pictures"].size(), 2u);
    EXPECT_EQ(json["worst"]["name"], "deep/two");
    EXPECT_TRUE(json["unpaired"].empty());
}

TEST(Compare, AMissingPictureFailsTheThreshold) {
    const Folder folder;
    for (const char* name : {"a/1.png", "a/2.png", "b/1.png"}) save(folder / name, plain(0.5f));
    const Outcome told = run_ewa({"compare", folder / "a", folder / "b"});
    expect_success(told);
    EXPECT_NE(told.out.find("2.png  has no picture"), std::string::npos) << told.out;
    const Outcome outcome = run_ewa({"compare", folder / "a", folder / "b", "--threshold", "10"});
    EXPECT_EQ(outcome.status, 1) << outcome.err;
}

TEST(Compare, WhatIsNotANumberDoesNotPass) {
    const Folder folder;
    Image bad = plain(0.5f);
    bad.at(4, 5)[2] = std::numeric_limits<float>::quiet_NaN();
    save(folder / "a.exr", plain(0.5f));
    save(folder / "b.exr", bad);
    const Outcome outcome = run_ewa(
        {"compare", folder / "a.exr", folder / "b.exr", "--threshold", "0", "--heat-map", folder / "m.png"});
    EXPECT_EQ(outcome.status, 1) << outcome.out << outcome.err;
    EXPECT_GT(ewa::load_image(folder / "m.png").at(4, 5)[0], 0.9f);
}

TEST(Compare, WrongUse) {
    const Folder folder;
    save(folder / "a.png", plain(0.5f));
    save(folder / "small.png", plain(0.5f, 9, 9));
    save(folder / "d/x.png", plain(0.5f));
    save(folder / "e/y.png", plain(0.5f));
    const std::string a = folder / "a.png";
    expect_failure(run_ewa({"compare", a, folder / "small.png"}), 2, "small.png");
    expect_failure(run_ewa({"compare", a, folder / "d"}), 2, "is a folder");
    expect_failure(run_ewa({"compare", folder / "d", folder / "e"}), 2, "no picture in");
    expect_failure(run_ewa({"compare", a, folder / "absent.png"}), 2, "absent.png");
    expect_failure(run_ewa({"compare", a}), 2, "B");
    expect_failure(run_ewa({"compare", a, a, "--threshold", "much"}), 2, "--threshold");
    expect_failure(run_ewa({"compare", a, a, "--heat-map", folder / "m.txt"}), 2, "m.txt");
}

}  // namespace
