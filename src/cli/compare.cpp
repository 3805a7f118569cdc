// SPDX-License-Identifier: Apache-2.0
// ewa compare: how far apart two pictures are, or two folders of pictures of the same names; splat scenes in
// place of either are drawn.
#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/compared_side.h"
#include "cli/dataset_argument.h"
#include "cli/output.h"
#include "cli/picture_pairs.h"
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
    std::optional<double> threshold, max_error;
    double heat_scale = 0.25;

    // How splat scenes are drawn.
    fs::path cameras;
    std::string frames = "all";
    int test_every = 8, downscale = 1;
    DrawArguments draw;
    DeviceOptions device;
};

/// What is compared.
struct Sides {
    std::unique_ptr<ComparedSide> a, b;
    Dataset cameras;  // of scenes
    RenderOptions options;
};

struct Compared {
    std::string name;
    ImageDifference difference;
    std::vector<std::string> failed;  // the figures that are beyond what was allowed

    bool passed() const { return failed.empty(); }
};

/// Infinite for equal pictures, for which JSON has no number.
report::Json number(double value) {
    return std::isfinite(value) ? report::Json(value) : report::Json();
}

report::Json to_json(const Compared& compared) {
    const ImageDifference& d = compared.difference;
    return {{"name", compared.name},
            {"psnr", number(d.psnr)},
            {"ssim", number(d.ssim)},
            {"max_error", number(d.max_error)},
            {"max_error_at", {d.max_x, d.max_y}},
            {"mean_error", number(d.mean_error)},
            {"rms", number(d.rms_error)},
            {"identical", d.max_error == 0},
            {"passed", compared.passed()},
            {"failed", compared.failed}};
}

std::string figures(const ImageDifference& d) {
    return fmt::format("PSNR {:.3f} dB  SSIM {:.5f}  RMS {:.6g}  max error {:.6g}{}", d.psnr, d.ssim,
                       d.rms_error, d.max_error,
                       d.max_error > 0 ? fmt::format(" at {},{}", d.max_x, d.max_y) : "");
}

/// The RMS of a PSNR.
double allowed_rms(double threshold) {
    return std::pow(10.0, -threshold / 20);
}

/// The figures beyond what is allowed; written so that one that is not a number, of pictures that hold NaN,
/// is. PSNR is of RGB clamped to [0, 1], as everywhere: the threshold holds for the error over all values
/// too, so that neither alpha nor what is brighter than white goes unseen.
std::vector<std::string> beyond(const ImageDifference& d, const CompareArguments& arguments) {
    constexpr double kRounding = 1 + 1e-9;  // of the same figure by two ways
    std::vector<std::string> failed;
    if (arguments.threshold && !(d.psnr >= *arguments.threshold)) failed.emplace_back("psnr");
    if (arguments.threshold && !(d.rms_error <= allowed_rms(*arguments.threshold) * kRounding))
        failed.emplace_back("rms");
    if (arguments.max_error && !(d.max_error <= *arguments.max_error)) failed.emplace_back("max_error");
    return failed;
}

/// Why a picture did not pass; empty where it did.
std::string reasons(const Compared& compared, const CompareArguments& arguments) {
    const auto has = [&](const char* figure) {
        return std::find(compared.failed.begin(), compared.failed.end(), figure) != compared.failed.end();
    };
    std::string text;
    if (has("psnr"))
        text += fmt::format("  under {:g} dB", *arguments.threshold);
    else if (has("rms"))
        text += fmt::format("  under {:g} dB (RMS over {:.3g}) with alpha and values outside [0, 1]",
                            *arguments.threshold, allowed_rms(*arguments.threshold));
    if (has("max_error")) text += fmt::format("  max error over {:g}", *arguments.max_error);
    return text;
}

