// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cfloat>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <iterator>
#include <limits>

#include "bench/result.h"
#include "bench/stability/case_table.h"
#include "bench/stability/stability.h"
#include "core/random.h"

namespace ewa::bench {
namespace {

Gaussians usual_scene(const Camera& camera, uint32_t count, int sh_degree = 1, const Change& change = {},
                      double depth = 1) {
    Builder builder(camera, sh_degree);
    builder.add_usual(count, change, depth);
    return builder.take();
}

const std::pair<Footprint, const char*> kKernels[] = {
    {Footprint::peak, ""}, {Footprint::antialias, "_antialias"}, {Footprint::density, "_density"}};

void add_ordinary(Table& table) {
    for (const auto& [kernel, suffix] : kKernels)
        table.add(std::string("ordinary") + suffix, "nothing is", usual_scene(usual_camera(), 60, 3),
                  usual_camera(), kernel);
}

/// Half of them needles (one long axis), half discs (two).
Gaussians thin_splats(double length, double ratio) {
    return usual_scene(usual_camera(), 48, 1, [&](Sketch& s, uint32_t i) {
        const double along = length * s.view.z, across = along / ratio;
        s.scale = {along, i % 2 == 0 ? across : along, across};
    });
}

void add_axis_ratios(Table& table) {
    for (const double ratio : {1.0, 1e2, 1e4, 1e6, 1e7})
        for (const auto& [kernel, suffix] : kKernels)
            if (kernel == Footprint::peak || ratio == 1e4)
                table.add(text_of("axes_1:%.0e%s", ratio, suffix),
                          "needles and discs of 10 px at random orientations", thin_splats(0.15, ratio),
                          usual_camera(), kernel);
    for (const double ratio : {1e4, 1e7})
        table.add(text_of("long_axes_1:%.0e", ratio), "needles and discs of 200 px", thin_splats(3, ratio));
}

void add_scales(Table& table) {
    for (const double factor : {1e-12, 1e-6, 1e-3, 1e3, 1e6})
        for (const auto& [kernel, suffix] : kKernels) {
            if (kernel != Footprint::peak && factor != 1e-6 && factor != 1e6) continue;
            Builder builder(usual_camera());
            builder.add_usual(40, [&](Sketch& s, uint32_t i) {
                s.scale *= factor;
                if (factor > 1) s.logit = between(numbers_of(i, 6)[0], -3, -1);  // transparent
            });
            // If none of them is visible, others are, which must not be affected.
            const bool unseen = kernel != Footprint::peak && factor < 1;
            if (unseen) builder.add_usual(20);
            table.add(text_of("scale_%.0e%s", factor, suffix), "scales times this", builder.take(),
                      usual_camera(), kernel);
        }
}

void add_depths(Table& table) {
    const Camera camera = usual_camera();
    const double around[] = {-1,       -0.01,    -1e-6,  0,     1e-6, 0.005, 0.0099,
                             0.009999, 0.010001, 0.0101, 0.011, 0.02, 0.05};
    for (const bool large : {false, true}) {
        Builder builder(camera);
        for (uint32_t i = 0; i < 4 * std::size(around); ++i) {
            const double z = around[i % std::size(around)];
            Sketch s = usual_sketch(i, camera, z == 0 ? 0.01 : std::abs(z));
            s.view.z = z;
            if (large) s.scale = glm::dvec3(between(numbers_of(i, 7)[0], 0.1, 1));
            if (large) s.logit = -2;
            builder.add(s);
        }
        table.add(large ? "near_plane_large" : "near_plane",
                  large ? "splats of 0.1 to 1 at, across and behind the near plane"
                        : "small splats at, across and just behind the near plane",
                  builder.take());
    }
    for (const double distance : {1e-6, 1e-3, 0.02, 1e4, 1e8}) {
        Builder at(camera);
        for (uint32_t i = 0; i < 40; ++i) at.add(usual_sketch(i, camera, distance * usual_depth(i) / 5));
        // Splats behind the near plane are invisible; the others are not.
        if (distance < 0.01) at.add_usual(20);
        table.add(text_of("distance_%.0e", distance), "so far from the camera", at.take());
    }
    Camera straight = camera;
    straight.rotation = glm::dmat3(1);
    straight.translation = {};
    Builder level(straight);
    for (uint32_t i = 0; i < 200; ++i) level.add(usual_sketch(i, straight, 4));
    table.add("equal_depths", "200 splats at one depth", level.take(), straight);
}

void add_far_from_origin(Table& table) {
    Camera camera = usual_camera();
    const glm::dvec3 place(1e7, -8e6, 300);
    camera.translation = -(camera.rotation * (camera.position() + place));
    table.add("offset_1e7", "a scene of 5 km, 1e7 from the origin, positions in float32",
              usual_scene(camera, 60, 1, {}, 1000), camera);

    // Stored as a georeferenced capture: float32 positions relative to a float64 origin.
    Camera near = usual_camera();
    Gaussians held = usual_scene(near, 60, 3);
    held.origin = place;
    near.translation = -(near.rotation * (near.position() + place));
    table.add("georeferenced_1e7", "a scene of 5 m, 1e7 from the origin, relative to an origin of its own",
              std::move(held), near);
}

void add_opacities(Table& table) {
    const double logits[] = {-1e30, -100, -20, -6, -5.4, -4, 4, 4.7, 6, 10, 16, 20, 88, 100, 1e30};
    const auto change = [&](Sketch& s, uint32_t i) {
        s.logit = logits[i % std::size(logits)];
        s.scale *= 0.5;
    };
    for (const auto& [kernel, suffix] : kKernels)
        if (kernel != Footprint::antialias)
            table.add(std::string("opacity_0_and_1") + suffix, "opacity logits of -1e30 to 1e30",
                      usual_scene(usual_camera(), 60, 1, change), usual_camera(), kernel);
}

void add_stacks(Table& table) {
    Camera camera = usual_camera();
    camera.width = 17;
    camera.height = 13;
    camera.cx = 8.2;
    camera.cy = 6.7;
    for (const bool opaque : {false, true}) {
        Builder builder(camera, 0);
        for (uint32_t i = 0; i < 50000; ++i) {
            Sketch s;
            s.view.z = 4 + 1e-5 * i;
            s.scale = glm::dvec3(0.7 * 4 / camera.fx);
            const double opacity = (opaque ? 0.3 : 1.7) / (opaque ? 1 : 255);
            s.logit = std::log(opacity / (1 - opacity));
            builder.add(s);
        }
        table.add(opaque ? "stack_50000" : "stack_50000_faint", "50,000 splats on one pixel", builder.take(),
                  camera);
    }
}

void add_images(Table& table) {
    Camera dot = usual_camera();
    dot.width = dot.height = 1;
    dot.cx = dot.cy = 0.5;
    table.add("image_1x1", "one pixel", usual_scene(usual_camera(), 40), dot);
    Camera strip = usual_camera();
    strip.width = 16384;
    strip.height = 4;
    strip.cx = 8000.3;
    strip.cy = 2.1;
    strip.fx = strip.fy = 9000;
    const auto small = [](Sketch& s, uint32_t) { s.scale *= 0.05; };
    table.add("image_16384x4", "a strip", usual_scene(strip, 40, 1, small), strip);
}

void add_focal_lengths(Table& table) {
    for (const double focal : {0.01, 1.0, 1e4, 1e6}) {
        Camera camera = usual_camera();
        camera.fx = camera.fy = focal;
        table.add(text_of("focal_%.0e", focal), "focal length in px", usual_scene(camera, 50), camera);
    }
}

void add_quaternions(Table& table) {
    for (const double norm : {1e-37, 1e-20, 1e20, 1e38}) {
        const auto change = [&](Sketch& s, uint32_t) {
            double sum = 0;
            for (const double q : s.quaternion) sum += q * q;
            for (double& q : s.quaternion) q *= norm / std::sqrt(sum);
        };
        table.add(text_of("quaternion_%.0e", norm), "norm of the quaternions",
                  usual_scene(usual_camera(), 50, 1, change));
    }
}

void add_colors(Table& table) {
    for (const double factor : {1e3, 1e6, 1e19, 1e28, 1e36}) {
        Gaussians g = usual_scene(usual_camera(), 50, 3);
        // A splat whose colour exceeds the range is skipped; those in front of it are not.
        const size_t spared = factor > 1e30 ? 20 * g.sh_stride() : 0;
        for (size_t i = spared; i < g.sh.size(); ++i) g.sh[i] = float(g.sh[i] * factor);
        table.add(text_of("sh_%.0e", factor), "SH coefficients times this", std::move(g));
    }
}

float& stored_value(Gaussians& g, size_t splat, size_t value) {
    if (value < 3) return g.means[3 * splat + value];
    if (value < 7) return g.quaternions[4 * splat + value - 3];
    if (value < 10) return g.log_scales[3 * splat + value - 7];
    if (value < 11) return g.opacity_logits[splat];
    return g.sh[g.sh_stride() * splat + value - 11];
}

/// Replaces value i of splat 2 i: each value is bad once. This must not affect the splats between.
void add_replaced(Table& table) {
    constexpr float inf = std::numeric_limits<float>::infinity();
    const std::pair<const char*, float> bad[] = {{"nan", std::numeric_limits<float>::quiet_NaN()},
                                                 {"inf", inf},
                                                 {"minus_inf", -inf},
                                                 {"denormal", 1e-40f},
                                                 {"largest", FLT_MAX},
                                                 {"minus_largest", -FLT_MAX}};
    for (const auto& [name, value] : bad) {
        constexpr size_t kValues = 59;
        Gaussians g = usual_scene(usual_camera(), 2 * kValues, 3);
        for (size_t i = 0; i < kValues; ++i) stored_value(g, 2 * i, i) = value;
        table.add(std::string("value_") + name,
                  "every other splat has one value replaced by this, each in turn", std::move(g));
    }
}

/// The same splats as spheres.
void add_points(Table& table) {
    const auto add = [&](const char* name, const char* what, Gaussians gaussians,
                         const Camera& camera = usual_camera()) {
        table.add(std::string("points_") + name, what, std::move(gaussians), camera);
        table.cases.back().options.points = true;
    };
    const auto scaled = [](double factor) {
        return usual_scene(usual_camera(), 40, 1, [=](Sketch& s, uint32_t) { s.scale *= factor; });
    };
    add("ordinary", "spheres, the 8 nearest at a pixel", usual_scene(usual_camera(), 60, 3));
    add("scale_1e-06", "spheres with scales times this", scaled(1e-6));
    add("scale_1e+02", "spheres with scales times this", scaled(1e2));
    add("needles", "spheres of splats that are 1 : 1e4", thin_splats(0.15, 1e4));
    add("coinciding", "spheres in one place", usual_scene(usual_camera(), 20, 1, [](Sketch& s, uint32_t) {
            s.view = {0.1, 0.2, 4};
        }));
    add("close", "spheres at and just in front of the near plane",
        usual_scene(usual_camera(), 40, 1, {}, 0.004));
    Camera far = usual_camera();
    const glm::dvec3 place(1e7, -8e6, 300);
    Gaussians held = usual_scene(far, 60, 1);
    held.origin = place;
    far.translation = -(far.rotation * (far.position() + place));
    add("georeferenced_1e7", "spheres 1e7 from the origin", std::move(held), far);
    Gaussians damaged = usual_scene(usual_camera(), 60, 1);
    for (size_t i = 0; i < 20; ++i) stored_value(damaged, 2 * i, i) = std::numeric_limits<float>::quiet_NaN();
    add("value_nan", "spheres, every other one with a value that is not a number", std::move(damaged));
}

/// The same splats on rays.
void add_rays(Table& table) {
    const auto add = [&](const char* name, const char* what, const Gaussians& gaussians,
                         const Camera& camera = usual_camera(), Footprint kernel = Footprint::peak) {
        for (const auto& [integrator, prefix] :
             {std::pair(Integrator::ray, "ray_"), std::pair(Integrator::march, "march_")}) {
            table.add(std::string(prefix) + name, what, gaussians, camera, kernel);
            table.cases.back().options.integrator = integrator;
            table.cases.back().options.samples = 16;
        }
    };
    const auto scaled = [](double factor) {
        return usual_scene(usual_camera(), 40, 1, [=](Sketch& s, uint32_t) { s.scale *= factor; });
    };
    add("ordinary", "splats along rays", usual_scene(usual_camera(), 60, 3));
    add("ordinary_density", "densities along rays", usual_scene(usual_camera(), 60, 3), usual_camera(),
        Footprint::density);
    add("scale_1e-02", "scales times this", scaled(1e-2));
    add("scale_1e+02", "scales times this: the camera is inside", scaled(1e2));
    add("needles", "scales of 1 : 1e4", thin_splats(0.15, 1e4));
    add("pancakes", "one scale of 1e-4",
        usual_scene(usual_camera(), 40, 1, [](Sketch& s, uint32_t i) { s.scale[i % 3] *= 1e-4; }));
    Camera far = usual_camera();
    const glm::dvec3 place(1e7, -8e6, 300);
    Gaussians held = usual_scene(far, 60, 1);
    held.origin = place;
    far.translation = -(far.rotation * (far.position() + place));
    add("georeferenced_1e7", "splats 1e7 from the origin", held, far);
    Gaussians damaged = usual_scene(usual_camera(), 60, 1);
    for (size_t i = 0; i < 20; ++i) stored_value(damaged, 2 * i, i) = std::numeric_limits<float>::quiet_NaN();
    add("value_nan", "every other splat has a value that is not a number", damaged);
    const auto widened = [&](const char* name, const char* what, Gaussians gaussians) {
        table.add(std::string("fast_ray_") + name, what, std::move(gaussians), usual_camera(),
                  Footprint::antialias);
        table.cases.back().options.integrator = Integrator::fast_ray;
    };
    widened("ordinary_antialias", "splats along rays, widened by a pixel",
            usual_scene(usual_camera(), 60, 3));
    widened("scale_1e-06_antialias", "scales times this: all of the width is the pixel's", scaled(1e-6));
    widened("scale_1e+02_antialias", "scales times this: the camera is inside", scaled(1e2));
    widened("needles_antialias", "scales of 1 : 1e4", thin_splats(0.15, 1e4));
    // Splats in one place have no order on a ray, but a march mixes them.
    table.add("march_coinciding", "splats in one place",
              usual_scene(usual_camera(), 20, 1, [](Sketch& s, uint32_t) {
                  s.view = {0.1, 0.2, 4};
              }));
    table.cases.back().options.integrator = Integrator::march;
    table.cases.back().options.samples = 16;
}

}  // namespace

std::vector<StabilityCase> stability_cases() {
    Table table;
    for (const auto add : {add_ordinary, add_axis_ratios, add_scales, add_depths, add_far_from_origin,
                           add_opacities, add_stacks, add_images, add_focal_lengths, add_quaternions,
                           add_colors, add_replaced, add_points, add_rays, add_lenses, add_readouts})
        add(table);
    return std::move(table.cases);
}

StabilityCase stability_case_of(const std::string& name, const Gaussians& gaussians) {
    // The camera looks at the middle half of the splats along each axis.
    glm::dvec3 low(0), high(0);
    for (int k = 0; k < 3; ++k) {
        std::vector<double> values;
        for (size_t i = 0; i < gaussians.size(); ++i)
            if (std::isfinite(gaussians.means[3 * i + size_t(k)]))
                values.push_back(gaussians.world_mean(i)[k]);
        if (values.empty()) continue;
        std::sort(values.begin(), values.end());
        low[k] = values[values.size() / 4];
        high[k] = values[values.size() * 3 / 4];
    }
    const double radius = std::max(0.5 * glm::length(high - low), 1e-3);
    const glm::dmat3 rotation = turned(0.3, 0.5);
    const glm::dvec3 eye = 0.5 * (low + high) - glm::transpose(rotation) * glm::dvec3(0, 0, 3 * radius);
    const Camera camera{320, 240, 300, 300, 160, 120, rotation, -(rotation * eye)};
    RenderOptions options;
    options.kernel = gaussians.density ? Footprint::density : Footprint::peak;
    return {name, "the scene of this file", gaussians, camera, options};
}

Image stability_target(int width, int height) {
    Image target(width, height, 3);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const auto noise = numbers_of(uint32_t(x), 1000 + uint32_t(y));
            for (int c = 0; c < 3; ++c)
                target.at(x, y)[c] =
                    float(0.5 + 0.3 * std::sin(0.21 * x + 0.13 * y + 2 * c) + 0.2 * (noise[size_t(c)] - 0.5));
        }
    return target;
}

}  // namespace ewa::bench
