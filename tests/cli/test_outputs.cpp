// SPDX-License-Identifier: Apache-2.0
// What the commands write, and what happens where they cannot.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <functional>
#include <map>

#include "cli/expect.h"
#include "cli/faulty.h"
#include "ewa/image.h"
#include "ewa/splat_files.h"

namespace {

using namespace ewa::test;
using ewa::Gaussians;
using ewa::Image;
namespace fs = std::filesystem;
using Names = std::vector<std::string>;

TEST(Outputs, RenderNamesPicturesByStem) {
    const Folder folder;
    make_dataset(folder / "data");
    make_splats(folder / "s.ply");
    const Names render{"render", folder / "s.ply", "--cameras", folder / "data", "-o"};
    auto files = [&](const std::string& out, const Names& more) {
        Names arguments = render;
        arguments.push_back(folder / out);
        arguments.insert(arguments.end(), more.begin(), more.end());
        expect_success(run_ewa(arguments));
        return files_below(folder / out);
    };
    EXPECT_EQ(files("all", {}), (Names{"0.png", "1.png", "2.png", "3.png"}));
    EXPECT_EQ(files("test", {"--frames", "test", "--test-every", "2"}), (Names{"0.png", "2.png"}));
    EXPECT_EQ(files("list", {"--frames", "3,1", "--format", "exr"}), (Names{"1.exr", "3.exr"}));
    // The images are not needed.
    fs::remove_all(folder / "data/images");
    EXPECT_EQ(files("bare", {"--frames", "train", "--test-every", "2"}), (Names{"1.png", "3.png"}));
}

TEST(Outputs, SameStemsDoNotOverwriteEachOther) {
    const Folder folder;
    make_dataset(folder / "data", {"left/1.png", "right/1.png", "right/2.png"});
    make_splats(folder / "s.ply");
    expect_success(
        run_ewa({"render", folder / "s.ply", "--cameras", folder / "data", "-o", folder / "o", "--quiet"}));
    EXPECT_EQ(files_below(folder / "o"), (Names{"left/1.png", "right/1.png", "right/2.png"}));
}

TEST(Outputs, ExrKeepsWhatAPngClamps) {
    const Folder folder;
    make_dataset(folder / "data");
    Gaussians bright;
    bright.resize(1);
    bright.quaternions[0] = 1;
    bright.opacity_logits[0] = 4;
    for (float& v : bright.log_scales) v = -0.5f;
    for (float& v : bright.sh) v = 10;
    ewa::save_splats(folder / "bright.ply", bright);
    const Names render{
        "render", folder / "bright.ply", "--cameras", folder / "data", "--frames", "0", "--quiet", "-o"};
    auto picture = [&](const std::string& out, const Names& more) {
        Names arguments = render;
        arguments.push_back(folder / out);
        arguments.insert(arguments.end(), more.begin(), more.end());
        expect_success(run_ewa(arguments));
        return ewa::load_image((folder / out) + "/" + files_below(folder / out).front());
    };
    const Image exr = picture("exr", {"--format", "exr"});
    ASSERT_EQ(exr.channels, 4);
    EXPECT_GT(exr.at(24, 16)[0], 2.0f);
    EXPECT_NEAR(exr.at(24, 16)[3], 1 / (1 + std::exp(-4.0)), 0.01);
    EXPECT_EQ(exr.at(0, 0)[3], 0.0f);
    const Image depth = picture("depth", {"--format", "exr", "--mode", "depth"});
    EXPECT_NEAR(depth.at(24, 16)[0], std::sqrt(17.0), 0.01);
    const Image median = picture("median", {"--format", "exr", "--mode", "median-depth"});
    EXPECT_NEAR(median.at(24, 16)[0], std::sqrt(17.0), 0.02);
    EXPECT_EQ(median.at(0, 0)[0], 0.0f);
    const Image normal = picture("normal", {"--format", "exr", "--mode", "normal"});
    const float* n = normal.at(24, 16);
    EXPECT_NEAR(std::hypot(n[0], n[1], n[2]), 1, 1e-4);
    const Image lifted = picture("lifted", {"--mode", "normal"});
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(lifted.at(24, 16)[c], 0.5 + 0.5 * double(n[c]), 0.01);
    EXPECT_EQ(lifted.at(0, 0)[0], 0.0f);
    const Image alpha = picture("alpha", {"--mode", "alpha"});
    EXPECT_NEAR(alpha.at(24, 16)[0], 1 / (1 + std::exp(-4.0)), 0.01);
    const Image white = picture("white", {"--background", "0.2,0.4,0.6"});
    EXPECT_EQ(white.at(24, 16)[0], 1.0f);
    EXPECT_NEAR(white.at(0, 0)[1], 0.4, 1.0 / 255);
    const Image small = picture("small", {"--downscale", "2"});
    EXPECT_EQ(small.width, 24);
    const Outcome told = run_ewa({"render", folder / "bright.ply", "--cameras", folder / "data", "--frames",
                                  "0", "--mode", "depth", "-o", folder / "told"});
    EXPECT_NE(told.out.find("white is depth 4.1"), std::string::npos) << told.out;
}

TEST(Outputs, Eval) {
    const Folder folder;
    make_dataset(folder / "data");
    make_splats(folder / "s.ply");
    const Outcome outcome =
        run_ewa({"eval", folder / "s.ply", folder / "data", "--split", "all", "--json", folder / "e/e.json"});
    expect_success(outcome);
    EXPECT_NE(outcome.out.find("mean of 4 frames"), std::string::npos) << outcome.out;
    const auto json = read_json(folder / "e/e.json");
    for (const char* key : {"psnr", "ssim", "frames", "seconds"}) EXPECT_TRUE(json.contains(key)) << key;
    ASSERT_EQ(json["frames"].size(), 4u);
    double sum = 0;
    for (const auto& frame : json["frames"]) {
        EXPECT_TRUE(frame["name"].is_string() && frame["ssim"].is_number());
        sum += frame["psnr"].get<double>();
    }
    EXPECT_NEAR(json["psnr"].get<double>(), sum / 4, 1e-9);
}

TEST(Outputs, Grad) {
    const Folder folder;
    make_dataset(folder / "data");
    make_splats(folder / "s.ply");
    expect_success(run_ewa({"grad", folder / "s.ply", folder / "data", "--frame", "1", "-o", folder / "g.ply",
                            "--json", folder / "g.json"}));
    const auto json = read_json(folder / "g.json");
    EXPECT_NEAR(json["loss"].get<double>(),
                0.8 * json["l1"].get<double>() + 0.2 * (1 - json["ssim"].get<double>()), 1e-5);
    EXPECT_TRUE(json.contains("frame"));
    EXPECT_FALSE(json.contains("l2"));
    auto properties = [](const std::string& ply) {
        return ply.substr(ply.find("element"), ply.find("end_header") - ply.find("element"));
    };
    EXPECT_EQ(properties(read_file(folder / "g.ply")), properties(read_file(folder / "s.ply")));
    const Gaussians gradient = ewa::load_splats(folder / "g.ply");
    EXPECT_EQ(gradient.size(), 50u);
    double size = 0;
    for (const float v : gradient.opacity_logits) size += std::abs(v);
    EXPECT_GT(size, 0);
    const Outcome other = run_ewa({"grad", folder / "s.ply", folder / "data", "--frame", "1", "-o",
                                   folder / "h.ply", "--json", folder / "h.json", "--loss", "l1=0.25,l2=3"});
    expect_success(other);
    EXPECT_NE(other.out.find("  L2 "), std::string::npos) << other.out;
    EXPECT_EQ(other.out.find("SSIM"), std::string::npos) << other.out;
    const auto weighted = read_json(folder / "h.json");
    EXPECT_FALSE(weighted.contains("ssim"));
    EXPECT_EQ(weighted["l1"], json["l1"]);
    EXPECT_NEAR(weighted["loss"].get<double>(),
                0.25 * weighted["l1"].get<double>() + 3 * weighted["l2"].get<double>(), 1e-5);
}

TEST(Outputs, Info) {
    const Folder folder;
    make_dataset(folder / "data");
    make_splats(folder / "s.ply", 50, 2);
    const Outcome text = run_ewa({"info", folder / "s.ply"});
    expect_success(text);
    EXPECT_NE(text.out.find("2 stored, 0 present"), std::string::npos) << text.out;
    EXPECT_EQ(text.out.find("skipped when"), std::string::npos) << text.out;
    EXPECT_EQ(text.out.find("undrawable"), std::string::npos) << text.out;
    const Outcome verbose = run_ewa({"info", folder / "s.ply", "--verbose"});
    EXPECT_EQ(verbose.out.substr(0, text.out.size()), text.out);
    EXPECT_NE(verbose.out.find("skipped when training"), std::string::npos) << verbose.out;
    const Outcome splats = run_ewa({"info", folder / "s.ply", "--json"});
    expect_success(splats);
    const auto json = nlohmann::json::parse(splats.out);
    EXPECT_EQ(json["splats"], 50);
    EXPECT_EQ(json["sh_degree"], 2);
    EXPECT_EQ(json["sh_degree_present"], 0);
    EXPECT_EQ(json["nonfinite"], 0);
    EXPECT_NEAR(json["scale"]["median"].get<double>(), std::exp(-2.0), 1e-6);
    const auto skips = [&](const char* purpose, const std::string& what) {
        const auto& lines = json["plan"][purpose];
        return std::any_of(lines.begin(), lines.end(),
                           [&](const auto& line) { return line["what"] == what; });
    };
    EXPECT_TRUE(skips("rendering", "SH degrees 1 to 2"));
    EXPECT_TRUE(skips("rendering", "Adam's moments"));
    // By default `auto` is mcmc, which reads no statistics and has regularisers.
    EXPECT_TRUE(skips("training", "densification statistics"));
    EXPECT_FALSE(skips("training", "opacity and scale regularisers"));
    EXPECT_FALSE(skips("training", "SH degrees 1 to 2"));

    fs::remove(folder / "data/images/2.png");
    const Outcome data = run_ewa({"info", folder / "data", "--json", "--test-every", "2"});
    expect_success(data);
    const auto dataset = nlohmann::json::parse(data.out);
    EXPECT_EQ(dataset["frames"], 3);
    EXPECT_EQ(dataset["missing_images"], 1);
    EXPECT_EQ(dataset["test"], 2);
    EXPECT_EQ(dataset["cameras"][0]["width"], 48);
    expect_success(run_ewa({"info", folder / "data"}));
}

TEST(Outputs, InfoCountsThePointsOfATransformsJson) {
    const Folder folder;
    write_file(folder / "points.ply",
               "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
               "property float z\nend_header\n0 0 1\n0 1 1\n");
    write_file(folder / "transforms.json",
               R"({"w": 8, "h": 8, "fl_x": 8, "fl_y": 8, "cx": 4, "cy": 4, "ply_file_path": "points.ply",
                   "frames": [{"file_path": "0.png",
                               "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]})");
    const Outcome info = run_ewa({"info", folder / "."});
    expect_success(info);
    EXPECT_NE(info.out.find("points          2\n"), std::string::npos) << info.out;
    EXPECT_NE(info.out.find("(1 frame)"), std::string::npos) << info.out;
}

TEST(Outputs, InfoCountsWhatIsNotDrawn) {
    const Folder folder;
    make_splats(folder / "s.ply");
    Gaussians splats = ewa::load_splats(folder / "s.ply");
    splats.means[0] = std::numeric_limits<float>::quiet_NaN();
    std::fill_n(&splats.quaternions[4], 4, 0.0f);
    ewa::save_splats(folder / "s.ply", splats);
    const Outcome outcome = run_ewa({"info", folder / "s.ply", "--json"});
    expect_success(outcome);
    EXPECT_EQ(nlohmann::json::parse(outcome.out)["nonfinite"], 2);
}

TEST(Outputs, Devices) {
    const Outcome outcome = run_ewa({"devices", "--json"});
    expect_success(outcome);
    const auto json = nlohmann::json::parse(outcome.out);
    ASSERT_FALSE(json.empty());
    EXPECT_TRUE(json[0]["name"].is_string());
    const Outcome text = run_ewa({"devices"});
    expect_success(text);
    size_t lacking = 0;
    for (const auto& one : json) {
        lacking += !one["lacks"].empty();
        for (const std::string lack : one["lacks"]) EXPECT_NE(text.out.find(lack), std::string::npos) << lack;
    }
    EXPECT_EQ(size_t(std::count(text.out.begin(), text.out.end(), '\n')), json.size() + lacking);
}

/// Who has a driver that fails, or none, learns which files were tried and what to install.
TEST(Devices, WithoutADriverNameWhatWasTried) {
    for (const char* file : {"/dev/null", "/nowhere/driver.json"}) {
        const Outcome outcome =
            run_ewa({"devices"}, {.environment = {{"VK_DRIVER_FILES", file}, {"VK_ICD_FILENAMES", file}}});
        expect_failure(outcome, 1, "VK_DRIVER_FILES names " + std::string(file) + " alone");
        EXPECT_NE(outcome.err.find("mesa-vulkan-drivers"), std::string::npos) << outcome.err;
    }
}

TEST(Outputs, PlacesThatCannotBeWritten) {
    const Folder folder;
    make_dataset(folder / "data");
    make_splats(folder / "s.ply");
    write_file(folder / "file", "in the way");
    const std::string splats = folder / "s.ply", data = folder / "data";
    expect_failure(run_ewa({"train", data, "--init", splats, "-o", folder / "file/out"}), 1, "file/out");
    expect_failure(run_ewa({"train", data, "--init", splats, "-o", folder / "file"}), 1, "file");
    expect_failure(run_ewa({"render", splats, "--cameras", data, "-o", folder / "file/out"}), 1, "file/out");
    expect_failure(run_ewa({"grad", splats, data, "--frame", "0", "-o", folder / "file/g.ply"}), 1, "file");
    expect_failure(run_ewa({"eval", splats, data, "--json", folder / "file/e.json"}), 1, "file");
    EXPECT_EQ(read_file(folder / "file"), "in the way");
    // Before anything is read or trained.
    const std::string none = folder / "none";
    expect_failure(run_ewa({"eval", none, data, "--json", folder / "file/e.json"}), 1, "file");
    expect_failure(run_ewa({"grad", none, data, "--frame", "0", "-o", folder / "file/g.ply"}), 1, "file");
    expect_failure(run_ewa({"bench", "--accuracy", none, "--json", folder / "file/a/b.json"}), 1, "file/a");
    expect_failure(run_ewa({"bench", "--accuracy", none, "--svg", folder / "file/b.svg"}), 1, "file");
    fs::create_directory(folder / "b_training.svg");
    expect_failure(run_ewa({"bench", "--accuracy", none, "--svg", folder / "b.svg"}), 1, "b_training.svg");
    expect_failure(run_ewa({"bench", "--accuracy", none, "--json", folder / "new/b.json"}), 2, none);
    EXPECT_FALSE(fs::exists(folder / "new"));
}

TEST(Outputs, NoFileTakesAnothersPlace) {
    const Folder folder;
    make_dataset(folder / "data");
    make_splats(folder / "s.ply");
    const std::string splats = folder / "s.ply", data = folder / "data", out = folder / "o.ply",
                      good = read_file(splats);
    expect_failure(run_ewa({"eval", splats, data, "--json", splats}), 2, "is the same file as SPLATS");
    expect_failure(run_ewa({"grad", splats, data, "--frame", "0", "-o", splats}), 2,
                   "is the same file as SPLATS");
    expect_failure(run_ewa({"grad", splats, data, "--frame", "0", "-o", out, "--json", out}), 2,
                   "is the same file as --output");
    expect_failure(run_ewa({"bench", "--accuracy", data, "--splats", splats, "--json", splats}), 2,
                   "is the same file as --splats");
    for (const char* option : {"--compare", "--results"})
        expect_failure(run_ewa({"bench", option, splats, "--json", splats}), 2, option);
    expect_failure(run_ewa({"bench", "--stability", splats, "--json", splats}), 2, "the same file as FILE");
    expect_failure(run_ewa({"bench", "--accuracy", data, "--svg", out, "--json", out}), 2,
                   "is the same file as --svg");
    EXPECT_EQ(read_file(splats), good);
    EXPECT_FALSE(fs::exists(out));
}

/// No command writes over a file of a dataset that it reads.
TEST(Outputs, DatasetsStayWhole) {
    const Folder folder;
    make_dataset(folder / "data");
    make_splats(folder / "s.ply");
    const std::string splats = folder / "s.ply", data = folder / "data";
    const auto whole = [&] {
        std::string all;
        for (const std::string& file : files_below(data)) all += file + "\n" + read_file(data + "/" + file);
        return all;
    };
    const std::string before = whole();
    const auto refused = [&](const Names& arguments, const std::string& text) {
        expect_failure(run_ewa(arguments), 2, text);
        EXPECT_EQ(whole(), before);
    };
    refused({"render", splats, "--cameras", data, "-o", data + "/images"}, "is a folder of a dataset");
    fs::create_directory_symlink(data + "/images", folder / "link");
    refused({"render", splats, "--cameras", data, "-o", folder / "link"}, "is a folder of a dataset");
    refused({"eval", splats, data, "--json", data + "/transforms.json"}, "a file of DATASET");
    refused({"eval", splats, data + "/transforms.json", "--json", data + "/transforms.json"}, "DATASET");
    refused({"eval", splats, data, "--json", data + "/images/1.png"}, "an image of DATASET");
    fs::create_hard_link(data + "/images/1.png", folder / "hard.ply");
    refused({"grad", splats, data, "--frame", "0", "-o", folder / "hard.ply"}, "an image of DATASET");
    refused({"compare", splats, splats, "--cameras", data, "--heat-map", data + "/images"},
            "is a folder of a dataset");

    // Held-out images in test/, where a run puts its renders.
    make_dataset(folder / "blender", {"test/0.png", "test/1.png", "test/2.png"});
    fs::rename(folder / "blender/images/test", folder / "blender/test");
    auto json = read_json(folder / "blender/transforms.json");
    for (auto& frame : json["frames"])
        frame["file_path"] = frame["file_path"].get<std::string>().substr(std::string("images/").size());
    write_file(folder / "blender/transforms.json", json.dump());
    const std::string image = read_file(folder / "blender/test/0.png");
    expect_failure(
        run_ewa({"train", folder / "blender", "-o", folder / "blender", "--init", splats, "--steps", "1"}), 2,
        "is a dataset");
    expect_failure(
        run_ewa({"render", splats, "--cameras", folder / "blender", "-o", folder / "blender/test"}), 2,
        "holds images of");
    EXPECT_EQ(read_file(folder / "blender/test/0.png"), image);
    fs::create_directory(folder / "o");
    fs::rename(splats, folder / "o/splats.ply");
    expect_failure(run_ewa({"train", data, "-o", folder / "o", "--init", folder / "o/splats.ply", "--steps",
                            "1", "--force"}),
                   2, "is the same file as --init");
}

TEST(Outputs, MissingFoldersAreMade) {
    const Folder folder;
    make_dataset(folder / "data");
    make_splats(folder / "s.ply");
    const std::string splats = folder / "s.ply", data = folder / "data";
    expect_success(run_ewa({"convert", splats, folder / "a/b/c.gltf", "--json", folder / "a/j/c.json"}));
    expect_success(run_ewa({"grad", splats, data, "--frame", "0", "-o", folder / "g/h/g.ply"}));
    expect_success(run_ewa({"eval", splats, data, "--json", folder / "e/f/e.json"}));
    expect_success(run_ewa({"render", splats, "--cameras", data, "-o", folder / "r/s", "--quiet"}));
    expect_success(run_ewa(
        {"compare", data + "/images/0.png", data + "/images/0.png", "--heat-map", folder / "m/n/m.png"}));
    expect_success(
        run_ewa({"train", data, "--init", splats, "-o", folder / "t/u", "--steps", "1", "--quiet"}));
    for (const char* file : {"a/b/c.gltf", "a/b/c.bin", "a/j/c.json", "g/h/g.ply", "e/f/e.json", "r/s/0.png",
                             "m/n/m.png", "t/u/splats.ply"})
        EXPECT_TRUE(fs::exists(folder / file)) << file;
}

/// The number of a process that has ended.
int ended_process() {
    const pid_t child = fork();
    if (child == 0) _exit(0);
    waitpid(child, nullptr, 0);
    return child;
}

/// Every command that writes is killed at each moment of its writing, with an earlier result in its place. Each file
/// is then the earlier one or the new one, and what reads them takes them.
TEST(Outputs, AKillAtAnyMomentLeavesWholeFiles) {
    const Folder folder;
    make_dataset(folder / "data");
    make_splats(folder / "old.ply", 60);
    make_splats(folder / "new.ply", 50);
    const std::string data = folder / "data", pictures = data + "/images/";
    const auto survives = [&](const std::function<Names(const std::string&)>& command, const Names& outputs,
                              const std::function<void()>& check = {}) {
        const std::string out = folder / "out";
        const auto bytes = [&] {
            std::map<std::string, std::string> all;
            for (const std::string& name : outputs) all[name] = read_file(folder / name);
            return all;
        };
        fs::remove_all(out);
        expect_success(run_ewa(command(folder / "new.ply")));
        const auto later = bytes();
        fs::remove_all(out);
        expect_success(run_ewa(command(folder / "old.ply")));
        SCOPED_TRACE(command("")[0]);
        int kills = 0;
        for (int moment = 1; moment < 400; ++moment) {
            SCOPED_TRACE(moment);
            const auto earlier = bytes();
            const Outcome outcome =
                run_ewa(command(folder / "new.ply"), with_fault("EWA_FAULT_KILL", std::to_string(moment)));
            for (const auto& [name, now] : bytes())
                EXPECT_TRUE(now == earlier.at(name) || now == later.at(name)) << name;
            if (check) check();
            if (outcome.status == 0) break;
            ASSERT_EQ(outcome.status, 128 + SIGKILL) << outcome.err;
            ++kills;
        }
        EXPECT_GE(kills, 3);
        for (const auto& [name, now] : bytes()) EXPECT_TRUE(now == later.at(name)) << name;
    };
    const std::string out = folder / "out/";
    for (const char* name : {"o.ply", "o.spz", "o.glb"})
        survives(
            [&](const std::string& splats) {
                return Names{"convert", splats, out + name};
            },
            {std::string("out/") + name});
    survives(
        [&](const std::string& splats) {
            return Names{"convert", splats, out + "o.gltf"};
        },
        {},
        [&] {
            const size_t splats = ewa::load_splats(out + "o.gltf").size();
            EXPECT_TRUE(splats == 50 || splats == 60) << splats;
        });
    survives(
        [&](const std::string& splats) {
            return Names{"grad", splats, data, "--frame", "0", "-o", out + "g.ply", "--json", out + "g.json"};
        },
        {"out/g.ply"});
    survives([&](const std::string& splats) { return Names{"render", splats, "--cameras", data, "-o", out}; },
             {"out/0.png", "out/3.png"});
    survives(
        [&](const std::string& splats) {
            return Names{"render", splats, "-o", out + "x.exr", "--size", "16x16"};
        },
        {"out/x.exr"});
    survives(
        [&](const std::string& splats) {
            const std::string other = splats.ends_with("old.ply") ? "1.png" : "2.png";
            return Names{"compare",     pictures + "0.png", pictures + other, "--heat-map",
                         out + "m.png", "--json",           out + "c.json"};
        },
        {"out/m.png", "out/c.json"});
}

TEST(Outputs, WhatAKilledCommandLeftIsCleared) {
    const Folder folder;
    make_dataset(folder / "data");
    make_splats(folder / "s.ply");
    const std::string splats = folder / "s.ply", data = folder / "data";
    fs::create_directory(folder / "k");
    const Outcome killed =
        run_ewa({"convert", splats, folder / "k/o.ply"}, with_fault("EWA_FAULT_KILL", "2"));
    ASSERT_EQ(killed.status, 128 + SIGKILL);
    EXPECT_EQ(files_below(folder / "k").size(), 1u);
    expect_success(run_ewa({"convert", splats, folder / "k/o.ply"}));
    EXPECT_EQ(files_below(folder / "k"), Names{"o.ply"});

    const std::string name = "/.ewa-" + std::to_string(ended_process()) + "-";
    const auto clears = [&](const std::string& where, const Names& arguments) {
        SCOPED_TRACE(arguments[0]);
        fs::create_directories(folder / where);
        write_file((folder / where) + name + "0.tmp", "half");
        write_file((folder / where) + name + "1.tmp.txt", "not ours");
        const std::string locked = (folder / where) + name + "2.tmp",
                          running = (folder / where) + "/.ewa-" + std::to_string(getpid()) + "-0.tmp";
        write_file(locked, "of a process in another container");
        write_file(running, "of a process that runs");
        const int descriptor = open(locked.c_str(), O_RDONLY | O_CLOEXEC);
        ASSERT_EQ(flock(descriptor, LOCK_EX), 0);
        expect_success(run_ewa(arguments));
        close(descriptor);
        EXPECT_FALSE(fs::exists((folder / where) + name + "0.tmp"));
        for (const std::string& file : {(folder / where) + name + "1.tmp.txt", locked, running})
            EXPECT_TRUE(fs::exists(file)) << file;
    };
    clears("c", {"convert", splats, folder / "c/o.ply"});
    clears("g", {"grad", splats, data, "--frame", "0", "-o", folder / "g/g.ply"});
    clears("e", {"eval", splats, data, "--json", folder / "e/e.json"});
    clears("r", {"render", splats, "--cameras", data, "-o", folder / "r", "--quiet"});
    clears("m",
           {"compare", data + "/images/0.png", data + "/images/0.png", "--heat-map", folder / "m/m.png"});
    clears("t", {"train", data, "--init", splats, "-o", folder / "t", "--steps", "1", "--quiet"});
    clears("u/test", {"train", data, "--init", splats, "-o", folder / "u", "--steps", "1", "--quiet"});
}

TEST(Outputs, StandardOutputThatIsFull) {
    const Folder folder;
    make_splats(folder / "s.ply");
    Circumstances full;
    full.out_path = "/dev/full";
    expect_failure(run_ewa({"info", folder / "s.ply"}, full), 1, "standard output: No space left");
    // What was lost on the way is not forgotten where the last line fits.
    make_dataset(folder / "data");
    expect_failure(
        run_ewa({"render", folder / "s.ply", "--cameras", folder / "data", "-o", folder / "r"}, full), 1,
        "standard output");
}

TEST(Outputs, FullDiskLeavesNoHalfFile) {
    const Folder folder;
    make_dataset(folder / "data");
    make_splats(folder / "s.ply");
    const Circumstances full = with_fault("EWA_FAULT_BYTES", "2048");
    expect_failure(
        run_ewa({"grad", folder / "s.ply", folder / "data", "--frame", "0", "-o", folder / "o/g.ply"}, full),
        1, "g.ply");
    EXPECT_EQ(files_below(folder / "o"), Names{});
    expect_failure(run_ewa({"render", folder / "s.ply", "--cameras", folder / "data", "--format", "exr", "-o",
                            folder / "r"},
                           full),
                   1, ".exr");
    EXPECT_EQ(files_below(folder / "r"), Names{});
}

}  // namespace
