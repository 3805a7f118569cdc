// SPDX-License-Identifier: Apache-2.0
// How the values of a column spread over the splats of a scene. Independent of the window.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "edit/filters.h"

namespace ewa::viewer {

/// A column as a histogram shows it.
struct HistogramColumn {
    std::string name;
    bool decades = false;  // bins have equal widths in the logarithm
    bool whole = false;    // the values are whole numbers
};
/// The columns of edit::columns(), and with cameras edit::kViews.
std::vector<HistogramColumn> histogram_columns(bool cameras);

/// The values of all splats. cameras: for edit::kViews alone. Throws InputError for a column that there is not.
std::vector<double> column_values(const std::string& column, const Gaussians& splats,
                                  const edit::Cameras& cameras);

inline constexpr size_t kMostBins = 256;

/// Bins of equal widths. The outermost ones have also what lies beyond them.
struct Histogram {
    HistogramColumn column;
    double low = 0, high = 1;  // borders of the outermost bins; with `decades` their logarithms
    std::vector<uint32_t> left,
        selected;  // splats in each bin: all that are not deleted, and the selected ones

    size_t bins() const { return left.size(); }
    /// The value at the left border of a bin; of bins() the right border of the last one.
    double border(size_t bin) const;
};

/// Counts the values of the splats that are not deleted. states: edit::State bits. The borders pass over the outermost thousandth at
/// a side if it lies far away. Values that are not numbers are not counted.
Histogram histogram(const HistogramColumn& column, const std::vector<double>& values,
                    const std::vector<uint8_t>& states);

/// The filter COLUMN=LOW..HIGH of these bins. It has no bound where an outermost bin is among them.
std::string range_of_bins(const Histogram& histogram, size_t first, size_t last);

}  // namespace ewa::viewer
