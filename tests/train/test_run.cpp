// SPDX-License-Identifier: Apache-2.0
// A whole training run through the library: its files, stopping and resuming, and its options.
#include "ewa/run.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "core/json.h"
#include "ewa/error.h"
#include "ewa/splat_files.h"
#include "run/advanced_options.h"
#include "run/loss_option.h"
#include "run/option_table.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

RunOptions small_run(const fs::path& output) {
    RunOptions options;
    options.dataset = small_capture().folder.path();
    options.output = output;
    options.train.steps = 40;
    options.train.strategy = Strategy::mcmc;
    options.train.max_splats = 60;
    options.train.seed = 3;
    options.train.appearance = AppearanceModel::affine;
    options.test_every = 4;
    options.eval_every = 20;
    return options;
}

/// Notes what it is told, and stops the run before the step after `last_step`.
struct Recorder : RunObserver {
    explicit Recorder(int last_step = 1000) : last_step_(last_step) {}
    bool should_stop() override { return steps >= last_step_ || stop_late_ == calls_; }
    void on_note(const std::string& line) override { notes.push_back(line); }
    void on_start(const RunStart& start) override {
        calls_ = "start";
        started = start;
    }
    void on_begin(const fs::path&, const std::vector<MetricsLine>& metrics) override {
        earlier_lines = metrics.size();
    }
    void on_step(const StepReport& report) override { steps = report.step; }
    void on_evaluation(int step, const Evaluation& evaluation) override {
        evaluated.push_back(step);
        EXPECT_EQ(evaluation.frames.size(), 2u);
    }
    void on_metrics(const MetricsLine& line) override { logged.push_back(line.step); }
    void between_steps(const StepReport& report, const Trainer& trainer,
                       const RunCommands& commands) override {
        EXPECT_EQ(trainer.steps_done(), report.step);
        if (report.step == edit_at) {
            const EditCounts counts = commands.edit(edit);
            EXPECT_EQ(counts.removed, edit.remove.size());
            EXPECT_EQ(report.splats, trainer.splats());
        }
        if (report.step == save_at) commands.save();
        if (report.step == save_at) saved_at_step = fs::exists(save_file);
    }
    void on_saved(const StepReport&) override { calls_ = "saved"; }
    void on_evaluated(const StepReport&, const Gaussians& gaussians) override {
        splats_at_end = gaussians.size();
    }

    RunStart started;
    int steps = 0, save_at = 0, edit_at = 0;
    SplatEdit edit;
    fs::path save_file;
    bool saved_at_step = false;
    size_t earlier_lines = 0, splats_at_end = 0;
    std::vector<std::string> notes;
    std::vector<int> evaluated, logged;
    void stop_after_saving() { stop_late_ = "saved"; }

  private:
    int last_step_;
    std::string calls_ = "none", stop_late_ = "never";
};

Json json_of(const fs::path& path) {
    return core::read_json_file<Json>(path);
}

TEST(Run, WritesItsFilesAndTellsItsObserver) {
    TempFolder folder;
    const RunOptions options = small_run(folder / "o");
    Recorder recorder;
    recorder.save_at = 7;
    recorder.save_file = folder / "o/splats.ply";
    const RunResult result = run_training(options, recorder);
    for (const char* file : {"config.json", "metrics.jsonl", "checkpoint.ewa", "times.json", "splats.ply",
                             "summary.json", "report.html", "appearance.json"})
        EXPECT_TRUE(fs::exists(folder / "o" / file)) << file;
    EXPECT_EQ(result.folder, folder / "o");
    EXPECT_TRUE(fs::exists(result.first_render)) << result.first_render;
    EXPECT_EQ(result.summary.steps, 40);
    EXPECT_FALSE(result.summary.interrupted);
    EXPECT_EQ(result.summary.strategy, "mcmc");
    EXPECT_EQ(json_of(folder / "o/summary.json")["test_psnr"].get<double>(), *result.summary.test_psnr);

    EXPECT_EQ(recorder.started.train_views, 6u);
    EXPECT_EQ(recorder.started.test_views, 2u);
    EXPECT_EQ(recorder.started.splats, 40u);
    EXPECT_GT(recorder.started.memory.total(), 0u);
    EXPECT_EQ(recorder.steps, 40);
    EXPECT_EQ(recorder.evaluated, std::vector<int>{20});
    EXPECT_EQ(recorder.logged.size(), 40u);
    EXPECT_TRUE(recorder.saved_at_step);
    EXPECT_EQ(recorder.splats_at_end, result.summary.splats);
    const Json config = json_of(folder / "o/config.json");
    EXPECT_EQ(config["strategy"], "mcmc");
    EXPECT_EQ(config["sh-degree"], 3);
    EXPECT_EQ(config["background"], "0.24,0.28,0.21");
}

