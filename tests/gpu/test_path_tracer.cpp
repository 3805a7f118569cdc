// SPDX-License-Identifier: Apache-2.0
// Renders of mesh scenes whose answer is known in closed form, and rays against the float64 CPU reference.
#include <gtest/gtest.h>

#include <algorithm>

#include "gpu/test_device.h"
#include "pathtracer/path_tracer.h"
#include "pathtracer/virtual_camera.h"
#include "reference/tracing.h"
#include "scene/native_lens.h"
#include "support/mesh_scenes.h"
#include "support/random_lens.h"

namespace {

using namespace ewa;
using pathtracer::PathTracer;

constexpr double kPi = std::numbers::pi;
constexpr double kUnclamped = 1e30;

struct Shot {
    Image radiance;
    uint64_t unfinished, dropped;
};

Shot shoot(const scene::MeshScene& scene, const Camera& camera, int samples,
           const std::vector<Image>& images = {}, double brightest = kUnclamped) {
    PathTracer tracer(test::device(), pathtracer::pack(scene, images), scene.sky);
    Image image = tracer.radiance(camera, samples, 1, brightest);
    return {std::move(image), tracer.unfinished_rays(), tracer.dropped_samples()};
}

scene::MeshScene floor_scene(const glm::vec3& albedo, double half = 10) {
    scene::MeshScene scene;
    scene.sky = test::even_sky(0);
    scene.materials.push_back(test::diffuse(albedo));
    test::add_quad(scene, {-half, -half, 0}, {half, -half, 0}, {half, half, 0}, {-half, half, 0});
    return scene;
}

TEST(PathTracer, AFurnaceHidesABallOfItsAlbedo) {
    scene::MeshScene scene;
    scene.sky = test::even_sky(2);
    scene.materials.push_back(test::diffuse({0.8f, 1.0f, 0.1f}));
    test::add_ball(scene, 1.5, 16);
    const Shot shot = shoot(scene, test::camera_down_z({0, 0, 6}, 40, 40, 60), 16);
    double sum[3] = {}, coverage = 0;
    for (size_t i = 0; i < shot.radiance.pixels.size(); i += 4) {
        for (size_t c = 0; c < 3; ++c) sum[c] += double(shot.radiance.pixels[i + c]);
        coverage += double(shot.radiance.pixels[i + 3]);
    }
    EXPECT_NEAR(coverage / 1600, kPi * std::pow(60 * 1.5 / std::sqrt(36 - 2.25), 2) / 1600, 0.01);
    EXPECT_NEAR(sum[0] / coverage, 1.6, 1.6e-4);
    EXPECT_NEAR(sum[1] / coverage, 2.0, 2e-4);
    EXPECT_NEAR(sum[2] / coverage, 0.2, 2e-5);
    EXPECT_EQ(shot.unfinished + shot.dropped, 0u);
}

TEST(PathTracer, AMirrorsAlbedoIsGgxs) {
    // What a white metal ball reflects of an even sky, averaged over its disc: GGX with height-correlated
    // Smith shadowing, one bounce, integrated numerically apart from this program.
    const std::pair<float, double> known[] = {{0.0f, 1.0}, {0.2f, 0.9943}, {0.5f, 0.8822}};
    for (const auto& [roughness, albedo] : known) {
        scene::MeshScene scene;
        scene.sky = test::even_sky(1);
        scene.materials.emplace_back();
        scene.materials[0].roughness = roughness;  // of a metal of base 1
        test::add_ball(scene, 1.5, 16);
        const Shot shot = shoot(scene, test::camera_down_z({0, 0, 6}, 40, 40, 60), 16);
        double sum = 0, coverage = 0;
        for (size_t i = 0; i < shot.radiance.pixels.size(); i += 4) {
            sum += double(shot.radiance.pixels[i]);
            coverage += double(shot.radiance.pixels[i + 3]);
        }
        EXPECT_NEAR(sum / coverage, albedo, 3e-3) << roughness;
    }
}

TEST(PathTracer, AMirrorShowsTheSkyFromZenithToGround) {
    scene::MeshScene scene = floor_scene(glm::vec3(1));
    scene.materials[0] = {};
    scene.materials[0].roughness = 0;  // of a metal of base 1
    scene.sky = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const Shot shot = shoot(scene, test::camera_down_z({0, 0, 5}, 41, 41, 50), 16);
    for (const int y : {3, 20, 37}) {
        // Up is y: the mirror turns z alone.
        const double slope = (20.5 - (y + 0.5)) / 50, height = slope / std::sqrt(1 + slope * slope);
        const float* pixel = shot.radiance.at(20, y);
        EXPECT_NEAR(double(pixel[0]), std::max(height, 0.0), 0.01) << y;
        EXPECT_NEAR(double(pixel[1]), 1 - std::abs(height), 0.01) << y;
        EXPECT_NEAR(double(pixel[2]), std::max(-height, 0.0), 0.01) << y;
    }
}

/// Inside a closed box that shines and reflects: a geometric series, cut after the last bounce.
TEST(PathTracer, ARouletteTakesNothingAway) {
    scene::MeshScene scene;
    scene.sky = test::even_sky(0);
    const double albedo = 0.6;
    scene.materials.push_back(test::diffuse(glm::vec3(float(albedo))));
    scene.materials[0].emitted = glm::vec3(1.0f);
    const auto corner = [](int bits) {
        return glm::dvec3(bits & 1 ? 1 : -1, bits & 2 ? 1 : -1, bits & 4 ? 1 : -1);
    };
    const int faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                             {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& f : faces)  // seen from inside
        test::add_quad(scene, corner(f[3]), corner(f[2]), corner(f[1]), corner(f[0]));
    const Shot shot = shoot(scene, test::camera_down_z({0, 0, 0.5}, 16, 16, 10), 1024);
    double sum = 0;
    for (size_t i = 0; i < shot.radiance.pixels.size(); i += 4) sum += double(shot.radiance.pixels[i]);
    double expected = 0;
    for (int k = 0; k <= int(shared::TRACE_BOUNCES); ++k) expected += std::pow(albedo, k);
    EXPECT_NEAR(sum / 256, expected, 0.01 * expected);
}

TEST(PathTracer, APointLightOnALambertPlane) {
    for (const double size : {1.0, 1e-3, 1e4}) {  // the unit of length changes nothing
        scene::MeshScene scene = floor_scene({0.5f, 0.25f, 1.0f}, 10 * size);
        scene::Light light;
        light.position = glm::dvec3(1, 0, 2) * size;
        light.intensity = glm::dvec3(10, 20, 30) * size * size;
        scene.lights.push_back(light);
        const Shot shot = shoot(scene, test::camera_down_z({0, 0, 5 * size}, 41, 41, 50), 16);
        for (const auto& [x, y] : {std::pair{20, 20}, {30, 20}, {5, 33}}) {
            const double px = (x + 0.5 - 20.5) / 10, py = -(y + 0.5 - 20.5) / 10;
            const double d2 = (px - 1) * (px - 1) + py * py + 4;
            const double irradiance = 2 / std::pow(d2, 1.5);
            const float* pixel = shot.radiance.at(x, y);
            EXPECT_NEAR(double(pixel[0]), 0.5 / kPi * 10 * irradiance, 0.004 * irradiance);
            EXPECT_NEAR(double(pixel[1]), 0.25 / kPi * 20 * irradiance, 0.004 * irradiance);
            EXPECT_NEAR(double(pixel[2]), 1.0 / kPi * 30 * irradiance, 0.024 * irradiance);
            EXPECT_EQ(pixel[3], 1.0f);
        }
    }
}

TEST(PathTracer, LightsOfUnequalPowerAddUp) {
    scene::MeshScene scene = floor_scene(glm::vec3(0.5f));
    double expected = 0;
    for (const auto& [x, intensity] : {std::pair{1.0, 40.0}, {-2.0, 10.0}, {0.0, 2.0}}) {
        scene::Light light;
        light.position = {x, 0, 2};
        light.intensity = glm::dvec3(intensity);
        scene.lights.push_back(light);
        expected += 0.5 / kPi * intensity * 2 / std::pow(x * x + 4, 1.5);
    }
    const Shot shot = shoot(scene, test::camera_down_z({0, 0, 5}, 9, 9, 2000), 4096);
    EXPECT_NEAR(double(shot.radiance.at(4, 4)[0]), expected, 0.03 * expected);
}

/// GGX with height-correlated Smith shadowing (Heitz 2014), off its peak.
TEST(PathTracer, APointLightOnBrushedMetal) {
    scene::MeshScene scene = floor_scene(glm::vec3(0.0f));
    scene.materials[0] = {};
    scene.materials[0].roughness = 0.6f;  // of a metal of base 1
    scene::Light light;
    light.position = {1, 0, 2};
    light.intensity = glm::dvec3(10);
    scene.lights.push_back(light);
    const Shot shot = shoot(scene, test::camera_down_z({0, 0, 5}, 9, 9, 5000), 64);
    const double a2 = std::pow(0.6, 4), cos_in = 2 / std::sqrt(5.0);
    const double cos_h = std::sqrt((1 + cos_in) / 2);  // the view is the normal, so h stands half way
    const double lambda_in = 0.5 * (std::sqrt(1 + a2 * (1 / (cos_in * cos_in) - 1)) - 1);
    const double distribution = a2 / (kPi * std::pow(cos_h * cos_h * (a2 - 1) + 1, 2));
    const double expected = 10.0 / 5 * distribution / (4 * (1 + lambda_in));
    EXPECT_NEAR(double(shot.radiance.at(4, 4)[0]), expected, 0.01 * expected);
}

/// What a dielectric's surface mirrors does not reach the body under it. The specification's mix of the two
/// goes by the half vector and so gives back a little more than it gets.
TEST(PathTracer, AWhiteGlazeGivesBackWhatItGets) {
    scene::MeshScene scene;
    scene.sky = test::even_sky(1);
    scene.materials.emplace_back();
    scene.materials[0].metallic = 0;
    scene.materials[0].roughness = 0.5f;
    test::add_ball(scene, 1.5, 16);
    const Shot shot = shoot(scene, test::camera_down_z({0, 0, 6}, 40, 40, 60), 64);
    double sum = 0, coverage = 0;
    for (size_t i = 0; i < shot.radiance.pixels.size(); i += 4) {
        sum += double(shot.radiance.pixels[i]);
        coverage += double(shot.radiance.pixels[i + 3]);
    }
    EXPECT_NEAR(sum / coverage, 1, 0.02);
}

TEST(PathTracer, ATextureColoursWhatIsReflected) {
    Image image(1, 1, 3);
    image.pixels = {1, 0, 0};
    scene::MeshScene scene = floor_scene({0.5f, 0.5f, 0.5f});
    scene.sky = test::even_sky(1);
    scene.materials[0].base_texture = 0;
    scene.images.resize(1);
    scene.textures.push_back({0, shared::WRAP_REPEAT, shared::WRAP_REPEAT, true});
    const Shot shot = shoot(scene, test::camera_down_z({0, 0, 5}, 9, 9, 10), 16, {image});
    EXPECT_NEAR(double(shot.radiance.at(4, 4)[0]), 0.5, 1e-3);
    EXPECT_EQ(shot.radiance.at(4, 4)[1], 0.0f);
    EXPECT_EQ(shot.radiance.at(4, 4)[2], 0.0f);
}

TEST(PathTracer, SunAndShadow) {
    scene::MeshScene scene = floor_scene(glm::vec3(0.5f));
    scene::Light sun;
    sun.kind = shared::LIGHT_DIRECTIONAL;
    sun.direction = {0, -1, -1};
    sun.intensity = glm::dvec3(kPi);
    scene.lights.push_back(sun);
    // An edge of a roof over y > 1 at height 1: its shadow begins at y = 0.
    scene.materials.push_back(test::diffuse(glm::vec3(0.0f)));
    test::add_quad(scene, {-5, 1, 1}, {5, 1, 1}, {5, 9, 1}, {-5, 9, 1}, 1);
    const Shot shot = shoot(scene, test::camera_down_z({0, -2, 5}, 41, 41, 50), 8);
    // y = -2 - (row - 20) / 10
    EXPECT_NEAR(double(shot.radiance.at(20, 30)[0]), 0.5 * std::sqrt(0.5), 1e-5);
    EXPECT_NEAR(double(shot.radiance.at(20, 2)[0]), 0.5 * std::sqrt(0.5), 1e-5);
    Shot beyond = shoot(scene, test::camera_down_z({0, 0.5, 0.9}, 41, 41, 50), 8);
    EXPECT_EQ(beyond.radiance.at(20, 20)[0], 0.0f);
}

TEST(PathTracer, ASpotsConeAndALightsRange) {
    scene::MeshScene scene = floor_scene(glm::vec3(1.0f));
    scene::Light light;
    light.kind = shared::LIGHT_SPOT;
    light.position = {0, 0, 2};
    light.inner = 0.2;
    light.outer = 0.6;
    light.range = 4;
    light.intensity = glm::dvec3(kPi);
    scene.lights.push_back(light);
    const Shot shot = shoot(scene, test::camera_down_z({0, 0, 5}, 61, 61, 100), 16);
    for (const int column : {30, 36, 44, 52, 58}) {
        const double x = (column - 30) / 20.0, d = std::hypot(x, 2.0), cosine = 2 / d;
        const double cone = std::clamp((cosine - std::cos(0.6)) / (std::cos(0.2) - std::cos(0.6)), 0.0, 1.0);
        const double window = 1 - std::pow(d / 4, 4);
        EXPECT_NEAR(double(shot.radiance.at(column, 30)[0]), cone * cone * window * cosine / (d * d), 2e-3)
            << column;
    }
}

TEST(PathTracer, ASquareThatShines) {
    // The form factor of a square over the point under its middle (Siegel and Howell, configuration C-11,
    // four times).
    scene::MeshScene scene = floor_scene(glm::vec3(0.6f));
    scene::Material shining = test::diffuse(glm::vec3(0.0f));
    shining.emitted = glm::vec3(3, 0, 0);
    scene.materials.push_back(shining);
    const double a = 0.7, h = 1.2;
    test::add_quad(scene, {-a, -a, h}, {-a, a, h}, {a, a, h}, {a, -a, h}, 1);  // faces down
    Camera camera = test::camera_down_z({0, 0, 0.6}, 3, 3, 60);
    const Shot shot = shoot(scene, camera, 1024);
    const double s = a / h, w = std::sqrt(1 + s * s);
    const double factor = 4 / (2 * kPi) * 2 * (s / w * std::atan(s / w));
    EXPECT_NEAR(double(shot.radiance.at(1, 1)[0]), 0.6 * 3 * factor, 0.01);
    EXPECT_EQ(shot.radiance.at(1, 1)[1], 0.0f);
    // From above the square is not there: it has one side.
    const Shot above = shoot(scene, test::camera_down_z({0, 0, 4}, 3, 3, 60), 256);
    EXPECT_NEAR(double(above.radiance.at(1, 1)[0]), 0.6 * 3 * factor, 0.02);
}

TEST(PathTracer, DepthOfATiltedPlane) {
    for (const double shift : {0.0, 1e6}) {  // far from the origin nothing is lost
        scene::MeshScene scene;
        scene.materials.push_back(test::diffuse(glm::vec3(1.0f)));
        const glm::dvec3 at(shift, -shift, shift);
        // z = -4 + x / 2
        test::add_quad(scene, at + glm::dvec3(-20, -20, -14), at + glm::dvec3(20, -20, 6),
                       at + glm::dvec3(20, 20, 6), at + glm::dvec3(-20, 20, -14));
        PathTracer tracer(test::device(), pathtracer::pack(scene, {}), scene.sky);
        const Camera camera = test::camera_down_z(at, 32, 24, 40);
        const Image depth = tracer.seen(camera).depth;
        for (int y = 0; y < 24; ++y)
            for (int x = 0; x < 32; ++x) {
                const double slope = (x + 0.5 - 16) / 40;  // of x over depth
                EXPECT_NEAR(double(depth.at(x, y)[0]), 4 / (1 + slope / 2), 4e-6) << x << " " << y;
            }
    }
}

TEST(PathTracer, ATextureSeenFaceOnGivesItsTexels) {
    constexpr int kTexels = 8;
    Image image(kTexels, kTexels, 3);
    for (size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = float((i * 37) % 256) / 255;
    scene::MeshScene scene;
    scene::Material shown = test::diffuse(glm::vec3(0.0f));
    shown.emitted = glm::vec3(1);
    shown.emitted_texture = 0;
    scene.materials.push_back(shown);
    scene.images.resize(1);
    scene.textures.push_back({0, shared::WRAP_CLAMP, shared::WRAP_CLAMP, true});
    test::add_quad(scene, {-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0});
    const Shot shot = shoot(scene, test::camera_down_z({0, 0, 2}, 32, 32, 32), 4, {image});
    const Image developed = pathtracer::develop(shot.radiance, 1);
    ASSERT_EQ(developed.channels, 3);
    for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 32; ++x)
            for (int c = 0; c < 3; ++c)
                EXPECT_EQ(std::lround(developed.at(x, y)[c] * 255),
                          std::lround(image.at(x / 4, y / 4)[c] * 255))
                    << x << " " << y;
    // Smoothly: at the middle of a texel its own value, half way the mean of two.
    scene.textures[0].nearest = false;
    const Shot smooth = shoot(scene, test::camera_down_z({0, 0, 2}, 256, 256, 256), 4, {image});
    const auto linear = [](float v) {
        return v <= 0.04045f ? v / 12.92 : std::pow((double(v) + 0.055) / 1.055, 2.4);
    };
    const double left = linear(image.at(3, 2)[0]), right = linear(image.at(4, 2)[0]);
    EXPECT_NEAR(double(smooth.radiance.at(3 * 32 + 15, 2 * 32 + 15)[0]), left, 0.04);
    EXPECT_NEAR(double(smooth.radiance.at(4 * 32, 2 * 32 + 15)[0]), (left + right) / 2, 0.04);
}

TEST(PathTracer, WhatIsUnlitShowsItsVertexColours) {
    scene::MeshScene scene = floor_scene(glm::vec3(0.0f));
    scene.materials[0].emitted = glm::vec3(0.5f, 0.25f, 1.0f);
    scene.materials[0].unlit = true;
    for (scene::Triangle& t : scene.triangles) t.colors.fill(0xff0000ffu);  // red alone
    const auto middle = [&] {
        const Shot shot = shoot(scene, test::camera_down_z({0, 0, 5}, 9, 9, 10), 4);
        const float* pixel = shot.radiance.at(4, 4);
        return glm::vec3(pixel[0], pixel[1], pixel[2]);
    };
    EXPECT_NEAR(middle().r, 0.5f, 1e-3f);
    EXPECT_EQ(middle().g, 0.0f);
    scene.materials[0].unlit = false;  // a lamp's colour is its own
    EXPECT_NEAR(middle().g, 0.25f, 1e-3f);
}

TEST(PathTracer, SidesMasksAndBlends) {
    Image opacity(2, 1, 4);
    opacity.pixels = {1, 1, 1, 1, 1, 1, 1, 0.2f};  // opaque on the left, 20 percent on the right
    scene::MeshScene scene;
    scene::Material m = test::diffuse(glm::vec3(0.5f));
    m.base_texture = 0;
    scene.materials.push_back(m);
    scene.images.resize(1);
    scene.textures.push_back({0, shared::WRAP_CLAMP, shared::WRAP_CLAMP, true});
    test::add_quad(scene, {-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0});
    const Camera front = test::camera_down_z({0, 0, 2}, 32, 32, 32);
    Camera back = front;
    back.rotation = glm::dmat3(-1, 0, 0, 0, -1, 0, 0, 0, 1);
    back.translation = {0, 0, 2};
    const auto coverage = [&](const Camera& camera, bool right) {
        const Shot shot = shoot(scene, camera, 32, {opacity});
        double sum = 0;
        for (int y = 0; y < 32; ++y)
            for (int x = 0; x < 16; ++x) sum += double(shot.radiance.at(right ? x + 16 : x, y)[3]);
        return sum / 512;
    };
    EXPECT_EQ(coverage(front, true), 1.0);
    EXPECT_EQ(coverage(back, true), 0.0);
    scene.materials[0].two_sided = true;
    EXPECT_EQ(coverage(back, true), 1.0);
    scene.materials[0].masked = true;
    EXPECT_EQ(coverage(front, false), 1.0);
    EXPECT_EQ(coverage(front, true), 0.0);
    scene.materials[0].cutoff = 0.1f;
    EXPECT_EQ(coverage(front, true), 1.0);
    scene.materials[0].masked = false;
    scene.materials[0].blended = true;
    EXPECT_EQ(coverage(front, false), 1.0);
    EXPECT_NEAR(coverage(front, true), 0.2, 0.01);
    PathTracer tracer(test::device(), pathtracer::pack(scene, {opacity}), scene.sky);
    const Image depth = tracer.seen(front).depth;
    EXPECT_NEAR(double(depth.at(8, 16)[0]), 2, 1e-6);
    EXPECT_EQ(depth.at(24, 16)[0], 0.0f);
}

TEST(PathTracer, RaysAgreeWithTheCpuReference) {
    const pathtracer::PackedScene packed = pathtracer::pack(
        [] {
            scene::MeshScene scene = test::random_triangles(4, 4000);
            scene.materials[0].two_sided = true;
            return scene;
        }(),
        {});
    const Camera camera = test::camera_down_z({0.5, 0.25, 30}, 64, 48, 60);
    PathTracer tracer(test::device(), packed, {});
    const auto seen = tracer.seen(camera);
    EXPECT_EQ(tracer.unfinished_rays(), 0u);
    const auto triangles = pathtracer::device_triangles(packed);
    const auto nodes = pathtracer::device_nodes(packed);
    int same = 0, hits = 0;
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 64; ++x) {
            const glm::dvec3 d((x + 0.5 - 32) / 60, -(y + 0.5 - 24) / 60, -1);
            const auto hit =
                reference::trace({(camera.position() - packed.origin) / packed.unit, d}, nodes, triangles);
            const uint32_t found = seen.triangles[size_t(y) * 64 + size_t(x)];
            same += found == (hit ? hit->triangle : 0xffffffffu);
            if (!hit || found != hit->triangle) continue;
            ++hits;
            EXPECT_NEAR(double(seen.depth.at(x, y)[0]), hit->distance * packed.unit, 1e-3);
        }
    EXPECT_GE(same, 64 * 48 - 3);  // float32 may see another triangle along an edge
    EXPECT_GT(hits, 500);
}

