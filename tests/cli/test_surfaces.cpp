// SPDX-License-Identifier: Apache-2.0
// ewa mesh and ewa compare of meshes: files, what is said about them, and errors.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>

#include "cli/expect.h"
#include "cli/faulty.h"
#include "ewa/image.h"
#include "ewa/splat_files.h"
#include "io/gltf/document.h"
#include "io/meshes/mesh_files.h"

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

/// The program stands still in its work for the device, and nothing lets it go on.
TEST(Mesh, SignalsEndItInTheMiddleOfAStep) {
    const Prepared folder;
    for (const int signal : {SIGINT, SIGTERM}) {
        std::filesystem::remove(folder / "held");
        Circumstances held = held_at(4, folder / "held", signal);
        held.then = [] {};
        const Outcome outcome = run_ewa({"mesh", folder / "shell.ply", "-o", folder / "out/m.ply",
                                         "--cameras", folder / "data", "--quiet"},
                                        held);
        EXPECT_EQ(outcome.status, 130) << outcome.err;
        EXPECT_EQ(outcome.err, "");
        EXPECT_FALSE(std::filesystem::exists(folder / "out/m.ply"));
    }
}

TEST(Mesh, IsAnotherOfSmallerImages) {
    const Prepared folder;
    const auto made = [&](std::vector<std::string> more) {
        more.insert(more.end(), {"--voxel", "0.08"});
        expect_success(mesh(folder, "m.ply", more));
        return read_file(folder / "m.ply");
    };
    const std::string whole = made({}), half = made({"--downscale", "2"});
    EXPECT_NE(half, whole);
    EXPECT_EQ(made({"--max-width", "24"}), half);  // of 48
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

TEST(Mesh, ForCollisionIsClosed) {
    const Prepared folder;
    const auto told = [&](const std::vector<std::string>& more) {
        std::vector<std::string> arguments = {"mesh",      folder / "shell.ply", "-o",      folder / "m.ply",
                                              "--cameras", folder / "data",      "--voxel", "0.08"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Outcome outcome = run_ewa(arguments);
        expect_success(outcome);
        return outcome.out;
    };
    EXPECT_NE(told({}).find("not watertight"), std::string::npos);
    const std::string closed = told({"--collision"});
    EXPECT_NE(closed.find("in 1 part, voxels of 0.08, watertight"), std::string::npos) << closed;
    const std::string ply = read_file(folder / "m.ply");
    EXPECT_EQ(ply.find("property uchar red"), std::string::npos);
    EXPECT_LE(header_count(ply, "element face "), 10000u);
    told({"--collision", "--triangles", "300"});
    const size_t fewer = header_count(read_file(folder / "m.ply"), "element face ");
    EXPECT_LE(fewer, 300u);
    EXPECT_GE(fewer, 250u);
}

TEST(Mesh, OfABackground) {
    const Prepared folder;
    const auto made = [&](const std::string& out, const std::vector<std::string>& more) {
        std::vector<std::string> arguments = {
            "mesh", folder / "shell.ply", "-o",           folder / out, "--voxel",
            "0.08", "--cameras",          folder / "data"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Outcome outcome = run_ewa(arguments);
        expect_success(outcome);
        return outcome.out;
    };
    const std::string told = made("a.ply", {"--unbounded"});
    EXPECT_NE(told.find(" voxels of 0.08 within "), std::string::npos) << told;
    made("b.ply", {"--unbounded"});
    EXPECT_EQ(read_file(folder / "a.ply"), read_file(folder / "b.ply"));
}

TEST(Mesh, HasTheLengthThatIsKnown) {
    const Prepared folder;
    expect_success(mesh(folder, "a.glb", {"--voxel", "0.08"}));
    expect_success(mesh(folder, "b.glb", {"--voxel", "0.08", "--scale-to", "0,0,1,0,0,-1,20"}));
    const auto corner = [&](const std::string& name) {
        return ewa::io::read_mesh(folder / name).triangles.at(7).corners[1];
    };
    EXPECT_LT(glm::length(corner("b.glb") - 10.0 * corner("a.glb")), 1e-4);
    // The points are those before the transform.
    expect_success(mesh(folder, "c.glb",
                        {"--voxel", "0.08", "--transform", "scale=-3", "--scale-to", "0,0,1,0,0,-1,20"}));
    const auto mirrored = ewa::io::read_mesh(folder / "c.glb").triangles.at(7);
    EXPECT_LT(glm::length(mirrored.corners[2] + 10.0 * corner("a.glb")), 1e-4);
    expect_failure(mesh(folder, "c.glb", {"--scale-to", "1,2,3"}), 2, "--scale-to");
}

/// The corners of the box of all that the nodes of a glTF place, in the file's world.
std::array<glm::dvec3, 2> gltf_box(const std::filesystem::path& path) {
    const ewa::io::GltfDocument document(path, ewa::io::GltfContent::meshes);
    std::array<glm::dvec3, 2> box{glm::dvec3(1e300), glm::dvec3(-1e300)};
    ewa::io::visit_nodes(document, glm::dmat4(1), [&](int node, const glm::dmat4& place) {
        const int mesh = document.model().nodes.at(size_t(node)).mesh;
        if (mesh < 0) return;
        for (const auto& primitive : document.mesh(mesh, "a node").primitives)
            document.read(document.accessor(primitive.attributes.at("POSITION"), "positions"), "positions",
                          [&](size_t, const double* v) {
                              const glm::dvec3 at(place * glm::dvec4(v[0], v[1], v[2], 1));
                              box = {glm::min(box[0], at), glm::max(box[1], at)};
                          });
    });
    return box;
}

TEST(Mesh, LiesWhereTheSplatsOfAGlbLie) {
    const Prepared folder;
    const std::vector<std::string> steps = {"--transform", "move=5,2,1", "--transform", "turn=1,0,0,90"};
    std::vector<std::string> convert = {"convert", folder / "shell.ply", folder / "splats.glb"};
    convert.insert(convert.end(), steps.begin(), steps.end());
    expect_success(run_ewa(convert));
    expect_success(run_ewa({"mesh", folder / "shell.ply", "-o", folder / "m.glb", "--voxel", "0.08",
                            "--quiet", steps[0], steps[1], steps[2], steps[3]}));
    const auto splats = gltf_box(folder / "splats.glb"), made = gltf_box(folder / "m.glb");
    EXPECT_LT(glm::distance(splats[0], {-6, 0, 1}), 0.01) << "x and y are turned: y is up";
    for (size_t k = 0; k < 2; ++k) EXPECT_LT(glm::distance(splats[k], made[k]), 0.1);

    expect_success(mesh(folder, "z.glb", {"--voxel", "0.08", "--up", "z", steps[0], steps[1]}));
    const auto upright = gltf_box(folder / "z.glb");
    EXPECT_NEAR(0.5 * (upright[0].y + upright[1].y), 1, 0.3) << "z of the shell is its height";
    expect_failure(mesh(folder, "m.ply", {"--up", "z"}), 2, "--up is for .glb and .obj");
    expect_failure(mesh(folder, "m.obj", {"--up", "north"}), 2, "is not an axis");
    expect_failure(mesh(folder, "m.obj", {"--transform", "scale=0"}), 2, "flattens space");
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

/// A fisheye sees what no pinhole shows at once: by the sides of a cube, and nothing beyond its image.
TEST(Mesh, OfAFisheye) {
    const Prepared folder;
    std::filesystem::create_directories(folder / "fish/images");
    const auto write_fisheye = [&](int side) {
        ewa::save_image(folder / "fish/images/a.png", ewa::Image(side, side, 3));
        const double degrees = 220, radius = 0.5 * side, fl = radius / (degrees / 2 * std::numbers::pi / 180);
        write_file(folder / "fish/transforms.json",
                   nlohmann::json{
                       {"camera_model", "OPENCV_FISHEYE"},
                       {"fl_x", fl},
                       {"fl_y", fl},
                       {"cx", radius},
                       {"cy", radius},
                       {"w", side},
                       {"h", side},
                       {"frames",
                        {{{"file_path", "images/a.png"},
                          {"transform_matrix", {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}}}}}}
                       .dump());
    };
    write_fisheye(128);
    const Outcome outcome = run_ewa({"mesh", folder / "shell.ply", "-o", folder / "m.ply", "--cameras",
                                     folder / "fish", "--voxel", "0.05"});
    expect_success(outcome);
    EXPECT_EQ(outcome.out.find("coarse"), std::string::npos) << outcome.out;
    // The camera looks along -z. Its corners see about 156 degrees from there, and its sides 110.
    double farthest = -2, nearest = 2;
    for (const auto& t : ewa::io::read_mesh(folder / "m.ply").triangles) {
        farthest = std::max(farthest, t.corners[0].z);
        nearest = std::min(nearest, t.corners[0].z);
    }
    EXPECT_LT(nearest, -0.9);
    EXPECT_GT(farthest, 0.5) << "the corners see behind the camera";
    EXPECT_LT(farthest, 0.97) << "nothing sees straight behind";
    write_fisheye(64);
    const Outcome coarse =
        run_ewa({"mesh", folder / "shell.ply", "-o", folder / "m.ply", "--cameras", folder / "fish"});
    expect_success(coarse);
    EXPECT_NE(coarse.out.find("are coarse: the mesh is "), std::string::npos) << coarse.out;
    EXPECT_NE(coarse.out.find(" of them from corner to corner; --voxel 0.0"), std::string::npos)
        << coarse.out;
}

/// meshoptimizer 0.18 keeps more than four triangles of a closed surface, 0.22 does not.
TEST(Mesh, SaysWhereFewerTrianglesWouldTearIt) {
    const Prepared folder;
    const Outcome told = run_ewa({"mesh", folder / "shell.ply", "-o", folder / "m.ply", "--cameras",
                                  folder / "data", "--voxel", "0.1", "--triangles", "4"});
    expect_success(told);
    const bool tears = header_count(read_file(folder / "m.ply"), "element face ") > 4;
    EXPECT_EQ(told.out.find("--triangles 4: with fewer than ") != std::string::npos, tears) << told.out;
}

TEST(Mesh, ErrorsAreOneLine) {
    const Prepared folder;
    expect_failure(mesh(folder, "m.stl"), 2, ".ply, .obj or .glb");
    expect_failure(mesh(folder, "m.ply", {"--voxel", "0"}), 2, "--voxel");
    expect_failure(mesh(folder, "m.ply", {"--voxel", "1e-9"}), 2, "--voxel");
    expect_failure(mesh(folder, "m.ply", {"--voxel", "1"}), 2,
                   "voxels of 1; take a smaller --voxel, such as 0.1");
    expect_failure(mesh(folder, "m.ply", {"--voxel", "50"}), 2, "--voxel");
    expect_failure(mesh(folder, "shell.ply"), 2, "SPLATS");
    expect_failure(run_ewa({"mesh", folder / "absent.ply", "-o", folder / "m.ply"}), 2, "absent.ply");
    EXPECT_FALSE(std::filesystem::exists(folder / "m.ply"));
    expect_failure(run_ewa({"compare", folder / "shell.ply", folder / "shell.ply", "--distance", "1"}), 2,
                   "--distance");
}

/// One point of a scan is on the mesh, one half as far again from the middle, and one far away.
TEST(Mesh, ComparesWithAScan) {
    const Prepared folder;
    expect_success(mesh(folder, "m.glb", {"--voxel", "0.08"}));
    const glm::dvec3 on = ewa::io::read_mesh(folder / "m.glb").triangles.at(0).corners[0];
    std::string scan =
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n"
        "end_header\nnan 0 0\n";
    for (const double times : {1.0, 1.5, 40.0})
        for (int k = 0; k < 3; ++k) scan += std::to_string(times * on[k]) + (k < 2 ? " " : "\n");
    write_file(folder / "scan.ply", scan);
    const auto compared = [&](const std::vector<std::string>& more) {
        std::vector<std::string> arguments = {"compare", folder / "m.glb", folder / "scan.ply", "--json",
                                              folder / "j.json"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Outcome outcome = run_ewa(arguments);
        expect_success(outcome);
        EXPECT_NE(outcome.out.find("scan.ply: "), std::string::npos);
        return read_json(folder / "j.json");
    };
    const auto json = compared({"--distance", "0.2"});
    EXPECT_EQ(json["b"]["points"], 3);
    EXPECT_TRUE(json["normal_error"].is_null());
    EXPECT_NEAR(json["completeness"].get<double>(), 39.5 / 3 * glm::length(on), 0.1);
    EXPECT_NEAR(json["recall"].get<double>(), 1.0 / 3, 1e-5);
    expect_failure(run_ewa({"compare", folder / "shell.ply", folder / "shell.ply", "--distance", "1"}), 2,
                   "--distance is for two meshes");
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
