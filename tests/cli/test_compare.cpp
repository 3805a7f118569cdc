// SPDX-License-Identifier: Apache-2.0
// ewa compare: figures, heat maps, and the exit status that scripts go by.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "cli/expect.h"
#include "ewa/image.h"
#include "ewa/splat_files.h"
#include "support/png_bytes.h"

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
    EXPECT_EQ(outcome.out, "PSNR inf dB  SSIM 1.00000  RMS 0  max error 0\n");
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
    EXPECT_NE(outcome.out.find("mean of 2 images"), std::string::npos) << outcome.out;
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
    EXPECT_NE(told.out.find("2.png  has no image"), std::string::npos) << told.out;
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

/// PSNR knows of neither, by its convention.
TEST(Compare, TheThresholdHoldsForAlphaAndWhatIsBrighterThanWhite) {
    const Folder folder;
    save(folder / "five.exr", plain(5));
    save(folder / "eighty.exr", plain(80));
    Image opaque = plain(1, 20, 12, 4), clear = opaque;
    for (size_t i = 3; i < clear.pixels.size(); i += 4) clear.pixels[i] = 0;
    save(folder / "opaque.png", opaque);
    save(folder / "clear.png", clear);
    save(folder / "white.png", plain(1));
    const auto compare = [&](const std::string& a, const std::string& b, const Names& more) {
        Names command{"compare", folder / a, folder / b, "--json", folder / "j.json"};
        command.insert(command.end(), more.begin(), more.end());
        return run_ewa(command);
    };
    const Outcome bright =
        compare("five.exr", "eighty.exr", {"--threshold", "100", "--heat-map", folder / "m.png"});
    EXPECT_EQ(bright.status, 1);
    EXPECT_NE(bright.out.find("PSNR inf dB"), std::string::npos) << bright.out;
    EXPECT_NE(bright.out.find("RMS 75 "), std::string::npos) << bright.out;
    EXPECT_NE(bright.out.find("under 100 dB (RMS over 1e-05) with alpha and values outside [0, 1]"),
              std::string::npos)
        << bright.out;
    auto json = read_json(folder / "j.json");
    EXPECT_EQ(json["rms"], 75);
    EXPECT_EQ(json["passed"], false);
    EXPECT_EQ(json["pictures"][0]["failed"], nlohmann::json({"rms"}));
    EXPECT_GT(ewa::load_image(folder / "m.png").at(4, 5)[0], 0.9f);

    // A picture without alpha is opaque. RMS of one channel of four: a half, 6.02 dB.
    for (const char* other : {"opaque.png", "white.png"}) {
        EXPECT_EQ(compare(other, "clear.png", {"--threshold", "6.1"}).status, 1) << other;
        EXPECT_EQ(read_json(folder / "j.json")["rms"], 0.5) << other;
        EXPECT_EQ(compare("clear.png", other, {"--threshold", "6"}).status, 0) << other;
    }
    expect_success(compare("opaque.png", "white.png", {"--threshold", "1000", "--max-error", "0"}));
}

TEST(Compare, TheLargestErrorMayBeLimited) {
    const Folder folder;
    Image b = plain(0.25f);
    b.at(7, 3)[1] += 0.5f;
    save(folder / "a.exr", plain(0.25f));
    save(folder / "b.exr", b);
    const auto compare = [&](const std::string& b_name, const std::string& limit) {
        return run_ewa({"compare", folder / "a.exr", folder / b_name, "--max-error", limit, "--json",
                        folder / "j.json"});
    };
    expect_success(compare("b.exr", "0.5"));
    const Outcome bad = compare("b.exr", "0.49");
    EXPECT_EQ(bad.status, 1);
    EXPECT_EQ(bad.err, "");
    EXPECT_NE(bad.out.find("max error over 0.49"), std::string::npos) << bad.out;
    EXPECT_EQ(read_json(folder / "j.json")["worst"]["failed"], nlohmann::json({"max_error"}));
    // Of infinite values only an equal one is near.
    const float infinity = std::numeric_limits<float>::infinity(), nan = std::nanf("");
    Image bright = plain(0.25f);
    for (const float value : {infinity, -infinity, nan}) {
        bright.at(7, 3)[1] = value;
        save(folder / "bright.exr", bright);
        EXPECT_EQ(compare("bright.exr", "1e9").status, 1);
        for (const float other : {infinity, -infinity, nan}) {
            bright.at(7, 3)[1] = other;
            save(folder / "c.exr", bright);
            const Outcome outcome =
                run_ewa({"compare", folder / "bright.exr", folder / "c.exr", "--max-error", "1e9"});
            const bool equal = value == other || (std::isnan(value) && std::isnan(other));
            EXPECT_EQ(outcome.status, equal ? 0 : 1) << value << " " << other << ": " << outcome.out;
        }
    }
    // A picture that is not there is no smaller error.
    for (const char* name : {"x/1.png", "x/2.png", "y/1.png"}) save(folder / name, plain(0.5f));
    EXPECT_EQ(run_ewa({"compare", folder / "x", folder / "y", "--max-error", "1"}).status, 1);
}

