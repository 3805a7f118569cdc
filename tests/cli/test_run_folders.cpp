// SPDX-License-Identifier: Apache-2.0
// The folder of a run: as DATASET of ewa train, with --resume, and the files that runs write and do not write.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "cli/expect.h"
#include "cli/faulty.h"
#include "ewa/image.h"

namespace {

using namespace ewa::test;
namespace fs = std::filesystem;
using Names = std::vector<std::string>;

class RunFolders : public testing::Test {
  protected:
    void SetUp() override {
        make_dataset(folder / "data");
        make_splats(folder / "s.ply");
    }
    Outcome ewa_in(const std::string& where, const Names& arguments,
                   const Circumstances& circumstances = {}) {
        Names all{"-C", where, EWA_PROGRAM};
        all.insert(all.end(), arguments.begin(), arguments.end());
        Circumstances in_folder = circumstances;
        in_folder.program = "/usr/bin/env";
        return run_ewa(all, in_folder);
    }
    /// Trains with the first splats of s.ply, as names relative to the test's folder.
    Outcome train(const Names& more, const Circumstances& circumstances = {}) {
        Names all{"train", "data", "--init", "s.ply", "--quiet"};
        all.insert(all.end(), more.begin(), more.end());
        return ewa_in(folder / ".", all, circumstances);
    }
    int steps_of(const std::string& run) { return read_json((folder / run) + "/summary.json")["steps"]; }
    std::string bytes_below(const std::string& name) {
        std::string all;
        for (const std::string& file : files_below(folder / name))
            all += file + "\n" + read_file((folder / name) + "/" + file);
        return all;
    }
    Folder folder;
};

TEST_F(RunFolders, AsDatasetMeanThatRun) {
    expect_success(train({"-o", "out/data", "--steps", "3"}));
    expect_success(train({"-o", "ic", "--steps", "4", "--downscale", "2", "--seed", "3"}));
    expect_success(train({"-o", "same", "--steps", "4", "--downscale", "2", "--seed", "3"}));
    expect_success(train({"-o", "same", "--steps", "8", "--downscale", "2", "--seed", "3", "--resume"}));
    const std::string other = bytes_below("out");

    // From any current folder, with the options of the run, its relative paths too.
    expect_success(ewa_in(folder / ".", {"train", "ic", "--resume", "--steps", "8", "--quiet"}));
    EXPECT_EQ(steps_of("ic"), 8);
    EXPECT_EQ(read_json(folder / "ic/config.json")["downscale"], 2);
    EXPECT_EQ(read_file(folder / "ic/splats.ply"), read_file(folder / "same/splats.ply"));
    expect_success(ewa_in(folder / "ic", {"train", ".", "--resume", "--steps", "9", "--quiet"}));
    EXPECT_EQ(steps_of("ic"), 9);
    expect_success(ewa_in("/", {"train", folder / "ic", "--resume", "--steps", "10", "--quiet"}));
    EXPECT_EQ(steps_of("ic"), 10);
    expect_success(ewa_in(folder / ".", {"train", "--resume", "-o", "ic", "--steps", "11", "--quiet"}));
    EXPECT_EQ(steps_of("ic"), 11);
    expect_success(ewa_in(folder / ".", {"train", "ic", "--resume", "-o", "./ic/", "--quiet"}));
    EXPECT_EQ(steps_of("ic"), 11);

    const Outcome two = ewa_in(folder / ".", {"train", "ic", "--resume", "-o", "out/data"});
    expect_failure(two, 2, "ic is a run, which --resume continues in its own folder, not in -o out/data");
    const Outcome changed = ewa_in(folder / ".", {"train", "ic", "--resume", "--downscale", "1"});
    expect_failure(changed, 2, "was written with --downscale 2, not 1; with its own value the run continues");
    expect_failure(ewa_in(folder / ".", {"train", "ic", "--steps", "20"}), 2,
                   "ic: holds a finished run of 11 steps");
    expect_failure(ewa_in(folder / ".", {"train", "--resume"}), 2, "--resume needs the folder of a run");
    expect_failure(ewa_in(folder / ".", {"train", "--resume", "-o", "nowhere"}), 2,
                   "nowhere: there is no run to continue");
    EXPECT_EQ(bytes_below("out"), other) << "another run was touched";
    EXPECT_FALSE(fs::exists(folder / "nowhere"));
    // Without --resume, -o begins another run on the same dataset.
    expect_success(ewa_in(folder / ".", {"train", "ic", "-o", "new", "--steps", "2", "--quiet"}));
    EXPECT_EQ(read_json(folder / "new/config.json")["downscale"], 1);
}

TEST_F(RunFolders, OptionsOfTheCommandLineGoBeforeTheRuns) {
    expect_success(train({"-o", "run", "--steps", "3", "--save-every", "2", "--points", "--nearest", "3"}));
    expect_success(ewa_in(folder / ".", {"train", "run", "--resume", "--quality", "low", "--check-options"}));
    expect_success(
        ewa_in(folder / ".", {"train", "run", "--resume", "--steps", "5", "--save-every", "0", "--quiet"}));
    const auto config = read_json(folder / "run/config.json");
    EXPECT_EQ(config["steps"], 5);
    EXPECT_EQ(config["save-every"], 0);
    EXPECT_EQ(config["nearest"], 3);
    EXPECT_EQ(config["dataset"], "data");
}

TEST_F(RunFolders, ARunOfAMeshSceneContinuesWithoutIt) {
    for (const auto& entry : fs::directory_iterator(std::string(EWA_SOURCE_DIR) + "/scenes"))
        if (const std::string name = entry.path().filename().string(); name.starts_with("plaster"))
            fs::copy(entry.path(), folder / name);
    expect_success(ewa_in(folder / ".", {"dataset", "plaster.gltf", "-o", "run/dataset", "--views", "8",
                                         "--size", "32x24", "--quiet"}));
    expect_success(ewa_in(folder / ".", {"train", "run/dataset", "-o", "run", "--steps", "2", "--quiet"}));
    auto config = read_json(folder / "run/config.json");
    config["dataset"] = "plaster.gltf";
    write_file(folder / "run/config.json", config.dump());
    fs::remove(folder / "plaster.gltf");
    expect_success(ewa_in(folder / ".", {"train", "run", "--resume", "--steps", "4", "--quiet"}));
    EXPECT_EQ(steps_of("run"), 4);
    EXPECT_EQ(read_json(folder / "run/config.json")["dataset"], "plaster.gltf");
}

TEST_F(RunFolders, NoOutputsLandAmongPhotos) {
    make_dataset(folder / "other");
    const std::string before = bytes_below("data") + bytes_below("other");
    const auto refused = [&](const Names& arguments, const std::string& text) {
        SCOPED_TRACE(arguments[0] + " " + arguments.back());
        expect_failure(ewa_in(folder / ".", arguments), 2, text);
        EXPECT_EQ(bytes_below("data") + bytes_below("other"), before);
    };
    const std::string images = "is a folder of a dataset, where no outputs belong; name another folder";
    refused({"render", "s.ply", "--cameras", "data", "-o", "data/images"}, "-o data/images " + images);
    refused({"render", "s.ply", "--cameras", "data", "-o", "other/images"}, images);
    refused({"render", "s.ply", "--orbit", "2", "-o", "data/images"}, images);
    refused({"render", "s.ply", "--orbit", "2", "-o", "data"}, "is a dataset");
    refused({"train", "data", "-o", "data/images"}, images);
    refused({"train", "data", "-o", "data"}, "-o data is a dataset");
    refused({"train", "data", "-o", "other"}, "-o other is a dataset");
    refused({"train", "data", "-o", "data/images/run"}, "holds images of data");
    refused({"train", "data", "-o", "data", "--force"}, "-o data is a dataset");
    refused({"compare", "s.ply", "s.ply", "--cameras", "data", "--heat-map", "data/images"}, images);
    refused({"dataset", std::string(EWA_SOURCE_DIR) + "/scenes/plaster.gltf", "-o", "data/images"}, images);
    fs::create_directory_symlink(folder / "data/images", folder / "link");
    refused({"train", "data", "-o", "link"}, images);
    // Beside the photos is a usual place.
    expect_success(train({"-o", "data/out/run", "--steps", "1"}));
}

TEST_F(RunFolders, NothingIsWrittenThroughLinks) {
    fs::create_directory(folder / "pictures");
    write_file(folder / "pictures/0.png", "a picture");
    fs::create_directories(folder / "run");
    const Names links{"metrics.jsonl", "config.json", "report.html"};
    for (const std::string& file : links) {
        write_file(folder / ("my-" + file), "dear diary");
        fs::create_symlink("../my-" + file, folder / ("run/" + file));
    }
    fs::create_directory_symlink("../pictures", folder / "run/test");
    expect_success(train({"-o", "run", "--steps", "2"}));
    for (const std::string& file : links) {
        EXPECT_EQ(read_file(folder / ("my-" + file)), "dear diary");
        EXPECT_FALSE(fs::is_symlink(folder / ("run/" + file)));
    }
    EXPECT_EQ(read_file(folder / "pictures/0.png"), "a picture");
    fs::remove(folder / "run/test/0.png");
    fs::create_symlink("../../pictures/0.png", folder / "run/test/0.png");
    expect_success(train({"-o", "run", "--steps", "2", "--force"}));
    EXPECT_EQ(read_file(folder / "pictures/0.png"), "a picture");
}

/// What a run would replace or remove, in a folder where none has begun.
TEST_F(RunFolders, FilesOfOthersWithTheNamesOfARunAreRefused) {
    for (const std::string name : {"cameras.json", "sky.json", "report.html", "metrics.jsonl", "config.json",
                                   "test/0.png", "inria/cfg_args", "passers_by/0.png"}) {
        SCOPED_TRACE(name);
        const std::string out = "o-" + name.substr(0, name.find('/'));
        fs::create_directories(fs::path(folder / (out + "/" + name)).parent_path());
        write_file(folder / (out + "/" + name), "{\"mine\": 1}");
        expect_failure(train({"-o", out, "--steps", "2"}), 2,
                       "holds " + name.substr(0, name.find('/')) + ", which a run writes");
        EXPECT_EQ(read_file(folder / (out + "/" + name)), "{\"mine\": 1}");
    }
    expect_success(train({"-o", "o-sky.json", "--steps", "2", "--force"}));
    fs::create_directory(folder / "o");
    write_file(folder / "o/config.json", "{\"steps\": 2}");
    write_file(folder / "o/notes.txt", "mine");
    expect_success(train({"-o", "o", "--config", folder / "o/config.json"}));
    EXPECT_EQ(read_file(folder / "o/notes.txt"), "mine");
}

TEST_F(RunFolders, ALinkOfAnotherUserInAFolderOfAllIsNotFollowed) {
    if (geteuid() != 0) GTEST_SKIP() << "needs root";
    constexpr uid_t kSomebody = 12345;
    fs::create_directory(folder / "sticky");
    fs::permissions(folder / "sticky", fs::perms::all | fs::perms::sticky_bit);
    write_file(folder / "mine.ply", "mine");
    fs::create_symlink("../mine.ply", folder / "sticky/out.ply");
    ASSERT_EQ(lchown((folder / "sticky/out.ply").c_str(), kSomebody, kSomebody), 0);
    expect_failure(run_ewa({"convert", folder / "s.ply", folder / "sticky/out.ply"}), 1,
                   "it is another user's link in a folder that all may write");
    EXPECT_EQ(read_file(folder / "mine.ply"), "mine");
    ASSERT_EQ(lchown((folder / "sticky/out.ply").c_str(), 0, 0), 0);
    expect_success(run_ewa({"convert", folder / "s.ply", folder / "sticky/out.ply"}));
}

TEST_F(RunFolders, AConfigDecidesNeitherPlacesNorWhoMayConnect) {
    for (const auto& [name, value] : {std::pair{"output", "\"run\""},
                                      {"force", "true"},
                                      {"resume", "true"},
                                      {"serve", "\"0.0.0.0:0\""}}) {
        write_file(folder / "evil.json",
                   std::string(R"({"dataset": "data", "steps": 1, ")") + name + "\": " + value + "}");
        expect_failure(ewa_in(folder / ".", {"train", "--config", "evil.json"}), 2,
                       std::string("\"") + name + "\" belongs on the command line");
    }
    EXPECT_FALSE(fs::exists(folder / "out"));
}

TEST_F(RunFolders, AFileSizeLimitIsAFullDisk) {
    Circumstances shell;
    shell.program = "/bin/sh";
    const std::string command = "ulimit -f 4; exec \"$0\" \"$@\"";
    const Outcome outcome =
        run_ewa({"-c", command, EWA_PROGRAM, "convert", folder / "s.ply", folder / "o.ply"}, shell);
    expect_failure(outcome, 1, "o.ply: cannot be written: File too large");
    EXPECT_EQ(std::ranges::count_if(files_below(folder / "."),
                                    [](const std::string& file) { return file.ends_with(".tmp"); }),
              0);
}

#ifndef __SANITIZE_ADDRESS__  // which takes terabytes of address space
TEST_F(RunFolders, ShortAddressSpaceIsRefusedBeforeTheDriverCrashes) {
    if (nlohmann::json::parse(run_ewa({"devices", "--json"}).out)[0]["type"] != "cpu")
        GTEST_SKIP() << "no CPU device";
    Circumstances circumstances;
    circumstances.address_limit = size_t(650) << 20;
    expect_failure(run_ewa({"train", folder / "data", "-o", folder / "o", "--steps", "1"}, circumstances), 1,
                   "needs 960 MiB of address space; this process may use only 650 MiB");
}
#endif

/// Before it trains, a run compares the disk with what its files will take.
TEST_F(RunFolders, ASmallDiskIsNamedAtTheStart) {
    expect_failure(
        train({"-o", "o", "--steps", "1"}, with_fault("EWA_FAULT_ROOM", "4096")), 1,
        "o: its disk has 4.1 kB free, and splats.ply and checkpoint.ewa of the first 50 splats take 41.7 kB");
    EXPECT_FALSE(fs::exists(folder / "o/config.json"));
    const Outcome warned =
        ewa_in(folder / ".",
               {"train", "data", "--init", "s.ply", "-o", "o", "--steps", "1", "--max-splats", "100000"},
               with_fault("EWA_FAULT_ROOM", "1000000"));
    expect_success(warned);
    EXPECT_NE(warned.out.find("the disk of o has "), std::string::npos) << warned.out;
}

TEST_F(RunFolders, KeepTheLastNumberedSplats) {
    expect_failure(train({"-o", "o", "--steps", "9", "--keep", "2"}), 2,
                   "--keep is an option of --save-every");
    expect_success(train({"-o", "o", "--steps", "9", "--save-every", "3", "--keep", "2"}));
    const auto kept = [&] {
        Names names;
        for (const std::string& file : files_below(folder / "o"))
            if (file.starts_with("splats")) names.push_back(file);
        return names;
    };
    EXPECT_EQ(kept(), (Names{"splats.ply", "splats_000006.ply", "splats_000009.ply"}));
    EXPECT_EQ(read_file(folder / "o/splats.ply"), read_file(folder / "o/splats_000009.ply"));
    EXPECT_NE(read_file(folder / "o/splats.ply"), read_file(folder / "o/splats_000006.ply"));
    expect_success(ewa_in(folder / ".", {"eval", "o/splats_000006.ply"}));
    expect_failure(ewa_in(folder / ".", {"convert", "s.ply", "o/splats_000006.ply"}), 2,
                   "is a file of the training run in o");
    expect_success(ewa_in(folder / ".", {"train", "o", "--resume", "--steps", "13", "--quiet"}));
    EXPECT_EQ(kept(), (Names{"splats.ply", "splats_000009.ply", "splats_000012.ply"}));
    expect_success(train({"-o", "o", "--steps", "4", "--force"}));
    EXPECT_EQ(kept(), Names{"splats.ply"});
    fs::create_directory(folder / "k");
    fs::copy_file(folder / "s.ply", folder / "k/splats_000500.ply");
    expect_failure(train({"-o", "k", "--steps", "1"}), 2, "k: holds splats");
}

TEST_F(RunFolders, InriasLayoutIsWrittenWhereAskedFor) {
    expect_success(train({"-o", "o", "--steps", "2", "--inria", "--background", "1,1,1"}));
    EXPECT_EQ(read_file(folder / "o/inria/point_cloud/iteration_2/point_cloud.ply"),
              read_file(folder / "o/splats.ply"));
    const std::string arguments = read_file(folder / "o/inria/cfg_args");
    EXPECT_TRUE(arguments.starts_with("Namespace(") && arguments.ends_with(")")) << arguments;
    for (const std::string& text : {std::string("sh_degree="), std::string("white_background=True"),
                                    "source_path='" + fs::weakly_canonical(folder / "data").string() + "'"})
        EXPECT_NE(arguments.find(text), std::string::npos) << text << " is not in " << arguments;
    const auto cameras = read_json(folder / "o/inria/cameras.json");
    ASSERT_EQ(cameras.size(), 4u);
    EXPECT_EQ(cameras[0]["img_name"], "0") << "held-out images come first";
    const auto frames = read_json(folder / "data/transforms.json")["frames"];
    const auto& pose = frames[0]["transform_matrix"];
    for (size_t row = 0; row < 3; ++row) {
        EXPECT_NEAR(cameras[0]["position"][row].get<double>(), pose[row][3].get<double>(), 1e-9);
        for (size_t column = 0; column < 3; ++column)  // from OpenGL's axes to OpenCV's
            EXPECT_NEAR(cameras[0]["rotation"][row][column].get<double>(),
                        pose[row][column].get<double>() * (column == 0 ? 1 : -1), 1e-9);
    }
    EXPECT_EQ(cameras[0]["width"], 48);
    EXPECT_GT(cameras[0]["fy"], 0);
    EXPECT_TRUE(read_file(folder / "o/inria/input.ply").starts_with("ply\n"));
    expect_success(train({"-o", "o", "--steps", "1", "--inria", "--force"}));
    EXPECT_FALSE(fs::exists(folder / "o/inria/point_cloud/iteration_2"));
}

/// INRIA's cameras.json has pinholes alone.
TEST_F(RunFolders, InriasLayoutSaysWhatItCannotSayOfLenses) {
    const auto trained = [&](const std::string& model, const std::string& remark) {
        nlohmann::json top = read_json(folder / "data/transforms.json");
        top.update({{"camera_model", model}, {"h", 24}, {"k1", 0.01}});
        for (auto& frame : top["frames"])
            ewa::save_image((folder / "data") + "/" + frame["file_path"].get<std::string>(),
                            ewa::Image(48, 24, 3));
        write_file(folder / "data/transforms.json", top.dump());
        const Outcome outcome =
            ewa_in(folder / ".", {"train", "data", "--init", "s.ply", "-o", "o", "--steps", "1", "--inria",
                                  "--lens", "native", "--force"});
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_NE((outcome.out + outcome.err).find("--inria: cameras.json has pinholes alone, so " + remark),
                  std::string::npos)
            << outcome.out << outcome.err;
        return read_json(folder / "o/inria/cameras.json")[0];
    };
    const auto fisheye = trained("OPENCV_FISHEYE", "these have the focal lengths of their lenses");
    EXPECT_EQ(fisheye["width"], 48);
    EXPECT_EQ(fisheye["fx"], 50);
    const auto around = trained("EQUIRECTANGULAR", "these are views of 90 degrees");
    EXPECT_EQ(around["width"], 12);
    EXPECT_EQ(around["height"], 12);
    EXPECT_EQ(around["fx"], 6);
}

TEST_F(RunFolders, ATildeIsTheHomeFolder) {
    Circumstances at_home;
    at_home.environment = {{"HOME", folder / "home"}};
    expect_success(train({"-o", "~/a", "--steps", "1"}, at_home));
    expect_success(train({"--output=~/b", "--steps", "1"}, at_home));
    EXPECT_TRUE(fs::exists(folder / "home/a/splats.ply"));
    EXPECT_TRUE(fs::exists(folder / "home/b/splats.ply"));
    EXPECT_FALSE(fs::exists(folder / "~"));
}

}  // namespace
