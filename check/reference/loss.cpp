// SPDX-License-Identifier: Apache-2.0
#include "reference/loss.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "shared/constants.h"

namespace ewa::reference {

using namespace shared;

std::vector<double> ssim_window() {
    const int radius = int(SSIM_RADIUS);
    std::vector<double> window;
    double sum = 0;
    for (int k = -radius; k <= radius; ++k) {
        window.push_back(std::exp(-k * k / (2 * SSIM_SIGMA * SSIM_SIGMA)));
        sum += window.back();
    }
    for (double& w : window) w /= sum;
    return window;
}

namespace {

/// One channel of an image.
using Plane = std::vector<double>;

/// dot(window, values around i), with zeros outside [0, size).
double tap(const std::vector<double>& window, const double* values, int i, int size, size_t stride) {
    const int radius = int(window.size() / 2);
    double sum = 0;
    for (int k = std::max(-radius, -i); k <= std::min(radius, size - 1 - i); ++k)
        sum += window[size_t(k + radius)] * values[size_t(i + k) * stride];
    return sum;
}

Plane blur(const std::vector<double>& window, const Plane& in, int width, int height) {
    Plane rows(in.size()), out(in.size());
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            rows[size_t(y) * width + x] = tap(window, &in[size_t(y) * width], x, width, 1);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            out[size_t(y) * width + x] = tap(window, &rows[size_t(x)], y, height, size_t(width));
    return out;
}

Plane product(const Plane& a, const Plane& b) {
    Plane out(a.size());
    for (size_t i = 0; i < a.size(); ++i) out[i] = a[i] * b[i];
    return out;
}

Plane channel(const Raster& raster, int k) {
    Plane out(size_t(raster.width) * raster.height);
    for (size_t i = 0; i < out.size(); ++i) out[i] = raster.values[3 * i + k];
    return out;
}

Plane limited(Plane plane) {
    for (double& v : plane) v = std::clamp(v, -SSIM_LIMIT, SSIM_LIMIT);
    return plane;
}

/// Returns the sum of SSIM over the plane, and its gradient with respect to `rendered`.
double ssim_sum(const Plane& rendered, const Plane& target, int width, int height, Plane& gradient) {
    const std::vector<double> window = ssim_window();
    const Plane x = limited(rendered), y = limited(target);
    const Plane mx = blur(window, x, width, height), my = blur(window, y, width, height);
    const Plane xx = blur(window, product(x, x), width, height),
                yy = blur(window, product(y, y), width, height);
    const Plane xy = blur(window, product(x, y), width, height);
    Plane by_mx(x.size()), by_xx(x.size()), by_xy(x.size());
    double sum = 0;
    for (size_t i = 0; i < x.size(); ++i) {
        const double sxx = xx[i] - mx[i] * mx[i], syy = yy[i] - my[i] * my[i], sxy = xy[i] - mx[i] * my[i];
        const double n1 = 2 * mx[i] * my[i] + SSIM_C1, n2 = 2 * sxy + SSIM_C2;
        const double d1 = mx[i] * mx[i] + my[i] * my[i] + SSIM_C1, d2 = sxx + syy + SSIM_C2;
        const double ssim = n1 * n2 / (d1 * d2);
        sum += ssim;
        by_xx[i] = -ssim / d2;
        by_xy[i] = 2 * n1 / (d1 * d2);
        // mx occurs in n1 and d1, and through the products of means in sxx and sxy.
        by_mx[i] =
            2 * my[i] * n2 / (d1 * d2) - 2 * mx[i] * ssim / d1 - 2 * mx[i] * by_xx[i] - my[i] * by_xy[i];
    }
    const Plane from_mx = blur(window, by_mx, width, height);
    const Plane from_xx = blur(window, by_xx, width, height), from_xy = blur(window, by_xy, width, height);
    gradient.resize(x.size());
    for (size_t i = 0; i < x.size(); ++i)
        gradient[i] =
            std::abs(rendered[i]) <= SSIM_LIMIT ? from_mx[i] + 2 * x[i] * from_xx[i] + y[i] * from_xy[i] : 0;
    return sum;
}

}  // namespace

Loss image_loss(const Raster& rendered, const Raster& target, const LossWeights& terms) {
    assert(rendered.width == target.width && rendered.height == target.height);
    assert(rendered.channels == 3 && target.channels == 3);
    const double count = double(rendered.values.size());
    Loss out;
    out.gradient = Raster(rendered.width, rendered.height, 3);
    for (size_t i = 0; i < rendered.values.size(); ++i) {
        const double difference = rendered.values[i] - target.values[i];
        out.l1 += std::abs(difference) / count;
        const double size = std::min(std::abs(difference), SSIM_LIMIT);
        out.l2 += size * (2 * std::abs(difference) - size) / count;
        const double shown =
            std::clamp(rendered.values[i], 0.0, 1.0) - std::clamp(target.values[i], 0.0, 1.0);
        out.squared += shown * shown / count;
        const double sign = difference > 0 ? 1 : difference < 0 ? -1 : 0;
        out.gradient.values[i] = (terms.l1 + 2 * terms.l2 * size) * sign / count;
    }
    for (int k = 0; k < 3; ++k) {
        Plane by_x;
        out.ssim +=
            ssim_sum(channel(rendered, k), channel(target, k), rendered.width, rendered.height, by_x) / count;
        for (size_t i = 0; i < by_x.size(); ++i)
            out.gradient.values[3 * i + k] -= terms.ssim * by_x[i] / count;
    }
    out.loss = terms.l1 * out.l1 + terms.l2 * out.l2 + terms.ssim * (1 - out.ssim);
    return out;
}

Loss image_loss(const Raster& rendered, const Raster& target, const Raster& weights,
                const LossWeights& terms) {
    assert(weights.width == rendered.width && weights.height == rendered.height && weights.channels == 1);
    Raster pulled = rendered;
    for (size_t i = 0; i < pulled.values.size(); ++i) {
        const double weight = weights.values[i / 3];
        pulled.values[i] = weight * rendered.values[i] + (1 - weight) * target.values[i];
    }
    Loss out = image_loss(pulled, target, terms);
    for (size_t i = 0; i < pulled.values.size(); ++i) out.gradient.values[i] *= weights.values[i / 3];
    return out;
}

AlphaLoss alpha_loss(const Raster& transmittance, const Raster& alpha) {
    assert(alpha.values.size() == transmittance.values.size() && alpha.channels == 1);
    const double count = double(alpha.values.size());
    AlphaLoss out{0, Raster(alpha.width, alpha.height, 1)};
    for (size_t i = 0; i < alpha.values.size(); ++i) {
        const double difference = 1 - transmittance.values[i] - alpha.values[i];
        out.difference += std::abs(difference) / count;
        out.gradient.values[i] = (difference > 0 ? -1 : difference < 0 ? 1 : 0) / count;
    }
    return out;
}

DepthLoss depth_loss(const Raster& depth_sum, const Raster& transmittance, const Raster& depths) {
    assert(depths.values.size() == transmittance.values.size() && depths.channels == 1);
    const double count = double(depths.values.size());
    DepthLoss out{0, Raster(depths.width, depths.height, 1), Raster(depths.width, depths.height, 1)};
    for (size_t i = 0; i < depths.values.size(); ++i) {
        const double opacity = 1 - transmittance.values[i], sum = depth_sum.values[i];
        if (!(depths.values[i] > 0 && opacity >= DEPTH_OPACITY_MIN)) continue;
        const double difference = std::log(sum / opacity) - std::log(depths.values[i]);
        const double slope = double((difference > 0) - (difference < 0)) / count;
        out.difference += std::abs(difference) / count;
        out.by_sum.values[i] = slope / sum;
        out.by_left.values[i] = slope / opacity;
    }
    return out;
}

Raster exposed(const Raster& image, const Exposure& e) {
    Raster out(image.width, image.height, 3);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            const double* c = image.at(x, y);
            for (size_t row = 0; row < 3; ++row)
                out.at(x, y)[row] =
                    e[4 * row] * c[0] + e[4 * row + 1] * c[1] + e[4 * row + 2] * c[2] + e[4 * row + 3];
        }
    return out;
}

ExposureGradient exposed_backward(const Raster& image, const Exposure& e, const Raster& gradient) {
    assert(image.width == gradient.width && image.height == gradient.height);
    ExposureGradient out{Raster(image.width, image.height, 3), {}};
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            for (size_t row = 0; row < 3; ++row) {
                const double g = gradient.at(x, y)[row];
                for (size_t k = 0; k < 3; ++k) {
                    out.image.at(x, y)[k] += g * e[4 * row + k];
                    out.exposure[4 * row + k] += g * image.at(x, y)[k];
                }
                out.exposure[4 * row + 3] += g;
            }
    return out;
}

}  // namespace ewa::reference
