// SPDX-License-Identifier: Apache-2.0
#include "reference/appearance.h"

#include <algorithm>
#include <cmath>

#include "shared/constants.h"
#include "shared/layouts.h"

namespace ewa::reference {
namespace {

using namespace shared;

constexpr size_t kInputs = 3 + 9 + 27;  // colour, photo, camera

/// A value with its derivatives by all inputs.
struct Dual {
    double value = 0;
    std::array<double, kInputs> by{};
    Dual(double x = 0) : value(x) {}
};

/// f with the slopes of f by a and by b.
Dual chained(double f, const Dual& a, double by_a, const Dual& b = {}, double by_b = 0) {
    Dual out(f);
    for (size_t k = 0; k < kInputs; ++k) out.by[k] = by_a * a.by[k] + by_b * b.by[k];
    return out;
}
Dual operator+(const Dual& a, const Dual& b) {
    return chained(a.value + b.value, a, 1, b, 1);
}
Dual operator-(const Dual& a, const Dual& b) {
    return chained(a.value - b.value, a, 1, b, -1);
}
Dual operator*(const Dual& a, const Dual& b) {
    return chained(a.value * b.value, a, b.value, b, a.value);
}
Dual operator/(const Dual& a, const Dual& b) {
    return chained(a.value / b.value, a, 1 / b.value, b, -a.value / (b.value * b.value));
}
Dual exponential(const Dual& a) {
    return chained(std::exp(a.value), a, std::exp(a.value));
}
Dual logarithm(const Dual& a) {
    return chained(std::log(a.value), a, 1 / a.value);
}
/// With the derivative 1 at the limits.
Dual clamped(const Dual& a, double low, double high) {
    const bool inside = a.value >= low && a.value <= high;
    return inside ? a : Dual(std::clamp(a.value, low, high));
}
Dual power(const Dual& base, const Dual& exponent) {
    return exponential(exponent * logarithm(clamped(base, PPISP_BASE_MIN, INFINITY)));
}
Dual softplus(const Dual& a) {
    return logarithm(1 + exponential(a));
}

using Vector = std::array<Dual, 3>;
Vector cross(const Vector& a, const Vector& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double squared_length(const Vector& v) {
    return v[0].value * v[0].value + v[1].value * v[1].value + v[2].value * v[2].value;
}

/// The homography, row by row.
std::array<Vector, 3> homography(const Dual* latent) {
    constexpr std::array<std::array<double, 3>, 4> kBlocks{{{PPISP_BLUE_XX, PPISP_BLUE_XY, PPISP_BLUE_YY},
                                                            {PPISP_RED_XX, PPISP_RED_XY, PPISP_RED_YY},
                                                            {PPISP_GREEN_XX, PPISP_GREEN_XY, PPISP_GREEN_YY},
                                                            {PPISP_GREY_XX, PPISP_GREY_XY, PPISP_GREY_YY}}};
    const std::array<std::array<double, 2>, 4> sources{{{0, 0}, {1, 0}, {0, 1}, {1.0 / 3, 1.0 / 3}}};
    std::array<Vector, 4> target;
    for (size_t k = 0; k < 4; ++k) {
        const Dual &x = latent[2 * k], &y = latent[2 * k + 1];
        const auto& [xx, xy, yy] = kBlocks[k];
        target[k] = {sources[k][0] + xx * x + xy * y, sources[k][1] + xy * x + yy * y, 1};
    }
    // Rows of M = [grey]x T: column j of M is grey x target j.
    std::array<Vector, 3> m;
    for (size_t j = 0; j < 3; ++j) {
        const Vector column = cross(target[3], target[j]);
        for (size_t i = 0; i < 3; ++i) m[i][j] = column[i];
    }
    Vector lambda = cross(m[0], m[1]);
    for (const Vector& other : {cross(m[0], m[2]), cross(m[1], m[2])})
        if (squared_length(other) > squared_length(lambda)) lambda = other;
    constexpr double kInverse[3][3] = {{-1, -1, 1}, {1, 0, 0}, {0, 1, 0}};
    std::array<Vector, 3> h;
    for (size_t i = 0; i < 3; ++i)
        for (size_t j = 0; j < 3; ++j)
            for (size_t k = 0; k < 3; ++k) h[i][j] = h[i][j] + target[k][i] * lambda[k] * kInverse[k][j];
    const Dual last = h[2][2];
    for (Vector& row : h)
        for (Dual& entry : row) entry = entry / last;
    return h;
}

Dual response(const Dual& x, const Dual* raw) {
    const Dual toe = PPISP_CURVE_MIN + softplus(raw[0]), shoulder = PPISP_CURVE_MIN + softplus(raw[1]);
    const Dual gamma = PPISP_GAMMA_MIN + softplus(raw[2]), middle = 1 / (1 + exponential(0 - raw[3]));
    const Dual a = shoulder * middle / (toe + middle * (shoulder - toe)), b = 1 - a;
    const Dual y = x.value <= middle.value ? a * power(x / middle, toe)
                                           : 1 - b * power((1 - x) / (1 - middle), shoulder);
    return power(y, gamma);
}

/// h: of the photo. place: from the image's middle, in units of the larger side.
Vector shown(const Vector& color, const Dual& exposure, const std::array<Vector, 3>& h, const Dual* camera,
             const std::array<double, 2>& place) {
    Vector c;
    for (size_t k = 0; k < 3; ++k) {
        const Dual* v = camera + 9 * k;
        const Dual x = place[0] - v[0], y = place[1] - v[1], r2 = x * x + y * y;
        const Dual shade = 1 + v[2] * r2 + v[3] * r2 * r2 + v[4] * r2 * r2 * r2;
        c[k] = color[k] * exponential(std::log(2.0) * exposure) * clamped(shade, 0, 1);
    }
    const Dual intensity = c[0] + c[1] + c[2];
    Vector q;
    for (size_t i = 0; i < 3; ++i) q[i] = h[i][0] * c[0] + h[i][1] * c[1] + h[i][2] * intensity;
    const Dual scale = intensity / (q[2] + PPISP_INTENSITY_MIN);
    const Dual red = q[0] * scale, green = q[1] * scale, blue = q[2] * scale - red - green;
    return {response(clamped(red, 0, 1), camera + 5), response(clamped(green, 0, 1), camera + 14),
            response(clamped(blue, 0, 1), camera + 23)};
}

/// Calls use(x, y, colour as shown) with the derivatives by each pixel's colour and by all values.
template <class Use>
void develop(const Raster& image, const PpispPhoto& photo, const PpispCamera& camera, const Use& use) {
    const auto input = [](double value, size_t index) {
        Dual dual(value);
        dual.by[index] = 1;
        return dual;
    };
    std::array<Dual, 36> values;
    for (size_t k = 0; k < 36; ++k) values[k] = input(k < 9 ? photo[k] : camera[k - 9], 3 + k);
    const auto h = homography(&values[1]);
    const double larger = std::max(image.width, image.height);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            Vector color;
            for (size_t k = 0; k < 3; ++k) color[k] = input(image.at(x, y)[k], k);
            use(x, y,
                shown(color, values[0], h, &values[9],
                      {(x + 0.5 - 0.5 * image.width) / larger, (y + 0.5 - 0.5 * image.height) / larger}));
        }
}

double smooth_l1(double x, double beta) {
    return std::abs(x) < beta ? 0.5 * x * x / beta : std::abs(x) - 0.5 * beta;
}

}  // namespace

Raster ppisp(const Raster& image, const PpispPhoto& photo, const PpispCamera& camera) {
    Raster out(image.width, image.height, 3);
    develop(image, photo, camera, [&](int x, int y, const Vector& color) {
        for (size_t k = 0; k < 3; ++k) out.at(x, y)[k] = color[k].value;
    });
    return out;
}

PpispGradient ppisp_backward(const Raster& image, const PpispPhoto& photo, const PpispCamera& camera,
                             const Raster& gradient) {
    PpispGradient out{Raster(image.width, image.height, 3)};
    develop(image, photo, camera, [&](int x, int y, const Vector& color) {
        for (size_t k = 0; k < 3; ++k) {
            const double g = gradient.at(x, y)[k];
            for (size_t i = 0; i < 3; ++i) out.image.at(x, y)[i] += g * color[k].by[i];
            for (size_t i = 0; i < 9; ++i) out.photo[i] += g * color[k].by[3 + i];
            for (size_t i = 0; i < 27; ++i) out.camera[i] += g * color[k].by[12 + i];
        }
    });
    return out;
}

double ppisp_penalty(const PpispPhoto& means) {
    constexpr double kBlocks[4][3] = {{PPISP_BLUE_XX, PPISP_BLUE_XY, PPISP_BLUE_YY},
                                      {PPISP_RED_XX, PPISP_RED_XY, PPISP_RED_YY},
                                      {PPISP_GREEN_XX, PPISP_GREEN_XY, PPISP_GREEN_YY},
                                      {PPISP_GREY_XX, PPISP_GREY_XY, PPISP_GREY_YY}};
    double sum = smooth_l1(means[0], PPISP_EXPOSURE_BETA);
    for (size_t k = 0; k < 4; ++k) {
        const double x = means[1 + 2 * k], y = means[2 + 2 * k];
        sum += smooth_l1(kBlocks[k][0] * x + kBlocks[k][1] * y, PPISP_COLOR_BETA) +
               smooth_l1(kBlocks[k][1] * x + kBlocks[k][2] * y, PPISP_COLOR_BETA);
    }
    return sum;
}

double ppisp_penalty(const PpispCamera& camera) {
    double center = 0, rise = 0, vignette = 0, curve = 0;
    for (size_t k = 0; k < 9; ++k) {
        const double values[3] = {camera[k], camera[9 + k], camera[18 + k]};
        const double mean = (values[0] + values[1] + values[2]) / 3;
        for (const double value : values) {
            if (k < 2) center += value * value / 3;
            if (k >= 2 && k < 5) rise += std::max(value, 0.0) / 9;
            (k < 5 ? vignette : curve) += (value - mean) * (value - mean) / 3 / (k < 5 ? 5 : 4);
        }
    }
    return PPISP_CENTER_WEIGHT * center + PPISP_RISE_WEIGHT * rise +
           PPISP_CHANNEL_WEIGHT * (vignette + curve);
}

namespace {

/// The 8 cells around a pixel, with their weights and the weights' derivatives by the colour's grey.
struct Corner {
    size_t cell;  // its first value
    double weight, by_grey;
};
std::array<Corner, 8> corners_of(const Raster& image, int x, int y) {
    const double* c = image.at(x, y);
    const double grey = GREY_RED * c[0] + GREY_GREEN * c[1] + GREY_BLUE * c[2];
    const std::array<int, 3> size{int(GRID_WIDTH), int(GRID_HEIGHT), int(GRID_DEPTH)};
    const std::array<double, 3> place{(x + 0.5) / image.width * (size[0] - 1),
                                      (y + 0.5) / image.height * (size[1] - 1),
                                      std::clamp(grey, 0.0, 1.0) * (size[2] - 1)};
    std::array<Corner, 8> corners;
    for (size_t corner = 0; corner < 8; ++corner) {
        std::array<size_t, 3> cell;
        std::array<double, 3> weight;
        for (size_t k = 0; k < 3; ++k) {
            const int first = std::min(int(place[k]), size[k] - 2), step = int(corner >> k & 1);
            cell[k] = size_t(first + step);
            weight[k] = step == 1 ? place[k] - first : first + 1 - place[k];
        }
        const double slope = grey >= 0 && grey <= 1 ? (corner >> 2 ? 1 : -1) * (size[2] - 1) : 0;
        corners[corner] = {12 * (cell[0] + GRID_WIDTH * (cell[1] + GRID_HEIGHT * cell[2])),
                           weight[0] * weight[1] * weight[2], weight[0] * weight[1] * slope};
    }
    return corners;
}

/// Calls use(value, its neighbour, weight) for each pair of neighbouring values along the three axes.
template <class Use>
void for_neighbours(const Use& use) {
    const std::array<size_t, 3> size{GRID_WIDTH, GRID_HEIGHT, GRID_DEPTH};
    const std::array<size_t, 3> step{12, 12 * GRID_WIDTH, 12 * GRID_WIDTH * GRID_HEIGHT};
    for (size_t axis = 0; axis < 3; ++axis) {
        const double pairs = double(GRID_FLOATS) / double(size[axis]) * double(size[axis] - 1);
        for (size_t i = 0; i < GRID_FLOATS; ++i)
            if (i / step[axis] % size[axis] + 1 < size[axis])
                use(i, i + step[axis], GRID_VARIATION_WEIGHT / pairs);
    }
}

}  // namespace

Raster sliced(const Raster& image, const Grid& grid) {
    Raster out(image.width, image.height, 3);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            for (const Corner& corner : corners_of(image, x, y))
                for (size_t c = 0; c < 3; ++c) {
                    const double* row = &grid[corner.cell + 4 * c];
                    const double* from = image.at(x, y);
                    out.at(x, y)[c] +=
                        corner.weight * (row[0] * from[0] + row[1] * from[1] + row[2] * from[2] + row[3]);
                }
    return out;
}

GridGradient sliced_backward(const Raster& image, const Grid& grid, const Raster& gradient) {
    GridGradient out{Raster(image.width, image.height, 3), Grid(grid.size())};
    constexpr double kGrey[3] = {GREY_RED, GREY_GREEN, GREY_BLUE};
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            for (const Corner& corner : corners_of(image, x, y))
                for (size_t c = 0; c < 3; ++c) {
                    const double* row = &grid[corner.cell + 4 * c];
                    const double* from = image.at(x, y);
                    const double g = gradient.at(x, y)[c];
                    const double mapped = row[0] * from[0] + row[1] * from[1] + row[2] * from[2] + row[3];
                    for (size_t k = 0; k < 3; ++k) {
                        out.image.at(x, y)[k] +=
                            g * (corner.weight * row[k] + corner.by_grey * mapped * kGrey[k]);
                        out.grid[corner.cell + 4 * c + k] += g * corner.weight * from[k];
                    }
                    out.grid[corner.cell + 4 * c + 3] += g * corner.weight;
                }
    return out;
}

double grid_variation(const Grid& grid) {
    double sum = 0;
    for_neighbours([&](size_t a, size_t b, double weight) {
        sum += weight * (grid[a] - grid[b]) * (grid[a] - grid[b]);
    });
    return sum;
}

Grid grid_variation_gradient(const Grid& grid) {
    Grid out(grid.size());
    for_neighbours([&](size_t a, size_t b, double weight) {
        out[a] += 2 * weight * (grid[a] - grid[b]);
        out[b] += 2 * weight * (grid[b] - grid[a]);
    });
    return out;
}

}  // namespace ewa::reference
