// SPDX-License-Identifier: Apache-2.0
// ewa train: its options, the dataset of a mesh scene, and the run.
#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>
#include <array>
#include <chrono>
#include <memory>
#include <utility>

#include "capture/what_is.h"
#include "cli/arguments.h"
#include "cli/cameras.h"
#include "cli/command.h"
#include "cli/config.h"
#include "cli/interrupt.h"
#include "cli/resumed_run.h"
#include "cli/run_inputs.h"
#include "cli/status.h"
#include "cli/train_observer.h"
#include "core/folders.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "ewa/run.h"
#include "folders/run.h"
#include "ranks/open.h"
#include "run/earlier_run.h"
#include "run/option_table.h"
#include "run/run_input.h"
#include "run/share_machine.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

struct TrainArguments {
    RunOptions run;
    TrainOutput output;
    fs::path config;
    bool check_only = false;
    What made_of = What::nothing;  // RunOptions::scene, if the run makes its dataset of it
    std::string quality;           // empty: not given
};

/// Reads the config, if there is one. Then sets the steps of --quality, unless they are given themselves. A quality of the
/// command line goes before steps of the config.
void apply_config_and_quality(CLI::App& app, TrainArguments& arguments) {
    const bool on_command_line = !arguments.quality.empty();
    size_t given = app.count("--steps");
    if (!arguments.config.empty()) apply_config(app, arguments.config);
    if (!on_command_line) given = app.count("--steps");
    if (const auto steps = core::find_value(train::kQualities, arguments.quality); steps && given == 0)
        arguments.run.train.steps = *steps;
}

/// A folder of runs is no dataset, and a run in it may be meant.
void refuse_runs(const fs::path& folder) {
    if (const std::string runs = folders::runs_in(folder); !runs.empty())
        throw InputError(core::one_line(folder.string()) + ": not a dataset, but it has the training runs " +
                         runs + "; ewa train RUN --resume continues one");
}

/// Notes what a dataset will be made from: a mesh scene, photos or a video. The run's folder has its name.
void note_scene(TrainArguments& arguments) {
    RunOptions& run = arguments.run;
    if (run.dataset.empty() || !run.scene.empty()) return;
    const What what = what_is(run.dataset);
    if (what == What::mesh) {
        run.scene = run.dataset;
    } else {
        if (what == What::nothing && core::is_folder(run.dataset)) refuse_runs(run.dataset);
        check_training_input(run.dataset);
        // The run's name is the last part of the path, which "photos/" and "." do not have.
        if (is_searched(what)) run.scene = (fs::absolute(run.dataset).lexically_normal() / "").parent_path();
    }
    if (!run.scene.empty()) arguments.made_of = what;
}

/// Renders a mesh scene into the run's folder, which becomes the dataset. Throws Interrupted if Ctrl-C ended that.
void render_scene(TrainArguments& arguments) {
    RunOptions& run = arguments.run;
    if (arguments.made_of != What::mesh) return;
    run.output = output_folder(run);
    run.dataset = run.output / folders::kMadeDataset;
    train::check_free(run.output, run);
    // Another training may be reading the images that are there.
    std::unique_ptr<core::FolderLock> lock;
    if (fs::is_directory(run.output)) lock = std::make_unique<core::FolderLock>(run.output);
    SyntheticOptions synthetic;
    synthetic.force = run.force;
    render_with_progress(run.device, run.scene, run.dataset, synthetic, arguments.output.quiet);
    if (interrupted()) throw Interrupted();
}

/// The number of frames to take from a video, as --frames names it.
int video_frames(const std::string& frames) {
    if (frames == "all") return CaptureOptions().frames;
    const auto count = core::parse_count<int>(frames);
    if (!count || *count < kFewestVideoFrames || *count > kMostVideoFrames)
        throw InputError(
            fmt::format("--frames: '{}' is not a number of frames to take from a video, {} to {}", frames,
                        kFewestVideoFrames, kMostVideoFrames));
    return *count;
}

/// Throws what needs no dataset to be known, before the long work that makes it.
void check_before_scene(const TrainArguments& arguments) {
    const RunOptions& options = arguments.run;
    if (arguments.made_of == What::nothing) return;
    train::check_without_dataset(options);
    if (arguments.made_of != What::mesh) {
        const bool searched = arguments.made_of != What::archive || !archive_has_cameras(options.scene);
        if (arguments.made_of == What::video)
            video_frames(options.frames);
        else if (options.frames != "all" && searched)
            refuse_frames(options.frames, options.scene);
        if (const ImageSize size = smallest_image(options.scene); size.width > 0) {
            train::check_downscale(options.downscale, options.downscale, size.width, size.height,
                                   "the smallest image");
            if (options.max_width > 0 && size.width > options.max_width * options.downscale)
                train::check_max_width(options.max_width, size.width, size.height, "the smallest image");
        }
    }
    check_serve(arguments.output.serve);
    open_device(options.device);
}