Sides open_sides(const CompareArguments& arguments) {
    Sides sides;
    const bool scene_a = names_splat_scene(arguments.a), scene_b = names_splat_scene(arguments.b);
    const bool scene = scene_a || scene_b;
    if (!scene && !arguments.cameras.empty())
        throw InputError("--cameras: neither " + arguments.a.string() + " nor " + arguments.b.string() +
                         " is a splat scene");
    if (scene && arguments.cameras.empty())
        throw InputError((scene_a ? arguments.a : arguments.b).string() +
                         " is a splat scene; --cameras DATASET says where to look at it from");
    // What is soon said comes first.
    if (!scene_a) sides.a = picture_side(arguments.a);
    if (!scene_b) sides.b = picture_side(arguments.b);
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

/// What a comparison writes besides the figures; empty: nothing.
fs::path heat_map_file(const PicturePair& pair, const CompareArguments& arguments) {
    if (arguments.heat_map.empty() || pair.name.empty()) return arguments.heat_map;
    return arguments.heat_map / (pair.name + ".png");
}

/// Throws where a file that is to be written is one of those that are read, or cannot be written.
void check_outputs(const CompareArguments& arguments, const Sides& sides, const PicturePairs& pairs) {
    std::vector<NamedFile> written = {{"--json", arguments.json}};
    std::vector<NamedFile> read = {{"A", arguments.a}, {"B", arguments.b}, {"--cameras", arguments.cameras}};
    for (const PicturePair& pair : pairs.pairs) {
        written.push_back({"--heat-map", heat_map_file(pair, arguments)});
        if (!sides.a->names().is_scene) read.push_back({"a picture of A", sides.a->place(pair.a)});
        if (!sides.b->names().is_scene) read.push_back({"a picture of B", sides.b->place(pair.b)});
    }
    for (const Frame& frame : sides.cameras.frames) {
        read.push_back({"a photograph of --cameras", frame.image_path});
        read.push_back({"a mask of --cameras", frame.mask_path});
    }
    for (const char* name : {"transforms.json", "transforms_train.json", "transforms_test.json"})
        if (!arguments.cameras.empty()) read.push_back({"a file of --cameras", arguments.cameras / name});
    keep_apart(written, read);
    for (const NamedFile& file : written)
        if (!file.path.empty()) check_writable(file.path, Folder::made);
}

Compared compare(const PicturePair& pair, const Sides& sides, const CompareArguments& arguments) {
    ComparedPicture a = sides.a->picture(pair.a), b = sides.b->picture(pair.b);
    const bool drawn_a = sides.a->names().is_scene, drawn_b = sides.b->names().is_scene;
    if (drawn_a && !drawn_b) adapt_drawn(a, b, sides.options.background);
    if (drawn_b && !drawn_a) adapt_drawn(b, a, sides.options.background);
    Compared out{pair.name, {}, {}};
    try {
        out.difference = compare_images(a.image, b.image);
    } catch (const InputError& error) {
        throw InputError(sides.a->place(pair.a) + " and " + sides.b->place(pair.b) + ": " + error.what() +
                         (drawn_a || drawn_b ? "; scenes are drawn through the cameras of undistorted "
                                               "photographs, at --downscale (ewa eval takes photographs)"
                                             : ""));
    }
    out.failed = beyond(out.difference, arguments);
    if (const fs::path file = heat_map_file(pair, arguments); !file.empty()) {
        make_folder(file.parent_path());
        save_image(file, report::value_error_map(a.image, b.image, arguments.heat_scale));
    }
    return out;
}

/// In dB, the worse of PSNR and what RMS over all values means.
double nearness(const ImageDifference& d) {
    if (std::isnan(d.psnr) || std::isnan(d.rms_error)) return std::nan("");
    return std::min(d.psnr, -20 * std::log10(d.rms_error));
}

/// The mean over the pictures, and the worst of them.
struct Totals {
    double psnr = 0, ssim = 0, max_error = 0, rms = 0;
    const Compared* worst = nullptr;
    bool passed = true;
};

Totals totals_of(const std::vector<Compared>& all) {
    Totals out;
    for (const Compared& one : all) {
        out.psnr += one.difference.psnr / double(all.size());
        out.ssim += one.difference.ssim / double(all.size());
        out.max_error = std::max(out.max_error, one.difference.max_error);
        // What is not a number is the worst, and stays.
        if (!std::isnan(out.rms) && !(one.difference.rms_error <= out.rms))
            out.rms = one.difference.rms_error;
        out.passed = out.passed && one.passed();
        if (!out.worst || !(nearness(one.difference) >= nearness(out.worst->difference))) out.worst = &one;
    }
    return out;
}

void print(const Compared& one, const CompareArguments& arguments) {
    fmt::print("{}{}{}{}\n", core::one_line(one.name), one.name.empty() ? "" : "  ", figures(one.difference),
               reasons(one, arguments));
    std::fflush(stdout);
}

void print(const Totals& totals, size_t pictures) {
    if (pictures > 1)
        fmt::print(
            "mean of {} pictures  PSNR {:.3f} dB  SSIM {:.5f}; largest RMS {:.6g}, max error {:.6g}; "
            "worst: {}\n",
            pictures, totals.psnr, totals.ssim, totals.rms, totals.max_error,
            core::one_line(totals.worst->name));
}

int run(const CompareArguments& arguments) {
    const Sides sides = open_sides(arguments);
    const PicturePairs pairs = pair_pictures(sides.a->names(), sides.b->names());
    check_outputs(arguments, sides, pairs);
    std::vector<Compared> all;
    for (const PicturePair& pair : pairs.pairs) {
        all.push_back(compare(pair, sides, arguments));
        print(all.back(), arguments);
    }
    std::vector<std::string> unpaired;
    for (const fs::path& name : pairs.only_a) unpaired.push_back(sides.a->place(name));
    for (const fs::path& name : pairs.only_b) unpaired.push_back(sides.b->place(name));

    const Totals totals = totals_of(all);
    print(totals, all.size());
    for (const std::string& picture : unpaired)
        fmt::print("{}  has no picture of its name on the other side\n", core::one_line(picture));
    for (const ComparedSide* side : {sides.a.get(), sides.b.get()})
        if (side->skipped_splats() > 0)
            fmt::print("{}: {} splats have a value that is not finite and were not drawn\n",
                       core::one_line(side->names().side), side->skipped_splats());
    // What should be there and is not differs most of all.
    const bool judged = arguments.threshold || arguments.max_error;
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
        if (arguments.threshold) json["threshold"] = *arguments.threshold;
        if (arguments.max_error) json["max_error_allowed"] = *arguments.max_error;
        for (const Compared& one : all) json["pictures"].push_back(to_json(one));
        write_json(arguments.json, json);
    }
    return passed ? 0 : kTooFarApart;
}

}  // namespace

