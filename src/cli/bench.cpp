// SPDX-License-Identifier: Apache-2.0
// ewa bench: starts ewa-bench, reads splats for it, and measures held-out PSNR against the run time of training.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "cli/run_inputs.h"
#include "cli/status.h"
#include "core/atomic_file.h"
#include "core/bench_options.h"
#include "core/json_field.h"
#include "core/process.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/evaluation.h"
#include "ewa/splat_files.h"
#include "ewa/trainer.h"
#include "options/option.h"
#include "report/chart.h"
#include "scene/readout.h"
#include "scene/scene_file.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

constexpr uint32_t kMaxSplats = 40000;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr int kEvaluations = 6;

struct BenchArguments {
    core::BenchOptions options;
    fs::path file;  // of splats, or with --accuracy a dataset; empty: none
    bool accuracy = false;
    // Used only with --accuracy.
    fs::path splats, svg;  // splats empty: the result of the training. svg empty: not written
    int steps = 600;       // of each training; 0: no training
};

/// What ewa-bench gets of these arguments: all but the file. It has the same options.
std::vector<std::string> options_given(const CLI::App& app) {
    std::vector<std::string> words;
    for (const CLI::Option* option : app.get_options())
        if (option->count() > 0 && !option->get_positional())
            words.push_back("--" + option->get_lnames().front() + "=" + option->results().front());
    return words;
}

/// The program beside this one. Throws RunError if it is not there.
fs::path ewa_bench() {
    const fs::path own = core::own_program();
    fs::path program = own.parent_path() / "ewa-bench";
    if (own.extension() == ".exe") program += ".exe";
    if (!core::is_file(program))
        throw RunError(program.string() + ": is missing; install it there, or make it with scripts/build");
    return program;
}

/// Returns its exit status.
int run_ewa_bench(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), ewa_bench().string());
    return run_in_front(arguments);
}

/// Reads the splats of --stability into a scene file of the same name. Returns the exit status.
int run_stability(const BenchArguments& arguments, std::vector<std::string> words) {
    const fs::path file = splat_input(arguments.file).file;
    Gaussians gaussians = load_splats(file);
    if (gaussians.size() == 0) throw InputError(arguments.file.string() + ": has no splats");
    fs::path name = arguments.file.filename();
    if (name.empty() || name == "." || name == "..") name = file.filename();
    const core::TemporaryFolder folder("ewa-bench-");
    scene::write_scene_file(folder.path() / name, {std::move(gaussians), {}});
    words.push_back((folder.path() / name).string());
    return run_ewa_bench(std::move(words));
}

/// Trains with one strategy from the points of the dataset. Evaluates held-out views several times; that time
/// does not count. gaussians: becomes the result.
report::WorkSeries train(const std::shared_ptr<gpu::Device>& device, const Dataset& dataset,
                         const Split& split, const std::string& name, Strategy strategy, int steps,
                         Gaussians& gaussians) {
    TrainOptions options;
    options.steps = steps;
    options.strategy = strategy;
    options.max_splats = kMaxSplats;
    options.sh_degree = kAutomaticShDegree;
    options = resolve(options, dataset, split.train);
    Gaussians start = gaussians_from_points(dataset.points, options.sh_degree);
    Trainer trainer(device, dataset, split.train, start, options);
    report::WorkSeries curve{name, true, {}};
    const int every = std::max(1, steps / kEvaluations);
    Progress progress("trained with " + name, steps, "steps", false);
    while (trainer.steps_done() < steps) {
        const StepReport report = trainer.step();
        progress.update(report.step);
        if (report.step % every != 0 && report.step != steps) continue;
        gaussians = trainer.gaussians();
        const double psnr = evaluate(device, gaussians, dataset, split.test, options.render).psnr;
        curve.points.push_back({fmt::format("step {}", report.step), report.seconds, psnr, 0});
    }
    const report::WorkPoint& last = curve.points.back();
    progress.note(fmt::format("{:<24} {:<14} {:8.2f} s  {:.2f} dB held out, {} splats of SH degree {}",
                              "training", name, last.time, last.error, gaussians.size(),
                              gaussians.sh_degree));
    return curve;
}

