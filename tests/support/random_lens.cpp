// SPDX-License-Identifier: Apache-2.0
#include "support/random_lens.h"

#include <algorithm>
#include <cmath>
#include <glm/ext/quaternion_double.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>
#include <numbers>

#include "support/random_scene.h"

namespace ewa::test {
namespace {

glm::dvec3 any_direction(Random& random) {
    for (;;) {
        const glm::dvec3 v(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        const double length = glm::length(v);
        if (length > 0.1 && length < 1) return v / length;
    }
}

glm::dvec3 mean_of(Random& random, const Camera& camera) {
    const double distance = random.uniform(2, 8);
    if (camera.distortion.lens == Lens::orthographic)
        return {(random.uniform(-0.2, 1.2) * camera.width - camera.cx) / camera.fx,
                (random.uniform(-0.2, 1.2) * camera.height - camera.cy) / camera.fy, random.uniform(-2, 8)};
    if (camera.distortion.lens == Lens::brown)
        return distance * glm::dvec3((random.uniform(-0.2, 1.2) * camera.width - camera.cx) / camera.fx,
                                     (random.uniform(-0.2, 1.2) * camera.height - camera.cy) / camera.fy,
                                     random.uniform() < 0.1 ? -1 : 1);
    return distance * any_direction(random);
}

}  // namespace

std::vector<NamedCamera> random_lenses(uint64_t seed, int width, int height) {
    Camera base = random_camera(seed, width, height);
    std::vector<NamedCamera> all;
    const auto add = [&](const char* name, const Distortion& lens) -> Camera& {
        all.push_back({name, base});
        all.back().camera.distortion = lens;
        return all.back().camera;
    };
    add("brown", {.k1 = -0.11, .k2 = 0.04, .p1 = 0.003, .p2 = -0.004, .k3 = 0.01});
    add("rational", {.k1 = 0.31,
                     .k2 = -0.06,
                     .p1 = -0.002,
                     .p2 = 0.005,
                     .k3 = 0.01,
                     .k4 = 0.45,
                     .k5 = 0.02,
                     .k6 = 0.006,
                     .s1 = 0.004,
                     .s2 = -0.001,
                     .s3 = -0.005,
                     .s4 = 0.002});
    const double half = 95 * std::numbers::pi / 180;  // 190 degrees across the smaller side
    const double short_side = std::min(width, height);
    for (const bool plain : {true, false}) {
        Camera& fisheye =
            plain ? add("fisheye", {.lens = Lens::fisheye})
                  : add("fisheye_bent",
                        {.k1 = -0.03, .k2 = 0.004, .k3 = -0.002, .k4 = 0.0003, .lens = Lens::fisheye});
        fisheye.fx = 0.5 * short_side / half;
        fisheye.fy = 1.03 * fisheye.fx;
    }
    Camera& panorama = add("equirectangular", {.lens = Lens::equirectangular});
    panorama.fx = width / (2 * std::numbers::pi);
    panorama.fy = height / std::numbers::pi;
    panorama.cx = 0.5 * width;
    panorama.cy = 0.5 * height;
    Camera& parallel = add("orthographic", {.lens = Lens::orthographic});
    parallel.fx = 0.2 * width;
    parallel.fy = 0.22 * width;
    return all;
}

std::vector<NamedCamera> rolling_cameras(uint64_t seed, int width, int height) {
    const std::vector<NamedCamera> lenses = random_lenses(seed, width, height);
    std::vector<NamedCamera> all;
    for (const char* name : {"top", "bottom", "left", "right"}) {
        all.push_back({name, lenses[0].camera});
        all.back().camera.distortion = {};
    }
    for (const size_t lens : {0, 2, 3}) all.push_back(lenses[lens]);
    Random random(seed ^ 0x9011ull);
    for (size_t i = 0; i < all.size(); ++i) {
        Camera& camera = all[i].camera;
        const glm::dvec3 axis = any_direction(random), way = any_direction(random);
        const double angle = random.uniform(0.14, 0.2);
        Readout end{ReadoutFrom(i % 4), {}, {}};
        end.rotation = glm::mat3_cast(glm::angleAxis(angle, axis)) * camera.rotation;
        end.translation = -(end.rotation * (camera.position() + 0.3 * way));
        camera.readout = end;
    }
    return all;
}

Gaussians gaussians_around(uint64_t seed, size_t count, const Camera& camera, int sh_degree) {
    Gaussians gaussians = random_gaussians(seed, count, SplatKind::ordinary, camera, sh_degree);
    Random random(seed ^ 0x1e45ull);
    const bool parallel = camera.distortion.lens == Lens::orthographic;
    for (size_t i = 0; i < count; ++i) {
        const glm::dvec3 view = mean_of(random, camera);
        const glm::dvec3 mean = glm::transpose(camera.rotation) * (view - camera.translation);
        const double pixel = (parallel ? 1 : glm::length(view)) / std::min(camera.fx, camera.fy);
        for (int k = 0; k < 3; ++k) {
            gaussians.means[3 * i + size_t(k)] = float(mean[k]);
            gaussians.log_scales[3 * i + size_t(k)] = float(std::log(pixel * random.uniform(0.4, 4)));
        }
    }
    return gaussians;
}

}  // namespace ewa::test
