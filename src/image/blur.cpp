// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "image/metric.h"

namespace ewa::image {
namespace {

constexpr int kBlurReach = 5;  // px to each side, as Crete's filter of 11 px

/// Sums, over neighbours along a line, of |difference| before a box filter and of how much the filter takes of it.
std::array<double, 2> variation_of(const std::vector<double>& line) {
    const int count = int(line.size());
    const auto at = [&](int i) { return line[size_t(std::clamp(i, 0, count - 1))]; };
    double all = 0, lost = 0;
    for (int i = 1; i < count; ++i) {
        const double own = std::abs(at(i) - at(i - 1));
        // The means of the windows of both pixels differ by the window's ends.
        const double filtered = std::abs(at(i + kBlurReach) - at(i - 1 - kBlurReach)) / (2 * kBlurReach + 1);
        all += own;
        lost += std::max(0.0, own - filtered);
    }
    return {all, lost};
}

}  // namespace

double blur_effect(const Image& image) {
    const auto grey = [&](int x, int y) {
        double sum = 0;
        for (int c = 0; c < std::min(image.channels, 3); ++c) sum += double(image.at(x, y)[c]);
        return sum;
    };
    double effect = 0;
    for (const bool rows : {true, false}) {
        const int lines = rows ? image.height : image.width, along = rows ? image.width : image.height;
        double all = 0, lost = 0;
        std::vector<double> line(static_cast<size_t>(along));
        for (int k = 0; k < lines; ++k) {
            for (int i = 0; i < along; ++i) line[size_t(i)] = rows ? grey(i, k) : grey(k, i);
            const auto [own, taken] = variation_of(line);
            all += own;
            lost += taken;
        }
        if (all > 0) effect = std::max(effect, 1 - lost / all);
    }
    return effect;
}

}  // namespace ewa::image
