// SPDX-License-Identifier: Apache-2.0
// Median depth and normals: against the CPU reference, and of a disc against its plane.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>

#include "ewa/error.h"
#include "ewa/renderer.h"
#include "gpu/reference_inputs.h"
#include "gpu/test_device.h"
#include "reference/surface.h"
#include "support/random_lens.h"
#include "support/random_scene.h"

namespace ewa::test {
namespace {

/// Pixels whose values differ by more than a bound. Those in which a contribution may stand on the other side of a threshold
/// are among them.
size_t wrong_pixels(const Image& image, const reference::Raster& expected, double bound) {
    size_t wrong = 0;
    const size_t channels = size_t(expected.channels);
    EXPECT_EQ(image.pixels.size(), expected.values.size());
    for (size_t i = 0; i < image.pixels.size(); i += channels) {
        bool differs = false;
        for (size_t c = i; c < i + channels; ++c)
            differs = differs || !(std::abs(double(image.pixels[c]) - expected.values[c]) <= bound);
        wrong += differs;
    }
    return wrong;
}

size_t covered_pixels(const reference::Raster& raster) {
    size_t covered = 0;
    for (size_t i = 0; i < raster.values.size(); i += size_t(raster.channels))
        covered += raster.values[i] != 0;
    return covered;
}

/// Pictures of differently specialised pipelines. A GPU's compiler may fuse a multiplication and an addition in one and not in
/// the other. A CPU's does the same in both. allowed: pixels with a contribution on the other side of a threshold.
void expect_same_alpha(const Image& image, const Image& expected, size_t allowed) {
    if (device()->info().type == "cpu") {
        EXPECT_EQ(image.pixels, expected.pixels);
        return;
    }
    constexpr float kBound = 16 * std::numeric_limits<float>::epsilon();
    ASSERT_EQ(image.pixels.size(), expected.pixels.size());
    size_t wrong = 0;
    for (size_t i = 0; i < image.pixels.size(); ++i)
        wrong += !(std::abs(image.pixels[i] - expected.pixels[i]) <= kBound);
    EXPECT_LE(wrong, allowed);
}

void compare_surfaces(const Gaussians& gaussians, const Camera& camera, RenderOptions options, size_t allowed,
                      bool opaque = true) {
    options.background = {0.2f, 0.5f, 0.8f};
    const reference::Rendered rendered = reference::render(gaussians, camera, options);
    const auto surfaces = reference::surfaces(gaussians, camera, options);
    const reference::Raster depth = reference::median_depth(rendered, surfaces);
    const reference::Raster normal = reference::normals(rendered, surfaces);
    Renderer renderer(device(), gaussians, options);
    const Rendering median = renderer.render(camera, Drawing::median_depth);
    EXPECT_TRUE(median.color.pixels.empty());
    EXPECT_GT(covered_pixels(normal), 80u);
    EXPECT_TRUE(!opaque || covered_pixels(depth) > 80);
    EXPECT_LE(wrong_pixels(median.median_depth, depth, 2e-4), allowed);
    const Rendering shown = renderer.render(camera, Drawing::normal);
    EXPECT_LE(wrong_pixels(shown.normal, normal, 2e-4), allowed);
    // Both have the opacity of a picture in colour.
    const Image alpha = renderer.render(camera, Drawing::color).alpha;
    expect_same_alpha(median.alpha, alpha, allowed);
    expect_same_alpha(shown.alpha, alpha, allowed);
}

TEST(SurfaceFrame, ImagesAreTheReferences) {
    for (const SplatKind kind : {SplatKind::ordinary, SplatKind::mixed, SplatKind::needles})
        for (const Footprint kernel : {Footprint::peak, Footprint::density}) {
            SCOPED_TRACE(name_of(kind));
            const Scene scene = random_scene(7100, 500, kind, 61, 47, 0, kernel);
            compare_surfaces(scene.gaussians, scene.camera, scene.options, 8, kind != SplatKind::needles);
        }
}

TEST(SurfaceFrame, ImagesThroughLensesAreTheReferences) {
    for (const auto& [name, camera] : random_lenses(7200, 57, 41)) {
        SCOPED_TRACE(name);
        compare_surfaces(gaussians_around(7201, 900, camera, 1), camera, {}, 8);
    }
}

/// A wide disc, flat along a normal of the world.
Gaussians disc(const glm::dvec3& mean, const glm::dvec3& normal) {
    Gaussians g;
    g.sh_degree = 0;
    g.resize(1);
    for (size_t k = 0; k < 3; ++k) g.means[k] = float(mean[int(k)]);
    // The rotation of z to the normal.
    const glm::dvec3 axis = glm::cross(glm::dvec3(0, 0, 1), normal);
    const double quaternion[] = {1 + normal.z, axis.x, axis.y, axis.z};
    for (size_t k = 0; k < 4; ++k) g.quaternions[k] = float(quaternion[k]);
    const double scales[] = {0.2, 0.2, 1e-4};
    for (size_t k = 0; k < 3; ++k) g.log_scales[k] = float(std::log(scales[k]));
    g.opacity_logits[0] = 6;
    std::ranges::fill(g.sh, 0.0f);
    return g;
}

TEST(SurfaceFrame, ADiscIsAPlane) {
    Camera camera;
    camera.width = 64;
    camera.height = 48;
    camera.fx = camera.fy = 200;
    camera.cx = 32;
    camera.cy = 24;
    const glm::dvec3 mean(0.05, -0.02, 5), normal = glm::normalize(glm::dvec3(0.5, -0.3, -1));
    Renderer renderer(device(), disc(mean, -normal), {});
    const Rendering depth = renderer.render(camera, Drawing::median_depth);
    const Rendering shown = renderer.render(camera, Drawing::normal);
    size_t met = 0;
    for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x) {
            if (*depth.median_depth.at(x, y) == 0) continue;
            ++met;
            const glm::dvec3 ray((x + 0.5 - 32) / 200, (y + 0.5 - 24) / 200, 1);
            const double exact = glm::dot(normal, mean) / glm::dot(normal, ray);
            // Linear in the image where the plane itself is not: to second order.
            EXPECT_NEAR(*depth.median_depth.at(x, y), exact, 0.004) << x << " " << y;
            const float* n = shown.normal.at(x, y);
            EXPECT_NEAR(n[0], normal.x, 1e-4);
            EXPECT_NEAR(n[1], normal.y, 1e-4);
            EXPECT_NEAR(n[2], normal.z, 1e-4);
        }
    EXPECT_GT(met, 200u);
    EXPECT_EQ(*depth.median_depth.at(0, 0), 0);
    EXPECT_EQ(shown.normal.at(0, 0)[2], 0);
}

TEST(SurfaceFrame, OnlySplatsHaveSurfaces) {
    const Scene scene = random_scene(7300, 20, SplatKind::ordinary, 33, 21);
    RenderOptions points, ray;
    points.points = true;
    ray.integrator = Integrator::ray;
    for (const RenderOptions& options : {points, ray})
        for (const Drawing drawing : {Drawing::median_depth, Drawing::normal})
            EXPECT_THROW(Renderer(device(), scene.gaussians, options).render(scene.camera, drawing),
                         InputError);
}

}  // namespace
}  // namespace ewa::test
