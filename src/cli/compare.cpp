// SPDX-License-Identifier: Apache-2.0
// ewa compare: the difference of two images, or of two folders of images with the same names. A splat scene
// on either side is rendered through the cameras of a dataset. Also two meshes.
#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "cli/command.h"
#include "cli/compare_inputs.h"
#include "cli/compare_meshes.h"
#include "cli/comparison.h"
#include "cli/metric_arguments.h"
#include "cli/output.h"
#include "cli/run_inputs.h"
#include "cli/splat_statistics.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/image.h"
#include "io/datasets/dataset_folders.h"
#include "io/datasets/image_records.h"
#include "io/meshes/mesh_files.h"
#include "report/pictures.h"
#include "scene/dataset_files.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;
using report::Json;

constexpr int kTooFarApart = 1;

struct CompareArguments {
    CompareInputs inputs;
    MetricArguments metrics;
    fs::path json, heat_map;
    // The limits that each pair must meet; empty: none.
    std::optional<double> threshold;  // dB: the least PSNR
    std::optional<double> max_error;  // the largest difference of two values, alpha included
    double heat_scale = 0.25;
    std::optional<double> distance;  // meshes alone have it
};

/// Fills `failed` and `reasons`. NaN exceeds every limit. PSNR is of RGB clamped to [0, 1], as everywhere. The
/// threshold also limits the RMS error over all values, so that alpha and values above white count too.
void judge(Compared& pair, const CompareArguments& arguments) {
    constexpr double kRounding = 1 + 1e-9;  // the same figure, computed in two ways
    const ImageDifference& d = pair.difference;
    if (arguments.threshold) {
        const double threshold = *arguments.threshold;
        const double most = std::pow(10.0, -threshold / 20);  // the RMS error that has this PSNR
        const bool over = !(d.rms_error <= most * kRounding);
        if (!(d.psnr >= threshold)) {
            pair.failed.emplace_back("psnr");
            pair.reasons = fmt::format("  under {:g} dB", threshold);
        } else if (over) {
            pair.reasons = fmt::format(
                "  under {:g} dB (RMS over {:.3g}) with alpha and values outside [0, 1]", threshold, most);
        }
        if (over) pair.failed.emplace_back("rms");
    }
    if (arguments.max_error && !(d.max_error <= *arguments.max_error)) {
        pair.failed.emplace_back("max_error");
        pair.reasons += fmt::format("  max error over {:g}", *arguments.max_error);
    }
}

/// "identical" and "nan" tell which PSNR a null is.
Json to_json(const Compared& one) {
    const ImageDifference& d = one.difference;
    Json json{{"name", one.name},
              {"psnr", finite_number(d.psnr)},
              {"ssim", finite_number(d.ssim)},
              {"max_error", finite_number(d.max_error)},
              {"max_error_at", {d.max_x, d.max_y}},
              {"mean_error", finite_number(d.mean_error)},
              {"rms", finite_number(d.rms_error)},
              {"identical", d.max_error == 0},
              {"nan", std::isnan(d.psnr)},
              {"passed", one.failed.empty()},
              {"failed", one.failed}};
    add_figures(json, one.figures);
    return json;
}

void print(const Compared& one) {
    const ImageDifference& d = one.difference;
    fmt::print("{}{}PSNR {:.3f} dB  SSIM {:.5f}  RMS {:.6g}  max error {:.6g}{}{}\n",
               core::one_line(one.name), one.name.empty() ? "" : "  ", d.psnr, d.ssim, d.rms_error,
               d.max_error, d.max_error > 0 ? fmt::format(" at {},{}", d.max_x, d.max_y) : "", one.reasons);
    std::fflush(stdout);
}

/// The file of the pair's heat map; empty: none.
fs::path heat_map_file(const ImagePair& pair, const CompareArguments& arguments) {
    if (arguments.heat_map.empty() || pair.name.empty()) return arguments.heat_map;
    return arguments.heat_map / (pair.name + ".png");
}