Action add_compare(CLI::App& app) {
    const auto arguments = std::make_shared<CompareArguments>();
    app.add_option("A", arguments->a, "An image, a folder of images, or a splat scene")
        ->required()
        ->type_name("");
    app.add_option("B", arguments->b, "The same kind of thing, to compare with A")->required()->type_name("");
    app.add_option("--threshold", arguments->threshold,
                   "Exit status 1 if the PSNR of an image is below this, with or without alpha and values "
                   "outside 0 to 1, or if an image has no counterpart")
        ->check(CLI::Range(0.0, 1000.0).description(""))
        ->type_name("PSNR");
    app.add_option("--max-error", arguments->max_error,
                   "Exit status 1 if a value, alpha included, differs by more than this, or if an image has "
                   "no counterpart")
        ->check(CLI::Range(0.0, 1e9).description(""))
        ->type_name("E");
    app.add_option("--json", arguments->json, "Write the results to this file")->type_name("FILE");
    app.add_option("--heat-map", arguments->heat_map,
                   "Write the error as an image (.png, .exr), or one image for each pair into this folder")
        ->type_name("OUT");
    app.add_option("--heat-scale", arguments->heat_scale, "The error that the heat map shows brightest")
        ->check(CLI::Range(1e-9, 1e9).description(""))
        ->type_name("E")
        ->capture_default_str();
    CLI::Option* cameras =
        app.add_option("--cameras", arguments->cameras,
                       "Render splat scenes through the cameras of this dataset. A scene is compared with "
                       "the other scene, or with images as ewa render names and rounds them")
            ->type_name("DATASET");
    const std::vector<CLI::Option*> before = app.get_options();
    app.add_option("--frames", arguments->frames, "all, train, test, or indices in name order: 0,3,7")
        ->type_name("FRAMES")
        ->capture_default_str();
    add_test_every_option(app, arguments->test_every);
    add_draw_options(app, arguments->draw);
    add_downscale_option(app, arguments->downscale);
    add_device_options(app, arguments->device);
    for (CLI::Option* option : app.get_options())
        if (std::find(before.begin(), before.end(), option) == before.end()) option->needs(cameras);
    return [arguments] { return run(*arguments); };
}

}  // namespace ewa::cli