/// The checkpoint has the edit, also one that is saved later, and so has the run that continues it.
TEST(Run, AnEditedRunEndsWithTheSameBytesAfterAResume) {
    TempFolder folder;
    const auto edited = [](int last) {
        auto recorder = std::make_unique<Recorder>(last);
        recorder->edit_at = 7;
        recorder->edit = {.remove = {3, 5, 8}, .freeze = {0, 1, 2}};
        return recorder;
    };
    const auto whole = edited(1000), first = edited(13);
    run_training(small_run(folder / "whole"), *whole);
    EXPECT_NE(std::ranges::find(whole->notes, "step 7: an edit removed 3 splats, froze 3 splats"),
              whole->notes.end());
    RunOptions options = small_run(folder / "cut");
    options.resume = true;
    run_training(options, *first);
    Recorder second;
    run_training(options, second);
    for (const char* file : {"splats.ply", "checkpoint.ewa"})
        EXPECT_EQ(file_bytes(folder / "whole" / file), file_bytes(folder / "cut" / file)) << file;
    for (const char* run : {"whole", "cut"}) {
        std::ifstream lines(folder / run / "metrics.jsonl");
        std::string line;
        int found = 0;
        while (std::getline(lines, line)) {
            const Json json = Json::parse(line);
            if (!json.contains("removed")) continue;
            ++found;
            EXPECT_EQ(json["step"], 7);
            EXPECT_EQ(json["removed"], 3);
            EXPECT_EQ(json["frozen"], 3);
            EXPECT_EQ(json["unfrozen"], 0);
        }
        EXPECT_EQ(found, 1) << run;
        EXPECT_NE(file_bytes(folder / run / "report.html").find("step 7: an edit removed 3 splats"),
                  std::string::npos);
    }
    RunOptions unedited = small_run(folder / "unedited");
    run_training(unedited);
    EXPECT_NE(file_bytes(folder / "whole/splats.ply"), file_bytes(folder / "unedited/splats.ply"));
}

TEST(Run, StoppedAndResumedEndsWithTheSameBytes) {
    TempFolder folder;
    RunOptions whole = small_run(folder / "whole"), options = small_run(folder / "cut");
    whole.train.sky = options.train.sky = true;
    whole.train.loss = options.train.loss = {0.5, 1, 0.1};
    run_training(whole);
    options.resume = true;  // starts, since there is no checkpoint
    for (const int last : {13, 27}) {
        Recorder stops(last);
        const RunResult result = run_training(options, stops);
        EXPECT_TRUE(result.summary.interrupted);
        EXPECT_EQ(result.summary.steps, last);
        EXPECT_FALSE(result.summary.test_psnr);
    }
    Recorder late;
    late.stop_after_saving();
    EXPECT_TRUE(run_training(options, late).summary.interrupted);
    EXPECT_EQ(late.earlier_lines, 27u);
    EXPECT_EQ(late.steps, 40);

    const RunResult result = run_training(options);
    EXPECT_FALSE(result.summary.interrupted);
    EXPECT_EQ(json_of(folder / "cut/config.json")["background"], "sky");
    for (const char* file : {"splats.ply", "appearance.json", "sky.json", "config.json"})
        EXPECT_EQ(file_bytes(folder / "cut" / file), file_bytes(folder / "whole" / file)) << file;

    options.train.seed = 4;
    expect_error<InputError>([&] { run_training(options); }, {"--seed 3, not 4"});
    options.train.seed = 3;
    options.train.loss = {};
    expect_error<InputError>([&] { run_training(options); },
                             {R"(--loss "l1=0.5,l2=1,ssim=0.1", not "l1=0.8,ssim=0.2")"});
}

