// SPDX-License-Identifier: Apache-2.0
#include "bench/stability/cases.h"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <iterator>
#include <limits>

#include "bench/report.h"
#include "core/random.h"

namespace ewa::bench {
namespace {

constexpr uint32_t kSeed = 0x73746966u;

std::array<double, 4> uniform(uint32_t i, uint32_t stream) {
    return core::uniform4({i, stream, kSeed, 0});
}

double between(double u, double low, double high) {
    return low + (high - low) * u;
}

glm::dmat3 turned(double angle_x, double angle_y) {
    const double cx = std::cos(angle_x), sx = std::sin(angle_x), cy = std::cos(angle_y),
                 sy = std::sin(angle_y);
    return glm::dmat3(1, 0, 0, 0, cx, sx, 0, -sx, cx) * glm::dmat3(cy, 0, -sy, 0, 1, 0, sy, 0, cy);
}

/// The default camera: a small image from a generic position.
Camera usual_camera() {
    Camera camera;
    camera.width = 64;
    camera.height = 48;
    camera.fx = 70;
    camera.fy = 66;
    camera.cx = 31.3;
    camera.cy = 24.8;
    camera.rotation = turned(0.4, -0.7);
    camera.translation = -(camera.rotation * glm::dvec3(0.7, -0.4, 0.2));
    return camera;
}

struct Sketch {
    glm::dvec3 view{0, 0, 4};  // camera coordinates
    glm::dvec3 scale{0.2};     // world units
    std::array<double, 4> quaternion{1, 0, 0, 0};
    double logit = 0;
};

/// A splat at a relative position in the image, `pixels` wide.
Sketch usual_sketch(uint32_t i, const Camera& camera, double z) {
    const auto a = uniform(i, 1), b = uniform(i, 2), c = uniform(i, 3);
    Sketch s;
    s.view = {(between(a[0], -0.05, 1.05) * camera.width - camera.cx) / camera.fx * z,
              (between(a[1], -0.05, 1.05) * camera.height - camera.cy) / camera.fy * z, z};
    const double pixels = between(a[2], 0.02, 0.12) * std::max(camera.width, camera.height);
    for (int k = 0; k < 3; ++k)
        s.scale[k] = pixels * z / camera.fx * std::exp(between(b[size_t(k)], -0.6, 0.6));
    const auto n = core::normal3({i, 4, kSeed, 0});
    s.quaternion = {between(c[0], -1, 1), n[0], n[1], n[2]};
    s.logit = between(c[1], -2, 3);
    return s;
}

double usual_depth(uint32_t i) {
    return between(uniform(i, 5)[0], 2, 8);
}

class Builder {
  public:
    explicit Builder(const Camera& camera, int sh_degree = 1) : camera_(camera) {
        out_.sh_degree = sh_degree;
    }

    void add(const Sketch& sketch) {
        const uint32_t i = uint32_t(out_.size());
        const glm::dvec3 mean = glm::transpose(camera_.rotation) * sketch.view + camera_.position();
        for (int k = 0; k < 3; ++k) {
            out_.means.push_back(float(mean[k]));
            out_.log_scales.push_back(float(std::log(sketch.scale[k])));
        }
        for (const double q : sketch.quaternion) out_.quaternions.push_back(float(q));
        out_.opacity_logits.push_back(float(sketch.logit));
        for (size_t k = 0; k < out_.sh_stride(); ++k) {
            const double u = uniform(i, 16 + uint32_t(k))[0];
            out_.sh.push_back(float(k < 3 ? between(u, -1.5, 1.7) : between(u, -0.3, 0.3)));
        }
    }
    Gaussians take() { return std::move(out_); }

  private:
    Camera camera_;
    Gaussians out_;
};

Gaussians usual_scene(const Camera& camera, uint32_t count, int sh_degree = 1) {
    Builder builder(camera, sh_degree);
    for (uint32_t i = 0; i < count; ++i) builder.add(usual_sketch(i, camera, usual_depth(i)));
    return builder.take();
}

class Table {
  public:
    void add(std::string name, std::string what, Gaussians gaussians, const Camera& camera = usual_camera(),
             Footprint kernel = Footprint::peak) {
        RenderOptions options;
        options.background = {0.2f, 0.5f, 0.8f};
        options.kernel = kernel;
        cases_.push_back({std::move(name), std::move(what), std::move(gaussians), camera, options});
    }
    std::vector<StabilityCase> take() { return std::move(cases_); }