/// A scene through a dataset's cameras stands for the pictures that ewa render would write of it.
class CompareScenes : public ::testing::Test {
  protected:
    void SetUp() override {
        make_dataset(data_);
        make_splats(scene_);
        make_splats(other_, 40);
    }
    Outcome compare(const std::string& a, const std::string& b, const Names& more) const {
        Names command{"compare", a, b, "--json", json_};
        command.insert(command.end(), more.begin(), more.end());
        return run_ewa(command);
    }
    /// What `ewa render` writes, and where.
    std::string rendered(const std::string& name, const Names& more) const {
        Names command{"render", scene_, "--cameras", data_, "-o", folder_ / name, "--quiet"};
        command.insert(command.end(), more.begin(), more.end());
        expect_success(run_ewa(command));
        return folder_ / name;
    }
    Folder folder_;
    const std::string data_ = folder_ / "data", scene_ = folder_ / "scene.ply",
                      other_ = folder_ / "other.ply", json_ = folder_ / "j.json";
};

TEST_F(CompareScenes, WithPicturesOfThem) {
    for (const char* format : {"png", "exr"}) {
        const std::string pictures = rendered(format, {"--format", format, "--background", "0.2,0.4,0.6"});
        const Names drawn{"--cameras", data_, "--background", "0.2,0.4,0.6", "--max-error", "0"};
        for (const bool turned : {false, true}) {
            const Outcome outcome =
                turned ? compare(pictures, scene_, drawn) : compare(scene_, pictures, drawn);
            expect_success(outcome);
            EXPECT_EQ(read_json(json_)["pictures"].size(), 4u) << outcome.out;
        }
        EXPECT_EQ(compare(scene_, pictures, {"--cameras", data_, "--threshold", "30"}).status, 1)
            << "with another background";
        const Outcome outcome = compare(other_, pictures, drawn);
        EXPECT_EQ(outcome.status, 1) << outcome.out;
    }
}

TEST_F(CompareScenes, WithEachOther) {
    const Names cameras{"--cameras", data_, "--max-error", "0"};
    expect_success(compare(scene_, scene_, cameras));
    const Outcome outcome = compare(scene_, other_, cameras);
    EXPECT_EQ(outcome.status, 1);
    EXPECT_NE(outcome.out.find("mean of 4 images"), std::string::npos) << outcome.out;
    // The same figures as of the pictures themselves.
    const auto drawn = read_json(json_);
    const std::string pictures = rendered("now", {"--format", "exr"});
    EXPECT_EQ(compare(pictures, other_, cameras).status, 1);
    const auto loaded = read_json(json_);
    EXPECT_EQ(drawn, loaded);
    EXPECT_GT(drawn["max_error"], 0.05);
}

