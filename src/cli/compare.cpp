// SPDX-License-Identifier: Apache-2.0
// ewa compare: how far apart two pictures are, or two folders of pictures of the same names.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "cli/command.h"
#include "cli/output.h"
#include "cli/picture_pairs.h"
#include "ewa/error.h"
#include "ewa/image.h"
#include "report/pictures.h"

namespace ewa::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kBelowThreshold = 1;

struct CompareArguments {
    fs::path a, b, json, heat_map;
    std::optional<double> threshold;
    double heat_scale = 0.25;
};

struct Compared {
    std::string name;
    ImageDifference difference;
    bool passed = true;
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
            {"identical", d.max_error == 0},
            {"passed", compared.passed}};
}

std::string figures(const ImageDifference& d) {
    return fmt::format("PSNR {:.3f} dB  SSIM {:.5f}  max error {:.6g}{}", d.psnr, d.ssim, d.max_error,
                       d.max_error > 0 ? fmt::format(" at {},{}", d.max_x, d.max_y) : "");
}

Image color_of(const Image& image) {
    return over_background(image, {0, 0, 0});
}

Compared compare(const PicturePair& pair, const CompareArguments& arguments) {
    const Image a = load_image(pair.a), b = load_image(pair.b);
    Compared out{pair.name, {}, true};
    try {
        out.difference = compare_images(a, b);
    } catch (const InputError& error) {
        throw InputError(pair.a.string() + " and " + pair.b.string() + ": " + error.what());
    }
    // Written so that a PSNR that is not a number, of pictures that hold NaN, does not pass.
    if (arguments.threshold) out.passed = out.difference.psnr >= *arguments.threshold;
    if (!arguments.heat_map.empty()) {
        const fs::path file =
            pair.name.empty() ? arguments.heat_map : arguments.heat_map / (pair.name + ".png");
        make_folder(file.parent_path());
        save_image(file, report::error_map(color_of(a), color_of(b), arguments.heat_scale));
    }
    return out;
}

/// The mean over the pictures, and the worst of them.
struct Totals {
    double psnr = 0, ssim = 0, max_error = 0;
    const Compared* worst = nullptr;
    bool passed = true;
};

Totals totals_of(const std::vector<Compared>& all) {
    Totals out;
    for (const Compared& one : all) {
        out.psnr += one.difference.psnr / double(all.size());
        out.ssim += one.difference.ssim / double(all.size());
        out.max_error = std::max(out.max_error, one.difference.max_error);
        out.passed = out.passed && one.passed;
        if (!out.worst || !(one.difference.psnr >= out.worst->difference.psnr)) out.worst = &one;
    }
    return out;
}

void print(const std::vector<Compared>& all, const Totals& totals, const CompareArguments& arguments) {
    for (const Compared& one : all)
        fmt::print("{}{}{}{}\n", one.name, one.name.empty() ? "" : "  ", figures(one.difference),
                   one.passed ? "" : fmt::format("  under {:g} dB", *arguments.threshold));
    if (all.size() > 1)
        fmt::print("mean of {} pictures  PSNR {:.3f} dB  SSIM {:.5f}  max error {:.6g}; worst: {}\n",
                   all.size(), totals.psnr, totals.ssim, totals.max_error, totals.worst->name);
}

int run(const CompareArguments& arguments) {
    const PicturePairs pairs = pair_pictures(arguments.a, arguments.b);
    std::vector<Compared> all;
    for (const PicturePair& pair : pairs.pairs) all.push_back(compare(pair, arguments));

    const Totals totals = totals_of(all);
    print(all, totals, arguments);
    for (const fs::path& file : pairs.unpaired)
        fmt::print("{}  has no picture of its name in the other folder\n", file.string());
    // What should be there and is not differs most of all.
    const bool passed = !arguments.threshold || (totals.passed && pairs.unpaired.empty());
    if (!arguments.json.empty()) {
        report::Json json = {{"psnr", number(totals.psnr)},
                             {"ssim", number(totals.ssim)},
                             {"max_error", number(totals.max_error)},
                             {"worst", to_json(*totals.worst)},
                             {"passed", passed},
                             {"pictures", report::Json::array()},
                             {"unpaired", report::Json::array()}};
        if (arguments.threshold) json["threshold"] = *arguments.threshold;
        for (const Compared& one : all) json["pictures"].push_back(to_json(one));
        for (const fs::path& file : pairs.unpaired) json["unpaired"].push_back(file.string());
        write_json(arguments.json, json);
    }
    return passed ? 0 : kBelowThreshold;
}

}  // namespace

Action add_compare(CLI::App& app) {
    const auto arguments = std::make_shared<CompareArguments>();
    app.add_option("A", arguments->a, "A picture, or a folder of pictures")->required()->type_name("");
    app.add_option("B", arguments->b, "What it is compared with: the same")->required()->type_name("");
    app.add_option("--threshold", arguments->threshold,
                   "Exit status 1 where a picture's PSNR is under this, or a picture has no other")
        ->check(CLI::Range(0.0, 1000.0).description(""))
        ->type_name("PSNR");
    app.add_option("--json", arguments->json, "Write the figures to this file")->type_name("FILE");
    app.add_option("--heat-map", arguments->heat_map,
                   "Write the error as a picture (.png, .exr), or one a pair into this folder")
        ->type_name("OUT");
    app.add_option("--heat-scale", arguments->heat_scale, "Error that the heat map draws brightest")
        ->check(CLI::Range(1e-9, 1e9).description(""))
        ->type_name("E")
        ->capture_default_str();
    return [arguments] { return run(*arguments); };
}

}  // namespace ewa::cli
