// SPDX-License-Identifier: Apache-2.0
// Measures the difference of images, for ewa compare and ewa convert --check.
#pragma once
#include <string>
#include <vector>

#include "ewa/gaussians.h"
#include "ewa/image.h"
#include "ewa/metrics.h"
#include "ewa/render_options.h"
#include "report/summary.h"

namespace ewa::cli {

struct Compared {
    std::string name;
    ImageDifference difference;
    std::vector<Figure> figures = {};
    std::vector<std::string> failed = {};  // names of the figures that exceed their limit
    std::string reasons = {};              // text for the user: which figures exceed their limits
};

/// Compares two images of one size. Throws InputError if the sizes differ.
Compared compared(const std::string& name, const Image& a, const Image& b, const Meter& meter = {});

/// Compares renders of two scenes from `sides` cameras around the first, in the order of the cameras. The device has one scene
/// at a time in its memory. a: at least one splat. Throws RunError (no device, or too little memory).
std::vector<Compared> compared_all_round(const Gaussians& a, const Gaussians& b, const RenderOptions& options,
                                         int sides);

/// Means and extremes over all pairs of images.
struct CompareTotals {
    double psnr = 0, ssim = 0;        // means
    std::vector<Figure> figures;      // means
    double max_error = 0, rms = 0;    // largest
    const Compared* worst = nullptr;  // the pair with the lowest PSNR, or RMS over all values in dB
    bool passed = true;
};
/// all: at least one pair; it lives as long as `worst` is used.
CompareTotals totals_of(const std::vector<Compared>& all);

/// The value as JSON. Infinity, the PSNR of equal images, and NaN become null, since JSON has no numbers for them.
report::Json finite_number(double value);

}  // namespace ewa::cli
