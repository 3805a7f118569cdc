// SPDX-License-Identifier: Apache-2.0
// Whole frames with guard words round every buffer, on scenes at the edges.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "ewa/error.h"
#include "ewa/renderer.h"
#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "pipeline/backward.h"
#include "pipeline/frame_buffers.h"
#include "pipeline/frame_inputs.h"

namespace ewa::test {
namespace {

struct Result {
    shared::Counts counts{};
    std::vector<float> planes;
    std::vector<uint32_t> order, splats, places, starts, tile_counts;
    Gaussians gradient;
    pipeline::Sizes sizes;
};

/// A picture, or a picture and the loss's gradient, with capacity for that many instances.
Result run_frame(const Scene& scene, uint32_t capacity, bool gradients) {
    Rig& r = rig();
    const int width = scene.camera.width, height = scene.camera.height;
    const pipeline::Model model = pipeline::upload_model(*device(), scene.gaussians, 1, false);
    const gpu::Buffer camera = camera_buffer(scene.camera, r.config());
    const pipeline::CameraUse use{&camera, 0, uint32_t(width), uint32_t(height)};
    const gpu::Buffer photo = pipeline::upload_photo(*device(), random_target(9, width, height));
    GuardedFrame guarded(r.config(), {model.splats, use.width, use.height, capacity, gradients, !gradients});
    pipeline::FrameBuffers& frame = guarded.frame;
    const pipeline::Plan plan =
        pipeline::plan_for({.purpose = gradients ? pipeline::Purpose::gradient : pipeline::Purpose::image,
                            .scene_degree = scene.gaussians.sh_degree,
                            .present_degree = scene.gaussians.sh_degree,
                            .render = scene.options,
                            .drawing = Drawing::depth});
    const pipeline::FrameInputs inputs{use, scene.options.background};
    Result out;
    pipeline::Sorted sorted;
    r.run([&](gpu::Recording& recording) {
        const pipeline::FramePasses on{{recording, r.cache}, plan, frame, inputs};
        sorted = on.forward(model);
        if (!gradients) return;
        on.loss(photo);
        on.backward(model, sorted, {});
    });
    EXPECT_TRUE(guarded.intact());
    out.counts = frame.read_counts();
    out.sizes = frame.sizes;
    out.planes = frame.planes.download<float>(frame.sizes.planes / 4);
    const uint32_t listed = std::min(out.counts.instances, capacity);
    out.splats = sorted.splats->download<uint32_t>(listed);
    if (gradients) out.places = sorted.indices->download<uint32_t>(listed);
    out.starts = frame.tile_starts.download<uint32_t>(frame.sizes.tiles + 1);
    out.tile_counts = frame.tile_counts.download<uint32_t>(model.splats);
    if (gradients) out.gradient = download_model(model, model.moments1);
    return out;
}

double worst_color(const Result& result, const reference::Raster& expected) {
    double worst = 0;
    for (int c = 0; c < 3; ++c)
        for (int y = 0; y < expected.height; ++y)
            for (int x = 0; x < expected.width; ++x) {
                const float value = result.planes[size_t(c) * result.sizes.plane_floats +
                                                  size_t(y) * result.sizes.stride + size_t(x)];
                const double error = std::abs(double(value) - expected.at(x, y)[c]);
                worst = std::isfinite(error) ? std::max(worst, error) : INFINITY;
            }
    return worst;
}

TEST(DrawOptions, BytesAreTheRoundedColours) {
    const Scene scene = random_scene(77, 500, SplatKind::mixed, 61, 47, 1);
    Renderer renderer(device(), scene.gaussians, {});
    DrawOptions options;
    options.render.background = {0.2f, 2.0f, -1.0f};
    for (const Drawing drawing : {Drawing::color, Drawing::ellipsoids}) {
        options.drawing = drawing;
        const std::vector<uint8_t> bytes = renderer.render_bytes(scene.camera, options);
        const Rendering rendering = renderer.render(scene.camera, options);
        ASSERT_EQ(bytes.size(), 61u * 47 * 4);
        for (size_t i = 0; i < bytes.size() / 4; ++i) {
            for (size_t c = 0; c < 3; ++c) {
                const float v = rendering.color.pixels[3 * i + c];
                ASSERT_EQ(bytes[4 * i + c], v > 0 ? uint8_t(std::min(v, 1.0f) * 255.0f + 0.5f) : 0) << i;
            }
            ASSERT_EQ(bytes[4 * i + 3], 255);
        }
    }
}

TEST(DrawOptions, AreThoseOfARendererMadeForThem) {
    const Scene scene = random_scene(78, 400, SplatKind::mixed, 40, 33, 2);
    RenderOptions other;
    other.background = {0.1f, 0.2f, 0.3f};
    other.kernel = Footprint::antialias;
    other.sh_degree = 1;
    Renderer renderer(device(), scene.gaussians, {}), made_for(device(), scene.gaussians, other);
    const Rendering a = renderer.render(scene.camera, DrawOptions{other, Drawing::depth, 1});
    const Rendering b = made_for.render(scene.camera, true);
    EXPECT_EQ(a.color.pixels, b.color.pixels);
    EXPECT_EQ(a.depth.pixels, b.depth.pixels);
    EXPECT_GT(renderer.splats_drawn(), 20u);
    EXPECT_LE(renderer.splats_drawn(), 400u);
    const Rendering count = renderer.render(scene.camera, DrawOptions{other, Drawing::count, 1});
    EXPECT_EQ(count.color.pixels, b.color.pixels);
    EXPECT_GT(*std::max_element(count.count.pixels.begin(), count.count.pixels.end()), 1);
    EXPECT_NE(renderer.render(scene.camera, DrawOptions{other, Drawing::color, 0.5}).color.pixels,
              b.color.pixels);
    EXPECT_THROW(renderer.render(scene.camera, DrawOptions{other, Drawing::color, 0}), InputError);

    const Scene second = random_scene(79, 900, SplatKind::ordinary, 40, 33, 0);
    renderer.replace(second.gaussians);
    EXPECT_EQ(renderer.render(scene.camera, DrawOptions{{}, Drawing::color, 1}).color.pixels,
              Renderer(device(), second.gaussians, {}).render(scene.camera).color.pixels);
}

/// Buffers that share memory change no result, with one pass of the tile sort and with two.
TEST(Frame, OverlaidBuffersChangeNothing) {
    for (const auto& [width, height] : {std::pair{61, 120}, {66000, 9}}) {
        const Scene scene = random_scene(80, 600, SplatKind::mixed, width, height, 1);
        const Image target = random_target(9, width, height);
        const LossGradient shared =
            loss_gradient(device(), scene.gaussians, scene.camera, target, scene.options);
        const Result apart = run_frame(scene, 500000, true);
        ASSERT_LE(apart.counts.instances, 500000u);
        EXPECT_EQ(apart.sizes.tile_sort.passes == 1, width == 61);
        EXPECT_EQ(shared.gradient.means, apart.gradient.means);
        EXPECT_EQ(shared.gradient.sh, apart.gradient.sh);
        EXPECT_EQ(shared.gradient.quaternions, apart.gradient.quaternions);
        EXPECT_EQ(shared.l1, double(apart.counts.l1));
    }
}

/// So many splats that a CPU's depth sort takes an odd number of passes, and so many instances that they lie over its buffers.
TEST(Frame, OverlaidBuffersChangeNothingOfManySplats) {
    const passes::KernelConfig& config = rig().config();
    const size_t splats =
        config.ranked_sort ? 2000 : std::min<size_t>(size_t(config.sort_lanes_max) << 11, 300000);
    Scene scene = random_scene(81, splats, SplatKind::ordinary, 256, 192, 0);
    // Small and faint, so that the farthest show.
    for (float& scale : scene.gaussians.log_scales) scale -= 0.8f;
    for (float& logit : scene.gaussians.opacity_logits) logit = std::min(logit, -4.0f);
    const Image target = random_target(9, 256, 192);
    const LossGradient shared = loss_gradient(device(), scene.gaussians, scene.camera, target, scene.options);
    const Result apart = run_frame(scene, uint32_t(10 * splats), true);
    ASSERT_LE(apart.counts.instances, 10 * splats);
    EXPECT_GT(apart.counts.instances, 3 * splats);
    if (splats == size_t(config.sort_lanes_max) << 11) {
        EXPECT_EQ(apart.sizes.depth_sort.passes, 3u);
    }
    EXPECT_EQ(shared.l1, double(apart.counts.l1));
    EXPECT_EQ(shared.gradient.means, apart.gradient.means);
    EXPECT_EQ(shared.gradient.sh, apart.gradient.sh);
    const auto depth = [&](uint32_t splat) {
        const float* mean = &scene.gaussians.means[3 * size_t(splat)];
        return (scene.camera.rotation * glm::dvec3(mean[0], mean[1], mean[2]) + scene.camera.translation).z;
    };
    size_t behind = 0;
    for (uint32_t tile = 0; tile < apart.sizes.tiles; ++tile)
        for (uint32_t k = apart.starts[tile] + 1; k < apart.starts[tile + 1]; ++k)
            behind += depth(apart.splats[k]) < depth(apart.splats[k - 1]) - 1e-4;
    EXPECT_EQ(behind, 0u);
}

void expect_finite(const Gaussians& g) {
    for (const auto* values : {&g.means, &g.quaternions, &g.log_scales, &g.opacity_logits, &g.sh})
        for (const float value : *values) ASSERT_TRUE(std::isfinite(value));
}

void expect_background(const Result& result, const Scene& scene) {
    const reference::Raster empty = reference::render(Gaussians{}, scene.camera, scene.options).blended.color;
    EXPECT_EQ(worst_color(result, empty), 0);
}

/// Each tile's list: no tile of the CPU reference's lists is missing, what they share stands in the same
/// order, and few are more.
TEST(FrameLists, AreTheReferencesOrALittleMore) {
    for (const SplatKind kind : {SplatKind::ordinary, SplatKind::mixed}) {
        const Scene scene = random_scene(3100, 1500, kind, 161, 119);
        const Result result = run_frame(scene, 200000, kind == SplatKind::mixed);
        ASSERT_LE(result.counts.instances, 200000u);
        const auto cpu =
            reference::render(scene.gaussians, scene.camera, scene.options, reference_tiles(rig().config()));
        const auto& lists = cpu.instances;
        ASSERT_EQ(lists.grid.count(), result.sizes.tiles);
        size_t missed = 0;
        for (uint32_t tile = 0; tile < result.sizes.tiles; ++tile) {
            uint32_t at = result.starts[tile];
            const uint32_t end = result.starts[tile + 1];
            for (size_t k = lists.first_of_tile[tile]; k < lists.first_of_tile[tile + 1]; ++k) {
                while (at < end && result.splats[at] != lists.sorted[k].splat) ++at;
                missed += at == end;
            }
        }
        EXPECT_EQ(missed, 0u);
        EXPECT_EQ(result.starts[result.sizes.tiles], result.counts.instances);
        printf("    %zu exact, %u listed\n", lists.sorted.size(), result.counts.instances);
        EXPECT_LE(double(result.counts.instances), 1.02 * double(lists.sorted.size()));
    }
}

TEST(FrameEdges, NoSplatsOneSplatOddSizes) {
    for (const auto& [width, height] : {std::pair{1, 1}, {17, 3}, {3, 17}, {64, 64}})
        for (const size_t splats : {0, 1, 2})
            for (const bool gradients : {false, true}) {
                Scene scene = random_scene(3200 + splats, splats, SplatKind::ordinary, width, height, 1);
                scene.gaussians.sh_degree = 1;
                const Result result = run_frame(scene, 500, gradients);
                const auto cpu = reference::render(scene.gaussians, scene.camera, scene.options);
                EXPECT_LT(worst_color(result, cpu.blended.color), 1e-5);
                EXPECT_EQ(result.counts.skipped_nonfinite, 0u);
                if (gradients) expect_finite(result.gradient);
            }
}

TEST(FrameEdges, PointsStayInTheirBuffers) {
    for (const bool gradients : {false, true}) {
        Scene scene = random_scene(3250, 900, SplatKind::mixed, 131, 67, 1);
        scene.options.points = true;
        const Result result = run_frame(scene, 60000, gradients);
        ASSERT_LE(result.counts.instances, 60000u);
        const auto cpu = reference::render(scene.gaussians, scene.camera, scene.options);
        EXPECT_LT(worst_color(result, cpu.blended.color), 1e-5);
        if (gradients) expect_finite(result.gradient);
    }
}

TEST(FrameEdges, AllBehindTheCamera) {
    Scene scene = random_scene(3300, 500, SplatKind::ordinary, 61, 47);
    const glm::dmat3 turn(-1, 0, 0, 0, 1, 0, 0, 0, -1);  // half a turn about y
    scene.camera.rotation = turn * scene.camera.rotation;
    scene.camera.translation = turn * scene.camera.translation;
    const Result result = run_frame(scene, 4096, true);
    EXPECT_EQ(result.counts.instances, 0u);
    expect_background(result, scene);
    for (const auto* values : {&result.gradient.means, &result.gradient.sh, &result.gradient.opacity_logits})
        for (const float value : *values) ASSERT_EQ(value, 0);
}

TEST(FrameEdges, ThousandsOfTiles) {
    Scene scene = random_scene(3400, 40, SplatKind::ordinary, 1003, 707);
    const Result result = run_frame(scene, 200000, false);
    ASSERT_LE(result.counts.instances, 200000u);
    EXPECT_GT(result.sizes.tiles, device()->limits().cpu ? 10000u : 5000u);  // of 8x8 or 16x8 pixels
    const auto cpu = reference::render(scene.gaussians, scene.camera, scene.options);
    // One contribution at the cut is 1/255 of a colour of at most 3.
    EXPECT_LT(worst_color(result, cpu.blended.color), 3.0 / 255);
}

TEST(FrameEdges, SplatsThatCoverTheImage) {
    Scene scene = random_scene(3500, 12, SplatKind::ordinary, 200, 150, 1);
    for (size_t i = 0; i < 12; ++i) {
        for (size_t k = 0; k < 3; ++k) scene.gaussians.log_scales[3 * i + k] = i < 6 ? 2.0f : 9.0f;
        scene.gaussians.opacity_logits[i] = -1;
        for (size_t k = 0; k < 3; ++k)
            scene.gaussians.means[3 * i + k] =
                float((glm::transpose(scene.camera.rotation) *
                       (glm::dvec3(0, 0, 3 + 0.1 * double(i)) - scene.camera.translation))[int(k)]);
    }
    const Result result = run_frame(scene, 20000, true);
    for (size_t i = 6; i < 12; ++i) EXPECT_EQ(result.tile_counts[i], result.sizes.tiles) << i;
    const auto cpu = reference::render(scene.gaussians, scene.camera, scene.options);
    EXPECT_LT(worst_color(result, cpu.blended.color), 1e-5);
    expect_finite(result.gradient);
}

TEST(FrameEdges, WhereInstancesDoNotFitNothingIsDrawnAndTheNumberIsTold) {
    const Scene scene = random_scene(3600, 800, SplatKind::ordinary, 161, 119);
    for (const bool gradients : {false, true}) {
        const Result whole = run_frame(scene, 100000, gradients);
        const uint32_t needed = whole.counts.instances;
        ASSERT_GT(needed, 2000u);
        for (const uint32_t capacity : {1u, needed - 1}) {
            const Result none = run_frame(scene, capacity, gradients);
            EXPECT_EQ(none.counts.instances, needed);
            expect_background(none, scene);
            for (const float value : none.gradient.means) ASSERT_EQ(value, 0);
        }
        EXPECT_EQ(run_frame(scene, needed, gradients).planes, whole.planes);
    }
}

TEST(FrameEdges, RoomGrowsUntilTheInstancesFit) {
    Scene scene = random_scene(3650, 3, SplatKind::ordinary, 700, 600);
    for (float& scale : scene.gaussians.log_scales) scale = 5;
    for (size_t i = 0; i < 3; ++i)
        for (size_t k = 0; k < 3; ++k)
            scene.gaussians.means[3 * i + k] =
                float((glm::transpose(scene.camera.rotation) *
                       (glm::dvec3(0, 0, 5) - scene.camera.translation))[int(k)]);
    ASSERT_LT(pipeline::first_capacity(3), 3 * 75 * 88u);
    Renderer renderer(device(), scene.gaussians, scene.options);
    const Rendering rendering = renderer.render(scene.camera);
    const auto cpu = reference::render(scene.gaussians, scene.camera, scene.options);
    double worst = 0;
    for (size_t i = 0; i < rendering.color.pixels.size(); ++i)
        worst = std::max(worst, std::abs(rendering.color.pixels[i] - cpu.blended.color.values[i]));
    EXPECT_LT(worst, 1e-5);
}

TEST(FrameEdges, EqualDepthsGoByIndex) {
    Scene scene = random_scene(3700, 300, SplatKind::ordinary, 61, 47);
    scene.camera.rotation = glm::dmat3(1.0);
    scene.camera.translation = glm::dvec3(0.0);
    Random random(1);
    for (size_t i = 0; i < 300; ++i) {
        scene.gaussians.means[3 * i] = float(random.uniform(-1, 1));
        scene.gaussians.means[3 * i + 1] = float(random.uniform(-1, 1));
        scene.gaussians.means[3 * i + 2] = i % 2 ? 4.0f : 3.0f;
    }
    const Result result = run_frame(scene, 20000, false);
    for (uint32_t tile = 0; tile < result.sizes.tiles; ++tile)
        for (uint32_t k = result.starts[tile] + 1; k < result.starts[tile + 1]; ++k) {
            const uint32_t before = result.splats[k - 1], after = result.splats[k];
            EXPECT_TRUE(before % 2 == after % 2 ? before < after : before % 2 == 0)
                << before << " before " << after << " in tile " << tile;
        }
    const auto cpu = reference::render(scene.gaussians, scene.camera, scene.options);
    EXPECT_LT(worst_color(result, cpu.blended.color), 3.0 / 255);
}

TEST(FrameEdges, TenThousandSplatsInOneTile) {
    Scene scene = random_scene(3800, 10000, SplatKind::ordinary, 8, 8);
    for (size_t i = 0; i < 10000; ++i) {
        scene.gaussians.opacity_logits[i] = -5;  // 0.0067: over a thousand until the pixel closes
        for (size_t k = 0; k < 3; ++k) scene.gaussians.log_scales[3 * i + k] = 1;
    }
    const Result result = run_frame(scene, 20000, true);
    EXPECT_GT(result.counts.instances, 5000u);
    const auto cpu = reference::render(scene.gaussians, scene.camera, scene.options);
    EXPECT_LT(worst_color(result, cpu.blended.color), 2e-4);  // a thousand rounded products of T
    expect_finite(result.gradient);
}

/// Splats that are not finite leave the picture and everyone else's gradient as if they were not there.
TEST(FrameEdges, PoisonLeavesNoTrace) {
    const float inf = std::numeric_limits<float>::infinity(), nan = std::nanf("");
    Scene clean = random_scene(3900, 200, SplatKind::ordinary, 61, 47, 1);
    Scene poisoned = clean;
    Gaussians& g = poisoned.gaussians;
    g = Gaussians{};
    g.sh_degree = 1;
    g.resize(400);
    const size_t stride = g.sh_stride();
    for (size_t i = 0; i < 400; ++i) {
        const size_t from = i / 2;
        std::copy_n(&clean.gaussians.means[3 * from], 3, &g.means[3 * i]);
        std::copy_n(&clean.gaussians.quaternions[4 * from], 4, &g.quaternions[4 * i]);
        std::copy_n(&clean.gaussians.log_scales[3 * from], 3, &g.log_scales[3 * i]);
        g.opacity_logits[i] = clean.gaussians.opacity_logits[from];
        std::copy_n(&clean.gaussians.sh[stride * from], stride, &g.sh[stride * i]);
        if (i % 2 == 0) continue;
        const float poison = i % 3 == 0 ? nan : i % 3 == 1 ? inf : -inf;
        switch (i / 2 % 6) {
            case 0:
                g.means[3 * i + i % 3] = poison;
                break;
            case 1:
                g.quaternions[4 * i + i % 4] = poison;
                break;
            case 2:
                std::fill_n(&g.quaternions[4 * i], 4, 0.0f);
                break;
            case 3:
                g.log_scales[3 * i + i % 3] = poison;
                break;
            case 4:
                g.opacity_logits[i] = poison;
                break;
            case 5:
                g.sh[stride * i + i % stride] = poison;
                break;
        }
    }
    for (const bool gradients : {false, true}) {
        const Result expected = run_frame(clean, 30000, gradients);
        const Result actual = run_frame(poisoned, 30000, gradients);
        EXPECT_EQ(actual.planes, expected.planes);
        EXPECT_EQ(actual.counts.instances, expected.counts.instances);
        // A colour that is not finite counts only where the splat is in front.
        const auto cpu = reference::render(g, poisoned.camera, poisoned.options);
        EXPECT_EQ(actual.counts.skipped_nonfinite, cpu.skipped_nonfinite);
        EXPECT_GT(actual.counts.skipped_nonfinite, 180u);
        if (!gradients) continue;
        expect_finite(actual.gradient);
        for (size_t i = 0; i < 200; ++i) {
            EXPECT_EQ(actual.gradient.means[6 * i], expected.gradient.means[3 * i]);
            EXPECT_EQ(actual.gradient.means[6 * i + 3], 0);
        }
    }
}

/// Values at the ends of float32's range: whatever is drawn, nothing that is not finite comes out.
TEST(FrameEdges, ExtremeValuesMakeNoNaN) {
    Scene scene = random_scene(4000, 0, SplatKind::ordinary, 61, 47, 1);
    scene.camera.rotation = glm::dmat3(1.0);
    scene.camera.translation = glm::dvec3(0.0);
    const float extremes[] = {0, 1e-45f, 1e-38f, 1e-20f, 1e-4f, 1, 30, 87, 89, 1e4f, 1e19f, 1e30f, 3.4e38f};
    Random random(4);
    Gaussians& g = scene.gaussians;
    g.sh_degree = 1;
    g.resize(3000);
    const auto often = [&](float usual, int most) {
        const float value = extremes[random.integer(0, most)];
        const bool negative = random.bits() % 2;
        return random.bits() % 3 ? usual : negative ? -value : value;
    };
    for (float& value : g.quaternions) value = often(0.3f, 12);
    for (float& value : g.log_scales) value = often(-2, 12);
    for (float& value : g.opacity_logits) value = often(0, 12);
    for (size_t i = 0; i < g.means.size(); ++i) g.means[i] = often(i % 3 == 2 ? 4 : 0.1f, 12);
    // Squares of colours beyond 1e19 leave float32: the picture holds them, its loss cannot.
    for (const bool gradients : {false, true})
        for (const Footprint kernel : {Footprint::peak, Footprint::antialias, Footprint::density}) {
            for (float& value : g.sh) value = often(0.3f, gradients ? 9 : 12);
            scene.options.kernel = kernel;
            const Result result = run_frame(scene, 200000, gradients);
            ASSERT_LE(result.counts.instances, 200000u);
            EXPECT_GT(result.counts.instances, 1000u);
            for (const float value : result.planes) ASSERT_TRUE(std::isfinite(value));
            if (gradients) {
                EXPECT_TRUE(std::isfinite(result.counts.l1) && std::isfinite(result.counts.ssim));
            }
        }
}

TEST(FrameDeterminism, TheSameFrameTwiceIsTheSameBytes) {
    const Scene scene = random_scene(4100, 900, SplatKind::mixed, 161, 119, 2);
    const Result a = run_frame(scene, 100000, true), b = run_frame(scene, 100000, true);
    EXPECT_EQ(a.planes, b.planes);
    EXPECT_EQ(a.gradient.means, b.gradient.means);
    EXPECT_EQ(a.gradient.sh, b.gradient.sh);
    EXPECT_EQ(a.counts.ssim, b.counts.ssim);
}

}  // namespace
}  // namespace ewa::test
