// SPDX-License-Identifier: Apache-2.0
// The projection pass alone against the CPU reference.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <functional>
#include <limits>

#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "passes/passes.h"

namespace ewa::test {
namespace {

struct Output {
    std::vector<float> records;
    std::vector<uint32_t> keys, counts;
    shared::Counts totals;
};

Output run_project(const Scene& scene, bool debug = false, float log_scale_shift = 0) {
    Rig& r = rig();
    const uint32_t splats = uint32_t(scene.gaussians.size());
    const pipeline::Model model = pipeline::upload_model(*device(), scene.gaussians, 0, false);
    const gpu::Buffer camera = camera_buffer(scene.camera, r.config());
    const size_t capacity = std::max(splats, 1u);
    Guarded records("records", capacity * 48, gpu::Texel::rgba32f), keys("keys", capacity * 4),
        tile_counts("tile counts", capacity * 4), counts = zero_counts();
    r.run([&](gpu::Recording& recording) {
        r.cache
            .get<passes::Project>({{shared::SPEC_SH_DEGREE, uint32_t(scene.gaussians.sh_degree)},
                                   {shared::SPEC_KERNEL, uint32_t(scene.options.kernel)},
                                   {shared::SPEC_MODE, debug ? shared::PROJECT_DEBUG : 0}})
            .record(recording, {model.params, camera, records, keys, tile_counts, counts, model.params},
                    {model.splats, model.planes(), log_scale_shift, 0, 0});
    });
    expect_intact({&records, &keys, &tile_counts, &counts});
    Output out{records.read<float>(), keys.read<uint32_t>(), tile_counts.read<uint32_t>(),
               counts.read<shared::Counts>()[0]};
    out.keys.resize(splats);
    out.counts.resize(splats);
    return out;
}

struct ProjectCase {
    SplatKind kind;
    size_t splats;
    int width, height, sh_degree;
    Footprint kernel;
};

class ProjectPass : public testing::TestWithParam<ProjectCase> {};

TEST_P(ProjectPass, RecordsMatchTheReference) {
    const ProjectCase& c = GetParam();
    const Scene scene = random_scene(900 + uint64_t(c.sh_degree) + c.splats, c.splats, c.kind, c.width,
                                     c.height, c.sh_degree, c.kernel);
    const Output out = run_project(scene);
    const reference::Rendered cpu =
        reference::render(scene.gaussians, scene.camera, scene.options, reference_tiles(rig().config()));
    double worst_mean = 0, worst_shape = 0, worst_opacity = 0, worst_color = 0;
    for (size_t i = 0; i < c.splats; ++i) {
        const reference::Projected& p = cpu.projected[i];
        if (!p.visible) {
            EXPECT_EQ(out.counts[i], 0u) << i;
            EXPECT_EQ(out.keys[i], 0xffffffffu) << i;
            continue;
        }
        const float* r = &out.records[12 * i];
        // The mean is a float pair: its error is that of the pair, relative to how far it lies from the
        // principal point (a splat beside the camera projects thousands of px away).
        const double scale = 1 + std::hypot(p.mean2d.x, p.mean2d.y);
        worst_mean = std::max({worst_mean, std::abs(double(r[0]) + r[2] - p.mean2d.x) / scale,
                               std::abs(double(r[1]) + r[3] - p.mean2d.y) / scale});
        const auto [ux, k, vy] = whitening(p);
        // k shears: what matters is its share of sqrt(det) / c, the shear that moves u by one.
        worst_shape = std::max({worst_shape, std::abs(r[4] / ux - 1), std::abs(r[6] / vy - 1),
                                std::abs(r[5] - k) / (std::abs(k) + std::sqrt(p.a / p.c))});
        worst_opacity = std::max(worst_opacity, std::abs(r[7] / p.opacity - 1));
        for (int channel = 0; channel < 3; ++channel)
            worst_color = std::max(worst_color, std::abs(double(r[8 + channel]) - p.color[channel]));
        // Both round the depth to float32, from values that differ by less than a hundredth of its step.
        EXPECT_NEAR(double(r[11]), p.z, std::abs(p.z) * std::numeric_limits<float>::epsilon()) << i;
        EXPECT_EQ(out.keys[i], out.counts[i] ? std::bit_cast<uint32_t>(r[11]) : 0xffffffffu) << i;
    }
    printf("    mean %.1e, shape %.1e, opacity %.1e, colour %.1e\n", worst_mean, worst_shape, worst_opacity,
           worst_color);
    EXPECT_LT(worst_mean, 3e-12);    // 48 bits less a few for the dozen operations
    EXPECT_LT(worst_shape, 2e-5);    // float32; a needle's determinant takes its worst
    EXPECT_LT(worst_opacity, 5e-6);  // with antialiasing it follows a determinant through a logarithm
    EXPECT_LT(worst_color, 2e-6);    // 16 float32 products of a few units
    EXPECT_EQ(out.totals.skipped_nonfinite, cpu.skipped_nonfinite);
}

TEST_P(ProjectPass, TileCountsNeverMissATile) {
    const ProjectCase& c = GetParam();
    const Scene scene =
        random_scene(950 + c.splats, c.splats, c.kind, c.width, c.height, c.sh_degree, c.kernel);
    const Output out = run_project(scene);
    const reference::Rendered cpu =
        reference::render(scene.gaussians, scene.camera, scene.options, reference_tiles(rig().config()));
    uint64_t exact = 0, actual = 0;
    for (size_t i = 0; i < c.splats; ++i) {
        const size_t tiles = reference::covered_tiles(cpu.projected[i], cpu.instances.grid).size();
        EXPECT_GE(out.counts[i], tiles) << "splat " << i;
        exact += tiles;
        actual += out.counts[i];
    }
    // The device takes the ellipse's extent over a tile row, not the pixel centres: a tile that the ellipse
    // enters between two centres is listed too. Small splats pay most for that.
    EXPECT_LE(double(actual), 1.02 * double(exact) + 4);
    printf("    tiles: exact %zu, listed %zu\n", size_t(exact), size_t(actual));
}

std::string project_case_name(const testing::TestParamInfo<ProjectCase>& info) {
    const ProjectCase& c = info.param;
    return std::string(name_of(c.kind)) + "_" + std::to_string(c.splats) + "_" + std::to_string(c.width) +
           "x" + std::to_string(c.height) + "_sh" + std::to_string(c.sh_degree) + "_kernel" +
           std::to_string(int(c.kernel));
}

TEST(ProjectInspection, ScalesAreShiftedAndTheDrawnCounted) {
    Scene scene = random_scene(910, 500, SplatKind::mixed, 61, 47, 1);
    const Output shifted = run_project(scene, true, std::log(0.5f)), plain = run_project(scene, false, 3);
    EXPECT_EQ(plain.totals.visible, 0u);
    EXPECT_EQ(plain.records, run_project(scene).records) << "without inspection the shift means nothing";
    for (float& scale : scene.gaussians.log_scales) scale += std::log(0.5f);
    const Output smaller = run_project(scene, true);
    EXPECT_EQ(shifted.records, smaller.records);
    EXPECT_EQ(shifted.counts, smaller.counts);
    size_t drawn = 0;
    for (const uint32_t count : shifted.counts) drawn += count > 0;
    EXPECT_GT(drawn, 50u);
    EXPECT_EQ(shifted.totals.visible, drawn);
}

INSTANTIATE_TEST_SUITE_P(
    All, ProjectPass,
    testing::Values(ProjectCase{SplatKind::ordinary, 1000, 160, 120, 0, Footprint::peak},
                    ProjectCase{SplatKind::needles, 1000, 161, 119, 1, Footprint::antialias},
                    ProjectCase{SplatKind::sub_pixel, 500, 61, 47, 2, Footprint::density},
                    ProjectCase{SplatKind::off_screen_and_close, 500, 61, 47, 3, Footprint::peak},
                    ProjectCase{SplatKind::opacity_extremes, 500, 17, 3, 3, Footprint::antialias},
                    ProjectCase{SplatKind::mixed, 257, 1, 1, 2, Footprint::peak},
                    ProjectCase{SplatKind::mixed, 1, 33, 33, 1, Footprint::peak}),
    project_case_name);

TEST(ProjectEdges, NoSplats) {
    Scene scene = random_scene(1, 0, SplatKind::ordinary, 17, 3);
    EXPECT_EQ(run_project(scene).totals.skipped_nonfinite, 0u);
}

TEST(ProjectEdges, BehindTheCameraOrOnTheNearPlaneIsNotDrawn) {
    Scene scene = random_scene(2, 300, SplatKind::ordinary, 64, 48);
    scene.camera.rotation = glm::dmat3(1.0);
    scene.camera.translation = glm::dvec3(0.0);
    for (size_t i = 0; i < 300; ++i) {
        scene.gaussians.means[3 * i] = scene.gaussians.means[3 * i + 1] = 0;
        scene.gaussians.means[3 * i + 2] = i == 0 ? 0.01f : i == 1 ? 0.0f : -float(i);
    }
    const Output out = run_project(scene);
    for (size_t i = 0; i < 300; ++i) EXPECT_EQ(out.counts[i], 0u) << i;
    EXPECT_EQ(out.totals.skipped_nonfinite, 0u);
    scene.gaussians.means[2] = 0.0101f;
    scene.gaussians.opacity_logits[0] = 3;
    EXPECT_GT(run_project(scene).counts[0], 0u);
}

/// Every stored value of a splat in turn made not finite, and the quaternion zero.
TEST(ProjectEdges, PoisonIsSkippedAndCounted) {
    const int degree = 2;
    const float inf = std::numeric_limits<float>::infinity(), nan = std::nanf("");
    Scene scene = random_scene(3, 1, SplatKind::ordinary, 64, 48, degree);
    scene.camera.rotation = glm::dmat3(1.0);
    scene.camera.translation = glm::dvec3(0.0);
    Gaussians one = scene.gaussians;
    one.means = {0, 0, 4};
    one.log_scales = {-1, -1, -1};
    one.opacity_logits = {1};
    const size_t values = 3 + 1 + 4 + 3 + one.sh_stride();
    Gaussians& all = scene.gaussians;
    all.resize(3 * values + 2);
    const auto part = [&](Gaussians& g, size_t i, size_t v) -> float& {
        if (v < 3) return g.means[3 * i + v];
        if (v < 4) return g.opacity_logits[i];
        if (v < 8) return g.quaternions[4 * i + v - 4];
        if (v < 11) return g.log_scales[3 * i + v - 8];
        return g.sh[i * g.sh_stride() + v - 11];
    };
    for (size_t i = 0; i < all.size(); ++i)
        for (size_t v = 0; v < values; ++v) part(all, i, v) = part(one, 0, v);
    for (size_t v = 0; v < values; ++v) {
        part(all, 3 * v, v) = nan;
        part(all, 3 * v + 1, v) = inf;
        part(all, 3 * v + 2, v) = -inf;
    }
    for (size_t v = 4; v < 8; ++v) part(all, 3 * values, v) = 0;
    const Output out = run_project(scene);
    size_t meant = 0;  // an opacity of either infinity, and a scale whose logarithm is minus infinity
    for (size_t i = 0; i + 1 < all.size(); ++i) {
        const size_t v = i / 3;
        const bool opaque = v == 3 && i % 3 == 1, flat = v >= 8 && v < 11 && i % 3 == 2;
        const bool clear = v == 3 && i % 3 == 2;
        meant += opaque || flat || clear;
        if (opaque || flat) {
            EXPECT_GT(out.counts[i], 0u) << "value " << v;
            continue;
        }
        EXPECT_EQ(out.counts[i], 0u) << "value " << i / 3 << " poison " << i % 3;
        EXPECT_EQ(out.keys[i], 0xffffffffu) << i;
    }
    EXPECT_GT(out.counts.back(), 0u);  // the sound one among them
    EXPECT_EQ(meant, 5u);
    EXPECT_EQ(out.totals.skipped_nonfinite, all.size() - 1 - meant);
}

/// The norm of a quaternion does not matter, though its square leaves float32.
TEST(ProjectEdges, QuaternionsOfAnyNormTurnTheSame) {
    Scene scene = random_scene(5, 100, SplatKind::ordinary, 160, 120);
    const Output expected = run_project(scene);
    for (const float norm : {0x1p-80f, 0x1p-30f, 0x1p90f}) {  // powers of two: the direction stays exact
        Scene scaled = scene;
        for (float& q : scaled.gaussians.quaternions) q *= norm;
        const Output actual = run_project(scaled);
        EXPECT_EQ(actual.totals.skipped_nonfinite, 0u);
        EXPECT_EQ(actual.counts, expected.counts) << norm;
        EXPECT_EQ(actual.records, expected.records) << norm;
    }
}

/// A camera far from the origin sees what it sees at the origin.
TEST(ProjectEdges, GeoreferencedSceneKeepsItsSharpness) {
    Scene scene = random_scene(4, 200, SplatKind::ordinary, 160, 120);
    const glm::dvec3 offset(1 << 20, -(1 << 19), 1 << 18);  // float32 keeps 1/16 there
    for (size_t i = 0; i < scene.gaussians.means.size(); ++i) {
        float& mean = scene.gaussians.means[i];
        mean = float(std::round(mean * 16) / 16 + offset[glm::length_t(i % 3)]);
    }
    const glm::dvec3 near = scene.camera.translation;
    scene.camera.translation = near - scene.camera.rotation * offset;
    const Output out = run_project(scene);
    double worst = 0;
    for (size_t i = 0; i < 200; ++i) {
        const auto p = reference::project(scene.gaussians, i, scene.camera, scene.options);
        if (!p.visible) continue;
        const double scale = 1 + std::hypot(p.mean2d.x, p.mean2d.y);
        worst = std::max(
            worst, std::abs(double(out.records[12 * i]) + out.records[12 * i + 2] - p.mean2d.x) / scale);
    }
    printf("    worst %.1e\n", worst);
    EXPECT_LT(worst, 1e-7);  // float32 positions alone would be off by 1e-1
}

/// Up to 1e18 px; beyond that, and beyond VIEW_MAX along any axis, a splat is skipped. Scales beyond 1e12, minus
/// infinity and infinite opacities count as finite ones.
TEST(ProjectEdges, SplatsOfAllSizesAndDistances) {
    Scene scene = random_scene(6, 12, SplatKind::ordinary, 64, 48, 0, Footprint::antialias);
    scene.camera.rotation = glm::dmat3(1.0);
    scene.camera.translation = glm::dvec3(0.0);
    Gaussians& g = scene.gaussians;
    const float sizes[] = {1, 1e6f, 1e9f, 1e12f, 1e15f, 1e18f};
    for (size_t i = 0; i < 12; ++i) {
        for (size_t k = 0; k < 3; ++k) {
            g.means[3 * i + k] = k == 2 ? 4.0f : 0.0f;
            g.log_scales[3 * i + k] = std::log(sizes[i % 6] / (1 + float(k)));
        }
        g.opacity_logits[i] = 2;
    }
    for (size_t k = 0; k < 3; ++k) g.means[3 * (6 + k) + k] = 1e19f;
    for (size_t k = 0; k < 4; ++k) g.quaternions[4 * 9 + k] = 1e-39f;  // some devices take it for zero
    const auto check = [&](uint32_t expected, const std::function<bool(size_t)>& visible) {
        const Output out = run_project(scene);
        uint32_t skipped = 0;
        for (size_t i = 0; i < 12; ++i) {
            const auto p = reference::project(g, i, scene.camera, scene.options);
            EXPECT_EQ(out.counts[i] > 0, p.visible) << i;
            EXPECT_EQ(p.visible, visible(i)) << i;
            skipped += p.skipped_nonfinite;
        }
        EXPECT_EQ(out.totals.skipped_nonfinite, skipped);
        EXPECT_EQ(skipped, expected);
    };
    check(4, [](size_t i) { return i < 6 || i >= 10; });
    const Camera usual = scene.camera;
    scene.camera.fx = scene.camera.fy = 1e8;
    check(9, [](size_t i) { return i < 3; });
    scene.camera = usual;
    constexpr float inf = std::numeric_limits<float>::infinity();
    for (const float huge : {60.0f, 88.0f, 3e38f})
        for (size_t k = 0; k < 3; ++k) g.log_scales[3 * 1 + k] = huge;
    g.log_scales[3 * 2 + 1] = -inf;
    g.opacity_logits[3] = inf;
    g.opacity_logits[4] = -inf;
    g.log_scales[3 * 5] = inf;
    check(5, [](size_t i) { return i < 4 || i >= 10; });
}

}  // namespace
}  // namespace ewa::test
