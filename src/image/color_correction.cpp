// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "image/metric.h"

namespace ewa::image {
namespace {

// Quadratic, linear and constant terms of a colour.
constexpr size_t kTerms = 10;
using Terms = std::array<double, kTerms>;
using Color = std::array<double, 3>;

Terms terms_of(const Color& c) {
    return {c[0] * c[0], c[0] * c[1], c[0] * c[2], c[1] * c[1], c[1] * c[2],
            c[2] * c[2], c[0],        c[1],        c[2],        1};
}

std::vector<Color> colors_of(const Image& image) {
    std::vector<Color> colors;
    colors.reserve(size_t(image.width) * size_t(image.height));
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            const float* from = image.at(x, y);
            Color color;
            for (size_t c = 0; c < 3; ++c) color[c] = std::clamp(double(from[c]), 0.0, 1.0);
            colors.push_back(color);
        }
    return colors;
}

Image image_of(const std::vector<Color>& colors, const Image& size) {
    Image result(size.width, size.height, 3);
    for (size_t i = 0; i < colors.size(); ++i)
        for (size_t c = 0; c < 3; ++c) result.pixels[3 * i + c] = float(colors[i][c]);
    return result;
}

/// The normal equations of a least-squares fit.
struct NormalEquations {
    std::array<Terms, kTerms> matrix{};
    Terms right{};

    void add(const Terms& terms, double value, double weight) {
        for (size_t i = 0; i < kTerms; ++i) {
            for (size_t j = 0; j <= i; ++j) matrix[i][j] += weight * terms[i] * terms[j];
            right[i] += weight * terms[i] * value;
        }
    }
    /// By elimination, with the largest pivot of the diagonal first. Terms that depend on others get 0: with them, the fit
    /// would have the same values.
    Terms solution() const;
};

Terms NormalEquations::solution() const {
    constexpr double kDependent = 1e-12;  // of a term's own square, what the terms before it do not explain
    std::array<Terms, kTerms> m = matrix;
    for (size_t i = 0; i < kTerms; ++i)
        for (size_t j = i + 1; j < kTerms; ++j) m[i][j] = m[j][i];
    Terms rest = right, result{};
    std::array<bool, kTerms> used{};
    std::vector<size_t> order;
    for (size_t step = 0; step < kTerms; ++step) {
        size_t pivot = kTerms;
        for (size_t i = 0; i < kTerms; ++i)
            if (!used[i] && m[i][i] > kDependent * matrix[i][i] &&
                (pivot == kTerms || m[i][i] > m[pivot][pivot]))
                pivot = i;
        if (pivot == kTerms) break;
        used[pivot] = true;
        order.push_back(pivot);
        for (size_t i = 0; i < kTerms; ++i) {
            if (used[i]) continue;
            const double factor = m[i][pivot] / m[pivot][pivot];
            for (size_t j = 0; j < kTerms; ++j)
                if (!used[j] || j == pivot) m[i][j] -= factor * m[pivot][j];
            rest[i] -= factor * rest[pivot];
        }
    }
    for (size_t k = order.size(); k-- > 0;) {
        double sum = rest[order[k]];
        for (size_t later = k + 1; later < order.size(); ++later)
            sum -= m[order[k]][order[later]] * result[order[later]];
        result[order[k]] = sum / m[order[k]][order[k]];
    }
    return result;
}

double map_color(const Terms& map, const Terms& terms) {
    double sum = 0;
    for (size_t i = 0; i < kTerms; ++i) sum += map[i] * terms[i];
    return std::clamp(sum, 0.0, 1.0);
}

}  // namespace

Image affine_corrected(const Image& a, const Image& b, const Image& weights) {
    constexpr double kLeastVariance = 1e-8, kLeastSlope = 1e-8;
    compared_channels(a, b);
    const double count = weight_sum(weights, a);
    std::vector<Color> colors = colors_of(a);
    const std::vector<Color> reference = colors_of(b);
    for (size_t c = 0; c < 3; ++c) {
        double mean_a = 0, mean_b = 0, mean_ab = 0, mean_bb = 0;
        for (size_t i = 0; i < colors.size(); ++i) {
            const double share = (weights.pixels.empty() ? 1.0 : double(weights.pixels[i])) / count;
            const double va = colors[i][c], vb = reference[i][c];
            mean_a += share * va;
            mean_b += share * vb;
            mean_ab += share * va * vb;
            mean_bb += share * vb * vb;
        }
        double slope = (mean_ab - mean_b * mean_a) / std::max(mean_bb - mean_b * mean_b, kLeastVariance);
        const double offset = mean_a - slope * mean_b;
        if (std::abs(slope) < kLeastSlope) slope = 1;
        for (Color& color : colors) color[c] = std::clamp((color[c] - offset) / slope, 0.0, 1.0);
    }
    return image_of(colors, a);
}

Image affine_fitted(const Image& a, const Image& b, const Image& weights) {
    compared_channels(a, b);
    weight_sum(weights, a);  // refuses weights of another size
    std::vector<Color> colors = colors_of(a);
    const std::vector<Color> reference = colors_of(b);
    for (size_t c = 0; c < 3; ++c) {
        NormalEquations equations;
        const auto terms_at = [&](size_t i) {
            Terms terms{};
            terms[0] = colors[i][c];
            terms[1] = 1;
            return terms;
        };
        for (size_t i = 0; i < colors.size(); ++i)
            equations.add(terms_at(i), reference[i][c],
                          weights.pixels.empty() ? 1.0 : double(weights.pixels[i]));
        const Terms map = equations.solution();
        for (size_t i = 0; i < colors.size(); ++i) colors[i][c] = map_color(map, terms_at(i));
    }
    return image_of(colors, a);
}

Image quadratic_corrected(const Image& a, const Image& b, const Image& weights) {
    constexpr int kRounds = 5;
    constexpr double kMargin = 0.5 / 255;
    compared_channels(a, b);
    weight_sum(weights, a);  // refuses weights of another size
    const auto unsaturated = [](double value) { return value >= kMargin && value <= 1 - kMargin; };
    const std::vector<Color> first = colors_of(a), reference = colors_of(b);
    std::vector<Color> colors = first;
    for (int round = 0; round < kRounds; ++round) {
        std::array<NormalEquations, 3> equations;
        for (size_t i = 0; i < colors.size(); ++i) {
            const Terms terms = terms_of(colors[i]);
            const double weight = weights.pixels.empty() ? 1.0 : double(weights.pixels[i]);
            for (size_t c = 0; c < 3; ++c)
                if (unsaturated(first[i][c]) && unsaturated(colors[i][c]) && unsaturated(reference[i][c]))
                    equations[c].add(terms, reference[i][c], weight);
        }
        std::array<Terms, 3> maps;
        for (size_t c = 0; c < 3; ++c) maps[c] = equations[c].solution();
        for (Color& color : colors) {
            const Terms terms = terms_of(color);
            for (size_t c = 0; c < 3; ++c) color[c] = map_color(maps[c], terms);
        }
    }
    return image_of(colors, a);
}

}  // namespace ewa::image