/// Through a lens, the centre of a pixel sees what its ray meets, and so do the paths of the pixel.
TEST(PathTracer, SeesThroughLenses) {
    scene::MeshScene scene = test::random_triangles(4, 4000);
    scene.materials[0].two_sided = true;
    const pathtracer::PackedScene packed = pathtracer::pack(scene, {});
    const auto triangles = pathtracer::device_triangles(packed);
    const auto nodes = pathtracer::device_nodes(packed);
    std::vector<test::NamedCamera> lenses = test::random_lenses(6700, 60, 40);
    lenses.push_back({"fisheye with a rim", lenses[2].camera});
    lenses.back().camera.distortion.k1 = -0.1;  // folds before the borders of the image
    for (const auto& [name, lens] : lenses) {
        SCOPED_TRACE(name);
        const bool rimmed = name == "fisheye with a rim";
        Camera camera = test::camera_down_z({0.5, 0.25, 12}, 60, 40, 60);
        for (double Camera::*value : {&Camera::fx, &Camera::fy, &Camera::cx, &Camera::cy})
            camera.*value = lens.*value;
        camera.distortion = lens.distortion;
        const double limit = scene::lens_limit(camera);
        PathTracer tracer(test::device(), packed, {});
        const auto seen = tracer.seen(camera);
        const Image radiance = tracer.radiance(camera, 4, 1, 10);
        int same = 0, hits = 0, covered = 0, rim = 0;
        for (int y = 0; y < 40; ++y)
            for (int x = 0; x < 60; ++x) {
                const auto ray = scene::ray_of(camera, limit, x + 0.5, y + 0.5);
                bool whole = true;
                for (int corner = 0; corner < 4; ++corner)
                    whole = whole && scene::ray_of(camera, limit, x + corner % 2, y + corner / 2);
                const glm::dmat3 to_world = glm::transpose(camera.rotation);
                std::optional<reference::Hit> hit;
                if (ray && whole)  // a pixel across the rim shows nothing
                    hit = reference::trace(
                        {(camera.position() + to_world * ray->origin - packed.origin) / packed.unit,
                         to_world * ray->direction},
                        nodes, triangles);
                const reference::Hit met = hit.value_or(reference::Hit{});
                const uint32_t found = seen.triangles[size_t(y) * 60 + size_t(x)];
                same += found == (hit ? met.triangle : 0xffffffffu);
                covered += (radiance.at(x, y)[3] >= 0.5f) == bool(hit);
                if (ray && !whole) {
                    ++rim;
                    EXPECT_EQ(found, 0xffffffffu);
                    EXPECT_EQ(radiance.at(x, y)[3], 0);
                }
                if (!hit || found != met.triangle) continue;
                ++hits;
                // Next to a fold, the rays of a pixel differ too much to be interpolated.
                if (!rimmed) {
                    EXPECT_NEAR(double(seen.depth.at(x, y)[0]), met.distance * packed.unit, 0.2);
                }
            }
        // Rays between the corners of a pixel are interpolated: along an edge they may meet another triangle.
        EXPECT_GE(same, 0.97 * 60 * 40);
        EXPECT_GE(covered, 0.9 * 60 * 40);
        EXPECT_GT(hits, 100);
        EXPECT_EQ(rim > 20, rimmed);
    }
}

