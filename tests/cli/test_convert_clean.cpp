// SPDX-License-Identifier: Apache-2.0
// What ewa convert removes, and what it says of that.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "cli/expect.h"
#include "ewa/image.h"
#include "ewa/splat_files.h"
#include "support/transforms_scene.h"

namespace {

using namespace ewa::test;
using ewa::Gaussians;

/// A row of 12 red balls that touch, 3 green ones far away that touch, and a blue one alone. x is the index.
void make_row(const std::filesystem::path& path) {
    Gaussians g;
    g.resize(16);
    for (size_t i = 0; i < g.size(); ++i) {
        g.means[3 * i] = float(i);
        g.means[3 * i + 1] = i < 12 ? 0 : i < 15 ? 50 : 100;
        g.means[3 * i + 2] = 5;
        for (size_t k = 0; k < 3; ++k) g.log_scales[3 * i + k] = std::log(0.5f);
        g.quaternions[4 * i] = 1;
        g.opacity_logits[i] = i % 2 == 0 ? 2 : -2;  // 0.88 and 0.12
        g.sh[3 * i + (i < 12 ? 0 : i < 15 ? 1 : 2)] = 1;
    }
    ewa::save_splats(path, g);
}

TEST(ConvertClean, RemovesAndSaysHowMany) {
    const Folder folder;
    make_row(folder / "s.ply");
    const auto left = [&](std::vector<std::string> options, const std::string& said) {
        options.insert(options.begin(), {"convert", folder / "s.ply", folder / "o.ply"});
        const Outcome outcome = run_ewa(options);
        expect_success(outcome);
        EXPECT_NE(outcome.out.find(said), std::string::npos) << outcome.out;
        return ewa::load_splats(folder / "o.ply").size();
    };
    EXPECT_EQ(left({"--remove-floaters"}, "--remove-floaters removed 4 of 16 splats"), 12u);
    EXPECT_EQ(left({"--largest-cluster"}, "--largest-cluster removed 4 of 16 splats"), 12u);
    EXPECT_EQ(left({"--where", "opacity=0.5.."}, "--where opacity=0.5.. removed 8 of 16 splats"), 8u);
    EXPECT_EQ(left({"--crop", "0,-1,0,3.5,1,9"}, "--crop removed 12 of 16 splats"), 4u);
    EXPECT_EQ(left({"--where", "x=2..4", "--where", "red=..0.6", "--allow-empty"},
                   "--where red=..0.6 removed 3 of 3 splats"),
              0u);
}

TEST(ConvertClean, RangesAndSphere) {
    const Folder folder;
    make_row(folder / "s.ply");
    const auto left = [&](const std::vector<std::string>& options) {
        std::vector<std::string> all = {"convert", folder / "s.ply", folder / "o.ply", "--json",
                                        folder / "o.json"};
        all.insert(all.end(), options.begin(), options.end());
        expect_success(run_ewa(all));
        return ewa::load_splats(folder / "o.ply").size();
    };
    EXPECT_EQ(left({"--where", "x=2..4"}), 3u);
    EXPECT_EQ(read_json(folder / "o.json")["removed"]["--where x=2..4"], 13);
    EXPECT_EQ(left({"--where", "y=..50"}), 15u);
    EXPECT_EQ(left({"--where", "blue=0.7..", "--where", "scale=0.4..0.6", "--where", "thickness=0.4..0.6"}),
              1u);
    EXPECT_EQ(left({"--where", "sphere=1,0,5,2.5"}), 4u);
    // In the order typed.
    EXPECT_EQ(left({"--transform", "move=10,0,0", "--where", "x=..12"}), 3u);
    EXPECT_EQ(left({"--where", "x=..12", "--transform", "move=10,0,0"}), 13u);
    EXPECT_EQ(left({"--decimate", "4", "--where", "x=..5.37", "--allow-empty"}) +
                  left({"--decimate", "4", "--where", "x=5.37..", "--allow-empty"}),
              4u);
    EXPECT_EQ(left({"--transform", "move=-10,0,0", "--where", "x=..-1", "--transform", "move=20,0,0",
                    "--remove-floaters", "--where", "x=..12"}),
              3u);
    Gaussians g = ewa::load_splats(folder / "s.ply");
    g.means[4] = std::numeric_limits<float>::quiet_NaN();
    ewa::save_splats(folder / "s.ply", g);
    EXPECT_EQ(left({"--remove-invalid"}), 15u);
}

TEST(ConvertClean, DryRunDrawsInRed) {
    const Folder folder;
    make_row(folder / "s.ply");
    const Outcome outcome = run_ewa({"convert", folder / "s.ply", folder / "o.ply", "--largest-cluster",
                                     "--dry-run", folder / "p.png", "--json", folder / "o.json"});
    expect_success(outcome);
    EXPECT_NE(outcome.out.find("would remove 4 of 16 splats"), std::string::npos) << outcome.out;
    EXPECT_FALSE(std::filesystem::exists(folder / "o.ply"));
    EXPECT_EQ(read_json(folder / "o.json")["removed"]["--largest-cluster"], 4);
    // OUT may be left out, and boxes are shown, too.
    const Outcome alone =
        run_ewa({"convert", folder / "s.ply", "--crop", "0,-1,0,3.5,1,9", "--dry-run", folder / "q.png"});
    expect_success(alone);
    EXPECT_NE(alone.out.find("--crop would remove 12 of 16 splats"), std::string::npos) << alone.out;
    EXPECT_EQ(files_below(folder / "."), (std::vector<std::string>{"o.json", "p.png", "q.png", "s.ply"}));
    const ewa::Image picture = ewa::load_image(folder / "p.png");
    size_t red = 0, gray = 0;
    for (size_t i = 0; i < picture.pixels.size(); i += 3) {
        const float* p = &picture.pixels[i];
        red += p[0] > 3 * p[1] && p[0] > 0.2f;
        gray += std::abs(p[0] - p[1]) < 0.02f && p[0] > 0.2f;
    }
    EXPECT_GT(red, 10u);
    EXPECT_GT(gray, 3 * red / 2);
}

TEST(ConvertClean, DryRunDrawsCopiesAsLeft) {
    const Folder folder;
    make_row(folder / "s.ply");
    const auto red = [&](const std::vector<std::string>& edits, const std::string& said) {
        std::vector<std::string> all = {"convert", folder / "s.ply", "--dry-run", folder / "p.png"};
        all.insert(all.end(), edits.begin(), edits.end());
        const Outcome outcome = run_ewa(all);
        expect_success(outcome);
        EXPECT_NE(outcome.out.find(said), std::string::npos) << outcome.out;
        const ewa::Image picture = ewa::load_image(folder / "p.png");
        size_t count = 0;
        for (size_t i = 0; i < picture.pixels.size(); i += 3)
            count += picture.pixels[i] > 3 * picture.pixels[i + 1] && picture.pixels[i] > 0.2f;
        return count;
    };
    EXPECT_EQ(
        red({"--select", "all", "--duplicate", "--where", "x=..900"}, "--duplicate made 32 splats of 16"),
        0u);
    EXPECT_GT(red({"--select", "x=..11", "--duplicate", "--select", "x=12..", "--delete"},
                  "--delete would remove 4 of 28 splats"),
              10u);
}

/// A run on two black photos, with a bright ball before their camera and 200 splats behind it.
void make_run_with_a_floater(const TransformsScene& data, const std::filesystem::path& run) {
    data.write();
    Gaussians g;
    g.resize(201);
    for (size_t i = 0; i < g.size(); ++i) {
        const float at[] = {i == 0 ? -1.0f : 100.0f + float(i), 2, 3};
        std::copy_n(at, 3, &g.means[3 * i]);
        for (size_t k = 0; k < 3; ++k) g.log_scales[3 * i + k] = std::log(0.2f);
        g.quaternions[4 * i] = 1;
        g.opacity_logits[i] = 2;
        for (size_t k = 0; k < 3; ++k) g.sh[3 * i + k] = 1;
    }
    std::filesystem::create_directories(run);
    ewa::save_splats(run / "splats.ply", g);
    write_file(run / "config.json",
               nlohmann::json{{"dataset", data.folder.path().string()}, {"test-every", 0}}.dump());
}

TEST(ConvertClean, RemovesWhatThePhotosOfARunContradict) {
    const Folder folder;
    const TransformsScene data;
    const std::string run = folder / "run", out = folder / "o.ply";
    make_run_with_a_floater(data, run);
    const auto says = [&](const std::vector<std::string>& options, const std::string& said) {
        std::vector<std::string> all = {"convert", run, out};
        all.insert(all.end(), options.begin(), options.end());
        const Outcome outcome = run_ewa(all);
        expect_success(outcome);
        EXPECT_NE(outcome.out.find(said), std::string::npos) << outcome.out;
        EXPECT_NE(outcome.out.find("1 splat contradicted by the photos: mean squared error"),
                  std::string::npos)
            << outcome.out;
    };
    says({"--remove-contradicted", "--dry-run", folder / "p.png"},
         "--remove-contradicted would remove 1 of 201 splats");
    says({"--remove-contradicted"}, "--remove-contradicted removed 1 of 201 splats");
    EXPECT_EQ(ewa::load_splats(out).means[0], 101);
    says({"--select", "contradicted", "--delete"}, "--delete removed 1 of 201 splats");
    expect_failure(run_ewa({"convert", run, out, "--transform", "move=1,0,0", "--remove-contradicted"}), 2,
                   "before its splats move");
    std::filesystem::remove_all(data.folder / "images");
    expect_failure(run_ewa({"convert", run, out, "--remove-contradicted"}), 2, "image");
}

TEST(ConvertClean, RefusesWithTheReason) {
    const Folder folder;
    make_row(folder / "s.ply");
    const auto refuse = [&](const std::vector<std::string>& options, const std::string& why) {
        std::vector<std::string> all = {"convert", folder / "s.ply", folder / "o.ply"};
        all.insert(all.end(), options.begin(), options.end());
        expect_failure(run_ewa(all), 2, why);
        EXPECT_FALSE(std::filesystem::exists(folder / "o.ply"));
    };
    refuse({"--where", "opacity"}, "not COLUMN=LOW..HIGH");
    refuse({"--where", "opacity=.."}, "one bound or both");
    refuse({"--where", "opacty=0..1"}, "did you mean opacity?");
    refuse({"--where", "x=3..2"}, "the first is not above the second");
    refuse({"--where", "x=a..2"}, "numbers");
    refuse({"--where", "=1..2"}, "a column of x, y, z");
    refuse({"--where", "box=1,2,3"}, "--where");
    refuse({"--where", "sphere=1,2,3"}, "x,y,z,radius");
    refuse({"--where", "sphere=1,2,3,0"}, "one above 0");
    refuse({"--where", "sphere=1,2,3,nan"}, "finite");
    refuse({"--where", "views=2.."}, "the folder of a training run");
    refuse({"--remove-contradicted"}, "photos are known of the folder of a training run alone");
    refuse({"--dry-run", folder / "p.png"}, "no option removes splats");
    refuse({"--select", "all", "--duplicate", "--dry-run", folder / "p.png"}, "no option removes splats");
    refuse({"--where", "x=900.."}, "none of the 16 splats is left");
}

}  // namespace
