// SPDX-License-Identifier: Apache-2.0
// ewa mesh and ewa compare of meshes: files, what is said about them, and errors.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <numbers>

#include "cli/expect.h"
#include "ewa/image.h"
#include "ewa/splat_files.h"

namespace {

using namespace ewa::test;

/// A shell of flat, opaque splats at a distance of 1 from the origin.
void make_shell(const std::string& path) {
    ewa::Gaussians g;
    g.resize(600);
    for (size_t i = 0; i < g.size(); ++i) {
        const double z = 1 - (2 * double(i) + 1) / double(g.size()), turn = 2.39996 * double(i);
        const double r = std::sqrt(1 - z * z), n[] = {r * std::cos(turn), r * std::sin(turn), z};
        for (size_t k = 0; k < 3; ++k) {
            g.means[3 * i + k] = float(n[k]);
            g.log_scales[3 * i + k] = float(std::log(k < 2 ? 0.06 : 0.002));
            g.sh[g.sh_stride() * i + k] = float(k == 0 ? 1.5 : -1.5);
        }
        // From z to the normal.
        const double q[] = {1 + n[2], -n[1], n[0], 0};
        for (size_t k = 0; k < 4; ++k) g.quaternions[4 * i + k] = float(q[k]);
        g.opacity_logits[i] = 5;
    }
    ewa::save_splats(path, g);
}

Outcome mesh(const Folder& folder, const std::string& out, std::vector<std::string> more = {}) {
    std::vector<std::string> arguments = {"mesh",      folder / "shell.ply", "-o",     folder / out,
                                          "--cameras", folder / "data",      "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_ewa(arguments);
}

struct Prepared : Folder {
    Prepared() {
        make_shell(*this / "shell.ply");
        make_dataset(*this / "data");
    }
};

/// The number behind a word of a PLY's header.
size_t header_count(const std::string& bytes, const std::string& word) {
    return std::stoul(bytes.substr(bytes.find(word) + word.size()));
}

TEST(Mesh, OfAllFormatsAndTheSameTwice) {
    const Prepared folder;
    expect_success(mesh(folder, "a.ply", {"--voxel", "0.08"}));
    expect_success(mesh(folder, "b.ply", {"--voxel", "0.08"}));
    const std::string ply = read_file(folder / "a.ply");
    EXPECT_EQ(ply, read_file(folder / "b.ply"));
    const size_t vertices = header_count(ply, "element vertex "), faces = header_count(ply, "element face ");
    EXPECT_GT(faces, 300u);
    const size_t data = ply.find("end_header\n") + 11;
    ASSERT_EQ(ply.size(), data + 27 * vertices + 13 * faces);
    size_t red = 0;
    double apart = 0;
    for (size_t i = 0; i < vertices; ++i) {
        float p[3];
        std::memcpy(p, &ply[data + 27 * i], sizeof(p));
        const double off = std::abs(std::hypot(p[0], p[1], p[2]) - 1);
        EXPECT_LT(off, 0.2);
        apart += off;
        const auto color = [&](size_t k) { return int(uint8_t(ply[data + 27 * i + 24 + k])); };
        red += color(0) > 180 && color(1) < 60;
    }
    EXPECT_GT(red, vertices * 9 / 10);
    EXPECT_LT(apart, 0.08 * double(vertices)) << "a pixel is 0.08 wide on the shell";

    expect_success(mesh(folder, "c.obj", {"--voxel", "0.08"}));
    const std::string obj = read_file(folder / "c.obj");
    EXPECT_EQ(size_t(std::ranges::count(obj, '\n')), 1 + 2 * vertices + faces);
    expect_success(
        run_ewa({"compare", folder / "a.ply", folder / "c.obj", "--json", folder / "formats.json"}));
    const auto formats = read_json(folder / "formats.json");
    EXPECT_LT(formats["chamfer"], 1e-6);
    EXPECT_EQ(formats["a"], formats["b"]);
    EXPECT_EQ(formats["a"]["triangles"], faces);
    const Outcome told = run_ewa({"mesh", folder / "shell.ply", "-o", folder / "d.glb", "--cameras",
                                  folder / "data", "--voxel", "0.08", "--triangles", "200"});
    expect_success(told);
    EXPECT_NE(told.out.find(" triangles in 1 part, voxels of 0.08, not watertight: "), std::string::npos)
        << told.out;
    const Outcome same =
        run_ewa({"compare", folder / "d.glb", folder / "d.glb", "--json", folder / "j.json"});
    expect_success(same);
    const auto json = read_json(folder / "j.json");
    EXPECT_NEAR(json["f_score"].get<double>(), 1, 1e-9);
    EXPECT_LT(json["chamfer"], 1e-6);
    EXPECT_LE(json["a"]["triangles"], 200);
    EXPECT_EQ(json["a"]["watertight"], false);
}

TEST(Mesh, OfASplatFileAlone) {
    const Folder folder;
    make_shell(folder / "shell.ply");
    const Outcome outcome =
        run_ewa({"mesh", folder / "shell.ply", "-o", folder / "m.glb", "--voxel", "0.05"});
    expect_success(outcome);
    EXPECT_NE(outcome.out.find("in 1 part, voxels of 0.05, watertight"), std::string::npos) << outcome.out;
}

/// What shows the back of the shell through its front is nearer to the middle by the mean depth.
TEST(Mesh, AtTheMeanDepthAfterATrainingWithDepthMaps) {
    const Prepared folder;
    ewa::Gaussians g = ewa::load_splats(folder / "shell.ply");
    std::fill(g.opacity_logits.begin(), g.opacity_logits.end(), 2.0f);
    std::filesystem::create_directories(folder / "run");
    ewa::save_splats(folder / "run/splats.ply", g);
    write_file(folder / "run/metrics.jsonl",
               "{\"step\": 1, \"loss\": 0.5, \"seconds\": 0.1, \"splats\": 600}\n");
    const auto made = [&](const std::string& loss, const std::vector<std::string>& more = {}) {
        write_file(folder / "run/config.json",
                   nlohmann::json{{"dataset", folder / "data"}, {"steps", 3}, {"loss", loss}}.dump());
        std::vector<std::string> arguments = {"mesh",    folder / "run", "-o",     folder / "m.ply",
                                              "--voxel", "0.08",         "--quiet"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        expect_success(run_ewa(arguments));
        return read_file(folder / "m.ply");
    };
    const std::string usual = "l1=0.8,ssim=0.2", depth = usual + ",depth=2";
    const std::string median = made(usual), mean = made(depth);
    EXPECT_EQ(median, made(depth, {"--depth", "median"}));
    EXPECT_EQ(mean, made(usual, {"--depth", "mean"}));
    const auto radius = [](const std::string& ply) {
        const size_t vertices = header_count(ply, "element vertex "), data = ply.find("end_header\n") + 11;
        double sum = 0;
        for (size_t i = 0; i < vertices; ++i) {
            float p[3];
            std::memcpy(p, &ply[data + 27 * i], sizeof(p));
            sum += std::hypot(p[0], p[1], p[2]);
        }
        return sum / double(vertices);
    };
    EXPECT_LT(radius(mean), radius(median) - 0.01);
}

/// From inside, the six sides of one 360° image see the whole shell.
TEST(Mesh, OfA360Image) {
    const Prepared folder;
    std::filesystem::create_directories(folder / "around/images");
    ewa::save_image(folder / "around/images/a.png", ewa::Image(128, 64, 3));
    const auto dataset = [&](const std::string& model) {
        nlohmann::json top = {{"camera_model", model}, {"fl_x", 20}};
        top["frames"] = {{{"file_path", "images/a.png"},
                          {"transform_matrix", {{1, 0, 0, 0.1}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}}}};
        write_file(folder / "around/transforms.json", top.dump());
    };
    dataset("EQUIRECTANGULAR");
    const auto made = [&] {
        return run_ewa({"mesh", folder / "shell.ply", "-o", folder / "m.ply", "--cameras", folder / "around",
                        "--voxel", "0.05"});
    };
    const Outcome outcome = made();
    expect_success(outcome);
    EXPECT_NE(outcome.out.find("in 1 part, voxels of 0.05, watertight"), std::string::npos) << outcome.out;
    dataset("ORTHOGRAPHIC");
    expect_failure(made(), 2, "a.png has parallel rays; name other cameras with --cameras");
}

TEST(Mesh, SaysWhereFewerTrianglesWouldTearIt) {
    const Prepared folder;
    const Outcome told = run_ewa({"mesh", folder / "shell.ply", "-o", folder / "m.glb", "--cameras",
                                  folder / "data", "--voxel", "0.1", "--triangles", "4"});
    expect_success(told);
    EXPECT_NE(told.out.find("--triangles 4: with fewer than "), std::string::npos) << told.out;
}

TEST(Mesh, ErrorsAreOneLine) {
    const Prepared folder;
    expect_failure(mesh(folder, "m.stl"), 2, ".ply, .obj or .glb");
    expect_failure(mesh(folder, "m.ply", {"--voxel", "0"}), 2, "--voxel");
    expect_failure(mesh(folder, "m.ply", {"--voxel", "1e-9"}), 2, "--voxel");
    expect_failure(mesh(folder, "m.ply", {"--voxel", "50"}), 2, "--voxel");
    expect_failure(mesh(folder, "shell.ply"), 2, "SPLATS");
    expect_failure(run_ewa({"mesh", folder / "absent.ply", "-o", folder / "m.ply"}), 2, "absent.ply");
    EXPECT_FALSE(std::filesystem::exists(folder / "m.ply"));
    expect_failure(run_ewa({"compare", folder / "shell.ply", folder / "shell.ply", "--distance", "1"}), 2,
                   "--distance");
}

TEST(Mesh, ComparesWithMeshesOnly) {
    const Prepared folder;
    expect_success(mesh(folder, "m.glb", {"--voxel", "0.1"}));
    expect_failure(run_ewa({"compare", folder / "m.glb", folder / "shell.ply"}), 2, "is a mesh");
    expect_failure(run_ewa({"compare", folder / "m.glb", folder / "m.glb", "--threshold", "30"}), 2,
                   "--threshold");
    expect_failure(run_ewa({"compare", folder / "m.glb", folder / "m.glb", "--json", folder / "m.glb"}), 2,
                   "--json");
}

}  // namespace
