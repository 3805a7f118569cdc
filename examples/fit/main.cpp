// SPDX-License-Identifier: Apache-2.0
// Fits splats to one image by its squared error: fit IMAGE OUT.png [STEPS]
//
// The loss and the optimiser are this program's own. libewa's operators give the image and carry the gradient back.
#include <ewa/error.h>
#include <ewa/image.h>
#include <ewa/operators.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>

namespace {

constexpr size_t kSplats = 600;

/// What is learned, each with the moments of Adam (Kingma and Ba 2015, algorithm 1).
struct Parameter {
    std::vector<float> values, first, second;
    float rate;

    Parameter(size_t count, float r) : values(count), first(count), second(count), rate(r) {}
    void step(const std::vector<float>& gradient, int number) {
        const float bias1 = 1 - std::pow(0.9f, float(number)), bias2 = 1 - std::pow(0.999f, float(number));
        for (size_t i = 0; i < values.size(); ++i) {
            first[i] += 0.1f * (gradient[i] - first[i]);
            second[i] += 0.001f * (gradient[i] * gradient[i] - second[i]);
            values[i] -= rate * (first[i] / bias1) / (std::sqrt(second[i] / bias2) + 1e-8f);
        }
    }
};

/// Splats at depth 1 before a camera that sees the square from -0.5 to 0.5.
struct Scene {
    Parameter means{3 * kSplats, 2e-3f}, quaternions{4 * kSplats, 1e-2f}, log_scales{3 * kSplats, 1e-2f},
        logits{kSplats, 2e-2f}, colors{3 * kSplats, 1e-2f};

    Scene() {
        std::mt19937 random(1);
        std::uniform_real_distribution<float> uniform(-0.5f, 0.5f);
        for (size_t i = 0; i < means.values.size(); ++i)
            means.values[i] = i % 3 == 2 ? 0.0f : uniform(random);
        for (float& value : quaternions.values) value = uniform(random);
        for (float& value : log_scales.values) value = std::log(0.02f);
        for (float& value : colors.values) value = 0.5f + uniform(random);
    }
};

/// One step of gradient descent. Returns the mean squared error, and the image in `shown`.
double descend(ewa::Operators& operators, Scene& scene, const ewa::Image& target, int number,
               ewa::Image& shown) {
    const auto width = uint32_t(target.width), height = uint32_t(target.height);
    std::vector<float> scales, opacities;
    for (const float value : scene.log_scales.values) scales.push_back(std::exp(value));
    for (const float value : scene.logits.values) opacities.push_back(1 / (1 + std::exp(-value)));
    const std::array<float, 16> view{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 1};
    const std::array<float, 9> lens{
        float(width), 0, 0.5f * float(width), 0, float(height), 0.5f * float(height), 0, 0, 1};

    const ewa::SplatArrays splats{.means = scene.means.values,
                                  .quaternions = scene.quaternions.values,
                                  .scales = scales,
                                  .covariances = {},
                                  .opacities = opacities};
    const ewa::ViewArrays views{.view_matrices = view, .intrinsics = lens};
    ewa::ProjectionOptions projection;
    projection.width = width;
    projection.height = height;
    projection.whiteners = true;
    const ewa::ProjectedSplats projected = operators.project(splats, views, projection);

    const ewa::ScreenSplats screen{.means2d = projected.means2d,
                                   .conics = projected.conics,
                                   .whiteners = true,
                                   .opacities = opacities,
                                   .features = scene.colors.values,
                                   .channels = 3};
    ewa::BlendOptions blending;
    blending.width = width;
    blending.height = height;
    const ewa::BlendedImage image =
        operators.blend(screen, ewa::DepthOrder{projected.depths, projected.radii}, blending);

    std::vector<float> image_gradient(image.features.size());
    double error = 0;
    for (size_t i = 0; i < image_gradient.size(); ++i) {
        const float difference = image.features[i] - target.pixels[i / 3 * size_t(target.channels) + i % 3];
        error += double(difference) * difference;
        image_gradient[i] = 2 * difference / float(image_gradient.size());
    }
    const ewa::ScreenGradient by_screen = operators.blend_backward(*image.record, image_gradient, {}, false);
    const ewa::SplatGradient by_splats = operators.project_backward(
        splats, views, projection, projected.radii,
        {.means2d = by_screen.means2d, .depths = {}, .conics = by_screen.conics, .compensations = {}}, false);

    std::vector<float> by_log_scales = by_splats.scales, by_logits = by_screen.opacities;
    for (size_t i = 0; i < scales.size(); ++i) by_log_scales[i] *= scales[i];
    for (size_t i = 0; i < kSplats; ++i) by_logits[i] *= opacities[i] * (1 - opacities[i]);
    scene.means.step(by_splats.means, number);
    scene.quaternions.step(by_splats.quaternions, number);
    scene.log_scales.step(by_log_scales, number);
    scene.logits.step(by_logits, number);
    scene.colors.step(by_screen.features, number);
    std::copy(image.features.begin(), image.features.end(), shown.pixels.begin());
    return error / double(image_gradient.size());
}

}  // namespace

int main(int count, char** arguments) try {
    if (count < 3 || count > 4) {
        std::fputs("fit IMAGE OUT.png [STEPS]\n", stderr);
        return 2;
    }
    const ewa::Image target = ewa::load_image(arguments[1]);
    const int steps = count > 3 ? std::atoi(arguments[3]) : 300;
    ewa::Operators operators(ewa::open_device({}));
    Scene scene;
    ewa::Image shown(target.width, target.height, 3);
    for (int number = 1; number <= steps; ++number) {
        const double error = descend(operators, scene, target, number, shown);
        if (number % 50 == 0 || number == steps)
            std::printf("step %d: %.2f dB\n", number, -10 * std::log10(error));
    }
    ewa::save_image(arguments[2], shown);
    return 0;
} catch (const ewa::InputError& error) {
    std::fprintf(stderr, "fit: %s\n", error.what());
    return 2;
} catch (const ewa::RunError& error) {
    std::fprintf(stderr, "fit: %s\n", error.what());
    return 1;
}
