// SPDX-License-Identifier: Apache-2.0
// Statistics of values and of points.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/vec3.hpp>
#include <vector>

namespace ewa::scene {

/// The value at `share` (0 to 1) of the sorted values, at an index that is rounded down. 0 without values.
/// Reorders the values. O(n).
template <class T>
T quantile(std::vector<T>& values, double share) {
    if (values.empty()) return T{0};
    const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

/// A robust centre of values, and their spread.
struct Center {
    double median = 0;
    /// The standard deviation of a normal distribution with the same median absolute deviation.
    double deviation = 0;
};

/// The centre of the values, which few outliers do not change. Zeros without values. Overwrites the values. O(n).
inline Center center_of(std::vector<double>& values) {
    constexpr double kPerMad = 1.4826;  // of a normal distribution: sigma / MAD
    const double median = quantile(values, 0.5);
    for (double& value : values) value = std::abs(value - median);
    return {median, kPerMad * quantile(values, 0.5)};
}

/// The mean squared distance of each point to its 3 nearest other points, or to all others if there are
/// fewer. -1 for a single point. Points at the same position are neighbours at distance 0. All coordinates
/// must be finite. O(n log n).
std::vector<double> mean_squared_neighbor_distance(const std::vector<glm::dvec3>& positions);

/// Pairs of neighbours: each distinct position with the `count` distinct ones nearest to it. Each pair occurs once, as two indices
/// of positions, the lower one first. Pairs are sorted. All coordinates must be finite. O(n log n).
std::vector<std::array<size_t, 2>> neighbor_pairs(const std::vector<glm::dvec3>& positions, size_t count);

}  // namespace ewa::scene
