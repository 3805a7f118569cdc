// SPDX-License-Identifier: Apache-2.0
#include "cli/compare_figures.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/text.h"

namespace ewa::cli {

using Json = nlohmann::ordered_json;

namespace {

std::string figures(const ImageDifference& d) {
    return fmt::format("PSNR {:.3f} dB  SSIM {:.5f}  RMS {:.6g}  max error {:.6g}{}", d.psnr, d.ssim,
                       d.rms_error, d.max_error,
                       d.max_error > 0 ? fmt::format(" at {},{}", d.max_x, d.max_y) : "");
}

/// The RMS error that has this PSNR, in dB.
double allowed_rms(double threshold) {
    return std::pow(10.0, -threshold / 20);
}

/// Why a pair failed; empty if it passed.
std::string reasons(const Compared& compared, const CompareLimits& limits) {
    const auto has = [&](const char* figure) {
        return std::find(compared.failed.begin(), compared.failed.end(), figure) != compared.failed.end();
    };
    std::string text;
    if (has("psnr"))
        text += fmt::format("  under {:g} dB", *limits.threshold);
    else if (has("rms"))
        text += fmt::format("  under {:g} dB (RMS over {:.3g}) with alpha and values outside [0, 1]",
                            *limits.threshold, allowed_rms(*limits.threshold));
    if (has("max_error")) text += fmt::format("  max error over {:g}", *limits.max_error);
    return text;
}

/// In dB: the lower of the PSNR and the RMS error over all values.
double nearness(const ImageDifference& d) {
    if (std::isnan(d.psnr) || std::isnan(d.rms_error)) return std::nan("");
    return std::min(d.psnr, -20 * std::log10(d.rms_error));
}

}  // namespace

Json number(double value) {
    return std::isfinite(value) ? Json(value) : Json();
}

Json to_json(const Compared& compared) {
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

std::vector<std::string> exceeded(const ImageDifference& d, const CompareLimits& limits) {
    constexpr double kRounding = 1 + 1e-9;  // the same figure, computed in two ways
    std::vector<std::string> failed;
    if (limits.threshold && !(d.psnr >= *limits.threshold)) failed.emplace_back("psnr");
    if (limits.threshold && !(d.rms_error <= allowed_rms(*limits.threshold) * kRounding))
        failed.emplace_back("rms");
    if (limits.max_error && !(d.max_error <= *limits.max_error)) failed.emplace_back("max_error");
    return failed;
}

std::string line_of(const Compared& one, const CompareLimits& limits) {
    return fmt::format("{}{}{}{}", core::one_line(one.name), one.name.empty() ? "" : "  ",
                       figures(one.difference), reasons(one, limits));
}

CompareTotals totals_of(const std::vector<Compared>& all) {
    CompareTotals out;
    for (const Compared& one : all) {
        out.psnr += one.difference.psnr / double(all.size());
        out.ssim += one.difference.ssim / double(all.size());
        out.max_error = std::max(out.max_error, one.difference.max_error);
        // NaN is the worst, and stays.
        if (!std::isnan(out.rms) && !(one.difference.rms_error <= out.rms))
            out.rms = one.difference.rms_error;
        out.passed = out.passed && one.passed();
        if (!out.worst || !(nearness(one.difference) >= nearness(out.worst->difference))) out.worst = &one;
    }
    return out;
}

}  // namespace ewa::cli