/// A run that is resumed keeps its cap. With more steps it has that of the longer run.
TEST(Run, SaysAndKeepsAnAutomaticCap) {
    TempFolder folder;
    RunOptions options = small_run(folder / "whole");
    options.train.max_splats = kAutomaticMaxSplats;
    Recorder recorder;
    const RunResult whole = run_training(options, recorder);
    EXPECT_EQ(whole.summary.max_splats, 2539u);
    EXPECT_EQ(json_of(folder / "whole/summary.json")["max_splats"], 2539);
    EXPECT_EQ(json_of(folder / "whole/config.json")["max-splats"], "auto");
    const std::vector<std::string>& said = recorder.started.remarks;
    EXPECT_EQ(std::count(said.begin(), said.end(),
                         "at most 2539 splats: 6 photos with 0.0104 million pixels have detail for no more; "
                         "--max-splats N sets another limit"),
              1);

    options.output = folder / "cut";
    options.resume = true;
    Recorder stops(13);
    run_training(options, stops);
    EXPECT_EQ(run_training(options).summary.max_splats, 2539u);
    EXPECT_EQ(file_bytes(folder / "cut/splats.ply"), file_bytes(folder / "whole/splats.ply"));
    EXPECT_EQ(file_bytes(folder / "cut/checkpoint.ewa"), file_bytes(folder / "whole/checkpoint.ewa"));

    options.train.max_splats = 600;
    expect_error<InputError>([&] { run_training(options); }, {"--max-splats \"auto\", not 600"});
}

/// The rule for the splats at the end is that of the run's own steps: a full run keeps all.
TEST(Run, ContinuesAShortRunOfMcmcToAFullOne) {
    TempFolder folder;
    RunOptions options = small_run(folder / "o");
    options.train.strategy = Strategy::mcmc;
    options.train.max_splats = kAutomaticMaxSplats;
    Recorder recorder;
    run_training(options, recorder);
    const auto tells = [](const Recorder& of) {
        return std::ranges::any_of(of.started.remarks, [](const std::string& remark) {
            return remark.ends_with("in the last quarter: those that show most; --final-splats 0 keeps all");
        });
    };
    EXPECT_TRUE(tells(recorder));
    options.resume = true;
    options.train.steps = 30000;
    Recorder stops(45);
    EXPECT_EQ(run_training(options, stops).summary.steps, 45);
    EXPECT_FALSE(tells(stops));
}

TEST(Run, ADenseStartKeepsToACapThatIsGiven) {
    TempFolder folder;
    RunOptions options = small_run(folder / "o");
    options.dense_start = DenseStart::on;
    options.force = true;
    for (const uint32_t cap : {kAutomaticMaxSplats, 90u}) {
        options.train.max_splats = cap;
        Recorder stops(1);
        run_training(options, stops);
        EXPECT_EQ(stops.started.splats > 90, cap == kAutomaticMaxSplats) << stops.started.splats;
    }
}

