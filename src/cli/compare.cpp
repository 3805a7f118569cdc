// SPDX-License-Identifier: Apache-2.0
// ewa compare: the difference of two images, or of two folders of images with the same names. A splat scene
// on either side is rendered through the cameras of a dataset.
#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/compare_figures.h"
#include "cli/compare_inputs.h"
#include "cli/dataset_argument.h"
#include "cli/output.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/image.h"
#include "report/pictures.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kTooFarApart = 1;

struct CompareArguments {
    fs::path a, b, json, heat_map;
    CompareLimits limits;
    double heat_scale = 0.25;

    // How splat scenes are rendered.
    fs::path cameras;
    std::string frames = "all";
    int test_every = 8, downscale = 1;
    DrawArguments draw;
    DeviceOptions device;
};

struct Sides {
    std::unique_ptr<ComparedSide> a, b;
    Dataset cameras;  // for splat scenes
    RenderOptions options;
};

Sides open_sides(const CompareArguments& arguments) {
    Sides sides;
    const bool scene_a = names_splat_scene(arguments.a), scene_b = names_splat_scene(arguments.b);
    const bool scene = scene_a || scene_b;
    if (!scene && !arguments.cameras.empty())
        throw InputError("--cameras: neither " + arguments.a.string() + " nor " + arguments.b.string() +
                         " is a splat scene");
    if (scene && arguments.cameras.empty())
        throw InputError((scene_a ? arguments.a : arguments.b).string() +
                         " is a splat scene; --cameras DATASET names the cameras to render it through");
    // Images first: their errors are found without rendering.
    if (!scene_a) sides.a = image_side(arguments.a);
    if (!scene_b) sides.b = image_side(arguments.b);
    if (!scene) return sides;
    sides.options = arguments.draw.options();
    sides.cameras = load_cameras_as_trained(arguments.cameras, arguments.downscale);
    const SceneViews views{sides.cameras,
                           select_frames(sides.cameras, arguments.frames, arguments.test_every),
                           sides.options, open_device(arguments.device)};
    if (scene_a) sides.a = scene_side(arguments.a, views);
    if (scene_b) sides.b = scene_side(arguments.b, views);
    return sides;
}

/// The file of the pair's heat map; empty: none.
fs::path heat_map_file(const ImagePair& pair, const CompareArguments& arguments) {
    if (arguments.heat_map.empty() || pair.name.empty()) return arguments.heat_map;
    return arguments.heat_map / (pair.name + ".png");
}

/// Throws if an output is also an input, or cannot be written.
void check_outputs(const CompareArguments& arguments, const Sides& sides, const ImagePairs& pairs) {
    std::vector<NamedFile> written = {{"--json", arguments.json}};
    std::vector<NamedFile> read = {{"A", arguments.a}, {"B", arguments.b}, {"--cameras", arguments.cameras}};
    for (const ImagePair& pair : pairs.pairs) {
        written.push_back({"--heat-map", heat_map_file(pair, arguments)});
        if (!sides.a->names().is_scene) read.push_back({"an image of A", sides.a->place(pair.a)});
        if (!sides.b->names().is_scene) read.push_back({"an image of B", sides.b->place(pair.b)});
    }
    for (const Frame& frame : sides.cameras.frames) {
        read.push_back({"an image of --cameras", frame.image_path});
        read.push_back({"a mask of --cameras", frame.mask_path});
    }
    for (const char* name : {"transforms.json", "transforms_train.json", "transforms_test.json"})
        if (!arguments.cameras.empty()) read.push_back({"a file of --cameras", arguments.cameras / name});
    keep_apart(written, read);
    for (const NamedFile& file : written)
        if (!file.path.empty()) check_writable(file.path, Folder::made);
}

