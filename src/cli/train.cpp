// SPDX-License-Identifier: Apache-2.0
// ewa train: its options.
#include <CLI/CLI.hpp>
#include <memory>

#include "cli/checks.h"
#include "cli/command.h"
#include "cli/config.h"
#include "cli/train_run.h"
#include "ewa/error.h"

namespace ewa::cli {
namespace {

struct CommandState {
    TrainArguments arguments;
    std::filesystem::path config;
};

constexpr int kMaxSteps = 1000000000;

void add_model_options(CLI::App& app, TrainArguments& arguments) {
    app.add_option("--steps", arguments.steps, "Optimisation steps, one view each")
        ->check(in_range(1, kMaxSteps))
        ->type_name("N")
        ->capture_default_str();
    app.add_option("--strategy", arguments.strategy,
                   "adc grows and prunes splats (3DGS); mcmc relocates dead ones and grows to the cap "
                   "(3DGS-MCMC); none keeps their number; auto is mcmc from 5000 steps on, else adc")
        ->check(CLI::IsMember({"auto", "adc", "mcmc", "none"}))
        ->capture_default_str();
    app.add_option("--max-splats", arguments.max_splats, "Never more splats than this")
        ->check(without_sign())
        ->check(in_range(1u, 1000000000u))
        ->type_name("N")
        ->capture_default_str();
    app.add_option(
           "--init", arguments.init,
           "sfm (the dataset's points; random where it has none), random (where the cameras look), or a "
           "splat file to go on from")
        ->type_name("sfm|random|FILE")
        ->capture_default_str();
    app.add_flag("--absgrad", arguments.absgrad,
                 "adc: grow where the pixels' absolute gradients are large, which do not cancel (AbsGS)");
    app.add_flag("--revised-opacity", arguments.revised_opacity,
                 "adc: the two halves of a split are together as opaque as it was");
    app.add_flag(
        "--exposure", arguments.exposure,
        "Learn each photograph's exposure (an affine map of colours), for captures where it changes");
    app.add_option("--resolution-schedule", arguments.resolution_schedule,
                   "Start with the photographs' sides halved N times; each tenth of the run doubles them")
        ->check(in_range(0, 6))
        ->type_name("N")
        ->capture_default_str();
    app.add_option("--seed", arguments.seed, "Same seed, same device: same bytes")
        ->check(without_sign())
        ->type_name("S")
        ->capture_default_str();
    app.add_option("--image-cache", arguments.image_cache,
                   "MiB of decoded photographs held on the device; the others are read again each time")
        ->check(without_sign())
        ->check(in_range(uint64_t(0), uint64_t(1) << 40))
        ->type_name("MiB")
        ->capture_default_str();
    arguments.draw.random_allowed = arguments.draw.degree_by_dataset = true;
    add_draw_options(app, arguments.draw);
    add_downscale_option(app, arguments.downscale);
    add_masks_option(app, arguments.masks);
    add_test_every_option(app, arguments.test_every);
}

int run(CLI::App& app, CommandState& state) {
    TrainArguments& arguments = state.arguments;
    if (!state.config.empty()) apply_config(app, state.config);
    if (arguments.dataset.empty()) throw InputError("DATASET is required (see ewa train --help)");
    return run_train(arguments);
}

}  // namespace

Action add_train(CLI::App& app, const std::string& command_line) {
    const auto state = std::make_shared<CommandState>();
    TrainArguments& arguments = state->arguments;
    arguments.command_line = command_line;
    app.add_option("DATASET", arguments.dataset,
                   "Images with cameras: COLMAP folder or transforms.json; or a glTF with meshes, which is "
                   "photographed into DIR/dataset first")
        ->type_name("");
    app.add_option(
           "-o,--output", arguments.output,
           "Folder for splats.ply, summary.json, metrics.jsonl, report.html, config.json and checkpoint.ewa "
           "[out/<name of the dataset>]")
        ->type_name("DIR");
    add_model_options(app, arguments);
    app.add_option("--eval-every", arguments.eval_every,
                   "Evaluate the held-out views every N steps; 0: only at the end")
        ->check(in_range(0, kMaxSteps))
        ->type_name("N")
        ->capture_default_str();
    app.add_option(
           "--save-every", arguments.save_every,
           "Save splats.ply and checkpoint.ewa every N steps; 0: the checkpoint every 30 seconds or more")
        ->check(in_range(0, kMaxSteps))
        ->type_name("N")
        ->capture_default_str();
    app.add_flag("--accuracy", arguments.accuracy,
                 "At the end, draw error against run time for the report, as ewa bench --accuracy does");
    app.add_option("--serve", arguments.serve,
                   "Let ewa-view look on by this port (0: any free one), of this machine alone unless an "
                   "address stands "
                   "before it; DIR/live.json has the token that pausing and saving need")
        ->type_name("[ADDRESS:]PORT");
    app.add_flag("--resume", arguments.resume,
                 "Go on from DIR's checkpoint.ewa, or start where there is none");
    app.add_option("--config", state->config,
                   "JSON with the names of these options, such as a run's config.json; the command line wins")
        ->type_name("FILE");
    add_device_options(app, arguments.device);
    const auto quiet = app.add_flag("--quiet", arguments.quiet, "Print nothing but errors");
    app.add_flag("--verbose", arguments.verbose, "Print the plan: what this scene does not need")
        ->excludes(quiet);
    return [&app, state] { return run(app, *state); };
}

}  // namespace ewa::cli
