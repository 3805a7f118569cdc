// SPDX-License-Identifier: Apache-2.0
// Damaged and hostile inputs: exit status 2 and one line that names the file.
#include <gtest/gtest.h>

#include "cli/expect.h"
#include "ewa/image.h"

namespace {

using namespace ewa::test;
namespace fs = std::filesystem;

TEST(Inputs, DamagedSplatFiles) {
    const Folder folder;
    make_splats(folder / "good.ply");
    const std::string good = read_file(folder / "good.ply");
    std::string huge = good;
    huge.replace(huge.find("vertex 50"), 9, "vertex 4000000000");
    const std::pair<std::string, std::string> cases[] = {{"truncated", good.substr(0, good.size() - 7)},
                                                         {"headless", good.substr(0, 100)},
                                                         {"huge", huge},
                                                         {"empty", ""},
                                                         {"text", "not a ply at all\n"}};
    for (const auto& [name, bytes] : cases) {
        const std::string path = folder / (name + ".ply");
        write_file(path, bytes);
        expect_failure(run_ewa({"info", path}), 2, name + ".ply");
    }
    fs::create_directory(folder / "folder.ply");
    expect_failure(run_ewa({"render", folder / "folder.ply", "--cameras", "/nowhere"}), 2, "folder.ply");
    write_file(folder / "splats.xyz", "x");
    expect_failure(run_ewa({"info", folder / "splats.xyz"}), 2, "splats.xyz");
}

TEST(Inputs, DatasetsThatAreNone) {
    const Folder folder;
    fs::create_directory(folder / "empty");
    expect_failure(run_ewa({"train", folder / "empty", "-o", folder / "out"}), 2, "empty");
    fs::create_directory(folder / "garbage");
    write_file(folder / "garbage/transforms.json", "{\"frames\": [");
    expect_failure(run_ewa({"train", folder / "garbage", "-o", folder / "out"}), 2, "transforms.json");
    make_dataset(folder / "frameless", {});
    expect_failure(run_ewa({"train", folder / "frameless", "-o", folder / "out"}), 2, "frameless");
    EXPECT_FALSE(fs::exists(folder / "out"));
}

/// In the first lines of a training, and in `ewa info`.
TEST(Inputs, WhatOfADatasetIsUsed) {
    const Folder folder;
    make_dataset(folder / "data", {"0.png", "1.png", "2.png", "3.png"});
    fs::remove(folder / "data/images/3.png");
    fs::create_directory(folder / "data/masks");
    const ewa::Image mask(48, 32, 1);
    for (const char* name : {"a.png", "b.png"})
        ewa::save_image(folder / ("data/masks/" + std::string(name)), mask);
    const std::string used =
        "3 of 4 photos (images/3.png is missing), 0 of 2 masks (masks/a.png matches no photo)";
    const Outcome trained =
        run_ewa({"train", folder / "data", "-o", folder / "out", "--steps", "1", "--init", "random"});
    expect_success(trained);
    EXPECT_NE(trained.out.find("\n" + used + "\n"), std::string::npos) << trained.out;
    const Outcome info = run_ewa({"info", folder / "data"});
    expect_success(info);
    EXPECT_NE(info.out.find("used            " + used + "\n"), std::string::npos) << info.out;
    const Outcome json = run_ewa({"info", folder / "data", "--json"});
    const auto kinds = nlohmann::json::parse(json.out)["used"];
    ASSERT_EQ(kinds.size(), 2u);
    EXPECT_EQ(kinds[0]["what"], "photo");
    EXPECT_EQ(kinds[0]["used"], 3);
    EXPECT_EQ(kinds[1]["found"], 2);
    EXPECT_EQ(kinds[1]["why"], "masks/a.png matches no photo");
}

/// Of COLMAP's points as text, one has a coordinate that is no number.
TEST(Inputs, PointsThatAreNotFiniteAreSkipped) {
    const Folder folder;
    const std::string model = folder / "data/sparse/0/";
    fs::create_directories(model);
    write_file(model + "cameras.txt", "1 PINHOLE 48 32 50 50 24 16\n");
    write_file(model + "images.txt", "1 1 0 0 0 0 0 4 1 a.png\n\n2 1 0 0 0 1 0 4 1 b.png\n\n");
    write_file(model + "points3D.txt", "1 0 0 0 9 9 9 0\n2 nan 0 0 9 9 9 0\n3 1 0 0 9 9 9 0\n");
    for (const char* name : {"a.png", "b.png"})
        ewa::save_image(folder / ("data/" + std::string(name)), ewa::Image(48, 32, 3));
    const Outcome trained =
        run_ewa({"train", folder / "data", "-o", folder / "out", "--steps", "1", "--dense-start", "off"});
    expect_success(trained);
    EXPECT_NE(trained.out.find("2 splats to start from"), std::string::npos) << trained.out;
    EXPECT_NE(trained.out.find("2 of 2 photos, 2 of 3 points (" + model + "points3D.txt:2 is not finite)"),
              std::string::npos)
        << trained.out;
}

/// What a name may do to the terminal that it is printed on.
TEST(Inputs, NamesAreShownWithoutTheirControls) {
    const Folder folder;
    const std::string name = "a\x1b]0;title\x07\n.png", shown = "images/a\\x1b]0;title\\x07 .png";
    make_dataset(folder / "data", {name, "b.png"});
    make_splats(folder / "s.ply");
    const Outcome eval =
        run_ewa({"eval", folder / "s.ply", folder / "data", "--split", "all", "--json", folder / "e.json"});
    expect_success(eval);
    EXPECT_NE(eval.out.find(shown), std::string::npos) << eval.out;
    EXPECT_EQ(eval.out.find('\x1b'), std::string::npos);
    EXPECT_EQ(read_json(folder / "e.json")["frames"][0]["name"], "images/" + name);
    const Outcome grad =
        run_ewa({"grad", folder / "s.ply", folder / "data", "--frame", "0", "-o", folder / "g.ply"});
    expect_success(grad);
    EXPECT_NE(grad.out.find(shown), std::string::npos) << grad.out;
    fs::rename(folder / "s.ply", folder / "s\x1b.ply");
    const Outcome info = run_ewa({"info", folder / "s\x1b.ply"});
    expect_success(info);
    EXPECT_NE(info.out.find("/s\\x1b.ply\n"), std::string::npos) << info.out;
    write_file(folder / ("data/images/" + name), "x");
    expect_failure(run_ewa({"train", folder / "data", "-o", folder / "out"}), 2, shown);
}

TEST(Inputs, DatasetWithoutAnyImage) {
    const Folder folder;
    make_dataset(folder / "data");
    fs::remove_all(folder / "data/images");
    expect_failure(run_ewa({"train", folder / "data", "-o", folder / "out", "--init", "random"}), 2, "data");
}

/// An image that is missing may have no size either.
TEST(Inputs, InfoCountsEveryMissingImage) {
    const Folder folder;
    make_dataset(folder / "data");
    nlohmann::json top = read_json(folder / "data/transforms.json");
    for (const char* key : {"w", "h"}) {
        top.erase(key);
        for (auto& frame : top["frames"]) frame.erase(key);
    }
    write_file(folder / "data/transforms.json", top.dump());
    for (const char* name : {"data/images/1.png", "data/images/2.png"}) fs::remove(folder / name);
    const Outcome outcome = run_ewa({"info", folder / "data"});
    expect_success(outcome);
    EXPECT_NE(outcome.out.find("images          2 missing"), std::string::npos) << outcome.out;
}

TEST(Inputs, DatasetWithoutPoints) {
    const Folder folder;
    make_dataset(folder / "data");
    const Outcome outcome = run_ewa({"train", folder / "data", "-o", folder / "out", "--max-splats", "100",
                                     "--steps", "2", "--strategy", "none"});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("the dataset has no points"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("100 splats to start from"), std::string::npos) << outcome.out;
}

TEST(Inputs, PointThatIsNotFinite) {
    const Folder folder;
    const std::string data = folder / "data", points = data + "/sparse/0/points3D.txt";
    fs::copy(std::string(EWA_SOURCE_DIR) + "/scenes/still_life", data, fs::copy_options::recursive);
    const std::string good = read_file(points);
    write_file(points, good + "999999 1 nan 2 10 20 30 0.1\n");
    const Outcome outcome = run_ewa({"train", data, "-o", folder / "out", "--steps", "1"});
    expect_success(outcome);
    EXPECT_NE(outcome.out.find("points3D.txt:"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("is not finite"), std::string::npos) << outcome.out;
}

TEST(Inputs, EveryFrameHeldOut) {
    const Folder folder;
    make_dataset(folder / "data");
    expect_failure(
        run_ewa({"train", folder / "data", "-o", folder / "out", "--init", "random", "--test-every", "1"}), 2,
        "none is left to train on");
}

TEST(Inputs, ImageOfAnotherSizeOrCutShort) {
    const Folder folder;
    make_dataset(folder / "data");
    const std::string image = folder / "data/images/1.png";
    const std::string good = read_file(image);
    write_file(image, good.substr(0, good.size() / 2));
    expect_failure(run_ewa({"train", folder / "data", "-o", folder / "out", "--init", "random", "--quiet"}),
                   2, "1.png");
    ewa::save_image(image, ewa::Image(8, 8, 3));
    expect_failure(run_ewa({"train", folder / "data", "-o", folder / "out", "--init", "random", "--quiet"}),
                   2, "1.png");
}

TEST(Inputs, FramesThatAreNotThere) {
    const Folder folder;
    make_dataset(folder / "data");
    make_splats(folder / "s.ply");
    const std::string splats = folder / "s.ply", data = folder / "data";
    expect_failure(run_ewa({"render", splats, "--cameras", data, "--frames", "9", "-o", folder / "o"}), 2,
                   "frame 9");
    expect_failure(run_ewa({"render", splats, "--cameras", data, "--frames", "1,", "-o", folder / "o"}), 2,
                   "1,");
    expect_failure(run_ewa({"grad", splats, data, "--frame", "4", "-o", folder / "g.ply"}), 2, "frame 4");
    expect_failure(run_ewa({"eval", splats, data, "--test-every", "0"}), 2, "test split");
    expect_failure(run_ewa({"train", data, "--init", splats, "--max-splats", "49", "-o", folder / "o"}), 2,
                   "--max-splats");
}

TEST(Inputs, DevicesThatAreNotThere) {
    const Folder folder;
    make_dataset(folder / "data");
    make_splats(folder / "s.ply");
    for (const char* device : {"999", "no such device", "-1"})
        expect_failure(run_ewa({"eval", folder / "s.ply", folder / "data", "--device", device}), 2, device);
}

TEST(Inputs, InfoOfAnImage) {
    const Folder folder;
    make_dataset(folder / "data");
    fs::copy_file(folder / "data/images/0.png", folder / "photo.jpg");  // by its content
    const Outcome text = run_ewa({"info", folder / "photo.jpg"});
    expect_success(text);
    EXPECT_NE(text.out.find("kind            image (png)"), std::string::npos) << text.out;
    EXPECT_NE(text.out.find("size            48x32, 8 bits a channel"), std::string::npos) << text.out;
    const auto json = nlohmann::json::parse(run_ewa({"info", folder / "photo.jpg", "--json"}).out);
    EXPECT_EQ(json["kind"], "image");
    EXPECT_EQ(json["width"], 48);
    write_file(folder / "text.jpg", "no image");
    expect_failure(run_ewa({"info", folder / "text.jpg"}), 2, "text.jpg");
}

}  // namespace