TEST(PathTracer, RaysThatTakeTooManyStepsAreCounted) {
    // Triangles that all lie in one place: each ray has to ask each.
    const auto stack = [](size_t count) {
        scene::MeshScene scene;
        scene.sky = test::even_sky(1);
        scene.materials.push_back(test::diffuse(glm::vec3(0.5f)));
        for (size_t i = 0; i < count; ++i)
            test::add_quad(scene, {-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0});
        return scene;
    };
    const Camera camera = test::camera_down_z({0, 0, 4}, 8, 8, 8);
    const Shot few = shoot(stack(300), camera, 8);  // more than 8 paths at once have steps for
    EXPECT_EQ(few.unfinished, 0u);
    EXPECT_NEAR(double(few.radiance.at(4, 4)[0]), 0.5, 1e-4);
    EXPECT_GT(shoot(stack(8000), camera, 2).unfinished, 0u);
    // Also where the host reads a copy of the counts, and where several submissions add to them.
    const auto other = test::open_test_device(true);
    other->limit_host_access(gpu::HostAccess::none);
    PathTracer tracer(other, pathtracer::pack(stack(8000), {}), test::even_sky(1));
    tracer.radiance(camera, 2, 1, kUnclamped);
    const uint64_t two = tracer.unfinished_rays();
    EXPECT_GT(two, 0u);
    tracer.radiance(camera, 2, 1, kUnclamped);
    EXPECT_EQ(tracer.unfinished_rays(), 2 * two);
    EXPECT_GT(tracer.seen(camera).triangles.size(), 0u);
}