TEST_F(CompareScenes, OfSomeFrames) {
    const std::string pictures = rendered("few", {"--frames", "1,3"});
    const Outcome outcome = compare(scene_, pictures, {"--cameras", data_, "--threshold", "99"});
    EXPECT_EQ(outcome.status, 1) << "two frames have no picture";
    EXPECT_EQ(read_json(json_)["unpaired"].size(), 2u);
    EXPECT_NE(
        outcome.out.find("2 images have no image of their name on the other side; the first is " + scene_),
        std::string::npos)
        << outcome.out;
    expect_success(compare(scene_, pictures, {"--cameras", data_, "--frames", "1,3", "--threshold", "99"}));
    // Nothing is asked of those that are there besides.
    const std::string all = rendered("all", {});
    expect_success(compare(scene_, all, {"--cameras", data_, "--frames", "1,3", "--threshold", "99"}));
    EXPECT_EQ(read_json(json_)["pictures"].size(), 2u);
    EXPECT_TRUE(read_json(json_)["unpaired"].empty());
    save(all + "/stranger.png", plain(0.5f));
    EXPECT_EQ(compare(scene_, all, {"--cameras", data_, "--frames", "1,3", "--threshold", "99"}).status, 1);
    const Outcome strange =
        compare(scene_, all, {"--cameras", data_, "--frames", "1,3", "--threshold", "99"});
    EXPECT_NE(strange.out.find("stranger.png  has no image of this name on the other side"),
              std::string::npos)
        << strange.out;
    // One picture goes with one frame, and its map is a picture.
    const std::string one = pictures + "/3.png", map = folder_ / "map.png";
    expect_success(
        compare(one, scene_, {"--cameras", data_, "--frames", "3", "--threshold", "99", "--heat-map", map}));
    EXPECT_EQ(ewa::load_image(map).width, ewa::load_image(one).width);
    EXPECT_EQ(compare(one, scene_, {"--cameras", data_, "--frames", "1", "--threshold", "99"}).status, 1);
    expect_failure(compare(one, scene_, {"--cameras", data_}), 2, "is one image and");
}

/// A scene is what begins like one.
TEST_F(CompareScenes, OfAnotherName) {
    const std::string renamed = folder_ / "scene.dat";
    fs::copy_file(scene_, renamed);
    expect_success(compare(renamed, scene_, {"--cameras", data_, "--max-error", "0"}));
}

TEST_F(CompareScenes, SayWhatIsNotDrawn) {
    ewa::Gaussians gaussians = ewa::load_splats(scene_);
    gaussians.means[0] = std::nanf("");
    const std::string bad = folder_ / "bad.ply";
    ewa::save_splats(bad, gaussians);
    const Outcome outcome = compare(scene_, bad, {"--cameras", data_});
    expect_success(outcome);
    EXPECT_NE(outcome.out.find(bad + ": skipped 1 splat with a value that is not finite"), std::string::npos)
        << outcome.out;
    EXPECT_EQ(read_json(json_)["skipped_nonfinite"], nlohmann::json({0, 1}));
}

/// 16 bits hold what 8 do not, and no more is asked of them.
TEST_F(CompareScenes, WithPicturesOf16Bits) {
    const std::string exact = rendered("exr", {"--format", "exr"}), deep = folder_ / "deep",
                      shallow = folder_ / "shallow";
    fs::create_directories(deep);
    for (const char* name : {"/0", "/1", "/2", "/3"}) {
        const Image drawn = ewa::load_image(exact + name + ".exr");
        Image image(drawn.width, drawn.height, 3);
        for (size_t i = 0; i < image.pixels.size(); ++i)
            image.pixels[i] = drawn.pixels[i / 3 * size_t(drawn.channels) + i % 3];
        write_file(deep + name + ".png", deep_png(image));
        save(shallow + name + ".png", image);
    }
    expect_success(compare(scene_, deep, {"--cameras", data_, "--max-error", "0"}));
    expect_success(compare(scene_, shallow, {"--cameras", data_, "--max-error", "0"}));
    EXPECT_EQ(compare(deep, shallow, {"--max-error", "0.0019"}).status, 1)
        << "half a step of 8 bits is 0.00196";
}

/// The colours of a PNG that can be seen through are those in front of no background.
TEST_F(CompareScenes, WithPicturesCutOut) {
    const std::string exact = rendered("exr", {"--format", "exr"}), cut = folder_ / "cut";
    for (const char* name : {"/0", "/1", "/2", "/3"}) {
        Image image = ewa::load_image(exact + name + ".exr");
        for (size_t i = 0; i < image.pixels.size(); ++i)
            if (i % 4 != 3) image.pixels[i] /= std::max(image.pixels[i / 4 * 4 + 3], 1e-6f);
        save(cut + name + ".png", image);
    }
    // A step of 8 bits each of the colour and of alpha, on either side.
    const Names command{"--cameras", data_, "--background", "0.2,0.4,0.6", "--max-error", "0.012"};
    expect_success(compare(cut, scene_, command));
    EXPECT_EQ(compare(cut, other_, command).status, 1);
}

