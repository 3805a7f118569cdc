// SPDX-License-Identifier: Apache-2.0
// The stand-alone benchmark as a process.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "scene/scene_file.h"
#include "support/temp_folder.h"

namespace ewa::test {
namespace {

struct Ended {
    int status = -1;
    std::string output;  // both streams
};

Ended run(const std::string& command) {
    Ended ended;
    FILE* pipe = popen((command + " 2>&1").c_str(), "r");
    if (!pipe) return ended;
    char piece[4096];
    for (size_t n; (n = fread(piece, 1, sizeof(piece), pipe)) > 0;) ended.output.append(piece, n);
    const int status = pclose(pipe);
    ended.status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    return ended;
}

nlohmann::json read_json(const std::filesystem::path& path) {
    std::ifstream file(path);
    return nlohmann::json::parse(file);
}

const std::string kProgram = EWA_BENCH_PROGRAM;

TEST(BenchProgram, HelpFits80Columns) {
    const Ended help = run(kProgram + " --help");
    EXPECT_EQ(help.status, 0) << help.output;
    EXPECT_NE(help.output.find("--stability"), std::string::npos) << help.output;
    std::istringstream lines(help.output);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80u) << line;
}

TEST(BenchProgram, LinksTheRuntimeAlone) {
    const Ended ended = run("ldd " + kProgram);
    ASSERT_EQ(ended.status, 0) << ended.output;
    const std::set<std::string> allowed = {"linux-vdso.so.1", "libstdc++.so.6", "libm.so.6", "libgcc_s.so.1",
                                           "libc.so.6"};
    std::istringstream lines(ended.output);
    int libraries = 0;
    for (std::string line; std::getline(lines, line);) {
        std::string name;
        std::istringstream(line) >> name;
        const bool loader = name.find("/ld-linux") != std::string::npos;
        EXPECT_TRUE(loader || allowed.contains(name)) << line;
        ++libraries;
    }
    EXPECT_GE(libraries, 4);
}

TEST(BenchProgram, ATinyCaseIsMeasuredCheckedAndComparedWithItself) {
    const TempFolder folder;
    const std::string json = (folder.path() / "results.json").string();
    const Ended ended = run(kProgram + " --cases capture_2k --runs 3 --check --json " + json);
    ASSERT_EQ(ended.status, 0) << ended.output;

    const nlohmann::json results = read_json(json);
    EXPECT_EQ(results.at("schema"), "ewa-bench-1");
    ASSERT_EQ(results.at("cases").size(), 2u);
    for (const auto& one : results.at("cases")) {
        EXPECT_GT(one.at("instances").get<int>(), 1000);
        EXPECT_GT(one.at("pairs_evaluated"), one.at("pairs_blended"));
        EXPECT_GT(one.at("milliseconds").at("median").get<double>(), 0);
        EXPECT_EQ(one.at("milliseconds").at("samples"), 3);
        EXPECT_GE(one.at("checks").size(), 10u);
        for (const auto& check : one.at("checks")) EXPECT_EQ(check.at("good"), true) << check;
        std::set<std::string> passes;
        for (const auto& pass : one.at("passes")) passes.insert(pass.at("name"));
        EXPECT_TRUE(passes.contains("blend"));
        EXPECT_EQ(passes.contains("blend_backward"), one.at("kind") == "train");
    }

    const Ended compared = run(kProgram + " --compare " + json + " --results " + json);
    EXPECT_EQ(compared.status, 0) << compared.output;
    EXPECT_NE(compared.output.find("x 1.000"), std::string::npos) << compared.output;
    EXPECT_EQ(compared.output.find("SLOWER"), std::string::npos) << compared.output;
}

TEST(BenchProgram, OptionsOfACaseAreTaken) {
    EXPECT_EQ(run(kProgram + " --version").output.rfind("ewa ", 0), 0u);
    const Ended device = run(kProgram + " --cases capture_2k --device nosuchdevice");
    EXPECT_EQ(device.status, 2);
    EXPECT_NE(device.output.find("no usable Vulkan device matches 'nosuchdevice'"), std::string::npos)
        << device.output;
    const Ended kernels = run(kProgram + " --cases capture_2k --kernels tile=3x3");
    EXPECT_EQ(kernels.status, 2);
    EXPECT_NE(kernels.output.find("'tile=3x3' is not a tile"), std::string::npos) << kernels.output;
    const Ended large = run(kProgram + " --large --list");
    EXPECT_EQ(large.status, 0) << large.output;
    EXPECT_NE(large.output.find("_train  (--large)"), std::string::npos) << large.output;
}

TEST(BenchProgram, WrongUseIsToldInOneLine) {
    const TempFolder folder;
    folder.write("other.json", "{}\n");
    folder.write("broken.json", "{");
    const std::string at = (folder.path() / "").string();
    for (const std::string& arguments :
         {std::string("--cases nosuchcase"), std::string("--nosuchoption"), std::string("--results x.json"),
          "--compare " + at + "missing.json", "--compare " + at + "broken.json",
          "--compare " + at + "other.json --results " + at + "other.json"}) {
        const Ended ended = run(kProgram + " " + arguments);
        EXPECT_EQ(ended.status, 2) << arguments << ": " << ended.output;
        EXPECT_EQ(std::count(ended.output.begin(), ended.output.end(), '\n'), 1) << ended.output;
    }
}

TEST(BenchProgram, StabilityIsMeasuredAndWritten) {
    const TempFolder folder;
    const std::string json = (folder.path() / "stability.json").string();
    const Ended ended =
        run(kProgram + " --stability --cases ordinary,value_nan --training-steps 3 --json " + json);
    ASSERT_EQ(ended.status, 0) << ended.output;
    EXPECT_NE(ended.output.find("16 scenes. Each is rendered"), std::string::npos) << ended.output;
    EXPECT_NE(ended.output.find("all 24 results are within their bounds\n"), std::string::npos)
        << ended.output;
    const nlohmann::json results = read_json(json);
    // Three kernels and the one of NaNs, and the same of points, rays, marches, a lens, rays through it and a
    // rolling shutter; and one of widened splats along rays.
    ASSERT_EQ(results.at("cases").size(), 16u);
    for (const auto& one : results.at("cases")) {
        const std::string name = one.at("name");
        EXPECT_EQ(one.at("good"), true) << one;
        EXPECT_EQ(one.at("finite"), true);
        const bool moves_camera =
            name.starts_with("ordinary") || name == "value_nan" || name.starts_with("lens_");
        // Of a readout: turn, shift, and those of the pose.
        const size_t by_camera = name.starts_with("rolling_") ? 4 : moves_camera ? 3 : 0;
        EXPECT_EQ(one.at("comparisons").size(), 7u + by_camera) << name;
        if (name == "value_nan") {
            EXPECT_EQ(one.at("skipped"), 59);
        }
    }
    EXPECT_EQ(results.at("training").size(), 8u);  // along rays nothing trains
    EXPECT_EQ(run(kProgram + " --stability /nowhere.ply").status, 2);
}

TEST(BenchProgram, StabilityAndAccuracyOfASceneFileAreMeasured) {
    const TempFolder folder;
    scene::SceneFile scene;
    scene.gaussians.resize(1);
    scene.gaussians.means = {0, 0, 3};
    scene.gaussians.quaternions = {1, 0, 0, 0};
    scene.gaussians.log_scales = {-0.5f, -0.5f, -0.5f};
    scene.gaussians.opacity_logits = {3};
    scene.gaussians.sh = {1, 1, 1};
    scene.camera = {16, 16, 16, 16, 8, 8, glm::dmat3(1), glm::dvec3(0)};
    const std::string file = (folder / "one").string(), json = (folder / "a.json").string();
    scene::write_scene_file(file, scene);
    const Ended stable = run(kProgram + " --stability " + file + " --training-steps 2 --json " + json);
    ASSERT_TRUE(std::filesystem::exists(json)) << stable.output;
    const nlohmann::json stability = read_json(json);
    EXPECT_EQ(stability.at("cases").at(0).at("name"), "one");
    EXPECT_EQ(stability.at("training").at(0).at("steps"), 2);

    const Ended accurate = run(kProgram + " --accuracy " + file + " --json " + json);
    ASSERT_EQ(accurate.status, 0) << accurate.output;
    for (const char* text : {"\nmarch, density               256 samples  ", " on the front\n",
                             "\nError of splatting by cause, exact image: opacity. ", "\nall: splatting "})
        EXPECT_NE(accurate.output.find(text), std::string::npos) << text << accurate.output;
    const nlohmann::json results = read_json(json);
    EXPECT_EQ(results.at("rendering").at("schema"), "ewa-work-precision-1");
    EXPECT_EQ(results.at("rendering").at("tables").size(), 2u);
    EXPECT_EQ(results.at("styles").size(), results.at("rendering").at("series").size());

    scene::write_scene_file(file, {scene.gaussians, {}});
    EXPECT_EQ(run(kProgram + " --accuracy " + file).status, 2) << "without a camera";
}

TEST(BenchProgram, ListsItsCases) {
    const Ended ended = run(kProgram + " --list");
    EXPECT_EQ(ended.status, 0);
    for (const char* name :
         {"capture_14k_270x480_sh3_train", "cloud_1m_1920x1080_sh3_forward", "sort_1m", "first_step"})
        EXPECT_NE(ended.output.find(name), std::string::npos) << name;
}

}  // namespace
}  // namespace ewa::test
