// SPDX-License-Identifier: Apache-2.0
// The figures of ewa compare: one pair of images, the limits that it must meet, and the totals of all pairs.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "ewa/image.h"

namespace ewa::cli {

/// The limits that a pair must meet; empty: none.
struct CompareLimits {
    std::optional<double> threshold;  // dB: the least PSNR
    std::optional<double> max_error;  // the largest difference of two values, alpha included
};

struct Compared {
    std::string name;
    ImageDifference difference;
    std::vector<std::string> failed;  // names of the figures that exceed their limit

    bool passed() const { return failed.empty(); }
};

/// JSON has no number for an infinite PSNR, which equal images have: null.
nlohmann::ordered_json number(double value);
nlohmann::ordered_json to_json(const Compared& compared);

/// The names of the figures that exceed their limit; NaN always does. PSNR is of RGB clamped to [0, 1], as
/// everywhere. The threshold also limits the RMS error over all values, so that alpha and values above white
/// count too.
std::vector<std::string> exceeded(const ImageDifference& difference, const CompareLimits& limits);

/// "NAME  PSNR ... max error ..." in one line, with the reasons why the pair failed.
std::string line_of(const Compared& compared, const CompareLimits& limits);

/// Means and extremes over the pairs.
struct CompareTotals {
    double psnr = 0, ssim = 0;        // means
    double max_error = 0, rms = 0;    // largest
    const Compared* worst = nullptr;  // the pair with the lowest PSNR, or RMS over all values in dB
    bool passed = true;
};
CompareTotals totals_of(const std::vector<Compared>& all);

}  // namespace ewa::cli
