// SPDX-License-Identifier: Apache-2.0
// ewa eval: PSNR, SSIM and other metrics of a splat scene against the images of a dataset.
#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/depth_figures.h"
#include "cli/metric_arguments.h"
#include "cli/output.h"
#include "cli/run_inputs.h"
#include "core/text.h"
#include "ewa/evaluation.h"
#include "ewa/splat_files.h"
#include "platform/terminal.h"
#include "scene/dataset_files.h"

namespace ewa::cli {
namespace {

struct EvalArguments {
    ViewArguments views;
    MetricArguments metrics;
    std::filesystem::path json;
    std::string split = "test";
    AppearanceArguments appearance;
    std::optional<folders::Run> run;  // that of SPLATS, if its dataset is used
    int test_every = 8;
    bool depth = false;
};

report::Json to_json(const Evaluation& evaluation, const io::RefinedUse& refined,
                     const std::string& protocol) {
    report::Json frames = report::Json::array();
    for (const EvalFrame& frame : evaluation.frames) {
        frames.push_back({{"name", frame.name}, {"psnr", frame.psnr}, {"ssim", frame.ssim}});
        add_figures(frames.back(), frame.figures);
    }
    report::Json json{{"psnr", evaluation.psnr}, {"ssim", evaluation.ssim}};
    add_figures(json, evaluation.figures);
    json["frames"] = frames;
    json["seconds"] = evaluation.seconds;
    if (protocol != "ewa") json["protocol"] = protocol;
    if (refined.used) json["test_cameras_aligned"] = refined.aligned;
    return json;
}

std::string line_of(double psnr, double ssim, const std::vector<Figure>& figures) {
    const auto fitted = std::ranges::find(figures, kFittedMetric, &Figure::name);
    const std::string beside =
        fitted == figures.end() ? "" : fmt::format(" (colours fitted {:.3f} dB)", fitted->value);
    return fmt::format("PSNR {:.3f} dB{}  SSIM {:.5f}", psnr, beside, ssim);
}

void print_figures(const Evaluation& evaluation) {
    const auto others = [](std::vector<Figure> figures) {
        std::erase_if(figures, [](const Figure& figure) { return figure.name == kFittedMetric; });
        return figures;
    };
    std::vector<FigureRow> rows;
    for (const EvalFrame& frame : evaluation.frames) rows.push_back({frame.name, others(frame.figures)});
    rows.push_back({"mean", others(evaluation.figures)});
    fmt::print("{}", figure_table(rows));
}

int run(const CLI::App& app, const EvalArguments& arguments) {
    RenderOptions options = arguments.views.draw.options();
    check_typed_outputs(app);
    const Measures measures = arguments.metrics.measures();
    const Gaussians gaussians = arguments.views.draw.load(arguments.views.splats, options);
    const auto [dataset, refined, frames, folder] =
        load_views(arguments.views, arguments.split, arguments.test_every);
    check_typed_outputs(app, {}, scene::files_of(dataset, "DATASET"));
    const std::vector<Appearance> appearances =
        appearances_of(arguments.appearance, arguments.run, dataset, frames);

    if (arguments.depth) train::check_depth_evaluation(dataset, frames, options);

    // The lines of the frames follow: a file gets no others.
    Progress progress("evaluated", int(frames.size()) * (arguments.depth ? 2 : 1), "views",
                      !platform::redraws());
    int begun = 0;
    const auto before_frame = [&] { progress.update(begun++); };
    const auto device = open_device(arguments.views.device);
    const Evaluation evaluation =
        evaluate(device, gaussians, dataset, frames, options, appearances, before_frame, measures);
    std::optional<train::DepthEvaluation> depths;
    if (arguments.depth)
        depths = train::evaluate_depths(device, gaussians, dataset, frames, options, before_frame);
    progress.clear();
    for (const EvalFrame& frame : evaluation.frames)
        fmt::print("{}  {}\n", core::one_line(frame.name), line_of(frame.psnr, frame.ssim, frame.figures));
    if (dataset.missing_images > 0)
        fmt::print("{} missing and skipped\n", core::counted(uint64_t(dataset.missing_images), "image"));
    if (refined.used)
        fmt::print("cameras as the run refined them, those of test images {}aligned to these\n",
                   refined.aligned ? "" : "not ");
    if (evaluation.frames.empty())
        fmt::print("no figures: every pixel of {} ({}) is masked\n", core::counted(frames.size(), "frame"),
                   arguments.split);
    else
        fmt::print("mean of {} ({})  {}  in {:.2f} s\n", core::counted(evaluation.frames.size(), "frame"),
                   arguments.split, line_of(evaluation.psnr, evaluation.ssim, evaluation.figures),
                   evaluation.seconds);
    print_figures(evaluation);
    if (depths) fmt::print("{}", depth_table(*depths));
    if (!arguments.json.empty()) {
        report::Json json = to_json(evaluation, refined, arguments.metrics.protocol);
        if (depths) add_depths(json, *depths);
        write_json(arguments.json, json);
    }
    return 0;
}

}  // namespace

Action add_eval(CLI::App& app) {
    const auto arguments = std::make_shared<EvalArguments>();
    add_view_positionals(app, arguments->views);
    options::add(app, "split", arguments->split);
    options::add(app, "test-every", arguments->test_every);
    add_appearance_options(app, arguments->appearance);
    arguments->metrics.fitted = true;
    options::add(app, "metrics", arguments->metrics.metrics);
    options::add(app, "protocol", arguments->metrics.protocol);
    options::add(app, "depth", arguments->depth);
    options::add(app, "json", arguments->json);
    add_view_options(app, arguments->views);
    return [&app, arguments] {
        arguments->run = resolve_views(app, arguments->views);
        arguments->appearance.run = folders::run_of_splats(arguments->views.splats);
        return run(app, *arguments);
    };
}

}  // namespace ewa::cli
