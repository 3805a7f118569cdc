// SPDX-License-Identifier: Apache-2.0
// Blending and its gradient alone, on records and tile lists from the CPU reference.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "passes/passes.h"
#include "pipeline/frame_buffers.h"
#include "reference/blend.h"

namespace ewa::test {
namespace {

/// The CPU reference's picture and its lists as the device's buffers hold them.
struct Lists {
    Scene scene;
    reference::Rendered cpu;
    pipeline::Sizes sizes;
    Guarded records, splats, starts;

    explicit Lists(const Scene& s, size_t promised = 0)
        : scene(s),
          cpu(reference::render(s.gaussians, s.camera, s.options, reference_tiles(rig().config()))),
          sizes(pipeline::sizes_for(rig().config(), request())),
          records("records", pack_records(cpu.projected), gpu::Texel::rgba32f),
          splats("splats", words([&](size_t k) { return cpu.instances.sorted[k].splat; })),
          starts("starts", bounds(cpu.instances, promised)) {}

    size_t count() const { return cpu.instances.sorted.size(); }
    pipeline::FrameRequest request() const {
        return {uint32_t(scene.gaussians.size()),
                uint32_t(scene.camera.width),
                uint32_t(scene.camera.height),
                uint32_t(count()),
                true,
                true};
    }
    shared::BlendPush push() const {
        const auto steps = passes::tile_steps(rig().config(), sizes.tiles);
        const auto& b = scene.options.background;
        return {{b[0], b[1], b[2]},
                sizes.image(),
                {sizes.tiles_x, sizes.tiles_y},
                {steps[0], steps[1]},
                uint32_t(count())};
    }

