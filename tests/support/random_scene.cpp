// SPDX-License-Identifier: Apache-2.0
#include "support/random_scene.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>
#include <numbers>

namespace ewa::test {

uint64_t Random::bits() {
    uint64_t z = (state_ += 0x9e3779b97f4a7c15ull);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
}

double Random::uniform(double low, double high) {
    return low + (high - low) * double(bits() >> 11) * 0x1p-53;
}

double Random::normal() {
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
}

int Random::integer(int low, int high) {
    return low + int(bits() % uint64_t(high - low + 1));
}

namespace {

// Braces, where parentheses would leave the order of the draws to the compiler.
glm::dvec3 random_direction(Random& random) {
    return glm::normalize(glm::dvec3{random.normal(), random.normal(), random.normal()});
}

glm::dmat3 random_rotation(Random& random) {
    const glm::dvec3 x = random_direction(random);
    const glm::dvec3 other = random_direction(random);
    const glm::dvec3 y = glm::normalize(other - x * glm::dot(x, other));
    return glm::dmat3(x, y, glm::cross(x, y));
}

struct Shape {
    glm::dvec3 view{0};   // camera coordinates
    glm::dvec3 scale{1};  // world units
    double opacity = 0.5;
};

/// A point that lands at a share of the picture's size, at a depth.
glm::dvec3 behind_pixel(const Camera& camera, const glm::dvec2& share, double z) {
    return {(share.x * camera.width - camera.cx) / camera.fx * z,
            (share.y * camera.height - camera.cy) / camera.fy * z, z};
}

Shape random_shape(Random& random, SplatKind kind, const Camera& camera) {
    Shape shape;
    double z = random.uniform(2, 8);
    // World units a pixel spans at depth z.
    const double pixel = z / std::min(camera.fx, camera.fy);
    const double side = std::min(camera.width, camera.height);
    shape.view = behind_pixel(camera, {random.uniform(-0.1, 1.1), random.uniform(-0.1, 1.1)}, z);
    const double size = pixel * std::exp(random.uniform(std::log(0.8), std::log(std::max(1.6, 0.2 * side))));
    for (int k = 0; k < 3; ++k) shape.scale[k] = size * std::exp(random.uniform(-0.7, 0.7));
    shape.opacity = random.uniform(0.1, 0.95);
    switch (kind) {
        case SplatKind::ordinary:
        case SplatKind::mixed:
            break;
        case SplatKind::needles: {
            const double length = pixel * side * random.uniform(0.1, 0.5);
            shape.scale = {length, length / 1000, length / 1000};
            break;
        }
        case SplatKind::sub_pixel:
            shape.scale *= 0.02 * pixel / size;
            break;
        case SplatKind::off_screen_and_close: {
            z = 0.02 * std::exp(random.uniform(0, 3));
            const bool left = random.uniform() < 0.5;
            const double beyond = random.uniform(0, 0.3);
            shape.view = behind_pixel(camera, {left ? -beyond : 1 + beyond, random.uniform(-0.2, 1.2)}, z);
            shape.scale *= z / (pixel * std::min(camera.fx, camera.fy));
            break;
        }
        case SplatKind::opacity_extremes: {
            const double extremes[] = {1e-4, 0.003, 0.0045, 0.02, 0.5, 0.985, 0.995, 0.99999};
            shape.opacity = extremes[random.integer(0, 7)];
            break;
        }
    }
    return shape;
}

void put(Gaussians& gaussians, size_t i, Random& random, const Shape& shape, const Camera& camera) {
    const glm::dvec3 mean = glm::transpose(camera.rotation) * (shape.view - camera.translation);
    const double norm = std::exp(random.uniform(std::log(0.2), std::log(5)));
    double quaternion[4], sum = 0;
    for (double& q : quaternion) {
        q = random.normal();
        sum += q * q;
    }
    for (int k = 0; k < 3; ++k) gaussians.means[3 * i + k] = float(mean[k]);
    for (int k = 0; k < 4; ++k)
        gaussians.quaternions[4 * i + k] = float(quaternion[k] * norm / std::sqrt(sum));
    for (int k = 0; k < 3; ++k) gaussians.log_scales[3 * i + k] = float(std::log(shape.scale[k]));
    gaussians.opacity_logits[i] = float(std::log(shape.opacity / (1 - shape.opacity)));
    float* sh = &gaussians.sh[i * gaussians.sh_stride()];
    for (size_t k = 0; k < gaussians.sh_stride(); ++k) sh[k] = float(random.normal() * (k < 3 ? 1.2 : 0.3));
}

}  // namespace

Camera random_camera(uint64_t seed, int width, int height) {
    Random random(seed ^ 0xca3e7aull);
    Camera camera;
    camera.width = width > 0 ? width : 17 + 2 * random.integer(0, 16);
    camera.height = height > 0 ? height : 17 + 2 * random.integer(0, 16);
    camera.fx = camera.width * random.uniform(0.7, 1.4);
    camera.fy = camera.fx * random.uniform(0.9, 1.1);
    camera.cx = camera.width * random.uniform(0.35, 0.65);
    camera.cy = camera.height * random.uniform(0.35, 0.65);
    camera.rotation = random_rotation(random);
    camera.translation = {random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3)};
    return camera;
}