/// Makes a dataset of photos without cameras, or of a video, in the run's folder. Throws Interrupted if Ctrl-C ended
/// that. Returns the progress, which the training continues; null where the dataset has cameras.
std::unique_ptr<Progress> place_photos(TrainArguments& arguments) {
    RunOptions& run = arguments.run;
    if (!is_searched(arguments.made_of)) return nullptr;
    run.output = output_folder(run);
    run.dataset = run.output / folders::kMadeDataset;
    train::check_free(run.output, run);
    CaptureOptions capture{.level = run.level};
    if (arguments.made_of == What::video) {
        capture.frames = video_frames(run.frames);
        run.frames = "all";
    }
    auto progress = std::make_unique<Progress>("searched", 1, "photos", arguments.output.quiet);
    const CaptureProgressLine::After training = training_after(run);
    place_with_progress(
        run.scene, run.dataset, capture, *progress, training,
        arguments.quality.empty() ? advice_before(run, smallest_image(run.scene), training) : nullptr);
    return progress;
}

/// What the process of another rank than 0 does: it trains and says nothing.
int run_follower(const RunOptions& options) {
    const InterruptWatch watch;  // rank 0 ends all
    run_training(options);
    return 0;
}

int run(CLI::App& app, TrainArguments& arguments) {
    const auto begin = Clock::now();
    RunOptions& options = arguments.run;
    settle_dataset(options);
    note_scene(arguments);
    take_options_of_run(app, options, app.count("--steps") > 0 || !arguments.quality.empty());
    if (options.dataset.empty()) throw InputError("DATASET is required (see ewa train --help)");
    if (fs::is_directory(options.init)) options.init = splat_input(options.init).file.string();
    check_options(options);
    if (options.ranks->size() > 1 && arguments.made_of != What::nothing)
        throw InputError(
            options.scene.string() +
            ": several ranks train on a dataset; make it first, with ewa dataset or ewa cameras");
    check_before_scene(arguments);
    if (arguments.check_only) {
        train::check_free(output_folder(options), options);
        return 0;
    }
    train::share_machine(*options.ranks, options.device);
    if (options.ranks->rank() != 0) return run_follower(options);
    render_scene(arguments);
    std::unique_ptr<Progress> progress = place_photos(arguments);
    options.seconds_before = std::chrono::duration<double>(Clock::now() - begin).count();
    TrainObserver observer(arguments.output, options.train.steps, std::move(progress));
    const RunResult result = run_training(options, observer);
    observer.print(result);
    return result.summary.interrupted ? kInterruptedStatus : 0;
}

/// Under mpirun or srun this is one of several processes. If it fails, it ends all.
int run_rank(CLI::App& app, TrainArguments& arguments) {
    apply_config_and_quality(app, arguments);
    RunOptions& options = arguments.run;
    options.ranks = open_ranks(std::chrono::seconds(options.rank_timeout));
    if (options.ranks->size() == 1) return run(app, arguments);
    const std::string who = "ewa train: " + options.ranks->name(options.ranks->rank());
    const int status = status_of(who, [&] { return run(app, arguments); });
    if (status != kDone && status != kInterruptedStatus) options.ranks->end_all(status);
    return status;
}

}  // namespace

Action add_train(CLI::App& app, const std::string& command_line) {
    const auto arguments = std::make_shared<TrainArguments>();
    RunOptions& run = arguments->run;
    run.command = command_line;
    options::add(app, "output", run.output);
    for (const train::RunOption& option : train::run_options())
        if (option.name != "device")
            options::add(app, option.name == "dataset" ? "DATASET" : option.name, run);
    options::add(app, "quality", arguments->quality);
    options::add(app, "serve", arguments->output.serve);
    options::add(app, "resume", run.resume);
    options::add(app, "force", run.force);
    options::add(app, "config", arguments->config);
    add_device_options(app, run.device);
    // For ewa-view, which reports wrong options before its window opens.
    options::add(app, "check-options", arguments->check_only);
    options::add(app, "quiet", arguments->output.quiet);
    options::add(app, "verbose", arguments->output.verbose);
    return [&app, arguments] { return run_rank(app, *arguments); };
}

}  // namespace ewa::cli