TEST(PathTracer, BrightPathsAreCutAndTheSameSeedGivesTheSameBytes) {
    scene::MeshScene scene;
    scene::Material m = test::diffuse(glm::vec3(0.0f));
    m.emitted = glm::vec3(100, 1, 0);
    scene.materials.push_back(m);
    test::add_ball(scene, 1, 8);
    const Camera camera = test::camera_down_z({0, 0, 4}, 9, 9, 12);
    EXPECT_EQ(shoot(scene, camera, 4, {}, 8).radiance.at(4, 4)[0], 8.0f);
    scene.materials[0] = scene::Material();
    scene.sky = test::even_sky(0.5f);
    EXPECT_EQ(shoot(scene, camera, 4).radiance.pixels, shoot(scene, camera, 4).radiance.pixels);
}

TEST(Exposure, BringsTheBrightSurfacesUnderWhite) {
    Image image(100, 1, 4);
    for (int i = 0; i < 100; ++i) {
        image.at(i, 0)[1] = float(i);
        image.at(i, 0)[3] = 1;
    }
    EXPECT_NEAR(std::exp2(pathtracer::automatic_exposure({image})) * 94, 0.8, 0.03);
    EXPECT_EQ(pathtracer::automatic_exposure({Image(4, 4, 4)}), 0);
    EXPECT_EQ(pathtracer::developed(0.5), pathtracer::developed(0.5));
    EXPECT_NEAR(double(pathtracer::developed(0.21404114)), 0.5, 1e-6);
    EXPECT_EQ(pathtracer::developed(7), 1.0f);
    EXPECT_EQ(pathtracer::developed(NAN), 0.0f);
}

}  // namespace