/// Throws if an output is also an input, or cannot be written.
void check_files(const CLI::App& app, const CompareArguments& arguments, const Sides& sides,
                 const ImagePairs& pairs) {
    const bool maps = !arguments.heat_map.empty() && !pairs.pairs.empty() && !pairs.pairs[0].name.empty();
    if (maps) io::check_output_folder("--heat-map", arguments.heat_map, sides.cameras);
    std::vector<NamedFile> written, read = scene::files_of(sides.cameras, "--cameras");
    for (const ImagePair& pair : pairs.pairs) {
        written.push_back({"--heat-map", heat_map_file(pair, arguments)});
        if (!sides.a->is_scene) read.push_back({"an image of A", sides.a->place(pair.a)});
        if (!sides.b->is_scene) read.push_back({"an image of B", sides.b->place(pair.b)});
    }
    check_typed_outputs(app, written, read);
}

Compared compare(const ImagePair& pair, const Sides& sides, const CompareArguments& arguments,
                 const Meter& meter) {
    ComparedImage a = sides.a->picture(pair.a), b = sides.b->picture(pair.b);
    const bool drawn_a = sides.a->is_scene, drawn_b = sides.b->is_scene;
    if (drawn_a && !drawn_b) match_format(a, b, sides.options.background);
    if (drawn_b && !drawn_a) match_format(b, a, sides.options.background);
    Compared out;
    try {
        out = compared(pair.name, a.image, b.image, meter);
    } catch (const InputError& error) {
        throw InputError(sides.a->place(pair.a) + " and " + sides.b->place(pair.b) + ": " + error.what() +
                         (drawn_a || drawn_b ? "; scenes are rendered through undistorted cameras, at "
                                               "--downscale (ewa eval compares with the dataset's images)"
                                             : ""));
    }
    judge(out, arguments);
    if (const fs::path file = heat_map_file(pair, arguments); !file.empty()) {
        make_folder(file.parent_path());
        save_image(file, report::value_error_map(a.image, b.image, arguments.heat_scale));
    }
    return out;
}

void print(const CompareTotals& totals, size_t pictures) {
    if (pictures > 1)
        fmt::print(
            "mean of {} images  PSNR {:.3f} dB  SSIM {:.5f}; largest RMS {:.6g}, max error {:.6g}; "
            "worst: {}\n",
            pictures, totals.psnr, totals.ssim, totals.rms, totals.max_error,
            core::one_line(totals.worst->name));
}

void print_all_figures(const std::vector<Compared>& all, const CompareTotals& totals) {
    std::vector<FigureRow> rows;
    for (const Compared& one : all) rows.push_back({one.name, one.figures});
    if (rows.size() > 1) rows.push_back({"mean", totals.figures});
    fmt::print("{}", figure_table(rows));
}

/// One line: a folder of all images is often compared with renders of a few. --json names them all.
void print_unpaired(const ComparedSide& side, const std::vector<fs::path>& names) {
    if (names.empty()) return;
    const std::string first = core::one_line(side.place(names.front()));
    if (names.size() == 1)
        fmt::print("{}  has no image of this name on the other side\n", first);
    else
        fmt::print("{} images have no image of their name on the other side; the first is {}\n", names.size(),
                   first);
}