Gaussians random_gaussians(uint64_t seed, size_t count, SplatKind kind, const Camera& camera, int sh_degree) {
    Random random(seed ^ 0x6a055ull);
    Gaussians gaussians;
    gaussians.sh_degree = sh_degree;
    gaussians.resize(count);
    for (size_t i = 0; i < count; ++i) {
        const SplatKind own = kind == SplatKind::mixed ? SplatKind(i % 5) : kind;
        put(gaussians, i, random, random_shape(random, own, camera), camera);
    }
    return gaussians;
}

Image random_depths(uint64_t seed, int width, int height) {
    Random random(seed ^ 0xde9745ull);
    Image depths(width, height, 1);
    for (size_t i = 0; i < depths.pixels.size(); ++i)
        depths.pixels[i] = i % 5 == 4 ? 0.0f : float(std::exp(random.uniform(0, 2.3)));
    return depths;
}

Image random_target(uint64_t seed, int width, int height) {
    Random random(seed ^ 0x7a49e7ull);
    Image image(width, height, 3);
    double phase[3], frequency_x[3], frequency_y[3];
    for (int k = 0; k < 3; ++k) {
        phase[k] = random.uniform(0, 6);
        frequency_x[k] = random.uniform(0.05, 0.5);
        frequency_y[k] = random.uniform(0.05, 0.5);
    }
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int k = 0; k < 3; ++k) {
                const double wave = 0.5 + 0.35 * std::sin(phase[k] + frequency_x[k] * x + frequency_y[k] * y);
                image.at(x, y)[k] = float(std::clamp(wave + random.uniform(-0.15, 0.15), 0.0, 1.0));
            }
    return image;
}

Image cut_out(const Image& image, uint64_t seed) {
    Random random(seed);
    Image cut(image.width, image.height, 4);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            std::copy_n(image.at(x, y), 3, cut.at(x, y));
            cut.at(x, y)[3] = x % 3 == 0 ? 0 : float(random.uniform());
        }
    return cut;
}

std::string seed_text(uint64_t seed) {
    return "seed " + std::to_string(seed);
}

const char* name_of(SplatKind kind) {
    switch (kind) {
        case SplatKind::ordinary:
            return "ordinary";
        case SplatKind::needles:
            return "needles";
        case SplatKind::sub_pixel:
            return "sub_pixel";
        case SplatKind::off_screen_and_close:
            return "off_screen_and_close";
        case SplatKind::opacity_extremes:
            return "opacity_extremes";
        case SplatKind::mixed:
            return "mixed";
    }
    return "?";
}

}  // namespace ewa::test
