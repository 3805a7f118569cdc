// SPDX-License-Identifier: Apache-2.0
#include "ewa/appearance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "core/text.h"
#include "core/typing.h"
#include "ewa/error.h"
#include "shared/constants.h"
#include "shared/layouts.h"

namespace ewa {
namespace {

using namespace shared;

/// shaders/lib/ppisp.glsl, in float64.
class PpispMap {
  public:
    explicit PpispMap(const Ppisp& values)
        : camera_(values.camera), gain_(std::exp2(double(values.photo[0]))) {
        constexpr std::array<std::array<double, 3>, 4> kMatrices{
            {{PPISP_BLUE_XX, PPISP_BLUE_XY, PPISP_BLUE_YY},
             {PPISP_RED_XX, PPISP_RED_XY, PPISP_RED_YY},
             {PPISP_GREEN_XX, PPISP_GREEN_XY, PPISP_GREEN_YY},
             {PPISP_GREY_XX, PPISP_GREY_XY, PPISP_GREY_YY}}};
        std::array<glm::dvec3, 4> t{glm::dvec3(0, 0, 1), {1, 0, 1}, {0, 1, 1}, {1.0 / 3, 1.0 / 3, 1}};
        for (size_t k = 0; k < 4; ++k) {
            const double x = double(values.photo[1 + 2 * k]), y = double(values.photo[2 + 2 * k]);
            const auto& [xx, xy, yy] = kMatrices[k];
            t[k] += glm::dvec3(xx * x + xy * y, xy * x + yy * y, 0);
        }
        const double blue = glm::dot(glm::cross(t[1], t[2]), t[3]),
                     red = glm::dot(glm::cross(t[2], t[0]), t[3]),
                     green = glm::dot(glm::cross(t[0], t[1]), t[3]);
        colors_ = glm::dmat3(red / blue * t[1] - t[0], green / blue * t[2] - t[0], t[0]);
        for (size_t c = 0; c < 3; ++c) {
            const float* raw = &camera_[PPISP_CHANNEL_FLOATS * c + 5];
            const auto softplus = [](float x) { return std::log1p(std::exp(double(x))); };
            Curve& curve = curves_[c];
            curve.toe = PPISP_CURVE_MIN + softplus(raw[0]);
            curve.shoulder = PPISP_CURVE_MIN + softplus(raw[1]);
            curve.gamma = PPISP_GAMMA_MIN + softplus(raw[2]);
            curve.middle = 1 / (1 + std::exp(-double(raw[3])));
            curve.toe_share =
                curve.shoulder * curve.middle / (curve.toe + curve.middle * (curve.shoulder - curve.toe));
        }
    }

    /// place: from the image's middle, in units of the larger side.
    void apply(float* color, const glm::dvec2& place) const {
        glm::dvec3 c;
        for (int k = 0; k < 3; ++k) c[k] = double(color[k]) * gain_ * vignette(size_t(k), place);
        const double intensity = c.r + c.g + c.b;
        const glm::dvec3 q = colors_ * glm::dvec3(c.r, c.g, intensity);
        const glm::dvec3 scaled = q * (intensity / (q.z + PPISP_INTENSITY_MIN));
        const std::array<double, 3> mapped{scaled.x, scaled.y, scaled.z - scaled.x - scaled.y};
        for (size_t k = 0; k < 3; ++k) color[k] = float(curves_[k](std::clamp(mapped[k], 0.0, 1.0)));
    }

  private:
    struct Curve {
        double toe, shoulder, gamma, middle, toe_share;
        double operator()(double x) const {
            const auto power = [](double base, double exponent) {
                return std::pow(std::max(base, PPISP_BASE_MIN), exponent);
            };
            const double y = x <= middle ? toe_share * power(x / middle, toe)
                                         : 1 - (1 - toe_share) * power((1 - x) / (1 - middle), shoulder);
            return power(y, gamma);
        }
    };

    double vignette(size_t channel, const glm::dvec2& place) const {
        const float* v = &camera_[PPISP_CHANNEL_FLOATS * channel];
        const glm::dvec2 d = place - glm::dvec2(v[0], v[1]);
        const double r2 = d.x * d.x + d.y * d.y;
        return std::clamp(1 + r2 * (double(v[2]) + r2 * (double(v[3]) + r2 * double(v[4]))), 0.0, 1.0);
    }