/// What is written takes the place of nothing that is read, or else written.
TEST_F(CompareScenes, WriteOverNothing) {
    const std::string pictures = rendered("golden", {}), transforms = data_ + "/transforms.json",
                      one = pictures + "/1.png", two = pictures + "/2.png", new_file = folder_ / "x.png";
    const auto there = [&] {
        std::string bytes = read_file(scene_) + read_file(transforms);
        for (const char* name : {"/0.png", "/1.png", "/2.png", "/3.png"})
            bytes += read_file(pictures + name) + read_file(data_ + "/images" + name);
        return bytes;
    };
    const std::string before = there();
    for (const Names& rest : {
             Names{scene_, other_, "--cameras", transforms, "--json", transforms},
             Names{scene_, other_, "--cameras", data_, "--json", transforms},
             Names{scene_, pictures, "--cameras", data_, "--json", scene_},
             Names{scene_, pictures, "--cameras", data_, "--json", one},
             Names{scene_, pictures, "--cameras", data_, "--heat-map", pictures},
             Names{pictures, data_ + "/images", "--heat-map", pictures},
             Names{one, two, "--heat-map", one},
             Names{one, two, "--heat-map", new_file, "--json", new_file},
         }) {
        Names command{"compare"};
        command.insert(command.end(), rest.begin(), rest.end());
        expect_failure(run_ewa(command), 2, "it would be overwritten");
    }
    expect_failure(run_ewa({"compare", scene_, other_, "--cameras", data_, "--heat-map", data_ + "/images"}),
                   2, "is a folder of a dataset, where no outputs belong");
    EXPECT_EQ(there(), before);
}

TEST_F(CompareScenes, WrongUse) {
    const std::string pictures = folder_ / "data/images";
    expect_failure(run_ewa({"compare", scene_, pictures}), 2, "--cameras");
    expect_failure(run_ewa({"compare", pictures, pictures, "--cameras", data_}), 2, "is a splat scene");
    expect_failure(run_ewa({"compare", pictures, pictures, "--kernel", "ewa"}), 2, "--cameras");
    expect_failure(run_ewa({"compare", scene_, folder_ / "absent.ply", "--cameras", data_}), 2, "absent.ply");
    expect_failure(run_ewa({"compare", scene_, folder_ / "absent", "--cameras", data_}), 2, "absent");
    expect_failure(run_ewa({"compare", scene_, scene_, "--cameras", data_, "--json", scene_}), 2, "--json");
    expect_failure(run_ewa({"compare", scene_, pictures, "--cameras", data_, "--downscale", "2"}), 2,
                   scene_ + ", image 0 and " + pictures + "/0.png: pictures of 24 x 16");
}

TEST(Compare, WhatIsNoPictureIsOneLine) {
    const Folder folder;
    save(folder / "a.png", plain(0.5f));
    std::string png = read_file(folder / "a.png");
    for (size_t i = 16; i < 24; ++i) png[i] = '\x7f';
    write_file(folder / "huge.png", png);
    write_file(folder / "x.gif", "GIF89a\xff\xff\xff\xff");
    write_file(folder / "x.null?RES=4000x4000", "");
    for (const char* name : {"huge.png", "x.gif", "x.null?RES=4000x4000"})
        expect_failure(run_ewa({"compare", folder / name, folder / name}), 2, name);
}

TEST(Compare, WrongUse) {
    const Folder folder;
    save(folder / "a.png", plain(0.5f));
    save(folder / "small.png", plain(0.5f, 9, 9));
    save(folder / "d/x.png", plain(0.5f));
    save(folder / "e/y.png", plain(0.5f));
    save(folder / "e/z.png", plain(0.5f));
    const std::string a = folder / "a.png";
    expect_failure(run_ewa({"compare", a, folder / "small.png"}), 2, "small.png");
    expect_failure(run_ewa({"compare", a, folder / "e"}), 2, "is one image and");
    expect_failure(run_ewa({"compare", folder / "d", folder / "e"}), 2, "no image of");
    expect_failure(run_ewa({"compare", a, folder / "absent.png"}), 2, "absent.png");
    expect_failure(run_ewa({"compare", a}), 2, "B");
    expect_failure(run_ewa({"compare", a, a, "--threshold", "much"}), 2, "--threshold");
    expect_failure(run_ewa({"compare", a, a, "--max-error", "-1"}), 2, "--max-error");
    expect_failure(run_ewa({"compare", a, a, "--heat-map", folder / "m.txt"}), 2, "m.txt");
}

}  // namespace