  private:
    std::vector<StabilityCase> cases_;
};

const std::pair<Footprint, const char*> kKernels[] = {
    {Footprint::peak, ""}, {Footprint::antialias, "_antialias"}, {Footprint::unit_mass, "_unit_mass"}};

void add_ordinary(Table& table) {
    for (const auto& [kernel, suffix] : kKernels)
        table.add(std::string("ordinary") + suffix, "nothing is", usual_scene(usual_camera(), 60, 3),
                  usual_camera(), kernel);
}

/// Half of them needles (one long axis), half discs (two).
Gaussians thin_splats(double length, double ratio) {
    const Camera camera = usual_camera();
    Builder builder(camera);
    for (uint32_t i = 0; i < 48; ++i) {
        Sketch s = usual_sketch(i, camera, usual_depth(i));
        const double along = length * s.view.z, across = along / ratio;
        s.scale = {along, i % 2 == 0 ? across : along, across};
        builder.add(s);
    }
    return builder.take();
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
            const Camera camera = usual_camera();
            Builder builder(camera);
            for (uint32_t i = 0; i < 40; ++i) {
                Sketch s = usual_sketch(i, camera, usual_depth(i));
                s.scale *= factor;
                if (factor > 1) s.logit = between(uniform(i, 6)[0], -3, -1);  // transparent
                builder.add(s);
            }
            // If none of them is visible, others are, which must not be affected.
            const bool unseen =
                kernel == Footprint::antialias ? factor < 1 : kernel == Footprint::unit_mass && factor > 1;
            for (uint32_t i = 0; unseen && i < 20; ++i) builder.add(usual_sketch(i, camera, usual_depth(i)));
            table.add(text_of("scale_%.0e%s", factor, suffix), "scales times this", builder.take(), camera,
                      kernel);
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
            if (large) s.scale = glm::dvec3(between(uniform(i, 7)[0], 0.1, 1));
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
        for (uint32_t i = 0; distance < 0.01 && i < 20; ++i) at.add(usual_sketch(i, camera, usual_depth(i)));
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
    Builder stored(camera);
    for (uint32_t i = 0; i < 60; ++i) {
        Sketch s = usual_sketch(i, camera, 1000 * usual_depth(i));
        stored.add(s);
    }
    table.add("offset_1e7", "a scene of 5 km, 1e7 from the origin, positions in float32", stored.take(),
              camera);

    // Stored as a georeferenced capture: float32 positions relative to a float64 origin.
    Camera near = usual_camera();
    Gaussians held = usual_scene(near, 60, 3);
    held.origin = place;
    near.translation = -(near.rotation * (near.position() + place));
    table.add("georeferenced_1e7", "a scene of 5 m, 1e7 from the origin, relative to an origin of its own",
              std::move(held), near);
}

void add_opacities(Table& table) {
    const Camera camera = usual_camera();
    const double logits[] = {-1e30, -100, -20, -6, -5.4, -4, 4, 4.7, 6, 10, 16, 20, 88, 100, 1e30};
    Builder builder(camera);
    for (uint32_t i = 0; i < 60; ++i) {
        Sketch s = usual_sketch(i, camera, usual_depth(i));
        s.logit = logits[i % std::size(logits)];
        s.scale *= 0.5;
        builder.add(s);
    }
    table.add("opacity_0_and_1", "opacity logits of -1e30 to 1e30", builder.take());
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
    Builder builder(strip);
    for (uint32_t i = 0; i < 40; ++i) {
        Sketch s = usual_sketch(i, strip, usual_depth(i));
        s.scale *= 0.05;
        builder.add(s);
    }
    table.add("image_16384x4", "a strip", builder.take(), strip);
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
        const Camera camera = usual_camera();
        Builder builder(camera);
        for (uint32_t i = 0; i < 50; ++i) {
            Sketch s = usual_sketch(i, camera, usual_depth(i));
            double sum = 0;
            for (const double q : s.quaternion) sum += q * q;
            for (double& q : s.quaternion) q *= norm / std::sqrt(sum);
            builder.add(s);
        }
        table.add(text_of("quaternion_%.0e", norm), "norm of the quaternions", builder.take());
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

/// Replaces value i of splat 2 i, so that each value of a splat is bad once. The splats between are good and
/// must not be affected.
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

}  // namespace

std::vector<StabilityCase> stability_cases() {
    Table table;
    add_ordinary(table);
    add_axis_ratios(table);
    add_scales(table);
    add_depths(table);
    add_far_from_origin(table);
    add_opacities(table);
    add_stacks(table);
    add_images(table);
    add_focal_lengths(table);
    add_quaternions(table);
    add_colors(table);
    add_replaced(table);
    return table.take();
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
    StabilityCase one;
    one.name = name;
    one.what = "the scene of this file";
    one.gaussians = gaussians;
    one.camera.width = 320;
    one.camera.height = 240;
    one.camera.fx = one.camera.fy = 300;
    one.camera.cx = 160;
    one.camera.cy = 120;
    one.camera.rotation = turned(0.3, 0.5);
    const glm::dvec3 eye =
        0.5 * (low + high) - glm::transpose(one.camera.rotation) * glm::dvec3(0, 0, 3 * radius);
    one.camera.translation = -(one.camera.rotation * eye);
    return one;
}

Image stability_photo(int width, int height) {
    Image photo(width, height, 3);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const auto noise = uniform(uint32_t(x), 1000 + uint32_t(y));
            for (int c = 0; c < 3; ++c)
                photo.at(x, y)[c] =
                    float(0.5 + 0.3 * std::sin(0.21 * x + 0.13 * y + 2 * c) + 0.2 * (noise[size_t(c)] - 0.5));
        }
    return photo;
}

}  // namespace ewa::bench