/// 40 points for photos of 1,728 pixels are few: 0.02 a pixel. Eight photos are few, too.
TEST(Run, ADenseStartOfAThousandStepsIsForFewPoints) {
    Synthetic made;
    make_synthetic(made, 40, 8, 48, 36, 7);
    RunOptions options;
    options.train.strategy = Strategy::adc;
    options.train.sh_degree = 0;
    const std::vector<int> frames = all_frames(made.dataset);
    const auto splats = [&](int steps, int few_photos) {
        options.train.steps = steps;
        options.train.few_photos = few_photos;
        return train::initial_splats(options, made.dataset, frames).size();
    };
    const size_t points = made.dataset.points.positions.size(), dense = splats(700, 16);
    EXPECT_GT(dense, points);
    EXPECT_EQ(splats(1000, 0), dense);
    EXPECT_EQ(splats(1001, 0), points);
    EXPECT_EQ(splats(1000, 16), points);
    for (size_t copies = 1; copies < 7; ++copies)
        for (size_t i = 0; i < points; ++i) {
            made.dataset.points.positions.push_back(made.dataset.points.positions[i] +
                                                    glm::dvec3(0.01 * double(copies)));
            made.dataset.points.colors.push_back(made.dataset.points.colors[i]);
        }
    EXPECT_EQ(splats(1000, 0), 7 * points);  // 0.16 a pixel
    EXPECT_GT(splats(700, 0), 7 * points);
}

TEST(Run, ADenseStartNeedsPoints) {
    TempFolder folder;
    RunOptions options = small_run(folder / "o");
    run_training(options);
    options.dense_start = DenseStart::on;
    for (const std::string& start : {std::string("random"), (folder / "o/splats.ply").string()}) {
        options.init = start;
        options.output = folder / "p";
        expect_error<InputError>([&] { run_training(options); }, {"--dense-start on", start, "none"});
    }
}

TEST(Run, AContinuedRunDoesNotLowerItsCap) {
    TempFolder folder;
    RunOptions options = small_run(folder / "o");
    options.train.max_splats = kAutomaticMaxSplats;
    options.train.steps = 2;  // fewer splats by the steps than by the pixels
    options.resume = true;
    EXPECT_EQ(run_training(options).summary.max_splats, 240u);
    options.train.steps = 40;
    Recorder stops(3);
    EXPECT_EQ(run_training(options, stops).summary.max_splats, 2539u);
    options.train.steps = 3;
    EXPECT_EQ(run_training(options).summary.max_splats, 2539u);
}

TEST(Run, IsNotReplacedUnlessAskedTo) {
    TempFolder folder;
    RunOptions options = small_run(folder / "o");
    run_training(options);
    const std::string splats = file_bytes(folder / "o/splats.ply");
    options.train.seed = 4;
    expect_error<InputError>([&] { run_training(options); }, {"holds a finished run of 40 steps", "--force"});
    EXPECT_EQ(file_bytes(folder / "o/splats.ply"), splats);
    options.force = true;
    run_training(options);
    EXPECT_NE(file_bytes(folder / "o/splats.ply"), splats);
}

/// 280 steps start with images of half the size for 100 of them. 560 steps would do so for a smaller share.
TEST(Run, WithMoreStepsKeepsTheSizesOfImagesThatItHadChosen) {
    TempFolder folder;
    RunOptions options = small_run(folder / "o");
    options.train.strategy = Strategy::adc;
    options.train.appearance = AppearanceModel::none;
    options.train.few_photos = 1;
    options.train.steps = 280;
    options.eval_every = 0;
    Recorder at_60(60);
    EXPECT_TRUE(run_training(options, at_60).summary.interrupted);
    const auto asked = json_of(folder / "o/config.json");
    EXPECT_EQ(asked["resolution-schedule"], 1);
    EXPECT_EQ(asked["resolution-every"], 10714);
    options.resume = true;
    options.train.steps = 560;
    Recorder at_70(70);
    run_training(options, at_70);
    const auto kept = json_of(folder / "o/config.json");
    EXPECT_EQ(kept["steps"], 560);
    EXPECT_EQ(kept["resolution-schedule"], 1);
    EXPECT_EQ(kept["resolution-every"], 10714);

    options.force = true;
    options.resume = false;
    options.train.halvings = 0;
    Recorder at_1(1);
    run_training(options, at_1);
    EXPECT_EQ(json_of(folder / "o/config.json")["resolution-schedule"], 0);
}

