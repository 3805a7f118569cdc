// SPDX-License-Identifier: Apache-2.0
// ewa eval: PSNR and SSIM of a splat scene against the images of a dataset.
#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <memory>
#include <optional>

#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/output.h"
#include "cli/run_inputs.h"
#include "core/text.h"
#include "ewa/evaluation.h"
#include "ewa/splat_files.h"
#include "scene/dataset_files.h"

namespace ewa::cli {
namespace {

struct EvalArguments {
    ViewArguments views;
    std::filesystem::path json;
    std::string split = "test", exposures = "auto";
    std::optional<live::Run> run;  // that of SPLATS, if its dataset is used
    int test_every = 8;
};

report::Json to_json(const Evaluation& evaluation, const io::RefinedUse& refined) {
    report::Json frames = report::Json::array();
    for (const EvalFrame& frame : evaluation.frames)
        frames.push_back({{"name", frame.name}, {"psnr", frame.psnr}, {"ssim", frame.ssim}});
    report::Json json{{"psnr", evaluation.psnr},
                      {"ssim", evaluation.ssim},
                      {"frames", frames},
                      {"seconds", evaluation.seconds}};
    if (refined.used) json["test_cameras_aligned"] = refined.aligned;
    return json;
}

int run(const EvalArguments& arguments) {
    RenderOptions options = arguments.views.draw.options();
    const std::vector<NamedFile> written{{"--json", arguments.json}};
    check_command_outputs(written,
                          {{"SPLATS", arguments.views.splats}, {"DATASET", arguments.views.dataset}});
    const Gaussians gaussians = arguments.views.draw.load(arguments.views.splats, options);
    const auto [dataset, refined, frames, folder] =
        load_views(arguments.views, arguments.split, arguments.test_every);
    check_command_outputs(written, scene::files_of(dataset, "DATASET"));
    const std::vector<Exposure> exposures = exposures_of(arguments.exposures, arguments.run, dataset, frames);

    // The lines of the frames follow: a file gets no others.
    Progress progress("evaluated", int(frames.size()), "views", !core::redraws());
    int begun = 0;
    const Evaluation evaluation = evaluate(open_device(arguments.views.device), gaussians, dataset, frames,
                                           options, exposures, [&] { progress.update(begun++); });
    progress.clear();
    for (const EvalFrame& frame : evaluation.frames)
        fmt::print("{}  PSNR {:.3f} dB  SSIM {:.5f}\n", core::one_line(frame.name), frame.psnr, frame.ssim);
    if (dataset.missing_images > 0)
        fmt::print("{} missing and skipped\n", core::counted(uint64_t(dataset.missing_images), "image"));
    if (refined.used)
        fmt::print("cameras as the run refined them, those of test images {}aligned to these\n",
                   refined.aligned ? "" : "not ");
    fmt::print("mean of {} ({})  PSNR {:.3f} dB  SSIM {:.5f}  in {:.2f} s\n",
               core::counted(evaluation.frames.size(), "frame"), arguments.split, evaluation.psnr,
               evaluation.ssim, evaluation.seconds);
    if (!arguments.json.empty()) write_json(arguments.json, to_json(evaluation, refined));
    return 0;
}

}  // namespace

Action add_eval(CLI::App& app) {
    const auto arguments = std::make_shared<EvalArguments>();
    add_view_positionals(app, arguments->views);
    app.add_option("--split", arguments->split, "Frames to evaluate: test, train or all")
        ->transform(one_of({"test", "train", "all"}))
        ->capture_default_str();
    add_test_every_option(app, arguments->test_every);
    add_exposures_option(app, arguments->exposures);
    app.add_option("--json", arguments->json, "Write the results to this file")->type_name("FILE");
    add_view_options(app, arguments->views);
    return [&app, arguments] {
        arguments->run = resolve_views(app, arguments->views);
        return run(*arguments);
    };
}

}  // namespace ewa::cli