    std::array<float, 27> camera_;
    double gain_;
    glm::dmat3 colors_{1};
    std::array<Curve, 3> curves_{};
};

Image with_ppisp(Image image, const Ppisp& values) {
    const PpispMap map(values);
    const double larger = std::max(image.width, image.height);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            map.apply(image.at(x, y),
                      {(x + 0.5 - 0.5 * image.width) / larger, (y + 0.5 - 0.5 * image.height) / larger});
    return image;
}

/// The map of a pixel, interpolated between 8 cells. place: in units of cells.
Exposure slice(const ColorGrid& grid, const glm::dvec3& place) {
    constexpr std::array<uint32_t, 3> kSize{GRID_WIDTH, GRID_HEIGHT, GRID_DEPTH};
    std::array<uint32_t, 3> first;
    std::array<double, 3> share;
    for (size_t k = 0; k < 3; ++k) {
        first[k] = std::min(uint32_t(place[int(k)]), kSize[k] - 2);
        share[k] = place[int(k)] - first[k];
    }
    Exposure map{};
    for (uint32_t corner = 0; corner < 8; ++corner) {
        double weight = 1;
        std::array<uint32_t, 3> cell;
        for (size_t k = 0; k < 3; ++k) {
            const uint32_t step = corner >> k & 1;
            cell[k] = first[k] + step;
            weight *= step == 1 ? share[k] : 1 - share[k];
        }
        const float* from = &grid.cells[12 * (cell[0] + GRID_WIDTH * (cell[1] + GRID_HEIGHT * cell[2]))];
        for (size_t k = 0; k < 12; ++k) map[k] += float(weight) * from[k];
    }
    return map;
}

Image with_exposure(Image image, const Exposure& exposure) {
    for (size_t p = 0; p < image.pixels.size(); p += size_t(image.channels)) {
        float* color = &image.pixels[p];
        const float r = color[0], g = color[1], b = color[2];
        for (size_t c = 0; c < 3; ++c)
            color[c] =
                exposure[4 * c] * r + exposure[4 * c + 1] * g + exposure[4 * c + 2] * b + exposure[4 * c + 3];
    }
    return image;
}

Image with_grid(Image image, const ColorGrid& grid) {
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            float* color = image.at(x, y);
            const double grey =
                GREY_RED * double(color[0]) + GREY_GREEN * double(color[1]) + GREY_BLUE * double(color[2]);
            const Exposure map = slice(grid, {(x + 0.5) / image.width * (GRID_WIDTH - 1),
                                              (y + 0.5) / image.height * (GRID_HEIGHT - 1),
                                              std::clamp(grey, 0.0, 1.0) * (GRID_DEPTH - 1)});
            const std::array<float, 3> old{color[0], color[1], color[2]};
            for (size_t c = 0; c < 3; ++c)
                color[c] =
                    map[4 * c] * old[0] + map[4 * c + 1] * old[1] + map[4 * c + 2] * old[2] + map[4 * c + 3];
        }
    return image;
}

/// The mean of values(appearance), which are as many of each. weights: of each; their sum is 1.
template <class Model, class Values>
void average(const std::vector<Appearance>& all, const std::vector<double>& weights, Model& mean,
             const Values& values) {
    for (size_t k = 0; k < values(mean).size(); ++k) {
        double sum = 0;
        for (size_t i = 0; i < all.size(); ++i)
            sum += weights[i] * double(values(std::get<Model>(all[i]))[k]);
        values(mean)[k] = float(sum);
    }
}

Appearance weighted_mean(const std::vector<Appearance>& all, const std::vector<double>& weights) {
    Appearance mean = all.front();
    if (auto* exposure = std::get_if<Exposure>(&mean))
        average(
            all, weights, *exposure, [](auto& e) -> auto& { return e; });
    if (auto* ppisp = std::get_if<Ppisp>(&mean)) {
        average(
            all, weights, *ppisp, [](auto& p) -> auto& { return p.photo; });
        average(
            all, weights, *ppisp, [](auto& p) -> auto& { return p.camera; });
    }
    if (auto* grid = std::get_if<ColorGrid>(&mean))
        average(
            all, weights, *grid, [](auto& g) -> auto& { return g.cells; });
    return mean;
}

/// How bright an image is beside others. Colour offsets differ from image to image as well, but by little.
double brightness_of(const Appearance& appearance) {
    if (const auto* ppisp = std::get_if<Ppisp>(&appearance)) return double(ppisp->photo[0]);
    // Affine maps of a row a channel: what they make of a middle grey.
    const auto* grid = std::get_if<ColorGrid>(&appearance);
    const std::span<const float> maps =
        grid ? std::span<const float>(grid->cells) : std::span<const float>(std::get<Exposure>(appearance));
    constexpr double kGrey = 0.5;
    double sum = 0;
    for (size_t k = 0; k < maps.size(); ++k) sum += double(maps[k]) * (k % 4 == 3 ? 1 : kGrey);
    return sum / double(maps.size());
}

/// Shepard's, with a sum of 1. skipped: an image that has none; the number of images skips none.
std::vector<double> weights_at(const std::vector<glm::dvec3>& centers, const glm::dvec3& center,
                               size_t skipped) {
    std::vector<double> weights(centers.size(), 0);
    double nearest = std::numeric_limits<double>::infinity(), sum = 0;
    for (size_t i = 0; i < centers.size(); ++i)
        if (i != skipped) nearest = std::min(nearest, glm::distance(centers[i], center));
    for (size_t i = 0; i < centers.size(); ++i) {
        if (i == skipped) continue;
        const double distance = glm::distance(centers[i], center);
        const double ratio = distance > nearest ? nearest / distance : 1;
        sum += weights[i] = ratio * ratio * ratio * ratio;
    }
    for (double& weight : weights) weight /= sum;
    return weights;
}

/// Whether the brightness of an image is predicted better by its neighbours than by what all new views would have. of_all: empty
/// for the mean of the others.
bool neighbours_predict(const std::vector<Appearance>& images, const std::vector<glm::dvec3>& centers,
                        const std::optional<Appearance>& of_all) {
    if (images.size() < 3) return false;
    std::vector<double> values;
    for (const Appearance& image : images) values.push_back(brightness_of(image));
    const double sum = std::accumulate(values.begin(), values.end(), 0.0);
    double by_neighbours = 0, by_all = 0;
    for (size_t i = 0; i < images.size(); ++i) {
        const std::vector<double> weights = weights_at(centers, centers[i], i);
        const double near = std::inner_product(weights.begin(), weights.end(), values.begin(), 0.0);
        const double all = of_all ? brightness_of(*of_all) : (sum - values[i]) / double(images.size() - 1);
        by_neighbours += (near - values[i]) * (near - values[i]);
        by_all += (all - values[i]) * (all - values[i]);
    }
    return by_neighbours < by_all;
}

void check_colors(const Image& image) {
    check(image);
    if (image.channels < 3)
        throw InputError("an image of " + core::counted(uint64_t(image.channels), "channel") +
                         " has no colours");
}

}  // namespace