int run(const CLI::App& app, const CompareArguments& arguments) {
    const Sides sides = open_sides(arguments.inputs);
    const ImagePairs pairs = pair_images(*sides.a, *sides.b);
    check_files(app, arguments, sides, pairs);
    const Meter meter = arguments.metrics.measures().meter;
    std::vector<Compared> all;
    for (const ImagePair& pair : pairs.pairs) {
        all.push_back(compare(pair, sides, arguments, meter));
        print(all.back());
    }
    std::vector<std::string> unpaired;
    for (const fs::path& name : pairs.only_a) unpaired.push_back(sides.a->place(name));
    for (const fs::path& name : pairs.only_b) unpaired.push_back(sides.b->place(name));

    const CompareTotals totals = totals_of(all);
    print(totals, all.size());
    print_all_figures(all, totals);
    print_unpaired(*sides.a, pairs.only_a);
    print_unpaired(*sides.b, pairs.only_b);
    for (const ComparedSide* side : {sides.a.get(), sides.b.get()})
        if (side->skipped_splats > 0)
            fmt::print("{}: {}\n", core::one_line(side->side),
                       skipped_text(side->skipped_splats, side->undrawable));
    // A missing image is the largest difference of all.
    const bool judged = arguments.threshold || arguments.max_error;
    const bool passed = !judged || (totals.passed && unpaired.empty());
    if (!arguments.json.empty()) {
        Json json = {{"psnr", finite_number(totals.psnr)},
                     {"ssim", finite_number(totals.ssim)},
                     {"max_error", finite_number(totals.max_error)},
                     {"rms", finite_number(totals.rms)},
                     {"identical", totals.max_error == 0},
                     {"nan", std::isnan(totals.psnr)},
                     {"worst", to_json(*totals.worst)},
                     {"passed", passed},
                     {"pictures", Json::array()},
                     {"unpaired", unpaired},
                     {"skipped_nonfinite", {sides.a->skipped_splats, sides.b->skipped_splats}}};
        add_figures(json, totals.figures);
        if (arguments.threshold) json["threshold"] = *arguments.threshold;
        if (arguments.max_error) json["max_error_allowed"] = *arguments.max_error;
        for (const Compared& one : all) json["pictures"].push_back(to_json(one));
        write_json(arguments.json, json);
    }
    return passed ? 0 : kTooFarApart;
}

bool is_scan(const fs::path& path) {
    return fs::is_regular_file(path) && io::is_point_cloud(path);
}

/// Whether both sides are meshes. Throws InputError where one side is, or another option than theirs is given.
bool compares_meshes(const CLI::App& app, const CompareArguments& arguments) {
    const bool a = io::is_mesh(arguments.inputs.a);
    const bool b = io::is_mesh(arguments.inputs.b) || (a && is_scan(arguments.inputs.b));
    if (a != b)
        throw InputError(core::one_line((a ? arguments.inputs.a : arguments.inputs.b).string()) +
                         " is a mesh, and the other side is none");
    if (!a) {
        if (arguments.distance) throw InputError("--distance is for two meshes (.gltf, .glb, .ply, .obj)");
        return false;
    }
    for (const CLI::Option* option : app.get_options())
        if (option->count() > 0 && !option->get_lnames().empty() && option->get_lnames()[0] != "json" &&
            option->get_lnames()[0] != "distance")
            throw InputError("--" + option->get_lnames()[0] +
                             " is for images; meshes have --distance and --json");
    return true;
}

}  // namespace

Action add_compare(CLI::App& app) {
    const auto arguments = std::make_shared<CompareArguments>();
    CompareInputs& inputs = arguments->inputs;
    options::add(app, "A", inputs.a);
    options::add(app, "B", inputs.b);
    options::add(app, "threshold", arguments->threshold);
    options::add(app, "max-error", arguments->max_error);
    options::add(app, "metrics", arguments->metrics.metrics);
    options::add(app, "json", arguments->json);
    options::add(app, "heat-map", arguments->heat_map);
    options::add(app, "distance", arguments->distance);
    options::add(app, "heat-scale", arguments->heat_scale);
    options::add(app, "cameras", inputs.cameras);
    options::add(app, "frames", inputs.frames);
    options::add(app, "test-every", inputs.test_every);
    add_draw_options(app, inputs.draw);
    for (const char* name : {"downscale", "max-width", "lens"}) options::add(app, name, inputs.run);
    add_device_options(app, inputs.device);
    return [&app, arguments, &inputs] {
        if (compares_meshes(app, *arguments)) {
            check_typed_outputs(app);
            compare_meshes({inputs.a, inputs.b, arguments->json, arguments->distance});
            return 0;
        }
        if (!inputs.cameras.empty()) inputs.cameras = dataset_input(inputs.cameras);
        resolve_runs(app, inputs);
        return run(app, *arguments);
    };
}

}  // namespace ewa::cli
