// SPDX-License-Identifier: Apache-2.0
// What makes a training useless is said before its first step, and by ewa info.
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/expect.h"
#include "cli/program.h"
#include "ewa/image.h"

namespace {

using namespace ewa::test;
namespace fs = std::filesystem;

/// Four images round the origin, with points at a place. Image 0 is held out.
class FirstChecks : public testing::Test {
  protected:
    void SetUp() override {
        make_dataset(data);
        add_points("points.ply", 0);
        edit([](nlohmann::json& json) { json["ply_file_path"] = "points.ply"; });
    }
    void edit(const std::function<void(nlohmann::json&)>& change) const {
        nlohmann::json json = read_json(data + "/transforms.json");
        change(json);
        write_file(data + "/transforms.json", json.dump());
    }
    void add_points(const std::string& name, double z, int count = 200) const {
        std::ostringstream text;
        text << "ply\nformat ascii 1.0\nelement vertex " << count
             << "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
        for (int i = 0; i < count; ++i)
            text << 0.05 * (i % 7 - 3) << " " << 0.05 * (i % 5 - 2) << " " << z + 0.04 * (i % 11 - 5) << "\n";
        write_file(data + "/" + name, text.str());
    }
    void add_masks(const std::vector<std::string>& names, float value) const {
        fs::create_directories(data + "/masks");
        ewa::Image mask(48, 32, 1);
        for (float& v : mask.pixels) v = value;
        for (const std::string& name : names) save_image(data + "/masks/" + name, mask);
    }
    Outcome train(std::vector<std::string> more = {}) const {
        std::vector<std::string> arguments{"train", data, "-o", folder / "run", "--steps", "2", "--force"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_ewa(arguments);
    }
    std::string info() const {
        const Outcome outcome = run_ewa({"info", data});
        expect_success(outcome);
        return outcome.out;
    }
    /// Both say it, and the training before its first step.
    void expect_line(const std::string& text, std::vector<std::string> more = {}) const {
        const Outcome outcome = train(more);
        expect_success(outcome);
        const size_t at = outcome.out.find(text);
        ASSERT_NE(at, std::string::npos) << outcome.out;
        EXPECT_LT(at, outcome.out.find("trained 2 steps")) << outcome.out;
        if (!more.empty()) return;
        EXPECT_NE(info().find("warning         " + text), std::string::npos) << info();
    }

    Folder folder;
    const std::string data = folder / "data";
};

TEST_F(FirstChecks, NothingIsWrong) {
    const Outcome outcome = train();
    expect_success(outcome);
    for (const char* word : {"view of", "masked", "wrong", "starts from"})
        EXPECT_EQ(outcome.out.find(word), std::string::npos) << outcome.out;
    EXPECT_EQ(info().find("warning"), std::string::npos) << info();
    EXPECT_EQ(nlohmann::json::parse(run_ewa({"info", data, "--json"}).out)["warnings"],
              nlohmann::json::array());
    // Half of the points are out of view.
    const std::string near = read_file(data + "/points.ply");
    add_points("points.ply", 100);
    const std::string far = read_file(data + "/points.ply");
    std::string both = near + far.substr(far.find("end_header\n") + 11);
    write_file(data + "/points.ply", both.replace(both.find("vertex 200"), 10, "vertex 400"));
    EXPECT_EQ(info().find("warning"), std::string::npos) << info();
}

TEST_F(FirstChecks, PointsThatNoCameraSees) {
    add_points("points.ply", 100);
    expect_line(
        "none of the points is in view of a training camera: the axes or the direction of the poses are "
        "probably wrong");
}

TEST_F(FirstChecks, PosesOfAnotherConvention) {
    edit([](nlohmann::json& json) {
        for (nlohmann::json& frame : json["frames"])
            for (int row = 0; row < 3; ++row)
                for (int column = 1; column < 3; ++column) {
                    nlohmann::json& value = frame["transform_matrix"][size_t(row)][size_t(column)];
                    value = -value.get<double>();
                }
    });
    expect_line(
        "none of the points is in view of a training camera: the axes or the direction of the poses are "
        "probably wrong; "
        "with y and z of the cameras' axes reversed");
}

TEST_F(FirstChecks, FirstSplatsOfAnotherScene) {
    add_points("far.ply", 50);
    add_points("one.ply", 0, 1);
    expect_line("none of the first splats of " + data +
                    "/far.ply is in view of a training camera: they are probably of another scene",
                {"--init", data + "/far.ply"});
    expect_line("training starts from 1 splat of " + data + "/one.ply", {"--init", data + "/one.ply"});
    add_points("points.ply", 0, 1);
    expect_line("training starts from 1 point; --init random");
}

TEST_F(FirstChecks, ADamagedHeldOutImageStopsAtOnce) {
    const std::string image = data + "/images/0.png", good = read_file(image);
    std::string bad = good;
    bad[bad.size() / 2] = char(bad[bad.size() / 2] + 1);
    for (const std::string& bytes : {good.substr(0, good.size() / 2), bad}) {
        write_file(image, bytes);
        const Outcome outcome = train();
        expect_failure(outcome, 2, "images/0.png");
        if (bytes == bad) {
            EXPECT_NE(outcome.err.find("it is held out for the evaluation"), std::string::npos)
                << outcome.err;
        }
        EXPECT_EQ(outcome.out.find("trained"), std::string::npos) << outcome.out;
        EXPECT_FALSE(fs::exists(folder / "run/splats.ply"));
    }
    write_file(image, good.substr(0, good.size() / 2));
    EXPECT_NE(info().find("warning         images/0.png cannot be read: "), std::string::npos) << info();
    fs::remove(image);
    const Outcome without = train({"--test-every", "3"});
    expect_success(without);
    EXPECT_NE(without.out.find("1 image is missing and skipped"), std::string::npos) << without.out;
}

TEST_F(FirstChecks, MasksThatLeaveNoPixel) {
    add_masks({"0.png"}, 0);
    add_masks({"1.png", "2.png", "3.png"}, 1);
    expect_line(
        "every pixel of 1 held-out image is masked or transparent, and no figure is measured; masks are "
        "white");
    const nlohmann::json summary = read_json(folder / "run/summary.json");
    EXPECT_TRUE(summary["test_psnr"].is_null()) << summary;
    EXPECT_TRUE(summary["test_ssim"].is_null()) << summary;
    EXPECT_TRUE(summary["train_psnr"].is_number()) << summary;
    const Outcome eval = run_ewa({"eval", folder / "run", "--json", folder / "eval.json"});
    expect_success(eval);
    EXPECT_NE(eval.out.find("no figures: every pixel of 1 frame (test) is masked"), std::string::npos)
        << eval.out;
    EXPECT_TRUE(read_json(folder / "eval.json")["psnr"].is_null());
    add_masks({"1.png", "2.png", "3.png"}, 0);
    expect_line(
        "every pixel of 3 training images is masked or transparent, and nothing is learned from them");
    EXPECT_EQ(train().out.find("PSNR"), std::string::npos);
    EXPECT_EQ(read_file(folder / "run/metrics.jsonl").find("0.0,"), std::string::npos);
    add_masks({"2.png"}, 1);
    EXPECT_EQ(train().out.find("nothing is learned"), std::string::npos);
}

/// What a mask means is what counts, and not its red.
TEST_F(FirstChecks, MasksThatSayItInAlpha) {
    fs::create_directories(data + "/masks");
    ewa::Image mask(48, 32, 4);
    for (int x = 0; x < 24; ++x) mask.at(x, 3)[3] = 1;
    for (const char* name : {"0", "1", "2", "3"}) save_image(data + "/masks/" + name + ".png", mask);
    EXPECT_EQ(info().find("warning"), std::string::npos) << info();
    EXPECT_EQ(train().out.find("masked or transparent"), std::string::npos);
}

TEST_F(FirstChecks, MasksThatTheTrainingRefuses) {
    const auto refused = [&](const std::string& text) {
        EXPECT_NE(info().find("warning         " + data + "/masks/" + text), std::string::npos) << info();
        expect_failure(train(), 2, text);
    };
    add_masks({"0.png", "1.png", "2.png", "3.png"}, 1);
    save_image(data + "/masks/2.png", ewa::Image(32, 48, 1));
    refused("2.png: the mask is 32 x 48 pixels, its image 48 x 32");
    add_masks({"2.png"}, 20.0f / 255);
    refused("2.png: the mask's largest value is 20, and its values seem to number objects");
    write_file(data + "/masks/2.png", read_file(data + "/masks/1.png").substr(0, 60));
    refused("2.png");
}

TEST_F(FirstChecks, TransparentImages) {
    for (int i = 1; i < 4; ++i)
        save_image(data + "/images/" + std::to_string(i) + ".png", ewa::Image(48, 32, 4));
    expect_line("every pixel of 3 training images is masked or transparent");
}

TEST_F(FirstChecks, OneImageIsHeldOut) {
    edit([](nlohmann::json& json) { json["frames"] = {json["frames"][0]}; });
    const std::string text =
        "1 image is held out, and none is left to train on; --test-every 0 holds none out";
    expect_failure(train(), 2, text);
    EXPECT_NE(info().find(text), std::string::npos);
    expect_success(train({"--test-every", "0"}));
    edit([](nlohmann::json& json) { json["test_filenames"] = {"images/0.png"}; });
    expect_failure(
        train(), 2,
        "none is left to train on; the dataset itself says so; --test-every 0 trains on all of them");
    expect_success(train({"--test-every", "0"}));
}

TEST_F(FirstChecks, NotesOfTheDatasetAreShown) {
    edit([](nlohmann::json& json) { json["test_filenames"] = {"images/1.png", "images/2.png"}; });
    const Outcome outcome = train();
    expect_success(outcome);
    EXPECT_NE(outcome.out.find(
                  "split by names: 2 images to train, 0 of val_filenames and 2 of test_filenames held out"),
              std::string::npos)
        << outcome.out;
}

}  // namespace
