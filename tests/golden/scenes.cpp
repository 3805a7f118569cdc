// SPDX-License-Identifier: Apache-2.0
#include "golden/scenes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <numbers>

#include "ewa/dataset.h"
#include "scene/native_lens.h"
#include "scene/readout.h"
#include "shared/constants.h"
#include "support/random_scene.h"

namespace ewa::test {
namespace {

constexpr int kWidth = 64, kHeight = 48;

// float32 against float64 where no threshold is near: what rounding makes of a few dozen products.
constexpr Tolerance kExact{2e-5, 2e-5, 0};
// At the edge of its reach a contribution is 1/255 or nothing; the two round apart in a pixel here and there.
constexpr Tolerance kEdges{0.0045, 2e-5, 6};

using Color = std::array<double, 3>;

double logit(double p) {
    return std::log(p / (1 - p));
}

/// Looks along +z from the origin of the world.
Camera plain_camera(double focal = 60) {
    Camera camera;
    camera.width = kWidth;
    camera.height = kHeight;
    camera.fx = camera.fy = focal;
    camera.cx = kWidth / 2.0;
    camera.cy = kHeight / 2.0;
    return camera;
}

void add(Gaussians& g, const glm::dvec3& mean, const glm::dvec3& scale, double opacity, const Color& color,
         const glm::dquat& turn = {1, 0, 0, 0}) {
    const size_t i = g.size();
    g.resize(i + 1);
    for (int k = 0; k < 3; ++k) {
        g.means[3 * i + size_t(k)] = float(mean[k]);
        g.log_scales[3 * i + size_t(k)] = float(std::log(scale[k]));
        g.sh[g.sh_stride() * i + size_t(k)] =
            float((color[size_t(k)] - shared::COLOR_OFFSET) / shared::SH_C0);
    }
    const double wxyz[] = {turn.w, turn.x, turn.y, turn.z};
    for (size_t k = 0; k < 4; ++k) g.quaternions[4 * i + k] = float(wxyz[k]);
    g.opacity_logits[i] = float(logit(opacity));
}

glm::dquat about(const glm::dvec3& axis, double degrees) {
    return glm::angleAxis(degrees * std::numbers::pi / 180, glm::normalize(axis));
}

/// A ball of 9 px at the centre; tests/golden/test_scenes.cpp has its closed form.
GoldenScene one_splat() {
    GoldenScene s{"one_splat", {}, plain_camera(), {}, Shown::color, 1, kExact};
    s.camera.cx = 30.25;
    s.camera.cy = 21.5;
    s.options.background = {0.1f, 0.2f, 0.3f};
    add(s.gaussians, {0, 0, 4}, glm::dvec3(0.6), 0.8, {0.9, 0.6, 0.2});
    return s;
}

/// A wall of splats all round the camera, each of which has the same coefficients of one degree: the picture
/// is those spherical harmonics over the directions. channel[j] has the coefficient j of the degree.
GoldenScene sh_lobes(const std::string& name, int degree, const std::vector<int>& channel) {
    GoldenScene s{name, {}, plain_camera(30), {}, Shown::color, 0.5, kEdges};
    const glm::dquat turn = about({0.3, 1, 0.2}, 50);
    s.camera.rotation = glm::transpose(glm::mat3_cast(turn));
    s.gaussians.sh_degree = degree;
    const size_t first = size_t(degree) * size_t(degree);
    for (int y = 2; y < kHeight; y += 4)
        for (int x = 2; x < kWidth; x += 4) {
            const glm::dvec3 ray((x - s.camera.cx) / s.camera.fx, (y - s.camera.cy) / s.camera.fy, 1);
            const double distance = 4;
            add(s.gaussians, turn * (distance * glm::normalize(ray)),
                glm::dvec3(2 * distance / glm::length(ray) / s.camera.fx), 0.9, {0.5, 0.5, 0.5});
            float* sh = &s.gaussians.sh[s.gaussians.sh_stride() * (s.gaussians.size() - 1)];
            for (size_t j = 0; j < channel.size(); ++j)
                sh[3 * (first + j) + size_t(channel[j])] = 0.55f - 0.07f * float(j);
        }
    return s;
}

/// Discs one before another, their order in depth not that of the file; below, discs of equal depth, which go
/// by index.
GoldenScene overlap_order() {
    GoldenScene s{"overlap_order", {}, plain_camera(), {}, Shown::color, 1, kEdges};
    const glm::dvec3 size(0.45, 0.45, 0.01);
    add(s.gaussians, {-0.5, -0.6, 4}, size, 0.85, {0.9, 0.1, 0.1});
    add(s.gaussians, {0.1, -0.6, 3}, size * 0.75, 0.85, {0.1, 0.9, 0.1});
    add(s.gaussians, {0.7, -0.6, 5}, size * 1.25, 0.85, {0.1, 0.1, 0.9});
    for (int i = 0; i < 5; ++i)
        add(s.gaussians, {-1.2 + 0.6 * i, 0.8, 4}, size, 0.85,
            {0.9 - 0.2 * i, 0.1 + 0.8 * (i % 2), 0.1 + 0.2 * i});
    return s;
}

/// The same ball at depths on both sides of the near plane, its picture of the same size each time.
GoldenScene near_plane() {
    GoldenScene s{"near_plane", {}, plain_camera(), {}, Shown::color, 1, kEdges};
    const double depths[] = {-0.0101, 0.0099, 0.0101, 0.02, 1, 1000};
    for (int i = 0; i < 6; ++i) {
        const double z = depths[i], x = (i - 2.5) * 10 / 60;
        add(s.gaussians, {x * z, 0.02 * (i - 2) * z, z}, glm::dvec3(0.06 * std::abs(z)), 0.9,
            {0.15 * i, 0.9 - 0.1 * i, 0.5});
    }
    return s;
}

/// A thousand times as long as they are wide, flat and tilted in depth.
GoldenScene needles() {
    GoldenScene s{"needles", {}, plain_camera(), {}, Shown::color, 1, kEdges};
    const glm::dvec3 size(1.5, 0.0015, 0.0015);
    const double turns[] = {0, 30, 45, 77, 90, 135};
    for (int i = 0; i < 6; ++i)
        add(s.gaussians, {0.5 * (i - 2.5) * 0.4, 0.15 * (i % 3 - 1), 4 + 0.1 * i}, size, 0.95,
            {0.2 + 0.14 * i, 0.9 - 0.12 * i, i % 2 ? 0.9 : 0.3}, about({0, 0, 1}, turns[i]));
    add(s.gaussians, {0.9, 0.8, 4.9}, size, 0.95, {1, 1, 1}, about({0, 1, 0.4}, 70));
    return s;
}

/// Two opaque splats close a pixel: of what lies behind nothing is seen.
GoldenScene opaque_stop() {
    GoldenScene s{"opaque_stop", {}, plain_camera(), {}, Shown::color, 1, kExact};
    s.options.background = {1, 1, 1};
    const Color colors[] = {{0, 0, 0}, {0, 0, 1}, {0, 1, 0}, {1, 0, 0}};
    for (int i = 0; i < 4; ++i)
        add(s.gaussians, {0.45 * (i - 1.5), 0, 4.0 + i}, glm::dvec3(4.0 + i, 4.0 + i, 0.01), 0.9999,
            colors[i]);
    return s;
}

/// Opacities on both sides of 1/255, under which nothing is drawn.
GoldenScene faint() {
    GoldenScene s{"faint", {}, plain_camera(), {}, Shown::color, 20, {0.09, 2e-5, 6}};
    const double opacities[] = {0.0038, 0.00393, 0.006, 0.012, 0.03};
    for (int i = 0; i < 5; ++i)
        add(s.gaussians, {0.75 * (i - 2), 0.2 * (i % 2), 4}, glm::dvec3(0.3), opacities[i],
            {1, 1 - 0.2 * i, 0.5});
    return s;
}

/// Spheres of one size one behind another: a pixel blends the three nearest. Those on the right are smaller than a pixel.
GoldenScene spheres() {
    GoldenScene s{"spheres", {}, plain_camera(), {}, Shown::color, 1, kEdges};
    s.options.points = true;
    s.options.nearest = 3;
    s.options.background = {0.1f, 0.2f, 0.3f};
    for (int i = 7; i >= 0; --i)
        add(s.gaussians, {-1.4 + 0.22 * i, 0.25 * (i % 3 - 1), 3 + 0.2 * i}, glm::dvec3(0.25), 0.5,
            {0.9 - 0.1 * i, 0.2 + 0.25 * (i % 3), 0.1 + 0.1 * i});
    for (int i = 0; i < 6; ++i)
        add(s.gaussians, {1.2 + 0.07 * (i % 3), 0.4 * (i / 3) - 0.3, 3}, glm::dvec3(1e-3), 0.5, {1, 1, 0.6});
    return s;
}

/// Coordinates of a map projection: a million units from the origin, where float32 steps are a sixteenth.
GoldenScene far_from_origin() {
    GoldenScene s{"far_from_origin", {}, plain_camera(), {}, Shown::color, 1, kEdges};
    const glm::dvec3 eye(1e6 + 0.3, -1.2e6 + 0.7, 5e5 + 0.01);
    const glm::dquat turn = about({0.2, 1, -0.4}, 33);
    s.camera.rotation = glm::transpose(glm::mat3_cast(turn));
    s.camera.translation = -(s.camera.rotation * eye);
    Random random(71);
    for (int i = 0; i < 40; ++i) {
        const glm::dvec3 view(random.uniform(-7, 7), random.uniform(-5, 5), random.uniform(10, 20));
        add(s.gaussians, eye + turn * view, glm::dvec3(random.uniform(0.4, 1), random.uniform(0.2, 0.6), 0.3),
            0.8, {random.uniform(), random.uniform(), random.uniform()}, about({0, 0, 1}, 20.0 * i));
    }
    return s;
}

/// Unequal focal lengths, a principal point in a corner, and splats beyond the borders that reach in: there
/// the projection's slope is held.
GoldenScene off_centre() {
    GoldenScene s{"off_centre", {}, plain_camera(), {}, Shown::color, 1, kEdges};
    s.camera.fx = 70;
    s.camera.fy = 35;
    s.camera.cx = 9;
    s.camera.cy = 41;
    add(s.gaussians, {3.9, -2, 3}, {1.1, 0.5, 0.8}, 0.9, {0.9, 0.4, 0.1}, about({1, 1, 0}, 30));
    add(s.gaussians, {-2.4, -1.5, 3}, {1, 0.4, 0.9}, 0.9, {0.1, 0.6, 0.9}, about({0, 1, 1}, 50));
    add(s.gaussians, {1, -5.2, 3}, {0.4, 1, 0.9}, 0.9, {0.2, 0.9, 0.3}, about({1, 0, 1}, 20));
    add(s.gaussians, {0.8, 1.9, 3}, {0.5, 0.9, 0.9}, 0.9, {0.9, 0.2, 0.8}, about({1, 0, 0}, 40));
    add(s.gaussians, {1.1, -1.6, 3}, {0.15, 0.1, 0.1}, 0.9, {1, 1, 1});
    return s;
}

GoldenScene mode(const std::string& name, Shown shown, double scale) {
    GoldenScene s{name, {}, random_camera(812, kWidth, kHeight), {}, shown, scale, {0.005, 2e-5, 6}};
    s.gaussians = random_gaussians(813, 60, SplatKind::ordinary, s.camera, 2);
    s.options.background = {0.2f, 0.4f, 0.6f};
    return s;
}

/// The picture of mode_color: between its splats stand others with one value that is not a number.
GoldenScene poisoned() {
    GoldenScene s = mode("nonfinite_left_out", Shown::color, 0.25);
    const Gaussians clean = s.gaussians;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (size_t i = 0; i < 25; ++i) {
        const size_t at = s.gaussians.size();
        s.gaussians.resize(at + 1);
        std::copy_n(&clean.means[3 * i], 3, &s.gaussians.means[3 * at]);
        std::copy_n(&clean.quaternions[4 * i], 4, &s.gaussians.quaternions[4 * at]);
        std::copy_n(&clean.log_scales[3 * i], 3, &s.gaussians.log_scales[3 * at]);
        s.gaussians.opacity_logits[at] = 3;
        float* const spoilt[] = {&s.gaussians.means[3 * at + i % 3], &s.gaussians.quaternions[4 * at + i % 4],
                                 &s.gaussians.log_scales[3 * at + i % 3], &s.gaussians.opacity_logits[at],
                                 &s.gaussians.sh[s.gaussians.sh_stride() * at + i]};
        // An infinite opacity is drawn.
        *spoilt[i % 5] = i % 2 || i % 5 == 3 ? nan : std::numeric_limits<float>::infinity();
    }
    return s;
}

/// Splats all round the camera, seen through a lens. Some are close to the axis, the poles and the seam of 360°, and behind.
GoldenScene through_lens(const std::string& name, const Distortion& lens, double degrees) {
    GoldenScene s{name, {}, plain_camera(24), {}, Shown::color, 1, kEdges};
    const glm::dquat turn = about({0.3, 1, 0.2}, 50);
    s.camera.rotation = glm::transpose(glm::mat3_cast(turn));
    s.camera = scene::through_lens(s.camera, lens, degrees, {0, 0, 0});
    if (lens.lens == Lens::orthographic) s.camera.fx = s.camera.fy = 8;
    s.options.background = {0.1f, 0.2f, 0.3f};
    Random random(91);
    for (int i = 0; i < 160; ++i) {
        const double z = random.uniform(-1, 1), longitude = random.uniform(0, 2 * std::numbers::pi);
        const double distance = random.uniform(2, 5), r = std::sqrt(1 - z * z);
        const glm::dvec3 view(r * std::cos(longitude), r * std::sin(longitude), z);
        add(s.gaussians, turn * (distance * view),
            {distance * random.uniform(0.03, 0.2), distance * random.uniform(0.03, 0.1), 0.05 * distance},
            0.9, {random.uniform(), random.uniform(), random.uniform()},
            about({view.y, 0.3, view.x}, 41.0 * i));
    }
    return s;
}

GoldenScene along_rays(Integrator integrator, GoldenScene scene) {
    scene.options.integrator = integrator;
    return scene;
}

/// The points of the scene that comes with ewa, as training starts from them.
GoldenScene still_life() {
    const Dataset dataset = load_dataset(source_folder() / "scenes/still_life", {.downscale = 4});
    GoldenScene s{"still_life_points",
                  gaussians_from_points(dataset.points, 0),
                  dataset.frames.at(5).camera,
                  {},
                  Shown::color,
                  1,
                  kEdges};
    for (float& value : s.gaussians.opacity_logits) value = float(logit(0.7));
    return s;
}

/// The still life while the camera turns and rolls: straight lines are bent, and the rows below are later.
GoldenScene rolling_shutter() {
    GoldenScene s = still_life();
    s.name = "rolling_shutter";
    scene::add_readout(s.camera, ReadoutFrom::top, {0.05, 0.1, 0.3}, {0.1, 0, 0});
    return s;
}

}  // namespace

GoldenScene sub_pixel_scene(Footprint kernel) {
    GoldenScene s{"antialias", {}, plain_camera(), {}, Shown::color, 1, kEdges};
    s.options.kernel = kernel;
    Random random(5);
    for (int i = 0; i < 500; ++i) {
        const double z = random.uniform(3, 6), px = z / s.camera.fx;
        add(s.gaussians, {random.uniform(-30, 30) * px, random.uniform(-22, 22) * px, z},
            {random.uniform(0.02, 0.7) * px, random.uniform(0.02, 0.4) * px, 0.1 * px}, 0.95,
            {random.uniform(0.3, 1), random.uniform(0.3, 1), random.uniform(0.3, 1)},
            about({0, 0, 1}, 37.0 * i));
    }
    return s;
}

std::vector<GoldenScene> golden_scenes() {
    std::vector<GoldenScene> scenes{
        one_splat(),
        sh_lobes("sh_degree_1", 1, {0, 1, 2}),
        sh_lobes("sh_degree_2", 2, {0, 1, 0, 2, 1}),
        sh_lobes("sh_degree_3", 3, {0, 1, 2, 0, 1, 2, 0}),
        overlap_order(),
        near_plane(),
        needles(),
        opaque_stop(),
        faint(),
        far_from_origin(),
        off_centre(),
        sub_pixel_scene(Footprint::antialias),
        sub_pixel_scene(Footprint::density),
        mode("mode_color", Shown::color, 0.25),
        mode("mode_depth", Shown::depth, 0.1),
        mode("mode_alpha", Shown::alpha, 1),
        mode("mode_median_depth", Shown::median_depth, 0.1),
        mode("mode_normal", Shown::normal, 1),
        poisoned(),
        still_life(),
        spheres(),
        through_lens("native_brown", {.k1 = -0.1, .k2 = 0.02, .p1 = 0.02, .p2 = -0.01, .s1 = 0.02}, 0),
        through_lens("native_fisheye_220", {.k1 = 0.02, .k2 = -0.01, .lens = Lens::fisheye}, 220),
        through_lens("native_360", {.lens = Lens::equirectangular}, 0),
        through_lens("native_orthographic", {.lens = Lens::orthographic}, 0),
        along_rays(Integrator::ray, through_lens("ray_brown", {.k1 = -0.1, .k2 = 0.02, .p1 = 0.02}, 0)),
        along_rays(Integrator::ray,
                   through_lens("ray_fisheye_220", {.k1 = 0.02, .lens = Lens::fisheye}, 220)),
        along_rays(Integrator::fast_ray, through_lens("fast_ray_360", {.lens = Lens::equirectangular}, 0)),
        along_rays(Integrator::march, through_lens("march_360", {.lens = Lens::equirectangular}, 0)),
        rolling_shutter(),
    };
    for (GoldenScene& scene : scenes)
        if (scene.options.kernel == Footprint::density) scene.name = "density";
    return scenes;
}

}  // namespace ewa::test