TEST(Run, RefusesOptionsThatExcludeEachOther) {
    TempFolder folder;
    RunOptions options = small_run(folder / "o");
    options.train.absolute_gradients = true;
    expect_error<InputError>([&] { run_training(options); }, {"--absgrad", "--strategy adc"});
    options.train.strategy = Strategy::automatic;
    EXPECT_NO_THROW(check_options(options));
    EXPECT_EQ(resolve(options.train, {}, {}).strategy, Strategy::adc);
    options.resume = options.force = true;
    expect_error<InputError>([&] { run_training(options); }, {"--resume", "--force"});
    EXPECT_FALSE(fs::exists(folder / "o"));
}

TEST(Run, SkipsBlurredTrainingImages) {
    Synthetic made;
    make_synthetic(made, 40, 8, 48, 36, 7);
    for (size_t i = 0; i < 8; ++i) {
        // Rectangles without a period, then the mean over 9 px of a row in two images.
        Image sharp(48, 36, 3);
        for (int y = 0; y < 36; ++y)
            for (int x = 0; x < 48; ++x) {
                const int block = (x + int(i)) / 5 * 7 + y / 7 * 13;
                std::fill_n(sharp.at(x, y), 3, block * block / 3 % 2 == 0 ? 0.2f : 0.8f);
            }
        Image image = sharp;
        for (int y = 0; (i == 2 || i == 4) && y < 36; ++y)
            for (int x = 4; x < 44; ++x) {
                float sum = 0;
                for (int k = -4; k <= 4; ++k) sum += *sharp.at(x + k, y);
                std::fill_n(image.at(x, y), 3, sum / 9);
            }
        save_image(made.dataset.frames[i].image_path, image);
    }
    TempFolder folder;
    RunOptions options = small_run(folder / "o");
    options.dataset = made.folder.path();
    options.train.steps = 2;
    const auto views = [&](bool skip) {
        options.skip_blurred = skip;
        options.force = true;
        Recorder recorder;
        run_training(options, recorder);
        return std::pair(recorder.started.train_views, recorder.started.remarks);
    };
    EXPECT_EQ(views(false).first, 6u);
    // The fifth image, number 4, is held out.
    const auto [left, remarks] = views(true);
    EXPECT_EQ(left, 5u);
    EXPECT_NE(std::ranges::find_if(remarks,
                                   [&](const std::string& remark) {
                                       return remark == "1 training image is blurred and skipped: " +
                                                            made.dataset.frames[2].name;
                                   }),
              remarks.end());
}

TEST(Run, AnExceptionOfTheObserverEndsIt) {
    struct Thrower : RunObserver {
        void on_step(const StepReport& step) override {
            if (step.step == 5) throw std::domain_error("enough");
        }
    } thrower;
    TempFolder folder;
    EXPECT_THROW(run_training(small_run(folder / "o"), thrower), std::domain_error);
    EXPECT_FALSE(fs::exists(folder / "o/summary.json"));
    EXPECT_NO_THROW(run_training(small_run(folder / "o")));  // the folder is free again
}

TEST(RunOptions, AreNamedAfterTheirFolderOrScene) {
    TempFolder folder;
    RunOptions options;
    folder.write("capture/transforms.json", "{}");
    options.dataset = folder / "capture";
    EXPECT_EQ(run_name(options), "capture");
    EXPECT_EQ(output_folder(options), fs::path("out/capture"));
    options.dataset = folder / "capture/transforms.json";
    EXPECT_EQ(run_name(options), "capture");
    options.scene = "scenes/plaster.gltf";
    EXPECT_EQ(run_name(options), "plaster");
    options.output = "here";
    EXPECT_EQ(output_folder(options), fs::path("here"));
}

