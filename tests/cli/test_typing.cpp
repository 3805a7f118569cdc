// SPDX-License-Identifier: Apache-2.0
// What people type: mistyped words, short forms of numbers, colours and frames, and what they get to read.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cmath>
#include <limits>
#include <sstream>
#include <thread>

#include "cli/expect.h"
#include "ewa/image.h"

namespace {

using namespace ewa::test;
namespace fs = std::filesystem;

class Typed : public testing::Test {
  protected:
    Typed() {
        make_dataset(folder / "data");
        make_splats(folder / "s.ply");
    }
    Outcome train(const std::vector<std::string>& more, const std::string& data = "data") {
        std::vector<std::string> arguments{"train", folder / data, "-o", folder / "run"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_ewa(arguments);
    }
    Folder folder;
};

TEST_F(Typed, IntegratorsTakeWhatTheyCanUse) {
    const auto render = [&](const std::vector<std::string>& more) {
        std::vector<std::string> arguments{"render", folder / "s.ply", "--cameras", folder / "data",
                                           "-o",     folder / "out"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_ewa(arguments);
    };
    expect_failure(render({"--samples", "8"}), 2, "--samples is an option of --integrator march");
    expect_failure(render({"--integrator", "march", "--samples", "5000"}), 2, "--samples");
    expect_failure(render({"--integrator", "march", "--kernel", "antialias"}), 2,
                   "--integrator march and --kernel antialias exclude each other");
    expect_failure(render({"--integrator", "march", "--mode", "depth"}), 2,
                   "the integrator march draws no depth; the others do");
    expect_failure(render({"--integrator", "march", "--points"}), 2,
                   "--points and --integrator exclude each other");
    expect_failure(render({"--nearest", "8"}), 2, "--nearest is an option of --points");
    EXPECT_FALSE(std::filesystem::exists(folder / "out"));
    const Outcome drawn = render({"--integrator", "march", "--samples", "4"});
    EXPECT_EQ(drawn.status, 0) << drawn.err;
}

TEST_F(Typed, MistypedWordsAreRecognised) {
    expect_failure(run_ewa({"trian", "photos"}), 2,
                   "unknown command 'trian'; did you mean train? (see ewa --help)");
    expect_failure(run_ewa({"fly"}), 2, "unknown command 'fly' (see");
    expect_failure(run_ewa({"train", "photos", "--step", "300"}), 2,
                   "unexpected arguments: --step 300; did you mean --steps? (see ewa train --help)");
    expect_failure(run_ewa({"render", "s.ply", "--camera", "data"}), 2,
                   "unexpected arguments: --camera data; did you mean --cameras?");
    expect_failure(run_ewa({"info", "a", "b", "c"}), 2, "unexpected arguments: b c (");
    expect_failure(run_ewa({"--versoin"}), 2, "did you mean --version?");
    expect_failure(run_ewa({"train", "photos", "--masks", "ignroe"}), 2,
                   "--masks: 'ignroe' is not one of auto, ignore, cut, none; did you mean ignore?");
    expect_failure(run_ewa({"eval", "s.ply", "data", "--masks", "foo"}), 2,
                   "'foo' is not one of auto, ignore, cut, none");
    expect_failure(run_ewa({"train", "photos", "--steps"}), 2, "--steps needs a value: N");
    expect_failure(run_ewa({"eval", "s.ply", "data", "--integrator", "rya"}), 2,
                   "--integrator: 'rya' is not one of splat, ray, fast-ray, march; did you mean ray?");
    expect_failure(run_ewa({"train", "photos", "--samples", "4"}), 2, "unexpected arguments: --samples 4");
    expect_failure(run_ewa({"train", "photos", "--integrator", "march"}), 2,
                   "'march' is not one of splat, ray, fast-ray");
    expect_failure(run_ewa({}), 2, "a subcommand is required: train, render");
#ifdef EWA_VIEW_PROGRAM
    const Circumstances viewer{.program = EWA_VIEW_PROGRAM};
    expect_failure(run_ewa({"--screenshto", "x.png", "s.ply"}, viewer), 2,
                   "unexpected arguments: --screenshto s.ply; did you mean --screenshot?");
    expect_failure(run_ewa({"s.ply", "--mode", "smell"}, viewer), 2,
                   "--mode: 'smell' is not one of color, depth, alpha, count, ellipsoids");
    expect_failure(run_ewa({folder / "absent.ply", "--mode", "colour", "--background", "#fff"}, viewer), 2,
                   "absent.ply");
    expect_failure(run_ewa({folder / "s.ply", "--background", "whit"}, viewer), 2, "did you mean white?");
#endif
}

TEST_F(Typed, NumbersMayBeShort) {
    expect_success(train({"--iterations", "2e0", "--max-splats", "0.5k", "--init", "random", "--strategy",
                          "none", "--eval-every", "1k", "--quiet", "--background", "white"}));
    const auto config = read_json(folder / "run/config.json");
    EXPECT_EQ(config["steps"], 2);
    EXPECT_EQ(config["max-splats"], 500);
    EXPECT_EQ(config["eval-every"], 1000);
    EXPECT_EQ(config["background"], "1,1,1");
    for (const char* count : {"7kk", "1.23456k", "1e-3", "0x10", "7 k"})
        expect_failure(train({"--iters", count}), 2,
                       std::string("--steps: '") + count + "' is not a whole number from 1 to 1000000000");
    expect_failure(run_ewa({"eval", folder / "s.ply", folder / "data", "--downscale", "2k"}), 2,
                   "--downscale: '2k' is not a whole number from 1 to 1024");
    expect_failure(train({"--background", "#12"}), 2, "--background: '#12' is not a colour");
}

TEST_F(Typed, ColoursAndModesInEitherSpelling) {
    const auto render = [&](const std::string& out, const std::vector<std::string>& more) {
        std::vector<std::string> arguments{"render", folder / "s.ply", "--cameras", folder / "data",
                                           "-o",     folder / out};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Outcome outcome = run_ewa(arguments);
        expect_success(outcome);
        return outcome.out;
    };
    EXPECT_NE(render("a", {"--background", "1,0,0", "--frames", "0-1"}).find("2 images are in"),
              std::string::npos);
    render("b", {"--background", "red", "--mode", "colour", "--frames", "1.png,0"});
    render("c", {"--background", "#f00", "--mode", "color", "--frames", "0,1"});
    EXPECT_EQ(files_below(folder / "a"), (std::vector<std::string>{"0.png", "1.png"}));
    for (const char* name : {"0.png", "1.png"}) {
        EXPECT_TRUE(read_file(folder / "a/" + name) == read_file(folder / "b/" + name)) << name;
        EXPECT_TRUE(read_file(folder / "a/" + name) == read_file(folder / "c/" + name)) << name;
    }
    EXPECT_NE(render("d", {"--frames", "2.png"}).find("1 image is in"), std::string::npos);
    expect_success(
        run_ewa({"grad", folder / "s.ply", folder / "data", "--frame", "1.png", "-o", folder / "g.ply"}));
    expect_failure(
        run_ewa({"grad", folder / "s.ply", folder / "data", "--frame", "0-1", "-o", folder / "g.ply"}), 2,
        "--frame: '0-1' is more than one frame");
    expect_failure(run_ewa({"render", folder / "s.ply", "--cameras", folder / "data", "--frames", "1.pgn"}),
                   2, "did you mean 1.png?");
}

TEST_F(Typed, ConfigValuesHaveTheirType) {
    const std::string file = folder / "c.json";
    const std::pair<const char*, const char*> cases[] = {
        {R"({"steps": "3"})", "\"steps\" must be a number, without quotes"},
        {R"({"steps": true})", "\"steps\" takes a value, not true or false"},
        {R"({"steps": [3]})", "\"steps\" takes one value, not a list"},
        {R"({"sh-degree": "2"})", "\"sh-degree\" must be a number"},
        {R"({"absgrad": "true"})", "\"absgrad\" must be true or false, without quotes"},
        {R"({"absgrad": 1})", "\"absgrad\" must be true or false"},
        {R"({"quiet": "yes"})", "\"quiet\" must be true or false"},
        {R"({"init": 3})", "\"init\" must be a text in quotes"},
        {R"({"dataset": 3})", "\"dataset\" must be a text in quotes"}};
    for (const auto& [text, mistake] : cases) {
        write_file(file, text);
        const bool given = std::string(text).find("dataset") == std::string::npos;
        expect_failure(
            given ? run_ewa({"train", "/nowhere", "--config", file}) : run_ewa({"train", "--config", file}),
            2, std::string("c.json: ") + mistake);
    }
    write_file(file,
               R"({"steps": 2.0, "sh-degree": "auto", "background": [1, 1, 1], "device": 0, "absgrad": true,
                         "strategy": "adc", "quiet": true, "save-every": null})");
    expect_success(train({"--config", file}));
    const auto config = read_json(folder / "run/config.json");
    EXPECT_EQ(config["steps"], 2);
    EXPECT_EQ(config["background"], "1,1,1");
    EXPECT_EQ(config["absgrad"], true);
}

/// Runs of earlier versions of ewa have flags of their own for two values, and options that are gone.
TEST_F(Typed, ConfigsOfEarlierVersionsAreRead) {
    const std::string file = folder / "c.json";
    write_file(file, R"({"steps": 2, "appearance": "none", "exposure": true, "antialias": true,
                         "smoothness": false, "smoothing-file": "", "quiet": true})");
    expect_success(train({"--config", file}));
    auto config = read_json(folder / "run/config.json");
    EXPECT_EQ(config["appearance"], "affine");
    EXPECT_EQ(config["kernel"], "antialias");
    config["appearance"] = "none";
    config["exposure"] = true;
    write_file(folder / "run/config.json", config.dump());
    expect_success(run_ewa({"train", folder / "run", "--resume", "--steps", "3", "--quiet"}));
    EXPECT_EQ(read_json(folder / "run/config.json")["appearance"], "affine");
    EXPECT_EQ(read_json(folder / "run/config.json")["steps"], 3);
    write_file(file, R"({"smoothness": 3})");
    expect_failure(train({"--config", file}), 2, "\"smoothness\" is not an option of ewa train");
}

TEST_F(Typed, NoLibrarySpeaks) {
    const std::pair<const char*, const char*> files[] = {{"empty.glb", ""},
                                                         {"gzip.spz", "\x1f\x8b\x08 and so on"},
                                                         {"v4.spz", "NGSP and so on"},
                                                         {"a.ply", "ply\nformat ascii 1.0\n"},
                                                         {"text.gltf", "hello"},
                                                         {"cut.gltf", "{\"asset\": "}};
    const char* reasons[] = {
        "the file is empty",
        "is not a mesh scene (glTF): it is compressed with gzip, as splat files are (SPZ)",
        "is not a mesh scene (glTF): it is a splat file (SPZ)",
        "is not a mesh scene (glTF): it is a PLY",
        "is not a mesh scene (glTF): it begins neither with a brace nor as a .glb does",
        "not valid JSON: the text ends too early"};
    for (size_t i = 0; i < std::size(files); ++i) {
        write_file(folder / files[i].first, files[i].second);
        const Outcome outcome = run_ewa({"dataset", folder / files[i].first, "-o", folder / "d"});
        expect_failure(outcome, 2, std::string(files[i].first) + ": " + (i == 5 ? "byte" : reasons[i]));
        EXPECT_NE(outcome.err.find(reasons[i]), std::string::npos) << outcome.err;
    }
    write_file(folder / "c.json", "{\"steps\": 3,}");
    const Outcome config = train({"--config", folder / "c.json"});
    expect_failure(config, 2, "c.json: byte 13: not valid JSON: unexpected '");
    EXPECT_EQ(config.err.find("exception"), std::string::npos) << config.err;
    write_file(
        folder / "mesh.ply",
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n3 0 0 0\n");
    expect_failure(run_ewa({"info", folder / "mesh.ply"}), 2, "this is a mesh, not a splat file");
}

TEST_F(Typed, TooSmallImagesAndTooShortRunsAreTold) {
    expect_failure(train({"--downscale", "1000"}), 2,
                   "--downscale 1000 leaves 1x1 pixels of the image images/1.png");
    EXPECT_FALSE(fs::exists(folder / "run"));
    const Outcome few = train({"--steps", "2"});
    EXPECT_NE(
        few.out.find("\n2 steps are too few for adc to add or remove splats; it needs --steps 62 or more\n"),
        std::string::npos)
        << few.out;
    EXPECT_EQ(train({"--steps", "2", "--strategy", "none"}).out.find("too few"), std::string::npos);
}

TEST_F(Typed, AModelOfAColmapDatasetIsNotItsName) {
    fs::create_directories(folder / "photos/sparse/0");
    write_file(folder / "photos/sparse/0/cameras.txt", "1 PINHOLE 48 32 50 50 24 16\n");
    write_file(folder / "photos/sparse/0/images.txt",
               "1 1 0 0 0 0 0 4 1 0.png\n\n2 1 0 0 0 1 0 4 1 1.png\n\n");
    fs::copy(folder / "data/images", folder / "photos/images");
    const std::string said = run_ewa({"train", folder / "photos/sparse/0", "-o", folder / "run", "--steps",
                                      "1", "--init", "random", "--max-splats", "50", "--strategy", "none"})
                                 .out;
    EXPECT_TRUE(said.starts_with("photos: ")) << said;
    // A camera so far away that distances are infinite.
    write_file(folder / "photos/sparse/0/images.txt",
               "1 1 0 0 0 0 0 4 1 0.png\n\n2 1 0 0 0 1e300 0 4 1 1.png\n\n");
    expect_failure(run_ewa({"info", folder / "photos"}), 2, "frame \"1.png\": the position of its camera");
}

TEST_F(Typed, JsonTellsIdenticalFromNotANumber) {
    ewa::Image image(4, 4, 3), holes(4, 4, 3);
    holes.pixels[0] = std::numeric_limits<float>::quiet_NaN();
    ewa::save_image(folder / "a.exr", image);
    ewa::save_image(folder / "nan.exr", holes);
    for (const auto& [other, identical] : {std::pair("a.exr", true), std::pair("nan.exr", false)}) {
        run_ewa({"compare", folder / "a.exr", folder / other, "--json", folder / "c.json"});
        const auto json = read_json(folder / "c.json");
        for (const auto& place : {json, json["worst"], json["pictures"][0]}) {
            EXPECT_TRUE(place["psnr"].is_null());
            EXPECT_EQ(place["identical"], identical) << other;
            EXPECT_EQ(place["nan"], !identical) << other;
        }
    }
}

TEST_F(Typed, ClosedStreamsGetNoFile) {
    const auto closed = [&](const std::string& program, const std::vector<std::string>& arguments) {
        std::vector<std::string> words{"-c", "exec \"$0\" \"$@\" <&- >&- 2>&-", program};
        words.insert(words.end(), arguments.begin(), arguments.end());
        return run_ewa(words, {.program = "/bin/sh"});
    };
    EXPECT_EQ(closed(EWA_PROGRAM, {"train", folder / "data", "-o", folder / "run", "--steps", "12", "--init",
                                   "random", "--max-splats", "100", "--test-every", "0", "--serve", "0"})
                  .status,
              0);
    std::istringstream lines(read_file(folder / "run/metrics.jsonl"));
    int count = 0;
    for (std::string line; std::getline(lines, line); ++count)
        EXPECT_TRUE(nlohmann::json::accept(line)) << line;
    EXPECT_GT(count, 1);
}

TEST(Help, FailsWhereTheDiskIsFull) {
    for (const char* option : {"--help", "--version"}) {
        expect_failure(run_ewa({option}, {.out_path = "/dev/full"}), 1, "standard output: No space left");
#ifdef EWA_VIEW_PROGRAM
        expect_failure(run_ewa({option}, {.program = EWA_VIEW_PROGRAM, .out_path = "/dev/full"}), 1,
                       "standard output: No space left");
#endif
    }
    expect_failure(run_ewa({"train", "--help"}, {.out_path = "/dev/full"}), 1, "standard output");
}

TEST(Help, GroupsOptionsBySubject) {
    const std::string help = run_ewa({"train", "--help-all"}).out;
    size_t at = 0;
    for (const char* part :
         {"\nOptions:\n", "--help", "\nOutput:\n", "--output", "\nQuality:\n", "--steps, --iterations",
          "\nData:\n", "--downscale", "\nDevice:\n", "--moments"}) {
        const size_t next = help.find(part);
        ASSERT_NE(next, std::string::npos) << part << help;
        at = std::max(at, next);
    }
    EXPECT_EQ(run_ewa({"devices", "--help"}).out.find("\nDevice:\n"), std::string::npos)
        << "few options need no groups";
}

/// The longest line of the help on a terminal with so many columns.
size_t longest_line(unsigned short columns) {
    const int terminal = posix_openpt(O_RDWR | O_NOCTTY);
    EXPECT_EQ(grantpt(terminal), 0);
    EXPECT_EQ(unlockpt(terminal), 0);
    winsize size{};
    size.ws_col = columns;
    EXPECT_EQ(ioctl(terminal, TIOCSWINSZ, &size), 0);
    const std::string name = ptsname(terminal);
    const int held = open(name.c_str(), O_RDWR | O_NOCTTY);  // so that the output outlives the program
    std::string text;
    std::thread reader([&] {
        char buffer[4096];
        while (text.find('\x04') == std::string::npos) {
            const ssize_t count = read(terminal, buffer, sizeof(buffer));
            if (count <= 0) return;
            text.append(buffer, size_t(count));
        }
    });
    EXPECT_EQ(run_ewa({"train", "--help-all"}, {.out_path = name}).status, 0);
    EXPECT_EQ(write(held, "\x04", 1), 1);
    reader.join();
    close(held);
    close(terminal);
    std::istringstream lines(text);
    size_t longest = 0;
    for (std::string line; std::getline(lines, line);) {
        if (line.ends_with('\r')) line.pop_back();
        longest = std::max(longest, line.size());
    }
    return longest;
}

TEST(Help, WrapsAtTheTerminalsWidth) {
    EXPECT_LE(longest_line(60), 60u);
    EXPECT_GT(longest_line(100), 80u);
    EXPECT_LE(longest_line(100), 100u);
    EXPECT_LE(longest_line(1000), 120u) << "longer lines are hard to read";
    EXPECT_LE(longest_line(0), 80u) << "an unknown width";
}

}  // namespace
