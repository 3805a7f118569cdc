// SPDX-License-Identifier: Apache-2.0
// How far images are apart.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "ewa/image.h"
#include "reference/values.h"

namespace ewa::test {

/// The largest difference, but for `skipped` pixels in which a contribution may stand on the other side of ALPHA_MIN.
inline double largest_difference(const Image& image, const reference::Raster& expected, size_t skipped) {
    std::vector<double> worst;
    for (size_t i = 0; i < image.pixels.size(); i += 3) {
        double largest = 0;
        for (size_t c = i; c < i + 3; ++c)
            largest = std::max(largest, std::abs(double(image.pixels[c]) - expected.values[c]));
        worst.push_back(largest);
    }
    std::ranges::sort(worst);
    return worst[worst.size() - 1 - skipped];
}

inline double largest_difference(const Image& a, const Image& b) {
    double worst = 0;
    for (size_t i = 0; i < a.pixels.size(); ++i)
        worst = std::max(worst, std::abs(double(a.pixels[i]) - double(b.pixels[i])));
    return worst;
}

}  // namespace ewa::test
