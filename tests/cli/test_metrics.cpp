// SPDX-License-Identifier: Apache-2.0
// --metrics of ewa eval, ewa compare and ewa train. python/tests/test_figures.py checks the values.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <sstream>

#include "cli/expect.h"
#include "ewa/image.h"

namespace {

using namespace ewa::test;
namespace fs = std::filesystem;

std::set<std::string> keys_of(const nlohmann::json& object) {
    std::set<std::string> keys;
    for (const auto& [key, value] : object.items()) keys.insert(key);
    return keys;
}

class Metrics : public testing::Test {
  protected:
    Metrics() {
        make_dataset(folder / "data");
        make_splats(folder / "s.ply");
    }
    Outcome eval(std::vector<std::string> more) const {
        std::vector<std::string> words{"eval", folder / "s.ply", folder / "data",  "--split",
                                       "all",  "--json",         folder / "e.json"};
        words.insert(words.end(), more.begin(), more.end());
        return run_ewa(words);
    }
    nlohmann::json json() const { return read_json(folder / "e.json"); }

    Folder folder;
};

TEST_F(Metrics, AreNotMeasuredUnlessAskedFor) {
    const Outcome plain = eval({});
    expect_success(plain);
    EXPECT_EQ(std::count(plain.out.begin(), plain.out.end(), '\n'), 5) << plain.out;
    EXPECT_EQ(keys_of(json()), (std::set<std::string>{"psnr", "ssim", "fitted_psnr", "frames", "seconds"}));
    EXPECT_EQ(keys_of(json()["frames"][0]), (std::set<std::string>{"name", "psnr", "ssim", "fitted_psnr"}));
}

TEST_F(Metrics, FollowTheLinesOfPsnrAndSsim) {
    const Outcome plain = eval({});
    const double psnr = json()["psnr"];
    const Outcome asked = eval({"--metrics", "flip,cc_psnr,bands"});
    expect_success(asked);
    EXPECT_EQ(asked.out.rfind(plain.out.substr(0, plain.out.find("mean of")), 0), 0u) << asked.out;
    std::istringstream table(asked.out.substr(asked.out.find('\n', asked.out.find("mean of")) + 1));
    std::string line;
    std::getline(table, line);
    for (const char* name : {"cc_psnr", "flip", "psnr_1px", "psnr_16px"})
        EXPECT_NE(line.find(name), std::string::npos) << line;
    std::string last;
    for (const size_t width = line.size(); std::getline(table, line); last = line)
        EXPECT_EQ(line.size(), width) << line;
    EXPECT_EQ(last.rfind("mean", 0), 0u) << last;
    EXPECT_EQ(json()["psnr"], psnr);
    for (const char* name : {"cc_psnr", "flip", "psnr_1px", "psnr_16px"}) {
        double sum = 0;
        const auto all = json();
        for (const auto& frame : all["frames"]) sum += frame[name].get<double>() / 4;
        EXPECT_NEAR(all[name].get<double>(), sum, 1e-9) << name;
    }
}

TEST_F(Metrics, AMaskLimitsFigures) {
    ewa::Image mask(ewa::load_image(folder / "data/images/0.png"));
    const int width = mask.width, height = mask.height;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) std::fill_n(mask.at(x, y), 3, x < width / 2 ? 0.0f : 1.0f);
    fs::create_directories(folder / "data/masks");
    for (int i = 0; i < 4; ++i) ewa::save_image(folder / ("data/masks/" + std::to_string(i) + ".png"), mask);
    const std::vector<std::string> options{"--metrics", "cc_psnr,cc2_psnr,bands"};
    expect_success(eval(options));
    const auto masked = json();
    for (int i = 0; i < 4; ++i) {
        const std::string path = folder / ("data/images/" + std::to_string(i) + ".png");
        ewa::Image image = ewa::load_image(path);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width / 2; ++x) std::fill_n(image.at(x, y), 3, 1.0f);
        ewa::save_image(path, image);
    }
    const auto changed = [&](const std::vector<std::string>& more) {
        std::vector<std::string> words = options;
        words.insert(words.end(), more.begin(), more.end());
        expect_success(eval(words));
        return json();
    };
    const auto same = changed({}), other = changed({"--masks", "none"});
    for (const char* name : {"psnr", "cc_psnr", "cc2_psnr", "psnr_1px", "psnr_16px"}) {
        EXPECT_EQ(same[name], masked[name]) << name;
        EXPECT_NE(other[name], masked[name]) << name;
    }
}

