// SPDX-License-Identifier: Apache-2.0
#include "prepare/passers_by.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "scene/statistics.h"

namespace ewa::train {
namespace {

constexpr int kCell = 2;  // px a side; noise of single pixels cancels
// Errors are in units of the median error of the images. A passer-by is a region of cells above the lower limit, with one above
// the upper limit.
constexpr double kLowLimit = 4, kHighLimit = 12;
// Least unit (of 1): where renders are nearly exact, fine structures would exceed the limits.
constexpr double kLeastUnit = 0.01;
// An image whose own median is above this many times that of all is worse as a whole, as a blurred one is.
constexpr double kWorseImage = 2;
constexpr double kLeastShare = 0.002;  // of the image's cells; smaller regions are left
// How far the error falls at a region's border. Glare and soft shadows fade, a body ends.
constexpr double kLeastFall = 4;
constexpr int kInside = 2, kOutsideFrom = 2,
              kOutsideTo = 3;         // cells from the border, that the fall is measured over
constexpr int kGap = 1, kThread = 1;  // cells; gaps are filled, and threads of such a half width removed
constexpr int kFits = 3;              // each uses the half with smaller errors of the last one

int cells_of(int pixels) {
    return (pixels + kCell - 1) / kCell;
}

/// The mean of each cell.
Image cell_means(const Image& image) {
    Image means(cells_of(image.width), cells_of(image.height), image.channels);
    for (int y = 0; y < means.height; ++y)
        for (int x = 0; x < means.width; ++x) {
            const int right = std::min(image.width, (x + 1) * kCell),
                      bottom = std::min(image.height, (y + 1) * kCell);
            const auto pixels = float((right - x * kCell) * (bottom - y * kCell));
            for (int row = y * kCell; row < bottom; ++row)
                for (int column = x * kCell; column < right; ++column)
                    for (int c = 0; c < image.channels; ++c)
                        means.at(x, y)[c] += image.at(column, row)[c] / pixels;
        }
    return means;
}

struct Affine {
    double gain = 1, offset = 0;
};
using Colors = std::array<Affine, 3>;

/// Least squares over the used cells.
Affine fit(const Image& from, const Image& to, size_t channel, const std::vector<bool>& used) {
    constexpr double kLeastVariance = 1e-5;
    double count = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (size_t i = 0; i < used.size(); ++i) {
        if (!used[i]) continue;
        const double a = double(from.pixels[3 * i + channel]), b = double(to.pixels[3 * i + channel]);
        count += 1, x += a, y += b, xx += a * a, xy += a * b;
    }
    if (count == 0) return {};
    const double variance = xx / count - x * x / (count * count);
    const double gain = variance > kLeastVariance ? (xy / count - x * y / (count * count)) / variance : 1;
    return {gain, (y - gain * x) / count};
}

/// The colours of `from` that fit `to`. Cells with larger errors do not count.
Colors fitted(const Image& from, const Image& to, const std::vector<bool>& counts) {
    Colors colors;
    std::vector<bool> used = counts;
    std::vector<double> errors(counts.size());
    for (int round = 0; round < kFits; ++round) {
        for (size_t c = 0; c < 3; ++c) colors[c] = fit(from, to, c, used);
        std::vector<double> counted;
        for (size_t i = 0; i < errors.size(); ++i) {
            errors[i] = 0;
            for (size_t c = 0; c < 3; ++c)
                errors[i] += std::abs(colors[c].gain * double(from.pixels[3 * i + c]) + colors[c].offset -
                                      double(to.pixels[3 * i + c]));
            if (counts[i]) counted.push_back(errors[i]);
        }
        const double middle = scene::quantile(counted, 0.5);
        for (size_t i = 0; i < errors.size(); ++i) used[i] = counts[i] && errors[i] <= middle;
    }
    return colors;
}

/// The cells within a distance of a cell, of an image of cells.
template <class Visit>
void visit_near(int width, int height, size_t cell, int distance, const Visit& visit) {
    const int x = int(cell) % width, y = int(cell) / width;
    for (int row = std::max(0, y - distance); row <= std::min(height - 1, y + distance); ++row)
        for (int column = std::max(0, x - distance); column <= std::min(width - 1, x + distance); ++column)
            visit(size_t(row) * size_t(width) + size_t(column),
                  std::max(std::abs(column - x), std::abs(row - y)));
}

/// The mean of each value and its neighbours. image: of one channel.
std::vector<float> neighbor_means(const Image& image) {
    std::vector<float> means(image.pixels.size());
    for (size_t i = 0; i < means.size(); ++i) {
        double sum = 0;
        int near = 0;
        visit_near(image.width, image.height, i, 1,
                   [&](size_t other, int) { sum += double(image.pixels[other]), ++near; });
        means[i] = float(sum / near);
    }
    return means;
}

/// The cells that are connected with `first`, which is one of them. They leave `cells`.
std::vector<size_t> region_of(const Residual& residual, size_t first, std::vector<bool>& cells) {
    std::vector<size_t> region{first};
    cells[first] = false;
    for (size_t i = 0; i < region.size(); ++i)
        visit_near(residual.width, residual.height, region[i], 1, [&](size_t cell, int) {
            if (!cells[cell]) return;
            cells[cell] = false;
            region.push_back(cell);
        });
    return region;
}

/// The median error inside the region's border, and that outside of it; none outside if the region fills the image.
std::pair<double, std::optional<double>> border_errors(const Residual& residual,
                                                       const std::vector<size_t>& region) {
    std::vector<bool> in(residual.errors.size());
    for (const size_t cell : region) in[cell] = true;
    // The distance of cells around the region from it; 0 if it is not known.
    std::vector<uint8_t> distances(in.size());
    std::vector<double> inside, outside;
    for (const size_t cell : region) {
        bool border = false;
        visit_near(residual.width, residual.height, cell, kOutsideTo, [&](size_t other, int distance) {
            if (in[other]) return;
            border = border || distance <= kInside;
            uint8_t& least = distances[other];
            if (least == 0 || distance < least) least = uint8_t(distance);
        });
        if (border) inside.push_back(double(residual.errors[cell]));
    }
    for (size_t i = 0; i < distances.size(); ++i)
        if (distances[i] >= kOutsideFrom && residual.counts[i]) outside.push_back(double(residual.errors[i]));
    const double own = scene::quantile(inside, 0.5);
    if (outside.empty()) return {own, std::nullopt};
    return {own, scene::quantile(outside, 0.5)};
}

bool ends_abruptly(const Residual& residual, const std::vector<size_t>& region) {
    const auto [inside, outside] = border_errors(residual, region);
    return !outside || inside >= kLeastFall * *outside;
}

/// Cells that are marked.
using Marks = std::vector<bool>;

/// The cells within the distance of one with this mark.
Marks near(const Residual& residual, const Marks& marks, bool mark, int distance) {
    Marks result(marks.size());
    for (size_t i = 0; i < marks.size(); ++i)
        if (marks[i] == mark)
            visit_near(residual.width, residual.height, i, distance,
                       [&](size_t other, int) { result[other] = true; });
    return result;
}

Marks negated(Marks marks) {
    marks.flip();
    return marks;
}

/// The cells above the lower limit, but for threads of them: an edge of the scene that a passer-by touches.
Marks candidates(const Residual& residual, float low) {
    Marks above(residual.errors.size());
    for (size_t i = 0; i < above.size(); ++i) above[i] = residual.counts[i] && residual.errors[i] > low;
    const Marks thick = negated(near(residual, above, false, kThread));
    Marks result = near(residual, thick, true, kThread);
    for (size_t i = 0; i < above.size(); ++i) result[i] = result[i] && above[i];
    return result;
}

/// The mask of one image. unit: of errors.
Image mask_of(const Residual& residual, double unit) {
    const auto high = float(kHighLimit * unit);
    Marks left = candidates(residual, float(kLowLimit * unit));
    const size_t cells = left.size();
    Marks found(cells);
    for (size_t first = 0; first < cells; ++first) {
        if (!left[first]) continue;
        const std::vector<size_t> region = region_of(residual, first, left);
        const bool large = double(region.size()) >= kLeastShare * double(cells) &&
                           std::ranges::any_of(region, [&](size_t i) { return residual.errors[i] > high; });
        if (large && ends_abruptly(residual, region))
            for (const size_t cell : region) found[cell] = true;
    }
    if (std::ranges::find(found, true) == found.end()) return {};
    // A hole or gap is filled if all cells round it are near what is found.
    const Marks counted = near(residual, near(residual, found, true, kGap), false, kGap);
    Image mask(residual.columns, residual.rows, 1);
    for (int y = 0; y < mask.height; ++y)
        for (int x = 0; x < mask.width; ++x)
            *mask.at(x, y) =
                counted[size_t(y / kCell) * size_t(residual.width) + size_t(x / kCell)] ? 1.0f : 0.0f;
    return mask;
}

}  // namespace

Residual residual_of(const Image& image, const Image& weights, const Image& render) {
    const Image own = cell_means(image), drawn = cell_means(render), weight = cell_means(weights);
    const size_t cells = size_t(own.width) * size_t(own.height);
    Residual residual;
    residual.columns = image.width;
    residual.rows = image.height;
    residual.width = own.width;
    residual.height = own.height;
    residual.counts.assign(cells, true);
    for (size_t i = 0; i < weight.pixels.size(); ++i) residual.counts[i] = weight.pixels[i] > 0.5f;

    const Colors colors = fitted(drawn, own, residual.counts);
    Image differences(image.width, image.height, 1);
    for (size_t i = 0; i < differences.pixels.size(); ++i)
        for (size_t c = 0; c < 3; ++c)
            differences.pixels[i] += float(std::abs(colors[c].gain * double(render.pixels[3 * i + c]) +
                                                    colors[c].offset - double(image.pixels[3 * i + c])) /
                                           3);
    residual.errors = neighbor_means(cell_means(differences));
    std::vector<double> counted;
    for (size_t i = 0; i < cells; ++i)
        if (residual.counts[i]) counted.push_back(double(residual.errors[i]));
    residual.median = scene::quantile(counted, 0.5);
    return residual;
}

std::vector<Image> passers_by(const std::vector<Residual>& residuals) {
    std::vector<double> medians;
    for (const Residual& residual : residuals) medians.push_back(residual.median);
    const double usual = std::max(kLeastUnit, scene::quantile(medians, 0.5));
    std::vector<Image> masks;
    for (const Residual& residual : residuals)
        masks.push_back(mask_of(residual, std::max(usual, residual.median / kWorseImage)));
    return masks;
}

}  // namespace ewa::train
