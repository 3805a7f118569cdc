// SPDX-License-Identifier: Apache-2.0
#include "reference/screen.h"

#include <cmath>

namespace ewa::reference {
namespace {

struct Layer {
    uint32_t splat;
    double dx, dy;  // pixel - mean
    Alpha alpha;
    double transmittance;  // before the splat
};

/// -d^T conic d / 2.
double power_of(const ScreenValues& splats, size_t i, double dx, double dy) {
    const double* shape = &splats.conics[3 * i];
    if (!splats.whiteners) return -0.5 * (shape[0] * dx * dx + 2 * shape[1] * dx * dy + shape[2] * dy * dy);
    const double u = shape[0] * (dx - shape[1] * dy), v = shape[2] * dy;
    return -(u * u + v * v);
}

/// The splats that a pixel draws; `left` receives the last transmittance.
std::vector<Layer> layers_of(const ScreenValues& splats, std::span<const uint32_t> order, int x, int y,
                             const Smoothing& smoothing, double& left) {
    std::vector<Layer> layers;
    left = 1;
    const glm::dvec2 pixel = pixel_centre(x, y);
    for (const uint32_t i : order) {
        const double dx = pixel.x - splats.means2d[2 * i], dy = pixel.y - splats.means2d[2 * i + 1];
        const Alpha alpha = alpha_of(splats.opacities[i] * std::exp(power_of(splats, i, dx, dy)), smoothing);
        if (!alpha.kept) continue;
        const double next = left * (1 - alpha.value);
        if (smoothing.transmittance_stop && stops(next)) break;
        layers.push_back({i, dx, dy, alpha, left});
        left = next;
    }
    return layers;
}

/// Adds the gradient by the mean and the shape, with g = dL/d(power).
void add_power(const ScreenValues& splats, const Layer& s, double g, ScreenValuesGradient& gradient) {
    const size_t i = s.splat;
    const double* shape = &splats.conics[3 * i];
    double* shape_gradient = &gradient.values.conics[3 * i];
    double by_mean[2];
    if (splats.whiteners) {
        const double ux = shape[0], k = shape[1], vy = shape[2], w = s.dx - k * s.dy;
        shape_gradient[0] -= g * 2 * ux * w * w;
        shape_gradient[1] += g * 2 * ux * ux * w * s.dy;
        shape_gradient[2] -= g * 2 * vy * s.dy * s.dy;
        by_mean[0] = g * 2 * ux * ux * w;
        by_mean[1] = g * 2 * (vy * vy * s.dy - k * ux * ux * w);
    } else {
        shape_gradient[0] -= g * 0.5 * s.dx * s.dx;
        shape_gradient[1] -= g * s.dx * s.dy;
        shape_gradient[2] -= g * 0.5 * s.dy * s.dy;
        by_mean[0] = g * (shape[0] * s.dx + shape[1] * s.dy);
        by_mean[1] = g * (shape[1] * s.dx + shape[2] * s.dy);
    }
    for (size_t axis = 0; axis < 2; ++axis) {
        gradient.values.means2d[2 * i + axis] += by_mean[axis];
        gradient.absolute[2 * i + axis] += std::abs(by_mean[axis]);
    }
}

}  // namespace

ScreenImage blend(const ScreenValues& splats, std::span<const uint32_t> order, int width, int height,
                  const Smoothing& smoothing) {
    const size_t channels = splats.channels;
    ScreenImage image{width, height, {}, {}};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            double left;
            const std::vector<Layer> layers = layers_of(splats, order, x, y, smoothing, left);
            for (size_t c = 0; c < channels; ++c) {
                double sum = left * splats.background[c];
                for (const Layer& s : layers)
                    sum += splats.features[channels * s.splat + c] * s.alpha.value * s.transmittance;
                image.features.push_back(sum);
            }
            image.alphas.push_back(1 - left);
        }
    return image;
}

ScreenValuesGradient blend_backward(const ScreenValues& splats, std::span<const uint32_t> order, int width,
                                    int height, std::span<const double> features_gradient,
                                    std::span<const double> alphas_gradient, const Smoothing& smoothing) {
    const size_t channels = splats.channels, n = splats.size();
    ScreenValuesGradient gradient;
    ScreenValues& g = gradient.values;
    g = {std::vector<double>(2 * n),
         std::vector<double>(3 * n),
         std::vector<double>(n),
         std::vector<double>(channels * n),
         std::vector<double>(channels),
         channels,
         splats.whiteners};
    gradient.absolute.assign(2 * n, 0.0);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            double left;
            const std::vector<Layer> layers = layers_of(splats, order, x, y, smoothing, left);
            const size_t pixel = size_t(y) * size_t(width) + size_t(x);
            const double* incoming = &features_gradient[pixel * channels];
            // What is behind the splat, back to front.
            double behind = -left * alphas_gradient[pixel];
            for (size_t c = 0; c < channels; ++c) {
                behind += left * splats.background[c] * incoming[c];
                g.background[c] += left * incoming[c];
            }
            for (size_t k = layers.size(); k-- > 0;) {
                const Layer& s = layers[k];
                const double weight = s.alpha.value * s.transmittance;
                double own = 0;
                for (size_t c = 0; c < channels; ++c) {
                    own += splats.features[channels * s.splat + c] * incoming[c];
                    g.features[channels * s.splat + c] += weight * incoming[c];
                }
                const double by_alpha = s.transmittance * own - behind / (1 - s.alpha.value);
                behind += weight * own;
                // d(alpha) / d(raw), and raw = opacity exp(power).
                const double peak = std::exp(power_of(splats, s.splat, s.dx, s.dy));
                g.opacities[s.splat] += by_alpha * s.alpha.slope * peak;
                add_power(splats, s, by_alpha * s.alpha.slope * peak * splats.opacities[s.splat], gradient);
            }
        }
    return gradient;
}

}  // namespace ewa::reference
