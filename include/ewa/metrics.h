// SPDX-License-Identifier: Apache-2.0
// Metrics of two images beside PSNR and SSIM of image.h. docs/figures.md defines each.
#pragma once
#include <string>
#include <vector>

#include "ewa/image.h"

namespace ewa {

/// A metric of two images.
struct Metric {
    std::string name;  // as in JSON, e.g. "cc_psnr"
    std::string text;  // a description
    int decimals = 4;  // that a table shows
};

/// All metrics, in the order of tables. The first two are "psnr" and "ssim".
const std::vector<Metric>& all_metrics();

/// The names in a list such as "cc_psnr,flip", each once, in the order of all_metrics. "all" names all of them, and "bands"
/// the PSNR of all frequency bands. Throws InputError for any other word.
std::vector<std::string> metrics_named(const std::string& list);

/// The value of a metric.
struct Figure {
    std::string name;  // Metric::name
    double value = 0;  // NaN: not computed, or no pixel counts
};

/// Measures a choice of metrics.
class Meter {
  public:
    Meter() = default;  // measures nothing
    /// names: of all_metrics, as metrics_named returns them. "psnr" and "ssim" are skipped.
    explicit Meter(const std::vector<std::string>& names);

    /// Whether it measures nothing.
    bool empty() const { return names_.empty(); }
    /// The names of the figures.
    const std::vector<std::string>& names() const { return names_; }
    /// One figure for each of names(), in their order. Runs on all cores; the result does not depend on their number. image:
    /// the render. reference: the image that it should equal. Both have 3 or 4 channels; alpha is not used. Values are clamped
    /// to [0, 1]. weights: as in psnr and ssim. Throws InputError if the sizes differ.
    std::vector<Figure> measure(const Image& image, const Image& reference, const Image& weights = {}) const;

  private:
    std::vector<std::string> names_;
};

}  // namespace ewa