/// Held-out PSNR against run time of training with each strategy. gaussians: becomes the result of the last.
report::WorkPrecision training_diagram(const std::shared_ptr<gpu::Device>& device, const Dataset& dataset,
                                       const Split& split, int steps, Gaussians& gaussians) {
    report::WorkPrecision diagram{
        "Training: held-out PSNR against run time", "seconds of training", "PSNR, dB", true, {}, {}};
    const std::pair<const char*, Strategy> strategies[] = {
        {"none", Strategy::none}, {"mcmc", Strategy::mcmc}, {"adc", Strategy::adc}};
    for (const auto& [name, strategy] : strategies) {
        if (steps == 0) break;
        diagram.series.push_back(train(device, dataset, split, name, strategy, steps, gaussians));
    }
    diagram.notes.push_back(
        fmt::format("{} steps of each strategy, at most {} splats, on {}; evaluation does not count.", steps,
                    kMaxSplats, device_info(*device).name));
    return diagram;
}

/// The diagram of what ewa-bench has measured. measured: its JSON.
report::WorkPrecision rendering_diagram(const report::Json& measured) {
    const report::Json& rendering = measured.at("rendering");
    report::WorkPrecision diagram;
    diagram.title = rendering.at("title");
    for (size_t i = 0; i < rendering.at("series").size(); ++i) {
        const report::Json &series = rendering.at("series")[i], &style = measured.at("styles").at(i);
        report::WorkSeries one{series.at("name"), true, {}, style.at("dashed"), style.at("hue")};
        for (const report::Json& point : series.at("points"))
            one.points.push_back({point.at("name"), core::number_in(point, "time").value_or(kUnknown),
                                  core::number_in(point, "error").value_or(kUnknown)});
        diagram.series.push_back(std::move(one));
    }
    return diagram;
}

/// The file of the training diagram, beside that of rendering; empty: none.
fs::path training_svg(const BenchArguments& arguments) {
    if (arguments.svg.empty() || arguments.steps == 0) return {};
    return fs::path(arguments.svg).replace_filename(arguments.svg.stem().string() + "_training.svg");
}

void write_diagrams(const BenchArguments& arguments, const report::Json& measured,
                    const report::WorkPrecision& training) {
    if (!arguments.options.json.empty())
        write_json(arguments.options.json, {{"rendering", measured.at("rendering")},
                                            {"training", report::work_precision_json(training)}});
    if (arguments.svg.empty()) return;
    make_folder(arguments.svg.parent_path());
    core::write_text_file(arguments.svg, report::work_precision_svg(rendering_diagram(measured)));
    if (const fs::path beside = training_svg(arguments); !beside.empty())
        core::write_text_file(beside, report::work_precision_svg(training));
}