  private:
    /// The tiles' bounds, and the end of the list with `promised` instances more that stand behind the last
    /// tile.
    static std::vector<uint32_t> bounds(const reference::Instances& instances, size_t promised) {
        std::vector<uint32_t> out(instances.first_of_tile.begin(), instances.first_of_tile.end());
        out.push_back(uint32_t(out.back() + promised));
        return out;
    }
    template <class Word>
    std::vector<uint32_t> words(Word word) const {
        std::vector<uint32_t> out;
        for (size_t k = 0; k < count(); ++k) out.push_back(word(k));
        if (out.empty()) out.push_back(0);
        return out;
    }
};

struct BlendCase {
    SplatKind kind;
    size_t splats;
    int width, height;
};
std::string blend_case_name(const testing::TestParamInfo<BlendCase>& info) {
    const BlendCase& c = info.param;
    return std::string(name_of(c.kind)) + "_" + std::to_string(c.splats) + "_" + std::to_string(c.width) +
           "x" + std::to_string(c.height);
}
const auto kCases = testing::Values(
    BlendCase{SplatKind::ordinary, 0, 33, 21}, BlendCase{SplatKind::ordinary, 1, 33, 21},
    BlendCase{SplatKind::ordinary, 400, 1, 1}, BlendCase{SplatKind::mixed, 400, 17, 3},
    BlendCase{SplatKind::mixed, 600, 61, 47}, BlendCase{SplatKind::needles, 300, 61, 47},
    BlendCase{SplatKind::opacity_extremes, 900, 40, 40}, BlendCase{SplatKind::mixed, 800, 260, 131});

/// Pixels over a bound, and the largest error of all. In float32 a contribution that lies within rounding of
/// 1/255, or a transmittance within rounding of the stop, may fall to the other side.
struct Difference {
    double worst = 0;
    size_t over = 0;
    void add(double error, double bound) {
        worst = std::isfinite(error) ? std::max(worst, error) : INFINITY;
        if (!(error <= bound)) ++over;
    }
};

class BlendPass : public testing::TestWithParam<BlendCase> {};

TEST_P(BlendPass, PlanesMatchTheReference) {
    const BlendCase& c = GetParam();
    const Lists lists(random_scene(1500 + c.splats, c.splats, c.kind, c.width, c.height));
    Rig& r = rig();
    for (const bool with_depth : {false, true}) {
        SCOPED_TRACE(with_depth ? "with depth" : "without depth");
        const uint32_t planes = with_depth ? 5 : 4;
        Guarded out("planes", uint64_t(lists.sizes.plane_floats) * planes * 4);
        r.run([&](gpu::Recording& recording) {
            r.cache
                .get<passes::Blend>(
                    {{shared::SPEC_MODE, with_depth ? shared::BLEND_DEPTH : shared::BLEND_COLOR}})
                .record(recording, {lists.records, lists.splats, lists.starts, out, lists.splats},
                        lists.push());
        });
        EXPECT_TRUE(out.intact());
        const auto actual = out.read<float>();
        Difference color, depth;
        for (int y = 0; y < c.height; ++y)
            for (int x = 0; x < c.width; ++x) {
                const auto plane = [&](uint32_t p) {
                    return double(
                        actual[p * lists.sizes.plane_floats + size_t(y) * lists.sizes.stride + size_t(x)]);
                };
                const reference::Blended& b = lists.cpu.blended;
                for (int k = 0; k < 3; ++k)
                    color.add(std::abs(plane(uint32_t(k)) - b.color.at(x, y)[k]), 4e-6);
                color.add(std::abs(plane(shared::PLANE_T) - b.transmittance.at(x, y)[0]), 4e-6);
                if (with_depth)
                    depth.add(std::abs(plane(shared::PLANE_DEPTH) - b.depth_sum.at(x, y)[0]), 1e-5);
            }
        const size_t pixels = size_t(c.width) * size_t(c.height);
        if (with_depth)
            printf("    colour %.1e (%zu over), depth %.1e\n", color.worst, color.over, depth.worst);
        // A few dozen float32 operations on colours of up to 3: 4e-6; depths of up to 8 are twice that.
        EXPECT_LE(color.over, pixels / 500);
        EXPECT_LE(depth.over, pixels / 500);
        EXPECT_LT(color.worst, 3.0 / 255);  // one contribution at the cut, of colour 3
        // What lies between width and stride is zero, if it is written at all.
        for (int y = 0; y < c.height; ++y)
            for (uint32_t x = uint32_t(c.width); x < lists.sizes.stride; ++x) {
                const float beside = actual[size_t(y) * lists.sizes.stride + x];
                EXPECT_TRUE(std::isnan(beside) || beside == 0) << beside;
            }
    }
}

TEST_P(BlendPass, CountsMatchTheReference) {
    const BlendCase& c = GetParam();
    const Lists lists(random_scene(1500 + c.splats, c.splats, c.kind, c.width, c.height));
    Rig& r = rig();
    Guarded out("planes", uint64_t(lists.sizes.plane_floats) * 5 * 4);
    r.run([&](gpu::Recording& recording) {
        r.cache.get<passes::Blend>({{shared::SPEC_MODE, shared::BLEND_COUNT}})
            .record(recording, {lists.records, lists.splats, lists.starts, out, lists.splats}, lists.push());
    });
    EXPECT_TRUE(out.intact());
    const auto actual = out.read<float>();
    size_t different = 0;
    for (int y = 0; y < c.height; ++y)
        for (int x = 0; x < c.width; ++x) {
            const float count = actual[shared::PLANE_COUNT * lists.sizes.plane_floats +
                                       size_t(y) * lists.sizes.stride + size_t(x)];
            different += count != float(lists.cpu.blended.blended[size_t(y) * size_t(c.width) + size_t(x)]);
        }
    // Contributions that lie within rounding of the cut or of the stop.
    EXPECT_LE(different, size_t(c.width) * size_t(c.height) / 50);
}

TEST_P(BlendPass, EllipsoidsMatchTheReference) {
    const BlendCase& c = GetParam();
    const Lists lists(random_scene(1500 + c.splats, c.splats, c.kind, c.width, c.height));
    Rig& r = rig();
    Guarded out("planes", uint64_t(lists.sizes.plane_floats) * 4 * 4);
    r.run([&](gpu::Recording& recording) {
        r.cache.get<passes::Blend>({{shared::SPEC_MODE, shared::BLEND_ELLIPSOIDS}})
            .record(recording, {lists.records, lists.splats, lists.starts, out, lists.splats}, lists.push());
    });
    EXPECT_TRUE(out.intact());
    const reference::Raster expected =
        reference::ellipsoids(lists.cpu.projected, lists.cpu.instances, lists.scene.options.background);
    const auto actual = out.read<float>();
    Difference difference;
    for (int y = 0; y < c.height; ++y)
        for (int x = 0; x < c.width; ++x)
            for (int k = 0; k < 3; ++k)
                difference.add(std::abs(actual[size_t(k) * lists.sizes.plane_floats +
                                               size_t(y) * lists.sizes.stride + size_t(x)] -
                                        expected.at(x, y)[k]),
                               2e-3);  // the shade's slope has no bound at the outline
    // Pixels whose centre lies within rounding of an outline.
    EXPECT_LE(difference.over, size_t(c.width) * size_t(c.height) / 50);
}

TEST_P(BlendPass, LargestWeightsMatchTheReference) {
    const BlendCase& c = GetParam();
    const Lists lists(random_scene(1500 + c.splats, c.splats, c.kind, c.width, c.height));
    Rig& r = rig();
    // What other views have left stays where it is larger.
    std::vector<float> before(std::max<size_t>(c.splats, 1));
    for (size_t i = 0; i < before.size(); ++i) before[i] = i % 7 == 3 ? 0.01f : 0.0f;
    Guarded largest("largest", before);
    r.run([&](gpu::Recording& recording) {
        r.cache.get<passes::Contribute>().record(
            recording, {lists.records, lists.splats, lists.starts, largest, lists.splats}, lists.push());
    });
    EXPECT_TRUE(largest.intact());
    const auto expected = reference::largest_weights(lists.cpu.projected, lists.cpu.instances);
    const auto actual = largest.read<float>();
    Difference difference;
    for (size_t i = 0; i < c.splats; ++i)
        difference.add(std::abs(actual[i] - std::max(expected[i], double(before[i]))), 4e-6);
    printf("    largest weight %.1e (%zu over)\n", difference.worst, difference.over);
    EXPECT_LE(difference.over, c.splats / 200);
    EXPECT_LT(difference.worst, 1.0 / 255);  // one contribution at the cut
}

INSTANTIATE_TEST_SUITE_P(All, BlendPass, kCases, blend_case_name);

constexpr size_t kSums = 11;  // of a slot

class BlendBackwardPass : public testing::TestWithParam<BlendCase> {};

TEST_P(BlendBackwardPass, SlotsAreTheReferencesMoments) {
    const BlendCase& c = GetParam();
    const Lists lists(random_scene(1600 + c.splats, c.splats, c.kind, c.width, c.height));
    Rig& r = rig();
    reference::Raster gradient(c.width, c.height, 3);
    Random random(c.splats);
    for (double& g : gradient.values) g = float(random.normal());
    Guarded planes("planes", pack_planes(lists.cpu.blended.color, 4, lists.sizes.stride),
                   gpu::Texel::rgba32f),
        incoming("image gradient", pack_planes(gradient, 3, lists.sizes.stride), gpu::Texel::rgba32f),
        slots("slots", std::max<uint64_t>(lists.count(), 1) * shared::SLOT_FLOATS * 4, gpu::Texel::rgba32f);
    r.run([&](gpu::Recording& recording) {
        r.cache.get<passes::BlendBackward>({{shared::SPEC_MODE, shared::BLEND_BACKWARD_ABSOLUTE}})
            .record(recording,
                    {{{lists.records, lists.splats, lists.starts, planes}, incoming, slots}, lists.splats},
                    lists.push());
    });
    EXPECT_TRUE(slots.intact());
    const auto expected =
        reference::blend_backward(lists.cpu.projected, lists.cpu.instances, lists.cpu.blended, gradient);
    const auto actual = slots.read<float>();
    const auto splat_of = [&](size_t k) -> const reference::Projected& {
        return lists.cpu.projected[lists.cpu.instances.sorted[k].splat];
    };
    // Of each of the sums: largest error over the largest value in the picture.
    std::array<double, kSums> largest{}, error{};
    std::array<size_t, kSums> over{};
    for (size_t k = 0; k < lists.count(); ++k)
        for (size_t j = 0; j < kSums; ++j)
            largest[j] = std::max(largest[j], std::abs(slot_of(expected.instances[k], splat_of(k))[j]));
    // Sums of one order share their scale: one of them alone may cancel to nothing.
    for (const auto& [first, last] : {std::pair{1, 2}, {3, 5}, {6, 8}, {9, 9}, {10, 10}}) {
        const auto group = largest.begin() + first, end = largest.begin() + last + 1;
        std::fill(group, end, *std::max_element(group, end));
    }
    for (size_t k = 0; k < lists.count(); ++k)
        for (size_t j = 0; j < kSums; ++j) {
            const double e = std::abs(double(actual[shared::SLOT_FLOATS * k + j]) -
                                      slot_of(expected.instances[k], splat_of(k))[j]);
            ASSERT_TRUE(std::isfinite(e)) << "instance " << k << " sum " << j;
            error[j] = std::max(error[j], e / largest[j]);
            // 64 pixels of float32 terms; rest / (1 - alpha) magnifies rounding a hundredfold at alpha 0.99.
            if (e > 2e-5 * largest[j]) ++over[j];
        }
    for (size_t j = 0; j < kSums; ++j) {
        printf("%s%.1e", j ? " " : "    ", error[j]);
        EXPECT_LE(over[j], lists.count() / 200) << "sum " << j;
        EXPECT_LT(error[j], 0.05) << "sum " << j;  // one pixel on the other side of the cut
    }
    printf("\n");
}

INSTANTIATE_TEST_SUITE_P(All, BlendBackwardPass, kCases, blend_case_name);

/// Instances that projection promised and no tile has keep nothing of what stood in their slots before.
TEST(BlendBackwardSlots, BehindTheLastTileAreZero) {
    const Scene scene = random_scene(1702, 60, SplatKind::ordinary, 33, 21);
    const size_t promised = 37;
    const Lists lists(scene, promised);
    Rig& r = rig();
    const std::vector<float> stale((lists.count() + promised) * shared::SLOT_FLOATS, 7.0f);
    Guarded planes("planes", uint64_t(lists.sizes.plane_floats) * 16, gpu::Texel::rgba32f),
        incoming("image gradient", std::vector<float>(size_t(lists.sizes.plane_floats) * 3, 1.0f),
                 gpu::Texel::rgba32f),
        slots("slots", stale, gpu::Texel::rgba32f);
    r.run([&](gpu::Recording& recording) {
        r.cache.get<passes::Blend>({{shared::SPEC_MODE, shared::BLEND_COLOR}})
            .record(recording, {lists.records, lists.splats, lists.starts, planes, lists.splats},
                    lists.push());
        r.cache.get<passes::BlendBackward>({{shared::SPEC_MODE, 0}})
            .record(recording,
                    {{{lists.records, lists.splats, lists.starts, planes}, incoming, slots}, lists.splats},
                    lists.push());
    });
    expect_intact({&slots});
    const auto written = slots.read<float>();
    for (size_t k = lists.count(); k < lists.count() + promised; ++k)
        for (size_t j = 0; j < 9; ++j) EXPECT_EQ(written[shared::SLOT_FLOATS * k + j], 0.0f) << k << ' ' << j;
}

/// A picture of 8 x 8 pixels and its gradient against the CPU reference's. Returns how many slots hold
/// nothing but zero.
size_t check_one_tile(const Scene& scene) {
    const Lists lists(scene);
    Rig& r = rig();
    reference::Raster gradient(8, 8, 3);
    for (double& g : gradient.values) g = 1;
    Guarded planes("planes", uint64_t(lists.sizes.plane_floats) * 16, gpu::Texel::rgba32f),
        incoming("image gradient", pack_planes(gradient, 3, lists.sizes.stride), gpu::Texel::rgba32f),
        slots("slots", lists.count() * shared::SLOT_FLOATS * 4, gpu::Texel::rgba32f);
    r.run([&](gpu::Recording& recording) {
        r.cache.get<passes::Blend>({{shared::SPEC_MODE, shared::BLEND_COLOR}})
            .record(recording, {lists.records, lists.splats, lists.starts, planes, lists.splats},
                    lists.push());
        r.cache.get<passes::BlendBackward>({{shared::SPEC_MODE, shared::BLEND_BACKWARD_ABSOLUTE}})
            .record(recording,
                    {{{lists.records, lists.splats, lists.starts, planes}, incoming, slots}, lists.splats},
                    lists.push());
    });
    expect_intact({&planes, &slots});
    const auto actual = planes.read<float>();
    double worst = 0;
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x)
            for (int k = 0; k < 3; ++k)
                worst = std::max(worst, std::abs(double(actual[size_t(k) * 64 + size_t(y) * 8 + size_t(x)]) -
                                                 lists.cpu.blended.color.at(x, y)[k]));
    printf("    %zu instances, worst %.1e\n", lists.count(), worst);
    EXPECT_LT(worst, 2e-5);  // a thousand products of T, each rounded
    const auto written = slots.read<float>();
    size_t unseen = 0;
    for (size_t k = 0; k < lists.count(); ++k) {
        bool zero = true;
        for (size_t j = 0; j < kSums; ++j) {
            const float value = written[shared::SLOT_FLOATS * k + j];
            EXPECT_TRUE(std::isfinite(value)) << "slot of instance " << k << " was not written";
            if (!std::isfinite(value)) return 0;
            zero = zero && value == 0;
        }
        unseen += zero;
    }
    return unseen;
}

/// Ten thousand splats in one tile, of which only the nearest few thousand are seen.
TEST(BlendEdges, TenThousandSplatsInATile) {
    Scene scene = random_scene(1700, 10000, SplatKind::ordinary, 8, 8);
    for (size_t i = 0; i < 10000; ++i) {
        scene.gaussians.opacity_logits[i] = -5.0f;  // 0.0067: over a thousand until a pixel closes
        for (size_t k = 0; k < 3; ++k) scene.gaussians.log_scales[3 * i + k] = 1.0f;
    }
    EXPECT_GT(check_one_tile(scene), 1000u);  // those behind the last open pixel
}

/// Thousands that are seen, and every pixel open to the end: a driver that cuts loops short would show it.
TEST(BlendEdges, ThousandsOfSplatsThatNeverCloseATile) {
    Scene scene = random_scene(1701, 40000, SplatKind::sub_pixel, 8, 8);
    for (float& logit : scene.gaussians.opacity_logits) logit = -5.4f;  // 0.0045, a pixel each
    EXPECT_LT(check_one_tile(scene), 20000u);
}

}  // namespace
}  // namespace ewa::test
