// SPDX-License-Identifier: Apache-2.0
// ewa eval --depth.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "cli/expect.h"
#include "ewa/image.h"
#include "ewa/splat_files.h"
#include "io/gltf/mesh_writer.h"

namespace {

using namespace ewa::test;
namespace fs = std::filesystem;

constexpr float kWide = 2;

/// A square on the floor, as a mesh and as flat, opaque splats, and views of it with depth maps.
struct Floor : Folder {
    Floor() {
        ewa::scene::TriangleMesh m;
        for (int i = 0; i < 4; ++i)
            m.positions.emplace_back(i % 2 ? kWide : -kWide, 0, i / 2 ? kWide : -kWide);
        m.normals.assign(4, {0, 1, 0});
        m.colors.assign(4, {200, 100, 50});
        m.triangles = {{0, 2, 1}, {1, 2, 3}};
        ewa::io::write_glb_mesh(*this / "floor.glb", m);
        expect_success(run_ewa({"dataset", *this / "floor.glb", "-o", *this / "data", "--views", "3",
                                "--size", "96x64", "--samples", "1", "--points", "50", "--quiet"}));
        constexpr int kSide = 16;
        ewa::Gaussians g;
        g.resize(size_t(kSide) * kSide);
        for (size_t i = 0; i < g.size(); ++i) {
            g.means[3 * i] = kWide * (2 * (float(i % kSide) + 0.5f) / kSide - 1);
            g.means[3 * i + 2] = kWide * (2 * (float(i / kSide) + 0.5f) / kSide - 1);
            for (size_t k = 0; k < 3; ++k)
                g.log_scales[3 * i + k] = float(std::log(k == 1 ? 1e-4 : double(kWide) / kSide));
            g.quaternions[4 * i] = 1;
            g.opacity_logits[i] = 6;
        }
        ewa::save_splats(*this / "floor.ply", g);
    }
    Outcome eval(std::vector<std::string> more = {}) const {
        std::vector<std::string> arguments = {"eval",   *this / "floor.ply", *this / "data", "--split", "all",
                                              "--depth"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_ewa(arguments);
    }
    std::vector<fs::path> maps() const {
        std::vector<fs::path> found;
        for (const auto& entry : fs::directory_iterator(*this / "data/depth")) found.push_back(entry.path());
        return found;
    }
};

TEST(DepthFigures, AreZeroForTheTrueSurface) {
    const Floor floor;
    const Outcome right = floor.eval({"--json", floor / "j.json"});
    expect_success(right);
    EXPECT_NE(right.out.find("errors of median depth"), std::string::npos) << right.out;
    nlohmann::json json = read_json(floor / "j.json");
    const auto& errors = json["depth"]["median_depth"];
    EXPECT_LT(errors["median_error"], 0.005);
    EXPECT_GT(errors["within_1_percent"], 0.85);
    EXPECT_GT(errors["within_5_percent"], 0.95);
    // The mean depth is that of the splats' means, some of which lie beside the pixel.
    EXPECT_LT(json["depth"]["mean_depth"]["median_error"], 0.03);
    EXPECT_EQ(json["depth"]["frames"], 3);
    for (const auto& frame : json["frames"]) EXPECT_GT(frame["depth"]["pixels"], 100);

    // All depths of the maps are a tenth larger, and one map has none.
    const std::vector<fs::path> maps = floor.maps();
    ASSERT_EQ(maps.size(), 3u);
    for (const fs::path& path : maps) {
        ewa::Image map = ewa::load_image(path);
        for (float& d : map.pixels) d *= path == maps[0] ? 0 : 1.1f;
        ewa::save_image(path, map);
    }
    expect_success(floor.eval({"--json", floor / "j.json"}));
    json = read_json(floor / "j.json");
    EXPECT_EQ(json["depth"]["frames"], 2);
    EXPECT_NEAR(json["depth"]["median_depth"]["median_error"].get<double>(), 1 - 1 / 1.1, 0.005);
    EXPECT_LT(json["depth"]["median_depth"]["within_5_percent"], 0.05);
}

TEST(DepthFigures, ErrorsAreOneLine) {
    const Floor floor;
    expect_failure(floor.eval({"--integrator", "ray"}), 2, "--depth");
    std::ofstream(floor.maps()[0]) << "no picture";
    std::ofstream(floor.maps()[1]) << "no picture";
    std::ofstream(floor.maps()[2]) << "no picture";
    expect_failure(floor.eval(), 2, ".exr");
    for (const fs::path& path : floor.maps()) ewa::save_image(path, ewa::Image(96, 64, 1));
    expect_failure(floor.eval(), 2, "no depth map of these images has a depth");
    for (const fs::path& path : floor.maps()) ewa::save_image(path, ewa::Image(32, 32, 1));
    expect_failure(floor.eval(), 2, "32 x 32");
    expect_failure(run_ewa({"eval", floor / "floor.ply", floor / "none", "--depth"}), 2, "none");
}

}  // namespace