/// Every option changes a member of its own, and comes back from its text.
TEST(RunOptions, TableReadsWhatItWrites) {
    std::map<std::string, std::string> other{{"dataset", "d"},
                                             {"steps", "7"},
                                             {"strategy", "adc"},
                                             {"max-splats", "8"},
                                             {"final-splats", "5"},
                                             {"sh-degree", "2"},
                                             {"absgrad", "true"},
                                             {"region", "-1,-2,-3,0.5,1,2"},
                                             {"loss", "l1=0.5,l2=2,ssim=0.25,alpha=0.5"},
                                             {"appearance", "grid"},
                                             {"resolution-schedule", "3"},
                                             {"init", "random"},
                                             {"dense-start", "on"},
                                             {"init-opacity", "0.5"},
                                             {"init-scale", "2.5"},
                                             {"frames", "0-3"},
                                             {"downscale", "2"},
                                             {"masks", "cut"},
                                             {"lens", "native"},
                                             {"test-every", "5"},
                                             {"level", "off"},
                                             {"skip-blurred", "true"},
                                             {"robust", "true"},
                                             {"seed", "18446744073709551615"},
                                             {"moments", "32"},
                                             {"image-cache", "9"},
                                             {"device-memory", "0.25"},
                                             {"background", "0.25,1,0"},
                                             {"kernel", "density"},
                                             {"batch", "4"},
                                             {"bands", "2"},
                                             {"points", "true"},
                                             {"nearest", "3"},
                                             {"integrator", "ray"},
                                             {"refine-poses", "true"},
                                             {"refine-focal", "true"},
                                             {"rolling-shutter", "right-to-left"},
                                             {"eval-every", "6"},
                                             {"save-every", "4"},
                                             {"keep", "3"},
                                             {"max-width", "800"},
                                             {"metrics", "ms_ssim"},
                                             {"tensorboard", "true"},
                                             {"inria", "true"},
                                             {"device", "cpu"},
                                             {"rank-timeout", "7"}};
    std::ifstream file(EWA_SOURCE_DIR "/docs/training_options.md");
    const std::string documents(std::istreambuf_iterator<char>(file), {});
    for (const train::RunOption& option : train::advanced_options()) {
        other[option.name] = option.get(RunOptions()).is_number_integer() ? "7"
                             : option.name == "growth"                    ? "1.25"
                                                                          : "0.25";
        EXPECT_EQ(option.before, train::value_text(option, RunOptions())) << option.name;
        const std::string row = "| `" + option.name + "` | " + option.help + " |";
        EXPECT_NE(documents.find(row), std::string::npos) << row;
    }
    ASSERT_EQ(train::run_options().size(), other.size());
    RunOptions all;
    for (const train::RunOption& option : train::run_options()) {
        SCOPED_TRACE(option.name);
        const Json before = train::to_config(RunOptions());
        RunOptions one;
        option.set(one, other.at(option.name));
        option.set(all, other.at(option.name));
        EXPECT_EQ(train::value_text(option, one), other.at(option.name));
        const Json after = train::to_config(one);
        for (const auto& [name, value] : after.items())
            EXPECT_EQ(value != before.value(name, Json()), name == option.name) << name;
        EXPECT_TRUE(after.contains(option.name));
        EXPECT_EQ(before.contains(option.name), !option.subject.empty());
        option.set(one, train::value_text(option, RunOptions()));
        EXPECT_EQ(train::to_config(one), before);
        EXPECT_FALSE(option.help.empty());
        EXPECT_TRUE(!option.subject.empty() || option.decides_result);
        if (option.flag) {
            EXPECT_TRUE(option.flag(all));
        }
    }
    const Json config = train::to_config(all);
    for (const auto& [name, text] : other)
        EXPECT_EQ(train::value_text(train::run_option(name), all), text) << name;
    EXPECT_EQ(all.train.moment_bits, 32);
    EXPECT_EQ(all.train.image_cache_bytes, uint64_t(9) << 20);
    EXPECT_EQ(all.train.device_memory_bytes, uint64_t(256) << 20);
    EXPECT_EQ(all.train.render.kernel, Footprint::density);
    EXPECT_EQ(config.begin().key(), "dataset");
}

