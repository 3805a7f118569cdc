// SPDX-License-Identifier: Apache-2.0
// ewa bench: time per pass, error against the CPU reference, and error against run time.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "bench/accuracy.h"
#include "bench/bench.h"
#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/output.h"
#include "cli/run_inputs.h"
#include "core/atomic_file.h"
#include "ewa/error.h"
#include "ewa/evaluation.h"
#include "ewa/splat_files.h"
#include "ewa/trainer.h"
#include "report/chart.h"
#include "scene/readout.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

constexpr uint32_t kMaxSplats = 40000;
constexpr int kEvaluations = 6;

struct BenchArguments {
    bench::Options options;
    bool accuracy = false;
    // Used only with --accuracy.
    fs::path splats, svg;  // splats empty: the result of the training. svg empty: not written
    int steps = 600;       // of each training; 0: no training
};

struct Trained {
    report::WorkSeries curve;
    Gaussians gaussians;
};

/// Trains with one strategy from the points of the dataset. Evaluates held-out views several times; that time
/// does not count.
Trained train(const std::shared_ptr<gpu::Device>& device, const Dataset& dataset, const Split& split,
              const std::string& name, Strategy strategy, int steps) {
    TrainOptions options;
    options.steps = steps;
    options.strategy = strategy;
    options.max_splats = kMaxSplats;
    options.sh_degree = kAutomaticShDegree;
    options = resolve(options, dataset, split.train);
    Gaussians start = gaussians_from_points(dataset.points, options.sh_degree);
    Trainer trainer(device, dataset, split.train, start, options);
    Trained result{{name, true, {}}, {}};
    const int every = std::max(1, steps / kEvaluations);
    Progress progress("trained with " + name, steps, "steps", false);
    while (trainer.steps_done() < steps) {
        const StepReport report = trainer.step();
        progress.update(report.step);
        if (report.step % every != 0 && report.step != steps) continue;
        result.gaussians = trainer.gaussians();
        const double psnr = evaluate(device, result.gaussians, dataset, split.test, options.render).psnr;
        result.curve.points.push_back({fmt::format("step {}", report.step), report.seconds, psnr, 0});
    }
    const report::WorkPoint& last = result.curve.points.back();
    progress.note(fmt::format("{:<24} {:<14} {:8.2f} s  {:.2f} dB held out, {} splats of SH degree {}",
                              "training", name, last.time, last.error, result.gaussians.size(),
                              result.gaussians.sh_degree));
    return result;
}

void print_tables(const report::WorkPrecision& diagram) {
    fmt::print(
        "\nTime: the median of a whole frame. RMS error, worst: over pixels and channels, against the exact "
        "image that "
        "the method's name ends with.\n"
        "  opacity: 3DGS's, the same from every side. density: a longer way through a splat absorbs more.\n"
        "on the front: nothing with the same exact image is faster and less wrong.\n\n"
        "{:<28} {:<12} {:>10}  {:>9} {:>9}  {}\n",
        "method", "effort", "ms", "RMS error", "worst", "verdict");
    for (const report::WorkSeries& series : diagram.series)
        for (const report::WorkPoint& p : series.points)
            fmt::print("{:<28} {:<12} {:>10.2f}  {:>9.2e} {:>9.2e}  {}\n", series.name, p.name, p.time,
                       p.error, p.worst, p.verdict);
    for (const report::WorkTable& table : diagram.tables) {
        fmt::print("\n{}. {}\n\n{:<44}", table.title, table.note, table.columns.front());
        for (size_t i = 1; i < table.columns.size(); ++i) fmt::print(" {:>22}", table.columns[i]);
        fmt::print("\n");
        for (const auto& [name, values] : table.rows) {
            fmt::print("{:<44}", name);
            for (const double value : values) fmt::print(" {:>22.2e}", value);
            fmt::print("\n");
        }
    }
}

report::WorkTable cause_table(const bench::AccuracyReference& reference) {
    report::WorkTable table{
        "Error of splatting by cause, exact image: " + reference.name,
        {"cause", "alone", "splatting without it"},
        {},
        "RMS error in float64. alone: the exact image with this approximation and no other"};
    for (const bench::Cause& cause : reference.causes)
        table.rows.emplace_back(cause.name, std::vector<double>{cause.alone, cause.without});
    table.rows.emplace_back("all: splatting", std::vector<double>{reference.splatting, reference.splatting});
    return table;
}

/// The file of the training diagram, beside that of rendering; empty: none.
fs::path training_svg(const BenchArguments& arguments) {
    if (arguments.svg.empty() || arguments.steps == 0) return {};
    return fs::path(arguments.svg).replace_filename(arguments.svg.stem().string() + "_training.svg");
}

void check_files(const BenchArguments& arguments) {
    const fs::path beside = training_svg(arguments);
    const fs::path& json = arguments.options.json;
    check_command_outputs(
        {{"--svg", arguments.svg}, {"--svg's diagram of training", beside}, {"--json", json}},
        {{"--splats", arguments.splats}});
}

