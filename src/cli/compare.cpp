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

constexpr int kTooFarApart = 1;

struct CompareArguments {
    fs::path a, b, json, heat_map;
    std::optional<double> threshold, max_error;
    double heat_scale = 0.25;
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

Compared compare(const PicturePair& pair, const CompareArguments& arguments) {
    const Image a = load_image(pair.a), b = load_image(pair.b);
    Compared out{pair.name, {}, {}};
    try {
        out.difference = compare_images(a, b);
    } catch (const InputError& error) {
        throw InputError(pair.a.string() + " and " + pair.b.string() + ": " + error.what());
    }
    out.failed = beyond(out.difference, arguments);
    if (!arguments.heat_map.empty()) {
        const fs::path file =
            pair.name.empty() ? arguments.heat_map : arguments.heat_map / (pair.name + ".png");
        make_folder(file.parent_path());
        save_image(file, report::value_error_map(a, b, arguments.heat_scale));
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

void print(const std::vector<Compared>& all, const Totals& totals, const CompareArguments& arguments) {
    for (const Compared& one : all)
        fmt::print("{}{}{}{}\n", one.name, one.name.empty() ? "" : "  ", figures(one.difference),
                   reasons(one, arguments));
    if (all.size() > 1)
        fmt::print(
            "mean of {} pictures  PSNR {:.3f} dB  SSIM {:.5f}; largest RMS {:.6g}, max error {:.6g}; "
            "worst: {}\n",
            all.size(), totals.psnr, totals.ssim, totals.rms, totals.max_error, totals.worst->name);
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
    const bool judged = arguments.threshold || arguments.max_error;
    const bool passed = !judged || (totals.passed && pairs.unpaired.empty());
    if (!arguments.json.empty()) {
        report::Json json = {{"psnr", number(totals.psnr)},           {"ssim", number(totals.ssim)},
                             {"max_error", number(totals.max_error)}, {"rms", number(totals.rms)},
                             {"worst", to_json(*totals.worst)},       {"passed", passed},
                             {"pictures", report::Json::array()},     {"unpaired", report::Json::array()}};
        if (arguments.threshold) json["threshold"] = *arguments.threshold;
        if (arguments.max_error) json["max_error_allowed"] = *arguments.max_error;
        for (const Compared& one : all) json["pictures"].push_back(to_json(one));
        for (const fs::path& file : pairs.unpaired) json["unpaired"].push_back(file.string());
        write_json(arguments.json, json);
    }
    return passed ? 0 : kTooFarApart;
}

}  // namespace

Action add_compare(CLI::App& app) {
    const auto arguments = std::make_shared<CompareArguments>();
    app.add_option("A", arguments->a, "A picture, or a folder of pictures")->required()->type_name("");
    app.add_option("B", arguments->b, "What it is compared with: the same")->required()->type_name("");
    app.add_option("--threshold", arguments->threshold,
                   "Exit status 1 where a picture's PSNR is under this, with or without alpha and values "
                   "outside 0 to 1, or a picture has no other")
        ->check(CLI::Range(0.0, 1000.0).description(""))
        ->type_name("PSNR");
    app.add_option(
           "--max-error", arguments->max_error,
           "Exit status 1 where a value, alpha too, is further off than this, or a picture has no other")
        ->check(CLI::Range(0.0, 1e9).description(""))
        ->type_name("E");
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
