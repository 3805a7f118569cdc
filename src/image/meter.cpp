// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <limits>
#include <set>
#include <string_view>

#include "core/parallel.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "ewa/metrics.h"
#include "image/metric.h"

namespace ewa {
namespace {

constexpr std::array<const char*, image::kBands> kBandNames = {"psnr_1px", "psnr_2px", "psnr_4px", "psnr_8px",
                                                               "psnr_16px"};

/// The metrics that a word of a list names.
std::vector<std::string> named_by(const std::string& word) {
    std::vector<std::string> names;
    for (const Metric& metric : all_metrics())
        if (word == "all" || word == metric.name ||
            (word == "bands" &&
             std::find(kBandNames.begin(), kBandNames.end(), metric.name) != kBandNames.end()))
            names.push_back(metric.name);
    return names;
}

}  // namespace

const std::vector<Metric>& all_metrics() {
    static const std::vector<Metric> metrics = {
        {"psnr", "PSNR, dB", 3},
        {"ssim", "SSIM", 5},
        {"ssim_valid", "SSIM without pixels whose window leaves the image", 5},
        {"fitted_psnr", "PSNR after an affine fit of the colours to the reference, dB", 3},
        {"cc_psnr", "PSNR after an affine correction of colours (gsplat), dB", 3},
        {"cc_ssim", "SSIM after it", 5},
        {"cc2_psnr", "PSNR after a quadratic correction of colours (multinerf), dB", 3},
        {"cc2_ssim", "SSIM after it", 5},
        {"ms_ssim", "multi-scale SSIM", 5},
        {"flip", "mean of LDR-FLIP", 5},
        {kBandNames[0], "PSNR of details of 1 to 2 px, dB", 3},
        {kBandNames[1], "PSNR of details of 2 to 4 px, dB", 3},
        {kBandNames[2], "PSNR of details of 4 to 8 px, dB", 3},
        {kBandNames[3], "PSNR of details of 8 to 16 px, dB", 3},
        {kBandNames[4], "PSNR of all that is larger than 16 px, dB", 3}};
    return metrics;
}

std::vector<std::string> metrics_named(const std::string& list) {
    std::vector<std::string> words = {"all", "bands"};
    for (const Metric& metric : all_metrics()) words.push_back(metric.name);
    std::set<std::string> wanted;
    for (const std::string_view part : core::split_list(list)) {
        std::string word(part);
        if (const std::string problem = core::settle_word(word, words); !problem.empty())
            throw InputError(problem);
        for (const std::string& name : named_by(word)) wanted.insert(name);
    }
    std::vector<std::string> names;
    for (const Metric& metric : all_metrics())
        if (wanted.contains(metric.name)) names.push_back(metric.name);
    return names;
}

Meter::Meter(const std::vector<std::string>& names) {
    for (const std::string& name : names)
        if (name != "psnr" && name != "ssim") names_.push_back(name);
}

std::vector<Figure> Meter::measure(const Image& image, const Image& reference, const Image& weights) const {
    if (!names_.empty() && image::compared_channels(image, reference) != 3)
        throw InputError("metrics beside PSNR and SSIM need images of three channels");
    image::weight_sum(weights, image);  // refuses weights of another size
    const auto asked = [&](std::string_view prefix) {
        return std::any_of(names_.begin(), names_.end(),
                           [&](const auto& name) { return name.starts_with(prefix); });
    };
    Image fitted, affine, quadratic;
    if (asked("fitted_")) fitted = image::affine_fitted(image, reference, weights);
    if (asked("cc_")) affine = image::affine_corrected(image, reference, weights);
    if (asked("cc2_")) quadratic = image::quadratic_corrected(image, reference, weights);
    std::array<double, image::kBands> bands{};
    if (asked("psnr_")) bands = image::band_psnr(image, reference, weights);
    const auto value_of = [&](const std::string& name) {
        if (name == "ssim_valid") return image::ssim_valid(image, reference, weights);
        if (name == "fitted_psnr") return psnr(fitted, reference, weights);
        if (name == "cc_psnr") return psnr(affine, reference, weights);
        if (name == "cc_ssim") return ssim(affine, reference, weights);
        if (name == "cc2_psnr") return psnr(quadratic, reference, weights);
        if (name == "cc2_ssim") return ssim(quadratic, reference, weights);
        if (name == "ms_ssim") return image::ms_ssim(image, reference, weights);
        if (name == "flip") return image::flip(image, reference, weights);
        const auto band = std::find(kBandNames.begin(), kBandNames.end(), name);
        return band == kBandNames.end() ? std::numeric_limits<double>::quiet_NaN()
                                        : bands[size_t(band - kBandNames.begin())];
    };
    std::vector<Figure> figures(names_.size());
    core::on_all_cores(names_.size(), [&](size_t i) { figures[i] = {names_[i], value_of(names_[i])}; });
    return figures;
}

}  // namespace ewa
