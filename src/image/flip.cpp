// SPDX-License-Identifier: Apache-2.0
// LDR-FLIP (Andersson et al. 2020, "FLIP: A Difference Evaluator for Alternating Images"). Symbols are the paper's.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "image/metric.h"

namespace ewa::image {
namespace {

constexpr double kPixelsPerDegree =
    3840 * std::numbers::pi / 180;  // a display of 3840 px, from its width away
constexpr double kColorExponent = 0.7, kFeatureExponent = 0.5, kFeatureWidth = 0.082;
constexpr double kPc = 0.4, kPt = 0.95;

using Triple = std::array<double, 3>;
using Taps = std::vector<double>;  // an odd number, the middle one at the pixel

struct Plane {
    int width = 0, height = 0;
    std::vector<float> values;

    Plane(int width_, int height_)
        : width(width_), height(height_), values(size_t(width_) * size_t(height_)) {}
    float* row(int y) { return &values[size_t(y) * size_t(width)]; }
    const float* row(int y) const { return &values[size_t(y) * size_t(width)]; }
};

constexpr Triple kIlluminant = {0.950428545, 1.0, 1.088900371};  // D65
constexpr Triple kInverseIlluminant = {1.052156925, 1.0, 0.918357670};

Triple xyz_of_linear(const Triple& c) {
    return {(10135552.0 * c[0] + 8788810.0 * c[1] + 4435075.0 * c[2]) / 24577794,
            (2613072.0 * c[0] + 8788810.0 * c[1] + 887015.0 * c[2]) / 12288897,
            (1425312.0 * c[0] + 8788810.0 * c[1] + 70074185.0 * c[2]) / 73733382};
}

Triple linear_of_xyz(const Triple& c) {
    return {3.241003275 * c[0] - 1.537398934 * c[1] - 0.498615861 * c[2],
            -0.969224334 * c[0] + 1.875930071 * c[1] + 0.041554224 * c[2],
            0.055639423 * c[0] - 0.204011202 * c[1] + 1.057148933 * c[2]};
}

double linear_of_srgb(double value) {
    return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

Triple ycxcz_of_linear(const Triple& linear) {
    Triple xyz = xyz_of_linear(linear);
    for (size_t i = 0; i < 3; ++i) xyz[i] *= kInverseIlluminant[i];
    return {116 * xyz[1] - 16, 500 * (xyz[0] - xyz[1]), 200 * (xyz[1] - xyz[2])};
}

Triple linear_of_ycxcz(const Triple& c) {
    const double y = (c[0] + 16) / 116;
    return linear_of_xyz({(y + c[1] / 500) * kIlluminant[0], y, (y - c[2] / 200) * kIlluminant[2]});
}

/// CIELab with the chroma that Hunt's effect leaves.
Triple adjusted_lab_of_linear(const Triple& linear) {
    constexpr double kDelta = 6.0 / 29;
    Triple xyz = xyz_of_linear(linear);
    for (size_t i = 0; i < 3; ++i) {
        const double t = xyz[i] * kInverseIlluminant[i];
        xyz[i] = t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3 * kDelta * kDelta) + 4.0 / 29;
    }
    const double lightness = 116 * xyz[1] - 16;
    return {lightness, 0.01 * lightness * 500 * (xyz[0] - xyz[1]),
            0.01 * lightness * 200 * (xyz[1] - xyz[2])};
}

double hyab(const Triple& a, const Triple& b) {
    return std::abs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]);
}

Taps gaussian(int radius, double deviation) {
    Taps taps;
    for (int i = -radius; i <= radius; ++i) taps.push_back(std::exp(-0.5 * i * i / (deviation * deviation)));
    return taps;
}

double sum_of(const Taps& taps) {
    double sum = 0;
    for (const double tap : taps) sum += tap;
    return sum;
}

/// Makes the positive taps add up to 1, and the negative ones to -1.
void normalise_signs(Taps& taps) {
    double positive = 0, negative = 0;
    for (const double tap : taps) (tap > 0 ? positive : negative) += tap;
    for (double& tap : taps) tap /= tap > 0 ? positive : -negative;
}

/// The plane under the taps along x, then along y. Beyond the edges, the pixels at the edges repeat.
Plane filtered(const Plane& from, const Taps& along_x, const Taps& along_y) {
    const auto radius_x = int(along_x.size() / 2), radius_y = int(along_y.size() / 2);
    Plane half(from.width, from.height), result(from.width, from.height);
    core::on_all_cores(size_t(from.height), [&](size_t y) {
        std::vector<double> padded(size_t(from.width + 2 * radius_x)), sums(size_t(from.width), 0.0);
        const float* row = from.row(int(y));
        for (int x = 0; x < int(padded.size()); ++x)
            padded[size_t(x)] = double(row[std::clamp(x - radius_x, 0, from.width - 1)]);
        for (size_t k = 0; k < along_x.size(); ++k)
            for (size_t x = 0; x < sums.size(); ++x) sums[x] += along_x[k] * padded[x + k];
        std::copy(sums.begin(), sums.end(), half.row(int(y)));
    });
    core::on_all_cores(size_t(from.height), [&](size_t y) {
        std::vector<double> sums(size_t(from.width), 0.0);
        for (size_t k = 0; k < along_y.size(); ++k) {
            const float* row = half.row(std::clamp(int(y) + int(k) - radius_y, 0, from.height - 1));
            for (size_t x = 0; x < sums.size(); ++x) sums[x] += along_y[k] * double(row[x]);
        }
        std::copy(sums.begin(), sums.end(), result.row(int(y)));
    });
    return result;
}

