// SPDX-License-Identifier: Apache-2.0
// A training that was ended, by Ctrl-C or kill -9, and goes on.
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <optional>
#include <sstream>

#include "cli/expect.h"
#include "cli/faulty.h"
#include "support/random_scene.h"

namespace {

using namespace ewa::test;
namespace fs = std::filesystem;
using Names = std::vector<std::string>;

class ResumeEdges : public testing::Test {
  protected:
    void SetUp() override {
        make_dataset(folder / "data");
        make_splats(folder / "s.ply");
    }
    Outcome train(const std::string& out, const Names& more, const Circumstances& circumstances = {}) {
        Names arguments{"train",          folder / "data", "-o",  folder / out, "--init",
                        folder / "s.ply", "--max-splats",  "400", "--quiet"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_ewa(arguments, circumstances);
    }
    std::vector<int> logged_steps(const std::string& out) {
        std::istringstream metrics(read_file(folder / (out + "/metrics.jsonl")));
        std::vector<int> steps;
        for (std::string line; std::getline(metrics, line);)
            steps.push_back(nlohmann::json::parse(line)["step"].get<int>());
        return steps;
    }
    std::string metrics_line(const std::string& out, int step) {
        std::istringstream metrics(read_file(folder / (out + "/metrics.jsonl")));
        for (std::string line; std::getline(metrics, line);)
            if (nlohmann::json::parse(line)["step"] == step) return line;
        return {};
    }
    Folder folder;
};

class Resume : public ResumeEdges, public testing::WithParamInterface<const char*> {};

/// Ten kills in the middle of the run, each at another of the things that it does, writing included; what
/// comes out at last is what an undisturbed run gives.
TEST_P(Resume, AfterTenKillsEndsWithTheSameBytes) {
    const Names options{"--steps", "600",    "--strategy", GetParam(),     "--save-every",
                        "7",       "--seed", "5",          "--background", "random"};
    expect_success(train("whole", options));
    Names again = options;
    again.push_back("--resume");
    Random random(uint64_t(std::hash<std::string>{}(GetParam())));
    for (int attempt = 0; attempt < 10; ++attempt) {
        const int moment = int(random.uniform(5, 200));
        SCOPED_TRACE(moment);
        const Outcome outcome = train("cut", again, with_fault("EWA_FAULT_KILL", std::to_string(moment)));
        EXPECT_EQ(outcome.status, 128 + SIGKILL) << outcome.err;
    }
    expect_success(train("cut", again));
    EXPECT_EQ(read_file(folder / "cut/splats.ply"), read_file(folder / "whole/splats.ply"));
    EXPECT_EQ(read_file(folder / "cut/checkpoint.ewa"), read_file(folder / "whole/checkpoint.ewa"));
    EXPECT_EQ(logged_steps("cut"), logged_steps("whole"));
    EXPECT_EQ(files_below(folder / "cut"), files_below(folder / "whole"));  // nothing half written is left
    const auto summary = read_json(folder / "cut/summary.json");
    EXPECT_EQ(summary["steps"], 600);
    EXPECT_EQ(summary["test_psnr"], read_json(folder / "whole/summary.json")["test_psnr"]);
}

INSTANTIATE_TEST_SUITE_P(Strategies, Resume, testing::Values("adc", "mcmc"));

TEST_F(ResumeEdges, AfterCtrlCGoesOn) {
    const Names options{"--steps", "60", "--strategy", "none"};
    ASSERT_EQ(train("o", options, held_at(20, folder / "held", SIGINT)).status, 130);
    const int done = read_json(folder / "o/summary.json")["steps"];
    ASSERT_GT(done, 0);
    ASSERT_LT(done, 60);
    EXPECT_TRUE(fs::exists(folder / "o/checkpoint.ewa"));
    Names again = options;
    again.push_back("--resume");
    expect_success(train("o", again));
    expect_success(train("whole", options));
    EXPECT_EQ(read_file(folder / "o/splats.ply"), read_file(folder / "whole/splats.ply"));
    EXPECT_EQ(logged_steps("o"), logged_steps("whole"));
    EXPECT_EQ(read_json(folder / "o/summary.json")["interrupted"], false);

    // A finished run has nothing left to do, and ends as it did.
    expect_success(train("o", again));
    EXPECT_EQ(read_file(folder / "o/splats.ply"), read_file(folder / "whole/splats.ply"));
    EXPECT_EQ(logged_steps("o"), logged_steps("whole"));
}

/// A run of 30 steps that goes on to 90 is the same however often it is ended on the way.
TEST_P(Resume, WithMoreStepsEndsWithTheSameBytes) {
    const Names common{"--strategy", GetParam(),     "--seed", "5", "--resolution-schedule",
                       "1",          "--save-every", "7"};
    const auto to = [&](const std::string& out, const char* steps, const Circumstances& circumstances = {}) {
        Names options = common;
        options.insert(options.end(), {"--steps", steps, "--resume"});
        return train(out, options, circumstances);
    };
    for (const char* out : {"once", "often"}) expect_success(to(out, "30"));
    const std::string first = read_file(folder / "once/splats.ply"), last_line = metrics_line("once", 30);
    EXPECT_NE(last_line.find("test_psnr"), std::string::npos);
    // Until the longer run has something to show, the shorter one's result stays whole.
    ASSERT_EQ(to("once", "90", with_fault("EWA_FAULT_KILL", "12")).status, 128 + SIGKILL);
    EXPECT_EQ(read_file(folder / "once/splats.ply"), first);
    EXPECT_EQ(read_json(folder / "once/summary.json")["steps"], 30);
    EXPECT_TRUE(fs::exists(folder / "once/report.html"));
    expect_success(to("once", "90"));
    EXPECT_EQ(read_json(folder / "once/summary.json")["steps"], 90);
    EXPECT_EQ(read_json(folder / "once/config.json")["steps"], 90);
    EXPECT_EQ(metrics_line("once", 30), last_line) << "the first run's evaluation is still in the curve";

    for (const char* moment : {"5", "25", "60"})
        EXPECT_EQ(to("often", "90", with_fault("EWA_FAULT_KILL", moment)).status, 128 + SIGKILL);
    ASSERT_EQ(to("often", "90", held_at(20, folder / "held", SIGINT)).status, 130);
    expect_success(to("often", "90"));
    EXPECT_EQ(read_file(folder / "often/splats.ply"), read_file(folder / "once/splats.ply"));
    EXPECT_EQ(logged_steps("often"), logged_steps("once"));
    expect_failure(to("often", "89"), 2, "after the last of --steps 89");
}

/// `auto` would choose mcmc for so many steps, but nobody asked for another strategy.
TEST_F(ResumeEdges, AutoKeepsTheStrategyOfTheCheckpoint) {
    expect_success(train("o", {"--steps", "4"}));
    ASSERT_EQ(read_json(folder / "o/config.json")["strategy"], "adc");
    ASSERT_EQ(train("o", {"--steps", "6000", "--resume"}, held_at(20, folder / "held", SIGINT)).status, 130);
    EXPECT_EQ(read_json(folder / "o/config.json")["strategy"], "adc");
    // The steps stay, too.
    ASSERT_EQ(train("o", {"--resume"}, held_at(20, folder / "held", SIGINT)).status, 130);
    EXPECT_EQ(read_json(folder / "o/config.json")["steps"], 6000);
    EXPECT_GT(read_json(folder / "o/summary.json")["steps"], 4);
    expect_failure(train("o", {"--steps", "6000", "--strategy", "mcmc", "--resume"}), 2, "--strategy");
}

TEST_F(ResumeEdges, StartsWhereThereIsNoCheckpoint) {
    expect_success(train("o", {"--steps", "3", "--resume"}));
    EXPECT_EQ(read_json(folder / "o/summary.json")["steps"], 3);
}

TEST_F(ResumeEdges, RefusesWhatWouldEndDifferently) {
    const Names options{"--steps", "6", "--seed", "1", "--resume"};
    expect_success(train("o", options));
    const auto refused = [&](const Names& more, const std::string& text) {
        const std::string before = read_file(folder / "o/splats.ply"),
                          log = read_file(folder / "o/metrics.jsonl"),
                          summary = read_file(folder / "o/summary.json");
        Names changed = options;
        changed.insert(changed.end(), more.begin(), more.end());
        expect_failure(train("o", changed), 2, text);
        EXPECT_EQ(read_file(folder / "o/splats.ply"), before);
        EXPECT_EQ(read_file(folder / "o/metrics.jsonl"), log);
        EXPECT_EQ(read_file(folder / "o/summary.json"), summary);
    };
    expect_failure(train("o", {"--steps", "5", "--seed", "1", "--resume"}), 2,
                   "is at step 6, after the last of --steps 5");
    expect_failure(train("o", {"--steps", "6", "--seed", "2", "--resume"}), 2, "--seed 1, not 2");
    refused({"--kernel", "antialias"}, "--kernel");
    refused({"--background", "1,1,1"}, "--background");
    refused({"--sh-degree", "1"}, "--sh-degree");
    refused({"--test-every", "2"}, "--test-every 8, not 2");
    refused({"--frames", "0-1"}, "--frames \"all\", not \"0-1\"");
    expect_success(train("o", {"--steps", "6", "--seed", "1", "--resume", "--eval-every", "2", "--save-every",
                               "3", "--image-cache", "1"}));

    fs::copy_file(folder / "data/images/1.png", folder / "data/images/2.png",
                  fs::copy_options::overwrite_existing);
    refused({}, "another dataset");
    std::string bytes = read_file(folder / "o/checkpoint.ewa");
    bytes[bytes.size() / 2] ^= 1;
    write_file(folder / "o/checkpoint.ewa", bytes);
    refused({}, "checksum");
    write_file(folder / "o/checkpoint.ewa", "ply");
    refused({}, "not a checkpoint");
}

/// A checkpoint whose section `section` has another name or other bytes, and the checksum that goes with
/// them.
std::string with_section(const std::string& checkpoint, const std::string& section, const std::string& name,
                         const std::optional<std::string>& bytes = {}) {
    constexpr size_t kStart = 16, kHeader = 32, kSize = 16, kChecksum = 24;
    for (size_t at = kStart; at < checkpoint.size();) {
        uint64_t before = 0;
        std::memcpy(&before, &checkpoint[at + kSize], sizeof(before));
        if (checkpoint.c_str() + at == section) {
            std::string header = checkpoint.substr(at, kHeader);
            const std::string body = bytes ? *bytes : checkpoint.substr(at + kHeader, before);
            std::copy(name.begin(), name.end(), header.begin());
            const uint64_t size = body.size();
            std::memcpy(&header[kSize], &size, sizeof(size));
            const auto* header_bytes = reinterpret_cast<const Bytef*>(header.data());
            const auto* body_bytes = reinterpret_cast<const Bytef*>(body.data());
            const auto sum = uint32_t(crc32_z(crc32_z(0, header_bytes, kChecksum), body_bytes, body.size()));
            std::memcpy(&header[kChecksum], &sum, sizeof(sum));
            return checkpoint.substr(0, at) + header + body + checkpoint.substr(at + kHeader + before);
        }
        at += kHeader + before;
    }
    ADD_FAILURE() << "there is no section " << section;
    return checkpoint;
}

TEST_F(ResumeEdges, NamesACheckpointThatIsWholeButWrong) {
    const Names options{"--steps", "3", "--resume"};
    expect_success(train("o", options));
    const std::string path = folder / "o/checkpoint.ewa", good = read_file(path);
    const auto refused = [&](const std::string& checkpoint, const std::string& text) {
        write_file(path, checkpoint);
        const Outcome outcome = train("o", options);
        expect_failure(outcome, 2, text);
        EXPECT_NE(outcome.err.find(path), std::string::npos) << outcome.err;
        EXPECT_LT(outcome.err.size(), 1000u);
    };
    refused(with_section(good, "moments1", "momentsX"),
            path + ": the state does not fit this training: it lacks moments1");
    refused(with_section(good, "metrics", "metrics", "xxx"), path + ": line 1 of the metrics");

    const auto settings = [&](const std::string& text) {
        return with_section(good, "settings", "settings", text);
    };
    const std::string deep = std::string(400000, '[') + std::string(400000, ']');
    refused(settings("{\"options\":{\"steps\":" + deep + "}}"), "nests deeper");
    refused(settings(deep), "nests deeper");
    refused(settings("{\"options\":3}"), "cannot be read");
    refused(settings(""), "not valid JSON");
    const std::string dataset = nlohmann::json::parse(good.substr(48, good.find("metrics") - 48))["dataset"];
    const nlohmann::json longer{{"dataset", dataset}, {"options", {{"steps", std::string(100000, 'x')}}}};
    refused(settings(longer.dump()), "its settings have --steps");
    auto stranger = nlohmann::json::parse(good.substr(48, good.find("metrics") - 48));
    stranger["reached"] = {{"sh_degree", 1e9}, {"halvings", -1}};
    write_file(path, settings(stranger.dump()));
    expect_success(train("o", options));

    write_file(path, with_section(good, "settings", "settings"));
    expect_success(train("o", options));
}

/// The times of a run are beside the checkpoint. Those of one that lacks them begin anew.
TEST_F(ResumeEdges, TimesGoOn) {
    const Names options{"--steps", "40", "--strategy", "none", "--resume"};
    ASSERT_EQ(train("o", options, held_at(20, folder / "held", SIGINT)).status, 130);
    const std::string times = folder / "o/times.json", first = metrics_line("o", 1);
    const auto saved = read_json(times)["checkpoints"].back();
    EXPECT_GT(saved[1], 0);
    EXPECT_GT(saved[2], saved[1]);
    const std::string checkpoint = read_file(folder / "o/checkpoint.ewa");

    const auto ends = [&](double seconds, double wall_seconds, bool known) {
        expect_success(train("o", options));
        const auto summary = read_json(folder / "o/summary.json");
        EXPECT_GT(summary["seconds"], seconds);
        EXPECT_GT(summary["wall_seconds"], wall_seconds);
        EXPECT_EQ(metrics_line("o", 1) == first, known);
        const std::string report = read_file(folder / "o/report.html");
        EXPECT_EQ(report.find("resumed without its earlier times") == std::string::npos, known);
        write_file(folder / "o/checkpoint.ewa", checkpoint);
    };
    const int step = saved[0];
    const auto row = [&](int at, const char* rest) { return "[" + std::to_string(at) + rest; };
    const std::string line =
        "[[1," +
        first.substr(first.find("seconds\":") + 9, first.find(",\"wall") - first.find("seconds\":") - 9) +
        "," +
        first.substr(first.find("wall_seconds\":") + 14,
                     first.find(",\"loss") - first.find("wall_seconds\":") - 14) +
        "]]";
    // After a kill between the two files, times.json has another checkpoint too.
    write_file(times, "{\"metrics\":" + line + ",\"checkpoints\":[" + row(step, ",100,200],") +
                          row(step + 3, ",3e6,4e6]]}"));
    ends(100, 200, true);
    EXPECT_LT(read_json(folder / "o/summary.json")["wall_seconds"], 3e6) << "those of the other checkpoint";
    EXPECT_EQ(read_json(times)["checkpoints"].front()[2], 200);
    for (const char* wrong : {"", R"({"metrics":[],"checkpoints":[[20,-1,2]]})"}) {
        SCOPED_TRACE(wrong);
        write_file(times, wrong);
        ends(0, 0, false);
    }
    fs::remove(times);
    ends(0, 0, false);
}

/// The last evaluation of a finished run comes after its checkpoint.
TEST_F(ResumeEdges, TheTimeOfTheLastEvaluationCounts) {
    const Names options{"--steps", "20", "--strategy", "none", "--resume"};
    expect_success(train("o", options));
    const std::string metrics = folder / "o/metrics.jsonl";
    std::string text = read_file(metrics);
    const size_t wall = text.rfind("wall_seconds\":") + 14;
    write_file(metrics, text.replace(wall, text.find(',', wall) - wall, "1000"));
    expect_success(train("o", {"--steps", "21", "--strategy", "none", "--resume"}));
    EXPECT_GT(read_json(folder / "o/summary.json")["wall_seconds"], 1000);
}

/// Before there was times.json, the checkpoint had the times.
TEST_F(ResumeEdges, AnEarlierCheckpointHasItsTimes) {
    const Names options{"--steps", "40", "--strategy", "none", "--resume"};
    ASSERT_EQ(train("o", options, held_at(20, folder / "held", SIGINT)).status, 130);
    const std::string path = folder / "o/checkpoint.ewa", good = read_file(path);
    const std::string metrics = metrics_line("o", 1) + "\n";
    constexpr size_t kSeconds = 8, kStateBytes = 64, kHeader = 32;
    const size_t state = good.find(std::string("state\0\0", 7)) + kHeader;
    std::string block = good.substr(state, kStateBytes);
    EXPECT_EQ(block.substr(kSeconds, 16), std::string(16, '\0'));
    const double times[] = {100, 200};
    std::memcpy(&block[kSeconds], times, sizeof(times));
    write_file(path,
               with_section(with_section(good, "state", "state", block), "metrics", "metrics", metrics));
    fs::remove(folder / "o/times.json");
    expect_success(train("o", options));
    const auto summary = read_json(folder / "o/summary.json");
    EXPECT_GT(summary["seconds"], 100);
    EXPECT_GT(summary["wall_seconds"], 200);
    EXPECT_EQ(metrics_line("o", 1) + "\n", metrics);
}

/// The folder that a run has without -o carries the name of what its dataset is made from.
TEST(ResumeOfAMeshScene, FindsTheRunsFolder) {
    const Folder folder;
    const std::filesystem::path run = folder / "out/plaster";
    std::filesystem::create_directories(run);
    write_file(run / "config.json", "{\"steps\": 7}");
    write_file(run / "metrics.jsonl", "{\"step\": 7}\n");
    write_file(run / "summary.json", "{\"steps\": 7}");
    Circumstances in_folder;
    in_folder.program = "/usr/bin/env";
    const std::string scene = std::string(EWA_SOURCE_DIR) + "/scenes/plaster.gltf";
    expect_failure(run_ewa({"-C", folder / "", EWA_PROGRAM, "train", scene, "--check-options"}, in_folder), 2,
                   "plaster");
}

}  // namespace
