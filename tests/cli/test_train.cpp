// SPDX-License-Identifier: Apache-2.0
// ewa train as a whole, on four small pictures.
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <sstream>

#include "cli/expect.h"
#include "cli/faulty.h"
#include "ewa/splat_files.h"

namespace {

using namespace ewa::test;
namespace fs = std::filesystem;
using Names = std::vector<std::string>;

class Train : public testing::Test {
  protected:
    void SetUp() override {
        make_dataset(folder / "data");
        make_splats(folder / "s.ply");
    }
    Outcome train(const std::string& out, const Names& more, const Circumstances& circumstances = {}) {
        Names arguments{"train", folder / "data", "-o", folder / out, "--init", folder / "s.ply"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_ewa(arguments, circumstances);
    }
    Folder folder;
};

TEST_F(Train, WritesEverythingItPromises) {
    const Outcome outcome =
        train("o", {"--steps", "20", "--eval-every", "10", "--save-every", "5", "--seed", "7"});
    expect_success(outcome);
    EXPECT_NE(outcome.out.find("held-out PSNR"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("report.html"), std::string::npos) << outcome.out;
    EXPECT_EQ(files_below(folder / "o"),
              (Names{"checkpoint.ewa", "config.json", "metrics.jsonl", "report.html", "splats.ply",
                     "summary.json", "test/0.png", "times.json"}));

    const auto summary = read_json(folder / "o/summary.json");
    EXPECT_EQ(summary["steps"], 20);
    EXPECT_EQ(summary["seed"], 7);
    EXPECT_EQ(summary["interrupted"], false);
    EXPECT_GT(summary["test_psnr"].get<double>(), 0);
    EXPECT_GT(summary["train_psnr"].get<double>(), 0);
    EXPECT_GT(summary["peak_host_bytes"].get<uint64_t>(), 1000000u);
    EXPECT_GT(summary["peak_device_bytes"].get<uint64_t>(), 0u);
    EXPECT_LE(summary["seconds"].get<double>(), summary["wall_seconds"].get<double>());
    EXPECT_EQ(summary["splats"], ewa::load_splats(folder / "o/splats.ply").size());

    std::istringstream metrics(read_file(folder / "o/metrics.jsonl"));
    std::string line;
    std::vector<int> steps, evaluated;
    while (std::getline(metrics, line)) {
        const auto json = nlohmann::json::parse(line);
        EXPECT_TRUE(json["loss"].is_number());
        steps.push_back(json["step"]);
        EXPECT_TRUE(json["train_psnr"].is_number());
        if (json.contains("test_psnr")) evaluated.push_back(json["step"]);
    }
    EXPECT_EQ(steps.size(), 20u);
    EXPECT_EQ(evaluated, (std::vector<int>{10, 20}));
    EXPECT_NE(read_file(folder / "o/report.html").find("data:image/jpeg;base64,"), std::string::npos);
    EXPECT_NE(outcome.out.find(", PSNR "), std::string::npos) << outcome.out;
}

TEST_F(Train, QuietIsQuiet) {
    const Outcome outcome = train("o", {"--steps", "2", "--quiet"});
    expect_success(outcome);
    EXPECT_EQ(outcome.out, "");
}

TEST_F(Train, VerboseTellsThePlan) {
    const Outcome plain = train("o", {"--steps", "1", "--strategy", "adc", "--verbose"});
    expect_success(plain);
    EXPECT_NE(plain.out.find("left out: appearance of images"), std::string::npos) << plain.out;
    EXPECT_EQ(plain.out.find("left out: densification statistics"), std::string::npos) << plain.out;
    EXPECT_NE(read_file(folder / "o/report.html").find("appearance of images, its passes"),
              std::string::npos);
    const Outcome other =
        train("p", {"--steps", "1", "--strategy", "mcmc", "--appearance", "affine", "--verbose"});
    expect_success(other);
    EXPECT_EQ(other.out.find("left out: appearance of images"), std::string::npos) << other.out;
    EXPECT_NE(other.out.find("left out: densification statistics"), std::string::npos) << other.out;
}

TEST_F(Train, ConfigOfARunRepeatsIt) {
    expect_success(train(
        "a", {"--steps", "15", "--seed", "3", "--kernel", "antialias", "--background", "1,1,1", "--quiet"}));
    expect_success(run_ewa({"train", "--config", folder / "a/config.json", "-o", folder / "b", "--quiet"}));
    EXPECT_EQ(read_file(folder / "a/splats.ply"), read_file(folder / "b/splats.ply"));
    EXPECT_EQ(read_file(folder / "a/config.json"), read_file(folder / "b/config.json"));
    expect_success(run_ewa({"train", "--config", folder / "a/config.json", "-o", folder / "c", "--quiet",
                            "--seed", "4", "--kernel", "peak"}));
    EXPECT_EQ(read_json(folder / "c/config.json")["seed"], 4);
    EXPECT_EQ(read_json(folder / "c/config.json")["kernel"], "peak");
    EXPECT_EQ(read_json(folder / "c/config.json")["steps"], 15);
    EXPECT_NE(read_file(folder / "a/splats.ply"), read_file(folder / "c/splats.ply"));
}

TEST_F(Train, ConfigSetsRatesThatTheHelpDoesNotShow) {
    write_file(folder / "c.json", R"({"means-rate": 1.6e-3, "steps": 5})");
    write_file(folder / "usual.json", R"({"means-rate": 1.6e-4, "steps": 5})");
    write_file(folder / "wrong.json", R"({"growth": 0.5})");
    expect_success(train("a", {"--config", folder / "c.json", "--quiet"}));
    expect_success(train("b", {"--config", folder / "usual.json", "--quiet"}));
    expect_success(train("c", {"--steps", "5", "--quiet"}));
    EXPECT_EQ(read_json(folder / "a/config.json")["means-rate"], 1.6e-3);
    EXPECT_FALSE(read_json(folder / "b/config.json").contains("means-rate"));
    EXPECT_NE(read_file(folder / "a/splats.ply"), read_file(folder / "b/splats.ply"));
    EXPECT_EQ(read_file(folder / "b/splats.ply"), read_file(folder / "c/splats.ply"));
    expect_failure(train("d", {"--config", folder / "wrong.json"}), 2,
                   "'0.5' is not a number from 1 to 1000");
    EXPECT_EQ(run_ewa({"train", "--help-all"}).out.find("means-rate"), std::string::npos);
}

TEST_F(Train, QualityGivesWhatIsNotGiven) {
    write_file(folder / "c.json", R"({"steps": 5, "max-splats": 700})");
    write_file(folder / "q.json", R"({"quality": "low", "max-splats": 700})");
    int number = 0;
    const auto config = [&](const Names& more) {
        const std::string out = "o" + std::to_string(++number);
        Circumstances interrupt;
        interrupt.signal = SIGINT;
        interrupt.await_file = folder / (out + "/metrics.jsonl");
        train(out, more, interrupt);
        const auto json = read_json(folder / (out + "/config.json"));
        return std::pair<int, std::string>(json["steps"], json["max-splats"].dump());
    };
    using Pair = std::pair<int, std::string>;
    const std::string automatic = "\"auto\"";
    EXPECT_EQ(config({}), Pair(30000, automatic));
    EXPECT_EQ(config({"--quality", "low"}), Pair(2000, automatic));
    EXPECT_EQ(config({"--quality", "medium"}), Pair(7000, automatic));
    EXPECT_EQ(config({"--quality", "high"}), Pair(30000, automatic));
    EXPECT_EQ(config({"--quality", "low", "--iterations", "6"}), Pair(6, automatic));
    EXPECT_EQ(config({"--max-splats", "600", "--quality", "low"}), Pair(2000, "600"));
    EXPECT_EQ(config({"--config", folder / "c.json"}), Pair(5, "700"));
    EXPECT_EQ(config({"--quality", "low", "--config", folder / "c.json"}), Pair(2000, "700"));
    EXPECT_EQ(config({"--quality", "low", "--steps", "8", "--config", folder / "c.json"}), Pair(8, "700"));
    EXPECT_EQ(config({"--config", folder / "q.json"}), Pair(2000, "700"));
    EXPECT_EQ(config({"--config", folder / "q.json", "--quality", "medium"}), Pair(7000, "700"));
    expect_failure(train("o", {"--quality", "best"}), 2, "--quality");
}

TEST_F(Train, FirstSplatsHaveTheOpacityAndScaleAskedFor) {
    Names arguments{"train",      folder / "data", "--init",  "random", "--max-splats", "100", "--steps", "1",
                    "--strategy", "none",          "--quiet", "-o"};
    int number = 0;
    const auto splats = [&](const Names& more) {
        Names all = arguments;
        all.push_back(folder / ("o" + std::to_string(++number)));
        all.insert(all.end(), more.begin(), more.end());
        expect_success(run_ewa(all));
        return ewa::load_splats(all[arguments.size()] + "/splats.ply");
    };
    const ewa::Gaussians usual = splats({}),
                         other = splats({"--init-opacity", "0.5", "--init-scale", "0.25"});
    for (size_t i = 0; i < usual.size(); ++i) {
        // One step of Adam moves each by at most its learning rate, which is 6 and 17 times that of a full run here.
        EXPECT_NEAR(usual.opacity_logits[i], std::log(0.1 / 0.9), 0.2) << i;
        EXPECT_NEAR(other.opacity_logits[i], 0, 0.2) << i;
        EXPECT_NEAR(other.log_scales[3 * i], usual.log_scales[3 * i] + std::log(0.25), 0.2) << i;
    }
    expect_failure(train("s", {"--init-opacity", "0.5"}), 2, "s.ply is a splat file");
    expect_failure(train("s", {"--init-scale", "2"}), 2, "s.ply is a splat file");
    expect_failure(train("s", {"--init-opacity", "1"}), 2,
                   "--init-opacity: '1' is not a number from 0.001 to 0.999");
}

TEST_F(Train, WithoutATestSetItsFiguresAreNull) {
    expect_success(train("o", {"--steps", "3", "--test-every", "0", "--quiet"}));
    const auto summary = read_json(folder / "o/summary.json");
    EXPECT_TRUE(summary["test_psnr"].is_null());
    EXPECT_TRUE(summary["train_psnr"].is_number());
}

TEST_F(Train, StartsFromNothing) {
    expect_success(
        run_ewa({"train", folder / "data", "-o", folder / "o", "--init", "random", "--max-splats", "200",
                 "--steps", "3", "--background", "random", "--strategy", "none", "--quiet"}));
    EXPECT_EQ(ewa::load_splats(folder / "o/splats.ply").size(), 200u);
}

TEST_F(Train, MissingImagesAreTold) {
    fs::remove(folder / "data/images/1.png");
    const Outcome outcome = train("o", {"--steps", "2"});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("1 image is missing"), std::string::npos) << outcome.out;
}

TEST_F(Train, InterruptKeepsWhatIsThere) {
    for (const int signal : {SIGINT, SIGTERM}) {
        const std::string out = signal == SIGINT ? "int" : "term";
        Circumstances interrupt;
        interrupt.signal = signal;
        interrupt.await_file = folder / (out + "/metrics.jsonl");
        const Outcome outcome = train(out, {"--steps", "100000000", "--strategy", "none"}, interrupt);
        EXPECT_EQ(outcome.status, 130) << outcome.err;
        EXPECT_EQ(outcome.err, "");
        EXPECT_TRUE(outcome.out.ends_with("to continue: ewa train " + (folder / out) + " --resume\n"))
            << outcome.out;
        const auto summary = read_json(folder / (out + "/summary.json"));
        EXPECT_EQ(summary["interrupted"], true);
        EXPECT_GE(summary["steps"].get<int>(), 1);
        EXPECT_EQ(ewa::load_splats(folder / (out + "/splats.ply")).size(), 50u);
    }
}

TEST_F(Train, RefusesTheFolderOfAnotherRun) {
    expect_success(train("o", {"--steps", "4", "--quiet"}));
    const auto files = [&](const std::string& out) {
        std::string all;
        for (const std::string& file : files_below(folder / out))
            all += file + "\n" + read_file((folder / out) + "/" + file);
        return all;
    };
    const std::string ways = "-o DIR takes another folder, --force replaces it";
    const auto refused = [&](const std::string& out, const Names& more, const std::string& text) {
        const std::string before = files(out);
        const Outcome outcome = train(out, more);
        expect_failure(outcome, 2, text);
        EXPECT_NE(outcome.err.find(ways), std::string::npos) << outcome.err;
        EXPECT_TRUE(files(out) == before);
    };
    const double psnr = read_json(folder / "o/summary.json")["test_psnr"];
    char finished[64];
    std::snprintf(finished, sizeof(finished), "holds a finished run of 4 steps (%.2f dB); --resume with more",
                  psnr);
    refused("o", {"--steps", "3"}, finished);
    refused("o", {"--steps", "4"}, finished);
    refused("o", {"--steps", "900"}, finished);
    expect_failure(train("o", {"--force", "--resume"}), 2, "--force");
    expect_failure(train("o", {"--steps", "3", "--resume"}), 2, "is at step 4, after the last of --steps 3");

    // A run that was interrupted is not lost by a second call either.
    ASSERT_EQ(
        train("i", {"--steps", "60", "--strategy", "none", "--quiet"}, held_at(20, folder / "held", SIGINT))
            .status,
        130);
    const int done = read_json(folder / "i/summary.json")["steps"];
    const std::string unfinished =
        "holds an unfinished run, at step " + std::to_string(done) + " of 60; --resume continues";
    refused("i", {"--steps", "60", "--strategy", "none"}, unfinished);
    refused("i", {"--steps", "900"}, unfinished);

    // Splats alone, of whatever origin, are no less a result.
    fs::create_directory(folder / "s");
    fs::copy_file(folder / "s.ply", folder / "s/splats.ply");
    refused("s", {"--steps", "3"}, "holds splats.ply without the checkpoint.ewa");
    refused("s", {"--steps", "3", "--resume"}, "holds splats.ply without the checkpoint.ewa");
    fs::remove(folder / "o/checkpoint.ewa");
    refused("o", {"--steps", "9", "--resume"}, "holds a run of 4 steps without the checkpoint.ewa");
    write_file(folder / "o/checkpoint.ewa", "ply");
    refused("o", {"--steps", "9"}, "holds a checkpoint.ewa that cannot be read");

    expect_success(train("o", {"--steps", "3", "--quiet", "--force"}));
    EXPECT_EQ(read_json(folder / "o/summary.json")["steps"], 3);
    expect_success(train("other", {"--steps", "3", "--quiet"}));
    EXPECT_EQ(read_file(folder / "o/splats.ply"), read_file(folder / "other/splats.ply"));
}

/// A mistake in the new run, found before its first step, costs nothing of the earlier run.
TEST_F(Train, ForceKeepsTheEarlierRunUntilTheNewOneBegins) {
    expect_success(train("o", {"--steps", "2", "--quiet"}));
    const Names before = files_below(folder / "o");
    expect_failure(train("o", {"--steps", "2", "--force"}, with_fault("EWA_FAULT_ALLOCATIONS", "1")), 1,
                   "memory");
    EXPECT_EQ(files_below(folder / "o"), before);
    expect_failure(train("o", {"--steps", "2", "--force", "--max-splats", "9"}), 2, "--max-splats");
    EXPECT_EQ(files_below(folder / "o"), before);
    EXPECT_EQ(read_json(folder / "o/config.json")["max-splats"], "auto");
}

TEST_F(Train, FullDiskKeepsTheEarlierSplats) {
    expect_success(train("o", {"--steps", "1", "--quiet"}));
    const std::string before = read_file(folder / "o/splats.ply");
    const Circumstances full = with_fault("EWA_FAULT_BYTES", "4096");
    expect_failure(train("o", {"--steps", "2", "--quiet", "--force"}, full), 1, "no checkpoint fitted");
    EXPECT_EQ(read_file(folder / "o/splats.ply"), before);
    for (const char* gone : {"o/summary.json", "o/checkpoint.ewa"})
        EXPECT_FALSE(fs::exists(folder / gone)) << gone;
}

}  // namespace