TEST_F(Metrics, AFigureThatAnImageIsTooSmallForIsNull) {
    expect_success(eval({"--metrics", "all"}));
    EXPECT_TRUE(json().at("ms_ssim").is_null());
    EXPECT_TRUE(json()["frames"][0].at("ms_ssim").is_null());
}

TEST_F(Metrics, ProtocolsNameThemselves) {
    expect_success(eval({}));
    const double psnr = json()["psnr"], ssim = json()["ssim"];
    for (const char* protocol : {"nerfbaselines", "inria"}) {
        expect_success(eval({"--protocol", protocol}));
        EXPECT_EQ(json()["protocol"], protocol);
        EXPECT_NEAR(json()["psnr"], psnr, 0.2);
        EXPECT_NE(json()["psnr"], psnr);
        EXPECT_NEAR(json()["ssim"], ssim, 0.2);
    }
}

TEST_F(Metrics, WrongNamesAreRefused) {
    expect_failure(eval({"--metrics", "fllip"}), 2, "did you mean flip?");
    expect_failure(eval({"--protocol", "nerf"}), 2, "--protocol");
    expect_failure(run_ewa({"train", folder / "data", "-o", folder / "o", "--metrics", "psnr,flop"}), 2,
                   "flop");
}

TEST_F(Metrics, CompareHasThemForEachPairAndTheirMean) {
    const std::string images = folder / "data/images";
    fs::copy(images, folder / "b");
    ewa::save_image(folder / "b/1.png", ewa::load_image(images + "/0.png"));
    const Outcome outcome =
        run_ewa({"compare", images, folder / "b", "--metrics", "flip", "--json", folder / "e.json"});
    expect_success(outcome);
    EXPECT_NE(outcome.out.find("\n         flip\n0     0.00000\n"), std::string::npos) << outcome.out;
    EXPECT_EQ(json()["pictures"][0]["flip"], 0.0);
    EXPECT_GT(json()["pictures"][1]["flip"].get<double>(), 0.001);
    EXPECT_NEAR(json()["flip"].get<double>(), json()["pictures"][1]["flip"].get<double>() / 4, 1e-12);
}

TEST_F(Metrics, OfEvaluationsDuringATraining) {
    const std::vector<std::string> words{
        "train",        folder / "data", "-o", folder / "o", "--steps",      "20",     "--eval-every",
        "10",           "--test-every",  "2",  "--metrics",  "flip,ms_ssim", "--seed", "7",
        "--tensorboard"};
    const Outcome outcome = run_ewa(words);
    expect_success(outcome);
    EXPECT_NE(outcome.out.find("held-out ms_ssim not computed, flip 0."), std::string::npos) << outcome.out;
    std::istringstream lines(read_file(folder / "o/metrics.jsonl"));
    int evaluated = 0;
    for (std::string line; std::getline(lines, line);) {
        const auto metrics = nlohmann::json::parse(line);
        EXPECT_EQ(metrics.contains("test_flip"), metrics.contains("test_psnr")) << line;
        if (!metrics.contains("test_flip")) continue;
        ++evaluated;
        EXPECT_GT(metrics["test_flip"].get<double>(), 0);
        EXPECT_TRUE(metrics.at("test_ms_ssim").is_null());
    }
    EXPECT_EQ(evaluated, 2);
    const auto summary = read_json(folder / "o/summary.json");
    EXPECT_GT(summary["test_flip"].get<double>(), 0);
    EXPECT_NE(read_file(folder / "o/report.html").find("flip, held-out views"), std::string::npos);
    const std::string events = folder / "o/events.out.tfevents.0.ewa";
    EXPECT_NE(read_file(events).find("test/flip"), std::string::npos);
    // A run that replaces it without --tensorboard leaves no curves of the earlier one.
    expect_success(
        run_ewa({"train", folder / "data", "-o", folder / "o", "--steps", "3", "--force", "--quiet"}));
    EXPECT_FALSE(fs::exists(events));
    EXPECT_FALSE(read_json(folder / "o/summary.json").contains("test_flip"));
}

}  // namespace