/// Error against run time of training, and of rendering its result or a given scene. Returns the exit status.
int run_accuracy(const BenchArguments& arguments) {
    const fs::path path = dataset_input(arguments.file);
    if (path.empty()) throw InputError("--accuracy needs a DATASET: ewa bench --accuracy DATASET");
    if (arguments.splats.empty() && arguments.steps == 0)
        throw InputError("--accuracy: --training-steps 0 leaves no scene to render; name one with --splats");
    check_command_outputs({{"--svg", arguments.svg},
                           {"--svg's diagram of training", training_svg(arguments)},
                           {"--json", arguments.options.json}},
                          {{"--splats", arguments.splats}});
    ewa_bench();  // fails before the training if it is missing
    scene::SceneFile scene;
    if (!arguments.splats.empty()) scene.gaussians = load_splats(splat_input(arguments.splats).file);
    const DeviceOptions device_options{.selector = arguments.options.device};
    report::WorkPrecision training;
    {
        const Views views = load_views(
            {.splats = arguments.splats, .dataset = path, .draw = {}, .device = device_options}, "all", 0);
        const Dataset& dataset = views.dataset;
        const Split split = split_frames(dataset, 8);
        if (split.test.empty() || split.train.empty())
            throw InputError(path.string() + ": too few images to hold one out");
        if (arguments.steps > 0 && dataset.points.positions.empty())
            throw InputError(path.string() + ": has no points to start the training from");
        scene.camera = dataset.frames[size_t(split.test.front())].camera;
        if (!scene.camera.distortion.none() || scene::moves(scene.camera))
            throw InputError("--accuracy measures pinholes at rest only; take --lens undistort");
        const auto device = open_device(device_options);
        fmt::print("device: {}\n", device_info(*device).name);
        Gaussians trained;
        training = training_diagram(device, dataset, split, arguments.steps, trained);
        if (arguments.splats.empty()) scene.gaussians = std::move(trained);
    }
    const core::TemporaryFolder folder("ewa-bench-");
    const fs::path file = folder.path() / "scene", results = folder.path() / "rendering.json";
    scene::write_scene_file(file, scene);
    std::vector<std::string> words{"--accuracy", "--json=" + results.string(), file.string()};
    if (!arguments.options.device.empty()) words.push_back("--device=" + arguments.options.device);
    const int status = run_ewa_bench(std::move(words));
    if (status == kDone) write_diagrams(arguments, core::read_json_file<report::Json>(results), training);
    return status;
}

/// Refuses options that the chosen mode would not use.
void check_modes(const CLI::App& app) {
    const bool accuracy = app.count("--accuracy") > 0;
    if (!accuracy && app.count("--svg") > 0) throw InputError("--svg is an option of --accuracy");
    if (!accuracy && app.count("--splats") > 0) throw InputError("--splats is an option of --accuracy");
    for (const char* name :
         {"--stability", "--list", "--large", "--cases", "--check", "--compare", "--results", "--runs"})
        if (accuracy && app.count(name) > 0)
            throw InputError(std::string(name) + " and --accuracy exclude each other");
}

}  // namespace

namespace {

void group_options(CLI::App& app) {
    for (const char* name : {"--cases", "--list", "--large", "--splats"})
        app.get_option(name)->group(options::kData);
    for (const char* name : {"--runs", "--training-steps", "--stability"})
        app.get_option(name)->group(options::kQuality);
    for (const char* name : {"--json", "--svg", "--accuracy", "--check", "--compare", "--results"})
        app.get_option(name)->group(options::kOutput);
    for (const char* name : {"--device", "--kernels"}) app.get_option(name)->group(options::kDevice);
}

}  // namespace

Action add_bench(CLI::App& app) {
    const auto arguments = std::make_shared<BenchArguments>();
    core::add_bench_options<CLI::Validator>(app, arguments->options);
    app.add_option("FILE", arguments->file,
                   "With --stability: use this splat file instead of the built-in scenes")
        ->type_name("");
    app.add_flag("--accuracy", arguments->accuracy,
                 "Error against run time on the dataset FILE: of rendering, against the integral along each "
                 "ray, and of training with each strategy for --training-steps (600). It takes minutes");
    app.add_option("--splats", arguments->splats,
                   "With --accuracy: render this scene instead of the trained one")
        ->type_name("FILE");
    app.add_option("--svg", arguments->svg,
                   "With --accuracy: write the diagram of rendering to FILE, and that of training to "
                   "NAME_training.svg beside it")
        ->type_name("FILE");
    group_options(app);
    return [&app, arguments] {
        check_modes(app);
        const core::BenchOptions& options = arguments->options;
        if (arguments->accuracy) {
            if (app.count("--training-steps") > 0) arguments->steps = options.training_steps;
            return run_accuracy(*arguments);
        }
        const fs::path& file = arguments->file;
        check_command_outputs(
            {{"--json", options.json}},
            {{"--compare", options.compare}, {"--results", options.results}, {"FILE", file}});
        std::vector<std::string> words = options_given(app);
        if (options.stability && !options.list && !file.empty())
            return run_stability(*arguments, std::move(words));
        if (!file.empty()) words.push_back(file.string());
        return run_ewa_bench(std::move(words));
    };
}

}  // namespace ewa::cli