std::array<float, 27> Ppisp::neutral_camera() {
    std::array<float, 27> camera{};
    for (size_t c = 0; c < 3; ++c) {
        float* response = &camera[PPISP_CHANNEL_FLOATS * c + 5];
        // softplus(log(exp(x) - 1)) = x: toe, shoulder and gamma are 1, and sigmoid(0) is a half.
        response[0] = response[1] = float(std::log(std::expm1(1 - PPISP_CURVE_MIN)));
        response[2] = float(std::log(std::expm1(1 - PPISP_GAMMA_MIN)));
    }
    return camera;
}

std::vector<float> ColorGrid::identity_cells() {
    std::vector<float> cells;
    cells.reserve(GRID_FLOATS);
    for (uint32_t k = 0; k < GRID_CELLS; ++k)
        cells.insert(cells.end(), kIdentityExposure.begin(), kIdentityExposure.end());
    return cells;
}

void check(const Appearance& appearance) {
    const auto* grid = std::get_if<ColorGrid>(&appearance);
    if (grid && grid->cells.size() != GRID_FLOATS)
        throw core::wrong_length("cells", grid->cells.size(), "a bilateral grid needs", GRID_FLOATS);
}

Image with_appearance(Image image, const Appearance& appearance) {
    check(appearance);
    check_colors(image);
    if (const auto* exposure = std::get_if<Exposure>(&appearance))
        return with_exposure(std::move(image), *exposure);
    if (const auto* ppisp = std::get_if<Ppisp>(&appearance)) return with_ppisp(std::move(image), *ppisp);
    return with_grid(std::move(image), std::get<ColorGrid>(appearance));
}

void check(const std::vector<Appearance>& appearances) {
    for (const Appearance& each : appearances) {
        check(each);
        if (each.index() != appearances.front().index()) throw InputError("appearances of several models");
    }
}

NewViewAppearance::NewViewAppearance(std::vector<Appearance> of_images, std::vector<glm::dvec3> centers)
    : of_images_(std::move(of_images)) {
    check(of_images_);
    if (!centers.empty() && centers.size() != of_images_.size())
        throw InputError(core::counted(centers.size(), "centre") + " for " +
                         core::counted(of_images_.size(), "appearance"));
    for (const glm::dvec3& center : centers)
        if (!std::isfinite(center.x + center.y + center.z))
            throw InputError("the centre of a camera is not finite");
    if (of_images_.empty()) return;
    std::optional<Appearance> own_colors;
    if (std::holds_alternative<Exposure>(of_images_.front())) own_colors = kIdentityExposure;
    const size_t n = of_images_.size();
    of_all_ = own_colors ? *own_colors : weighted_mean(of_images_, std::vector<double>(n, 1 / double(n)));
    if (!centers.empty() && neighbours_predict(of_images_, centers, own_colors))
        centers_ = std::move(centers);
}

std::optional<Appearance> NewViewAppearance::at(const glm::dvec3& center) const {
    if (centers_.empty()) return of_all_;
    return weighted_mean(of_images_, weights_at(centers_, center, centers_.size()));
}

}  // namespace ewa
