// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <limits>
#include <numbers>
#include <string>
#include <string_view>

#include "bench/stability/case_table.h"
#include "scene/native_lens.h"

namespace ewa::bench {
namespace {

/// On a sphere round the camera; from 0.02 to 0.12 radians wide. angle: to the axis, at most.
Sketch around(uint32_t i, double angle) {
    const auto a = numbers_of(i, 8), b = numbers_of(i, 9);
    Sketch s = usual_sketch(i, usual_camera(), 4);
    const double cosine = between(a[0], std::cos(angle), 1), turn = 2 * std::numbers::pi * a[1];
    const double sine = std::sqrt(1 - cosine * cosine), distance = usual_depth(i);
    s.view = distance * glm::dvec3(sine * std::cos(turn), sine * std::sin(turn), cosine);
    for (int k = 0; k < 3; ++k)
        s.scale[k] = between(b[3], 0.02, 0.12) * distance * std::exp(between(b[size_t(k)], -0.6, 0.6));
    return s;
}

Gaussians splats_around(double angle, const Change& change = {}) {
    Builder builder(usual_camera());
    for (uint32_t i = 0; i < 80; ++i) {
        Sketch s = around(i, angle);
        if (change) change(s, i);
        builder.add(s);
    }
    return builder.take();
}

Camera fisheye(double degrees, const Distortion& terms = {}) {
    Distortion lens = terms;
    lens.lens = Lens::fisheye;
    return scene::through_lens(usual_camera(), lens, degrees, {});
}

Camera panorama() {
    Camera camera = scene::through_lens(usual_camera(), {.lens = Lens::equirectangular}, 180, {});
    camera.width = 96;
    scene::set_equirectangular(camera);
    return camera;
}

Camera distorted(const Distortion& lens, double focal) {
    Camera camera = usual_camera();
    camera.fx = camera.fy = focal;
    camera.distortion = lens;
    return camera;
}

/// px per world unit: the splats of the usual depths fill the image.
Camera parallel() {
    Camera camera = usual_camera();
    camera.fx = camera.fy = 14;
    camera.distortion.lens = Lens::orthographic;
    return camera;
}

/// Distances on both sides of the near plane; the splats behind it are gone.
void near_the_eye(Sketch& s, uint32_t i) {
    const double distances[] = {1e-6, 0.005, 0.0099, 0.0101, 0.011, 0.02, 0.05};
    const double factor = distances[i % std::size(distances)] / glm::length(s.view);
    s.view *= factor;
    s.scale *= factor;
}

}  // namespace

void add_lenses(Table& table) {
    constexpr double kAll = std::numbers::pi;
    const Camera whole = panorama(), wide = fisheye(220, {.k1 = 0.02, .k2 = -0.01});
    table.add(
        "lens_brown", "radial, tangential and thin prism distortion", splats_around(1),
        distorted({.k1 = -0.2, .k2 = 0.05, .p1 = 0.01, .p2 = -0.008, .k4 = 0.03, .s1 = 0.01, .s4 = 0.004},
                  30));
    table.add("lens_brown_fold", "a radial polynomial that folds within the image", splats_around(1.3),
              distorted({.k1 = -0.35}, 20));
    table.add("lens_fisheye_220", "220 degrees, splats all round", splats_around(kAll), wide);
    table.add("lens_fisheye_axis", "splats within 1e-3 of the axis of a fisheye",
              splats_around(1,
                            [](Sketch& s, uint32_t) {
                                s.view = {1e-3 * s.view.x, 1e-3 * s.view.y, glm::length(s.view)};
                            }),
              wide);
    table.add("lens_fisheye_fold", "a fisheye's polynomial that folds within the image", splats_around(kAll),
              fisheye(200, {.k1 = -0.2}));
    table.add("lens_fisheye_near", "splats at the near plane of a fisheye, on all sides",
              splats_around(kAll, near_the_eye), wide);
    table.add("lens_360", "all directions", splats_around(kAll), whole);
    table.add("lens_360_seam", "splats across the border of a 360 degrees image",
              splats_around(kAll,
                            [](Sketch& s, uint32_t) {
                                const double distance = glm::length(glm::dvec2(s.view.x, s.view.z));
                                s.view.z = -distance;
                                s.view.x *= 0.05;
                            }),
              whole);
    table.add("lens_360_poles", "splats within 0.1 of the poles",
              splats_around(kAll,
                            [](Sketch& s, uint32_t) {
                                const double distance = glm::length(s.view);
                                s.view = {0.1 * s.view.x, std::copysign(distance, s.view.y), 0.1 * s.view.z};
                            }),
              whole);
    table.add("lens_360_near", "splats at the near plane, on all sides", splats_around(kAll, near_the_eye),
              whole);
    table.add("lens_parallel", "parallel rays", splats_around(0.5), parallel());
    table.add("lens_parallel_depths", "parallel rays, splats from -4 to 1e6",
              splats_around(0.5,
                            [](Sketch& s, uint32_t i) {
                                const double depths[] = {-4, 0, 0.0099, 0.0101, 1, 1e3, 1e6};
                                s.view.z = depths[i % std::size(depths)];
                            }),
              parallel());
    for (const auto& [name, camera] :
         {std::pair("lens_fisheye_1:1e4", wide), std::pair("lens_360_1:1e4", whole)})
        table.add(name, "needles and discs",
                  splats_around(kAll,
                                [](Sketch& s, uint32_t i) {
                                    const double along = 0.1 * glm::length(s.view), across = 1e-4 * along;
                                    s.scale = {along, i % 2 == 0 ? across : along, across};
                                }),
                  camera);
    Gaussians damaged = splats_around(kAll);
    for (size_t i = 0; i < 30; ++i) {
        const float bad =
            i % 2 ? std::numeric_limits<float>::quiet_NaN() : std::numeric_limits<float>::infinity();
        damaged.means[3 * (2 * i) + i % 3] = bad;
    }
    table.add("lens_360_value_nan", "every other splat has a mean that is not finite", damaged, whole);
    // The same along rays.
    for (const std::string_view name :
         {"brown", "brown_fold", "fisheye_220", "fisheye_near", "360", "360_seam", "360_poles",
          "fisheye_1:1e4", "360_1:1e4", "360_value_nan"}) {
        StabilityCase along = *std::find_if(
            table.cases.begin(), table.cases.end(),
            [&](const StabilityCase& each) { return each.name == "lens_" + std::string(name); });
        along.name = "ray_" + along.name;
        // Those near the eye have few distances: equal ones have no order.
        along.options.integrator = name == "fisheye_near" ? Integrator::ray : Integrator::fast_ray;
        along.options.kernel = Footprint::antialias;
        table.cases.push_back(std::move(along));
    }
}

}  // namespace ewa::bench
