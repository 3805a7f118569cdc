// SPDX-License-Identifier: Apache-2.0
// Gradients of PPISP and of bilateral grids against central differences, and the host's maps of images against the CPU
// reference.
#include "reference/appearance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "ewa/appearance.h"
#include "shared/layouts.h"
#include "support/random_scene.h"

namespace ewa::reference {
namespace {

constexpr double kStep = 1e-5;

/// Values by which the map is far from the identity, but no pixel near a limit for most colours.
PpispPhoto random_photo(uint64_t seed) {
    test::Random random(seed);
    PpispPhoto photo;
    for (double& value : photo) value = 0.6 * random.normal();
    photo[0] *= 0.5;
    return photo;
}

PpispCamera random_ppisp_camera(uint64_t seed) {
    test::Random random(seed);
    PpispCamera camera;
    const auto neutral = ewa::Ppisp::neutral_camera();
    for (size_t k = 0; k < 27; ++k)
        camera[k] = double(neutral[k]) + (k % 9 < 2 ? 0.05 : 0.3) * random.normal();
    for (const size_t k : {2u, 11u, 20u}) camera[k] = -std::abs(camera[k]);
    return camera;
}

Grid random_grid(uint64_t seed) {
    test::Random random(seed);
    const auto identity = ColorGrid::identity_cells();
    Grid grid(identity.begin(), identity.end());
    for (double& value : grid) value += 0.2 * random.normal();
    return grid;
}

struct AppearanceCase {
    Raster image = to_double(test::random_target(5, 11, 7)), weights{11, 7, 3};  // L = sum weights * image
    AppearanceCase() {
        test::Random random(6);
        for (double& w : weights.values) w = random.normal();
    }
    double value_of(const Raster& out) const {
        double sum = 0;
        for (size_t i = 0; i < out.values.size(); ++i) sum += weights.values[i] * out.values[i];
        return sum;
    }
};

/// The central difference of f by value, which stays as it was.
template <class F>
double central(double& value, const F& f) {
    const double before = value;
    value = before + kStep;
    const double above = f();
    value = before - kStep;
    const double below = f();
    value = before;
    return (above - below) / (2 * kStep);
}

TEST(ReferenceAppearance, PpispsGradientIsTheDifference) {
    AppearanceCase c;
    for (const uint64_t seed : {1, 2, 3}) {
        PpispPhoto photo = random_photo(seed);
        PpispCamera camera = random_ppisp_camera(seed + 10);
        const auto gradient = ppisp_backward(c.image, photo, camera, c.weights);
        const auto value = [&] { return c.value_of(ppisp(c.image, photo, camera)); };
        for (size_t k = 0; k < 9; ++k) EXPECT_NEAR(central(photo[k], value), gradient.photo[k], 1e-5) << k;
        for (size_t k = 0; k < 27; ++k) EXPECT_NEAR(central(camera[k], value), gradient.camera[k], 1e-5) << k;
        for (size_t i = 0; i < c.image.values.size(); i += 5)
            EXPECT_NEAR(central(c.image.values[i], value), gradient.image.values[i], 1e-5) << i;
    }
}

TEST(ReferenceAppearance, NeutralPpispChangesNoColour) {
    const AppearanceCase c;
    const auto neutral = ewa::Ppisp::neutral_camera();
    PpispCamera camera;
    std::copy(neutral.begin(), neutral.end(), camera.begin());
    const Raster out = ppisp(c.image, {}, camera);
    // The intensity is divided by itself and PPISP_INTENSITY_MIN.
    for (size_t i = 0; i < out.values.size(); ++i) EXPECT_NEAR(out.values[i], c.image.values[i], 2e-5);
    PpispPhoto brighter{};
    brighter[0] = -1;
    const Raster half = ppisp(c.image, brighter, camera);
    for (size_t i = 0; i < out.values.size(); ++i) EXPECT_NEAR(half.values[i], c.image.values[i] / 2, 2e-5);
}

TEST(ReferenceAppearance, TheGridsGradientIsTheDifference) {
    AppearanceCase c;
    Grid grid = random_grid(4);
    const auto gradient = sliced_backward(c.image, grid, c.weights);
    const auto variation = grid_variation_gradient(grid);
    const auto value = [&] { return c.value_of(sliced(c.image, grid)); };
    for (size_t k = 0; k < grid.size(); k += 61) {
        EXPECT_NEAR(central(grid[k], value), gradient.grid[k], 1e-6) << k;
        EXPECT_NEAR(central(grid[k], [&] { return grid_variation(grid); }), variation[k], 1e-6) << k;
    }
    for (size_t i = 0; i < c.image.values.size(); i += 5)
        EXPECT_NEAR(central(c.image.values[i], value), gradient.image.values[i], 1e-5) << i;
}

TEST(ReferenceAppearance, MatchesTheAppearanceOfAnImage) {
    const Image image = test::random_target(8, 13, 9);
    const auto close = [&](const Image& actual, const Raster& expected) {
        for (int y = 0; y < 9; ++y)
            for (int x = 0; x < 13; ++x)
                for (int k = 0; k < 3; ++k) EXPECT_NEAR(actual.at(x, y)[k], expected.at(x, y)[k], 2e-6);
    };
    const PpispPhoto photo = random_photo(1);
    const PpispCamera camera = random_ppisp_camera(2);
    ewa::Ppisp narrow;
    std::copy(photo.begin(), photo.end(), narrow.photo.begin());
    std::copy(camera.begin(), camera.end(), narrow.camera.begin());
    close(with_appearance(image, narrow), ppisp(to_double(image), photo, camera));
    const Grid grid = random_grid(3);
    close(with_appearance(image, ColorGrid{{grid.begin(), grid.end()}}), sliced(to_double(image), grid));
}

ewa::Ppisp exposed(float stops) {
    ewa::Ppisp ppisp;
    ppisp.photo[0] = stops;
    return ppisp;
}

double stops_at(const NewViewAppearance& appearance, const glm::dvec3& center) {
    return double(std::get<ewa::Ppisp>(*appearance.at(center)).photo[0]);
}

TEST(ReferenceAppearance, ANewViewHasTheMeanOfPhotosInUnknownPlaces) {
    EXPECT_EQ(stops_at(NewViewAppearance({exposed(1), exposed(-0.5f)}), glm::dvec3(7)), 0.25);
    EXPECT_EQ(std::get<ColorGrid>(*NewViewAppearance({ColorGrid(), ColorGrid()}).at({})), ColorGrid());
    EXPECT_EQ(std::get<Exposure>(*NewViewAppearance({Exposure{2}, Exposure{4}}).at({})), kIdentityExposure);
    EXPECT_FALSE(NewViewAppearance().at({}));
}

TEST(ReferenceAppearance, ANewViewIsBetweenThePhotosNearIt) {
    // The light changes along a row of photos.
    const std::vector<Appearance> row{exposed(0), exposed(0.1f), exposed(0.2f), exposed(0.3f), exposed(0.4f)};
    std::vector<glm::dvec3> centers;
    for (int i = 0; i < 5; ++i) centers.emplace_back(2 * i, 1, -i);
    const NewViewAppearance near(row, centers);
    EXPECT_TRUE(near.is_local());
    EXPECT_NEAR(stops_at(near, centers[3]), 0.3, 1e-7);
    const glm::dvec3 place(2.7, 1.5, -1.1);
    double sum = 0, all = 0;
    for (size_t i = 0; i < row.size(); ++i) {
        const double weight = std::pow(glm::length(place - centers[i]), -4);
        sum += weight * 0.1 * double(i);
        all += weight;
    }
    EXPECT_NEAR(stops_at(near, place), sum / all, 1e-7);
    // Neighbours that differ as much as any two photos predict no new view.
    const NewViewAppearance mixed({row[2], row[0], row[4], row[0], row[4]}, centers);
    EXPECT_FALSE(mixed.is_local());
    EXPECT_NEAR(stops_at(mixed, place), 0.2, 1e-7);
    // Two have no others to be predicted from.
    EXPECT_FALSE(NewViewAppearance({row[0], row[1]}, {centers[0], centers[1]}).is_local());
    // Photos from one place count alike.
    EXPECT_NEAR(stops_at(NewViewAppearance({row[0], row[2], row[0], row[2]},
                                           {centers[0], centers[0], centers[4], centers[4]}),
                         centers[0]),
                0.1, 1e-7);
}

TEST(ReferenceAppearance, ANewViewHasTheSplatsColoursUnlessNeighboursPredictExposures) {
    std::vector<Appearance> images;
    std::vector<glm::dvec3> centers;
    for (const float gain : {1.2f, 1.2f, 0.8f, 0.8f}) {
        images.emplace_back(Exposure{gain, 0, 0, 0, 0, gain, 0, 0, 0, 0, gain, 0});
        centers.emplace_back(gain > 1 ? 0 : 9, double(images.size() % 2), 0);
    }
    EXPECT_NEAR(double(std::get<Exposure>(*NewViewAppearance(images, centers).at(centers[0]))[0]), 1.2, 1e-6);
    std::swap(centers[0], centers[2]);
    EXPECT_EQ(std::get<Exposure>(*NewViewAppearance(images, centers).at(centers[0])), kIdentityExposure);
}

}  // namespace
}  // namespace ewa::reference