/// Error against run time of rendering a scene through one camera. Prints progress.
report::WorkPrecision rendering_diagram(const std::shared_ptr<gpu::Device>& device,
                                        const Gaussians& gaussians, const Camera& camera) {
    if (!camera.distortion.none() || scene::moves(camera))
        throw InputError("--accuracy measures pinholes at rest only; take --lens undistort");
    const bench::Accuracy accuracy = bench::measure_accuracy(device, gaussians, camera, {});
    report::WorkPrecision diagram;
    diagram.title = "Rendering: error against run time";
    diagram.series = accuracy.series;
    diagram.notes.push_back(
        fmt::format("{} splats, {}x{}, on {}. The error is measured at {} pixels against the "
                    "emission-absorption integral of the splats as 3D Gaussians, computed in float64 along "
                    "each ray ({:.1f} s).",
                    gaussians.size(), camera.width, camera.height, device_info(*device).name, accuracy.pixels,
                    accuracy.exact_seconds));
    diagram.notes.push_back(
        fmt::format("Times are of whole frames on the device, with recording and waiting. The march on the "
                    "host is C++ in "
                    "float64 on {} threads; its time at those pixels is scaled to the whole image.",
                    accuracy.threads));
    diagram.notes.push_back(
        "opacity: exact with 3DGS's opacity, the same from every side. density: exact with a density fixed "
        "per splat, "
        "so that a longer way through it absorbs more.");
    for (const bench::AccuracyReference& reference : accuracy.references)
        diagram.tables.push_back(cause_table(reference));
    return diagram;
}

/// Error against run time of training and of rendering its result, or of rendering a given scene.
int run_accuracy(const BenchArguments& arguments) {
    const fs::path path = dataset_input(arguments.options.scene);
    if (path.empty()) throw InputError("--accuracy needs a DATASET: ewa bench --accuracy DATASET");
    if (arguments.splats.empty() && arguments.steps == 0)
        throw InputError("--accuracy: --training-steps 0 leaves no scene to render; name one with --splats");
    check_files(arguments);
    Gaussians given;
    if (!arguments.splats.empty()) given = load_splats(splat_input(arguments.splats).file);
    const DeviceOptions device_options{.selector = arguments.options.device};
    const Views views = load_views(
        {.splats = arguments.splats, .dataset = path, .draw = {}, .device = device_options}, "all", 0);
    const Dataset& dataset = views.dataset;
    const Split split = split_frames(dataset, 8);
    if (split.test.empty() || split.train.empty())
        throw InputError(path.string() + ": too few images to hold one out");
    const auto device = open_device(device_options);
    fmt::print("device: {}\n", device_info(*device).name);

    report::WorkPrecision training{
        "Training: held-out PSNR against run time", "seconds of training", "PSNR, dB", true, {}, {}};
    Gaussians gaussians;
    if (arguments.steps > 0 && dataset.points.positions.empty())
        throw InputError(path.string() + ": has no points to start the training from");
    const std::pair<const char*, Strategy> strategies[] = {
        {"none", Strategy::none}, {"mcmc", Strategy::mcmc}, {"adc", Strategy::adc}};
    for (const auto& [name, strategy] : strategies) {
        if (arguments.steps == 0) break;
        Trained trained = train(device, dataset, split, name, strategy, arguments.steps);
        training.series.push_back(std::move(trained.curve));
        gaussians = std::move(trained.gaussians);
    }
    training.notes.push_back(
        fmt::format("{} steps of each strategy, at most {} splats, on {}; evaluation does not count.",
                    arguments.steps, kMaxSplats, device_info(*device).name));
    if (!arguments.splats.empty()) gaussians = std::move(given);
    const report::WorkPrecision rendering =
        rendering_diagram(device, gaussians, dataset.frames[size_t(split.test.front())].camera);
    print_tables(rendering);
    if (!arguments.options.json.empty())
        write_json(arguments.options.json, {{"rendering", report::work_precision_json(rendering)},
                                            {"training", report::work_precision_json(training)}});
    if (!arguments.svg.empty()) {
        make_folder(arguments.svg.parent_path());
        core::write_text_file(arguments.svg, report::work_precision_svg(rendering));
        if (const fs::path beside = training_svg(arguments); !beside.empty())
            core::write_text_file(beside, report::work_precision_svg(training));
    }
    return 0;
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

Action add_bench(CLI::App& app) {
    const auto arguments = std::make_shared<BenchArguments>();
    bench::add_options(app, arguments->options);
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
    arguments->options.read_splats = [](const fs::path& path) { return load_splats(splat_input(path).file); };
    const CLI::Option* steps = app.get_option("--training-steps");
    return [&app, arguments, steps] {
        check_modes(app);
        if (!arguments->accuracy) {
            check_command_outputs({{"--json", arguments->options.json}}, {});
            return bench::run(arguments->options, {"/proc/self/exe", "bench"});
        }
        if (steps->count() > 0) arguments->steps = arguments->options.training_steps;
        return run_accuracy(*arguments);
    };
}

}  // namespace ewa::cli
