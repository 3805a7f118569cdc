// SPDX-License-Identifier: Apache-2.0
#include "reference/sky.h"

#include <array>
#include <cmath>
#include <glm/matrix.hpp>
#include <optional>

#include "scene/native_lens.h"
#include "shared/constants.h"

namespace ewa::reference {
namespace {

struct SkyCorner {
    size_t texel;
    double weight;
};

/// The number of the texel at a column and row, of which one may be one beyond the border.
size_t sky_texel_number(int size, int column, int row) {
    if (column == -1 || column == size) {
        column = column == -1 ? 0 : size - 1;
        row = size - 1 - row;
    }
    if (row == -1 || row == size) {
        row = row == -1 ? 0 : size - 1;
        column = size - 1 - column;
    }
    return size_t(row) * size_t(size) + size_t(column);
}

std::array<SkyCorner, 4> sky_corners(int size, const glm::dvec3& direction) {
    const double sum = std::abs(direction.x) + std::abs(direction.y) + std::abs(direction.z);
    double x = direction.x / sum, y = direction.y / sum;
    if (direction.z < 0) {
        const double across = x;
        x = std::copysign(1 - std::abs(y), x);
        y = std::copysign(1 - std::abs(across), y);
    }
    const double column = (x + 1) / 2 * size - 0.5, row = (y + 1) / 2 * size - 0.5;
    const int left = int(std::floor(column)), top = int(std::floor(row));
    const double right_share = column - left, lower_share = row - top;
    return {{{sky_texel_number(size, left, top), (1 - right_share) * (1 - lower_share)},
             {sky_texel_number(size, left + 1, top), right_share * (1 - lower_share)},
             {sky_texel_number(size, left, top + 1), (1 - right_share) * lower_share},
             {sky_texel_number(size, left + 1, top + 1), right_share * lower_share}}};
}

/// World axes. Empty where the lens shows nothing. limit: scene::lens_limit(camera).
std::optional<glm::dvec3> ray_direction(const Camera& camera, double limit, int x, int y) {
    const auto ray = scene::ray_of(camera, limit, x + 0.5, y + 0.5);
    if (!ray) return std::nullopt;
    return glm::transpose(camera.rotation) * ray->direction;
}

}  // namespace

glm::dvec3 sky_color(const Sky& sky, const glm::dvec3& direction) {
    glm::dvec3 color(0);
    for (const SkyCorner& corner : sky_corners(sky.size, direction))
        for (int c = 0; c < 3; ++c) color[c] += corner.weight * sky.texels[3 * corner.texel + size_t(c)];
    return color;
}

Raster over_sky(const Raster& color, const Raster& left, const Camera& camera, const Sky& sky,
                int first_row) {
    Raster out = color;
    const double limit = scene::lens_limit(camera);
    for (int y = 0; y < out.height; ++y)
        for (int x = 0; x < out.width; ++x) {
            const auto direction = ray_direction(camera, limit, x, y + first_row);
            if (!direction) continue;
            const glm::dvec3 behind = sky_color(sky, *direction);
            for (int c = 0; c < 3; ++c) out.at(x, y)[c] += left.at(x, y)[0] * behind[c];
        }
    return out;
}

std::vector<double> sky_gradient(const Sky& sky, const Raster& left, const Camera& camera,
                                 const Raster& gradient) {
    std::vector<double> out(sky.texels.size());
    const double limit = scene::lens_limit(camera);
    for (int y = 0; y < left.height; ++y)
        for (int x = 0; x < left.width; ++x) {
            const auto direction = ray_direction(camera, limit, x, y);
            if (!direction) continue;
            for (const SkyCorner& corner : sky_corners(sky.size, *direction))
                for (size_t c = 0; c < 3; ++c)
                    out[3 * corner.texel + c] += corner.weight * left.at(x, y)[0] * gradient.at(x, y)[c];
        }
    return out;
}

double sky_penalty(const Sky& sky) {
    double sum = 0;
    for (int row = 0; row < sky.size; ++row)
        for (int column = 0; column < sky.size; ++column)
            for (const auto& [x, y] : {std::array{1, 0}, {-1, 0}, {0, 1}, {0, -1}})
                for (size_t c = 0; c < 3; ++c) {
                    const double own = sky.texels[3 * sky_texel_number(sky.size, column, row) + c];
                    const double other = sky.texels[3 * sky_texel_number(sky.size, column + x, row + y) + c];
                    sum += (own - other) * (own - other) / 4;  // each pair is met twice
                }
    return shared::SKY_PULL * sum;
}

std::vector<double> sky_penalty_gradient(const Sky& sky) {
    std::vector<double> out(sky.texels.size());
    for (int row = 0; row < sky.size; ++row)
        for (int column = 0; column < sky.size; ++column)
            for (const auto& [x, y] : {std::array{1, 0}, {-1, 0}, {0, 1}, {0, -1}})
                for (size_t c = 0; c < 3; ++c) {
                    const size_t own = 3 * sky_texel_number(sky.size, column, row) + c;
                    const size_t other = 3 * sky_texel_number(sky.size, column + x, row + y) + c;
                    out[own] += shared::SKY_PULL * (sky.texels[own] - sky.texels[other]);
                }
    return out;
}

}  // namespace ewa::reference