TEST(RunOptions, ALossHasTheTermsThatItNames) {
    EXPECT_EQ(train::parse_loss(" L1 = 0.5 , ssim=1e-1"), (LossWeights{0.5, 0, 0.1}));
    EXPECT_EQ(train::parse_loss("l2=1,ssim=0"), (LossWeights{0, 1, 0}));
    EXPECT_EQ(train::parse_loss("alpha=0,depth=1"), (LossWeights{0.8, 0, 0.2, 0, 1}));
    EXPECT_EQ(train::parse_loss("alpha=2,l2=1,sfm-depth=0.1"), (LossWeights{0, 1, 0, 2, 0, 0.1}));
    EXPECT_EQ(train::loss_text({0.8, 0, 0.2, 0}), "l1=0.8,ssim=0.2,alpha=0");
    EXPECT_EQ(train::loss_text({}), "l1=0.8,ssim=0.2");
    const std::pair<const char*, const char*> wrong[] = {
        {"", "'' is no term of the loss; l1, l2, ssim, alpha, depth and sfm-depth are"},
        {"sim=1", "did you mean ssim?"},
        {"l1=1,", "'' is no term"},
        {"l1", "'l1' has no weight; l1=0.5 has one"},
        {"l1=1,ssim=1,L1=2", "'l1' is named twice"},
        {"l1=-1", "l1: '-1' is not a number from 0 to"},
        {"l1=", "l1: '' is not a number"},
        {"ssim=nan", "ssim: 'nan' is not a number"},
        {"depth=1,sfm-depth=1", "'depth=1,sfm-depth=1' has depth and sfm-depth"},
        {"l1=0,ssim=0", "'l1=0,ssim=0' has no weight above 0; l1=0.8,ssim=0.2 is the usual loss"}};
    for (const auto& [text, message] : wrong)
        expect_error<InputError>([&, t = text] { train::parse_loss(t); }, {message});
}

TEST(RunOptions, TableRefusesWhatIsOutOfRange) {
    const std::pair<const char*, const char*> wrong[] = {{"steps", "0"},
                                                         {"steps", "1000000001"},
                                                         {"steps", "many"},
                                                         {"steps", "1.5"},
                                                         {"max-splats", "-1"},
                                                         {"max-splats", "0"},
                                                         {"max-splats", "automatic"},
                                                         {"seed", "-1"},
                                                         {"sh-degree", "4"},
                                                         {"strategy", "luck"},
                                                         {"background", "1,1"},
                                                         {"background", "0,0,2"},
                                                         {"background", "1,1,1,1"},
                                                         {"background", "1,nan,1"},
                                                         {"absgrad", "perhaps"},
                                                         {"kernel", "box"},
                                                         {"downscale", "1025"},
                                                         {"background", ""},
                                                         {"moments", "8"},
                                                         {"moments", "24"},
                                                         {"moments", "33"},
                                                         {"image-cache", "x"},
                                                         {"growth", "0.5"},
                                                         {"refine-every", "0"},
                                                         {"means-rate", "-1"}};
    for (const auto& [name, text] : wrong) {
        RunOptions options;
        expect_error<InputError>([&, n = name, t = text] { train::run_option(n).set(options, t); },
                                 {std::string("'") + text + "'"});
        EXPECT_EQ(train::to_config(options), train::to_config(RunOptions())) << name << " " << text;
    }
}

}  // namespace
}  // namespace ewa::test