Compared compare(const ImagePair& pair, const Sides& sides, const CompareArguments& arguments) {
    ComparedImage a = sides.a->picture(pair.a), b = sides.b->picture(pair.b);
    const bool drawn_a = sides.a->names().is_scene, drawn_b = sides.b->names().is_scene;
    if (drawn_a && !drawn_b) match_format(a, b, sides.options.background);
    if (drawn_b && !drawn_a) match_format(b, a, sides.options.background);
    Compared out{pair.name, {}, {}};
    try {
        out.difference = compare_images(a.image, b.image);
    } catch (const InputError& error) {
        throw InputError(sides.a->place(pair.a) + " and " + sides.b->place(pair.b) + ": " + error.what() +
                         (drawn_a || drawn_b ? "; scenes are rendered through undistorted cameras, at "
                                               "--downscale (ewa eval compares with the dataset's images)"
                                             : ""));
    }
    out.failed = exceeded(out.difference, arguments.limits);
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

int run(const CompareArguments& arguments) {
    const Sides sides = open_sides(arguments);
    const ImagePairs pairs = pair_images(sides.a->names(), sides.b->names());
    check_outputs(arguments, sides, pairs);
    std::vector<Compared> all;
    for (const ImagePair& pair : pairs.pairs) {
        all.push_back(compare(pair, sides, arguments));
        fmt::print("{}\n", line_of(all.back(), arguments.limits));
        std::fflush(stdout);
    }
    std::vector<std::string> unpaired;
    for (const fs::path& name : pairs.only_a) unpaired.push_back(sides.a->place(name));
    for (const fs::path& name : pairs.only_b) unpaired.push_back(sides.b->place(name));

    const CompareTotals totals = totals_of(all);
    print(totals, all.size());
    for (const std::string& picture : unpaired)
        fmt::print("{}  has no image of this name on the other side\n", core::one_line(picture));
    for (const ComparedSide* side : {sides.a.get(), sides.b.get()})
        if (side->skipped_splats() > 0)
            fmt::print("{}: {} splats with a value that is not finite were skipped\n",
                       core::one_line(side->names().side), side->skipped_splats());
    // A missing image is the largest difference of all.
    const bool judged = arguments.limits.threshold || arguments.limits.max_error;
    const bool passed = !judged || (totals.passed && unpaired.empty());
    if (!arguments.json.empty()) {
        report::Json json = {{"psnr", number(totals.psnr)},
                             {"ssim", number(totals.ssim)},
                             {"max_error", number(totals.max_error)},
                             {"rms", number(totals.rms)},
                             {"worst", to_json(*totals.worst)},
                             {"passed", passed},
                             {"pictures", report::Json::array()},
                             {"unpaired", unpaired},
                             {"skipped_nonfinite", {sides.a->skipped_splats(), sides.b->skipped_splats()}}};
        if (arguments.limits.threshold) json["threshold"] = *arguments.limits.threshold;
        if (arguments.limits.max_error) json["max_error_allowed"] = *arguments.limits.max_error;
        for (const Compared& one : all) json["pictures"].push_back(to_json(one));
        write_json(arguments.json, json);
    }
    return passed ? 0 : kTooFarApart;
}

}  // namespace

Action add_compare(CLI::App& app) {
    const auto arguments = std::make_shared<CompareArguments>();
    app.add_option("A", arguments->a, "Image, folder of images, or splat file")->required()->type_name("");
    app.add_option("B", arguments->b, "What A is compared with: image, folder or splat file")
        ->required()
        ->type_name("");
    app.add_option("--threshold", arguments->limits.threshold,
                   "Exit with status 1 if the PSNR of an image is lower, over RGB in 0..1 or over all values "
                   "with alpha, or if an image has no partner")
        ->check(CLI::Range(0.0, 1000.0).description(""))
        ->type_name("PSNR");
    app.add_option(
           "--max-error", arguments->limits.max_error,
           "Exit with status 1 if two values, alpha included, differ by more, or if an image has no partner")
        ->check(CLI::Range(0.0, 1e9).description(""))
        ->type_name("E");
    app.add_option("--json", arguments->json, "Write the results to this file")->type_name("FILE");
    app.add_option(
           "--heat-map", arguments->heat_map,
           "Write the error as an image (.png, .exr); for folders: one image per pair into this folder")
        ->type_name("OUT");
    app.add_option("--heat-scale", arguments->heat_scale, "Error that the heat map shows brightest")
        ->check(CLI::Range(1e-9, 1e9).description(""))
        ->type_name("E")
        ->capture_default_str();
    CLI::Option* cameras =
        app.add_option(
               "--cameras", arguments->cameras,
               "Dataset whose cameras render splat files. Each render is compared with that of the other "
               "splat file, or with the image that has the name ewa render would give it, rounded like that "
               "image")
            ->type_name("DATASET");
    const std::vector<CLI::Option*> before = app.get_options();
    add_frames_options(app, arguments->frames, arguments->test_every);
    add_draw_options(app, arguments->draw);
    add_downscale_option(app, arguments->downscale);
    add_device_options(app, arguments->device);
    for (CLI::Option* option : app.get_options())
        if (std::find(before.begin(), before.end(), option) == before.end()) option->needs(cameras);
    return [arguments] { return run(*arguments); };
}

}  // namespace ewa::cli