/// A contrast sensitivity function: the sum of two Gaussians, a * sqrt(pi / b) exp(-pi^2 r^2 / b) of the angle r, with the sum
/// 1 over the pixels. a2 may be 0.
Plane contrast_filtered(const Plane& plane, double a1, double b1, double a2, double b2) {
    constexpr double kWidestB = 0.04;  // of all channels: they share one radius
    const int radius = int(
        std::ceil(3 * std::sqrt(kWidestB / (2 * std::numbers::pi * std::numbers::pi)) * kPixelsPerDegree));
    const auto taps_of = [&](double b) {
        return gaussian(radius, std::sqrt(b / 2) / std::numbers::pi * kPixelsPerDegree);
    };
    const Taps first = taps_of(b1);
    double share = 1;  // of the first Gaussian
    if (a2 > 0) {
        const double sum1 = sum_of(first), sum2 = sum_of(taps_of(b2));
        const double weight1 = a1 * std::sqrt(1 / b1) * sum1 * sum1;
        share = weight1 / (weight1 + a2 * std::sqrt(1 / b2) * sum2 * sum2);
    }
    const auto normalised = [](Taps taps) {
        const double sum = sum_of(taps);
        for (double& tap : taps) tap /= sum;
        return taps;
    };
    const Taps one = normalised(first);
    Plane result = filtered(plane, one, one);
    if (a2 > 0) {
        const Taps two = normalised(taps_of(b2));
        const Plane other = filtered(plane, two, two);
        for (size_t i = 0; i < result.values.size(); ++i)
            result.values[i] =
                float(share * double(result.values[i]) + (1 - share) * double(other.values[i]));
    }
    return result;
}

/// The lengths of the responses along x and y to edges or points.
Plane feature_strength(const Plane& y, bool points) {
    const double deviation = 0.5 * kFeatureWidth * kPixelsPerDegree;
    const int radius = int(std::ceil(3 * deviation));
    Taps across = gaussian(radius, deviation), along = across;
    const double sum = sum_of(along);
    for (double& tap : along) tap /= sum;
    for (int i = -radius; i <= radius; ++i)
        across[size_t(i + radius)] *= points ? i * i / (deviation * deviation) - 1 : -double(i);
    normalise_signs(across);
    Plane result = filtered(y, across, along);
    const Plane other = filtered(y, along, across);
    for (size_t i = 0; i < result.values.size(); ++i)
        result.values[i] = std::hypot(result.values[i], other.values[i]);
    return result;
}

/// What FLIP compares of an image.
struct Perceived {
    std::array<Plane, 3> lab;
    Plane edges, points;
};

Perceived perceive(const Image& image) {
    Plane y(image.width, image.height), cx = y, cz = y;
    core::on_all_cores(size_t(image.height), [&](size_t row) {
        for (int x = 0; x < image.width; ++x) {
            const float* pixel = image.at(x, int(row));
            Triple linear;
            for (size_t c = 0; c < 3; ++c) linear[c] = linear_of_srgb(std::clamp(double(pixel[c]), 0.0, 1.0));
            const Triple color = ycxcz_of_linear(linear);
            y.row(int(row))[x] = float(color[0]);
            cx.row(int(row))[x] = float(color[1]);
            cz.row(int(row))[x] = float(color[2]);
        }
    });
    std::array<Plane, 3> lab = {contrast_filtered(y, 1, 0.0047, 0, 1), contrast_filtered(cx, 1, 0.0053, 0, 1),
                                contrast_filtered(cz, 34.1, 0.04, 13.5, 0.025)};
    core::on_all_cores(size_t(image.height), [&](size_t row) {
        for (int x = 0; x < image.width; ++x) {
            Triple color;
            for (size_t c = 0; c < 3; ++c) color[c] = double(lab[c].row(int(row))[x]);
            color = linear_of_ycxcz(color);
            for (double& value : color) value = std::clamp(value, 0.0, 1.0);
            color = adjusted_lab_of_linear(color);
            for (size_t c = 0; c < 3; ++c) lab[c].row(int(row))[x] = float(color[c]);
        }
    });
    for (float& value : y.values) value = (value + 16) / 116;
    return {std::move(lab), feature_strength(y, false), feature_strength(y, true)};
}

double flip_at(const Perceived& a, const Perceived& b, size_t i) {
    static const double most =
        std::pow(hyab(adjusted_lab_of_linear({0, 1, 0}), adjusted_lab_of_linear({0, 0, 1})), kColorExponent);
    const auto color = [&](const Perceived& p) {
        return Triple{double(p.lab[0].values[i]), double(p.lab[1].values[i]), double(p.lab[2].values[i])};
    };
    const double distance = std::pow(hyab(color(a), color(b)), kColorExponent);
    const double limit = kPc * most;
    const double color_error =
        distance < limit ? kPt / limit * distance : kPt + (distance - limit) / (most - limit) * (1 - kPt);
    const double features = std::max(std::abs(double(a.edges.values[i]) - double(b.edges.values[i])),
                                     std::abs(double(a.points.values[i]) - double(b.points.values[i])));
    return std::pow(color_error, 1 - std::pow(features / std::numbers::sqrt2, kFeatureExponent));
}

}  // namespace

double flip(const Image& a, const Image& b, const Image& weights) {
    compared_channels(a, b);
    const double count = weight_sum(weights, a);
    if (count == 0) return std::numeric_limits<double>::quiet_NaN();
    const Perceived seen = perceive(pulled_onto(a, b, weights)), wanted = perceive(b);
    std::vector<double> rows(size_t(a.height));
    core::on_all_cores(rows.size(), [&](size_t y) {
        for (int x = 0; x < a.width; ++x)
            rows[y] += weight_at(weights, x, int(y)) * flip_at(seen, wanted, y * size_t(a.width) + size_t(x));
    });
    double sum = 0;
    for (const double row : rows) sum += row;
    return sum / count;
}

}  // namespace ewa::image
