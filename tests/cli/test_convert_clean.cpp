// SPDX-License-Identifier: Apache-2.0
// What ewa convert removes, and what it says of that.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "cli/expect.h"
#include "ewa/image.h"
#include "ewa/splat_files.h"

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
    EXPECT_EQ(left({"--keep", "opacity=0.5.."}, "--keep opacity removed 8 of 16 splats"), 8u);
    EXPECT_EQ(left({"--crop", "0,-1,0,3.5,1,9"}, "--crop removed 12 of 16 splats"), 4u);
    EXPECT_EQ(left({"--min-opacity", "0.5"}, "--min-opacity removed 8 of 16 splats"), 8u);
    EXPECT_EQ(
        left({"--keep", "x=2..4", "--keep", "red=..0.6", "--allow-empty"}, "--keep red removed 3 of 16"), 0u);
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
    EXPECT_EQ(left({"--keep", "x=2..4"}), 3u);
    EXPECT_EQ(read_json(folder / "o.json")["removed"]["--keep x"], 13);
    EXPECT_EQ(left({"--keep", "y=..50"}), 15u);
    EXPECT_EQ(left({"--keep", "blue=0.7..", "--keep", "scale=0.4..0.6", "--keep", "thickness=0.4..0.6"}), 1u);
    EXPECT_EQ(left({"--crop-sphere", "1,0,5,2.5"}), 4u);
    EXPECT_EQ(left({"--transform", "move=10,0,0", "--keep", "x=..12"}), 3u);
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

TEST(ConvertClean, RefusesWithTheReason) {
    const Folder folder;
    make_row(folder / "s.ply");
    const auto refuse = [&](const std::vector<std::string>& options, const std::string& why) {
        std::vector<std::string> all = {"convert", folder / "s.ply", folder / "o.ply"};
        all.insert(all.end(), options.begin(), options.end());
        expect_failure(run_ewa(all), 2, why);
        EXPECT_FALSE(std::filesystem::exists(folder / "o.ply"));
    };
    refuse({"--keep", "opacity"}, "not COLUMN=LOW..HIGH");
    refuse({"--keep", "opacity=.."}, "one bound or both");
    refuse({"--keep", "opacty=0..1"}, "did you mean opacity?");
    refuse({"--keep", "x=3..2"}, "the first is not above the second");
    refuse({"--keep", "x=a..2"}, "numbers");
    refuse({"--keep", "=1..2"}, "a column of x, y, z");
    refuse({"--crop-sphere", "1,2,3"}, "x,y,z,radius");
    refuse({"--crop-sphere", "1,2,3,0"}, "one above 0");
    refuse({"--crop-sphere", "1,2,3,nan"}, "finite");
    refuse({"--min-views", "2"}, "the folder of a training run");
    refuse({"--dry-run", folder / "p.png"}, "no option removes splats");
    refuse({"--keep", "x=900.."}, "none of the 16 splats is left");
}

}  // namespace
