// SPDX-License-Identifier: Apache-2.0
// The operators of blending against their reference, on arrays as a caller has them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <thread>

#include "ewa/error.h"
#include "ewa/operators.h"
#include "gpu/memory.h"
#include "gpu/test_device.h"
#include "support/gradient_check.h"
#include "support/screen_splats.h"

namespace ewa::test {
namespace {

SharedByTests<std::shared_ptr<Operators>>* const operators_of_all =
    SharedByTests<std::shared_ptr<Operators>>::add();
Operators& operators() {
    return *operators_of_all->get([] { return std::make_shared<Operators>(device()); });
}

/// A scene's arrays as floats.
struct Arrays {
    std::vector<float> means2d, conics, opacities, features, background, depths, features_gradient,
        alphas_gradient;
    std::vector<int32_t> radii;
    const ScreenScene* scene;

    explicit Arrays(const ScreenScene& s)
        : means2d(floats(s.splats.means2d)),
          conics(floats(s.splats.conics)),
          opacities(floats(s.splats.opacities)),
          features(floats(s.splats.features)),
          background(floats(s.splats.background)),
          depths(floats(s.depths)),
          features_gradient(floats(s.features_gradient)),
          alphas_gradient(floats(s.alphas_gradient)),
          radii(s.radii),
          scene(&s) {}

    ScreenSplats splats() const {
        return {.means2d = means2d,
                .conics = conics,
                .whiteners = scene->splats.whiteners,
                .opacities = opacities,
                .features = features,
                .channels = uint32_t(scene->splats.channels)};
    }
    DepthOrder order() const { return {.depths = depths, .radii = radii}; }
    BlendOptions options() const {
        return {.width = uint32_t(scene->width), .height = uint32_t(scene->height), .background = background};
    }
    BlendedImage blend() const { return operators().blend(splats(), order(), options()); }
    ScreenGradient backward(const BlendedImage& image, bool absolute) const {
        return operators().blend_backward(*image.record, features_gradient, alphas_gradient, absolute);
    }
};

/// Whether float32 may decide otherwise at a pixel: an alpha near a threshold, or a transmittance near the stop.
bool is_fragile(const ScreenScene& s, int x, int y) {
    double left = 1;
    for (const uint32_t i : s.order) {
        const double dx = x + 0.5 - s.splats.means2d[2 * i], dy = y + 0.5 - s.splats.means2d[2 * i + 1];
        const double* shape = &s.splats.conics[3 * i];
        const double u = shape[0] * (dx - shape[1] * dy), v = shape[2] * dy;
        const double power = s.splats.whiteners
                                 ? -(u * u + v * v)
                                 : -0.5 * (shape[0] * dx * dx + 2 * shape[1] * dx * dy + shape[2] * dy * dy);
        const double raw = s.splats.opacities[i] * std::exp(power);
        if (std::abs(raw * 255 - 1) < 2e-3 || std::abs(raw / shared::ALPHA_MAX - 1) < 1e-3) return true;
        if (raw < shared::ALPHA_MIN) continue;
        left *= 1 - std::min(shared::ALPHA_MAX, raw);
        if (std::abs(left / shared::TRANSMITTANCE_STOP - 1) < 1e-2) return true;
        if (left < shared::TRANSMITTANCE_STOP) return false;
    }
    return false;
}

/// Fragile pixels have no gradient. Returns how many there are.
size_t quiet_fragile_pixels(ScreenScene& s) {
    size_t count = 0;
    const size_t channels = s.splats.channels;
    for (int y = 0; y < s.height; ++y)
        for (int x = 0; x < s.width; ++x) {
            if (!is_fragile(s, x, y)) continue;
            const size_t at = size_t(y) * size_t(s.width) + size_t(x);
            std::fill_n(&s.features_gradient[at * channels], channels, 0.0);
            s.alphas_gradient[at] = 0;
            ++count;
        }
    return count;
}

void expect_image(const BlendedImage& image, const reference::ScreenImage& expected, const ScreenScene& s) {
    const size_t channels = s.splats.channels;
    double worst = 0;
    for (int y = 0; y < s.height; ++y)
        for (int x = 0; x < s.width; ++x) {
            if (is_fragile(s, x, y)) continue;
            const size_t at = size_t(y) * size_t(s.width) + size_t(x);
            worst = std::max(worst, std::abs(double(image.alphas[at]) - expected.alphas[at]));
            for (size_t c = 0; c < channels; ++c) {
                const double error = std::abs(double(image.features[at * channels + c]) -
                                              expected.features[at * channels + c]);
                ASSERT_TRUE(std::isfinite(error)) << x << " " << y;
                worst = std::max(worst, error);
            }
        }
    EXPECT_LT(worst, 2e-5);
}

void expect_gradient(const ScreenGradient& actual, const reference::ScreenValuesGradient& expected,
                     bool absolute) {
    const auto wide = [](const std::vector<float>& v) { return std::vector<double>(v.begin(), v.end()); };
    const GradientTolerance tolerance{1e-7, 3e-4, 5e-3, 1e-4};
    EXPECT_TRUE(gradients_agree(wide(actual.means2d), expected.values.means2d, tolerance)) << "means";
    EXPECT_TRUE(gradients_agree(wide(actual.conics), expected.values.conics, tolerance)) << "conics";
    EXPECT_TRUE(gradients_agree(wide(actual.opacities), expected.values.opacities, tolerance)) << "opacities";
    EXPECT_TRUE(gradients_agree(wide(actual.features), expected.values.features, tolerance)) << "features";
    EXPECT_TRUE(gradients_agree(wide(actual.background), expected.values.background, tolerance))
        << "background";
    if (absolute) {
        EXPECT_TRUE(gradients_agree(wide(actual.absolute), expected.absolute, tolerance)) << "absolute";
    } else {
        EXPECT_TRUE(actual.absolute.empty());
    }
}

struct OperatorCase {
    SplatKind kind;
    size_t splats, channels;
    bool whiteners;
};

class OperatorBlend : public testing::TestWithParam<OperatorCase> {};

TEST_P(OperatorBlend, ImageAndGradientMatchTheReference) {
    const OperatorCase& c = GetParam();
    ScreenScene s = screen_scene(700 + c.splats, c.splats, c.kind, c.channels, c.whiteners, 61, 47);
    EXPECT_LT(quiet_fragile_pixels(s), size_t(61 * 47 / 3));
    const Arrays arrays(s);
    const BlendedImage image = arrays.blend();
    expect_image(image, reference::blend(s.splats, s.order, s.width, s.height), s);
    const auto expected = reference::blend_backward(s.splats, s.order, s.width, s.height, s.features_gradient,
                                                    s.alphas_gradient);
    expect_gradient(arrays.backward(image, true), expected, true);
    expect_gradient(arrays.backward(image, false), expected, false);
}

INSTANTIATE_TEST_SUITE_P(All, OperatorBlend,
                         testing::Values(OperatorCase{SplatKind::ordinary, 60, 3, false},
                                         OperatorCase{SplatKind::ordinary, 60, 1, false},
                                         OperatorCase{SplatKind::mixed, 90, 4, false},
                                         OperatorCase{SplatKind::mixed, 90, 9, false},
                                         OperatorCase{SplatKind::mixed, 200, 3, true},
                                         OperatorCase{SplatKind::needles, 60, 4, true},
                                         OperatorCase{SplatKind::opacity_extremes, 120, 2, true}),
                         [](const testing::TestParamInfo<OperatorCase>& each) {
                             const OperatorCase& c = each.param;
                             return std::string(name_of(c.kind)) + "_" + std::to_string(c.splats) + "_" +
                                    std::to_string(c.channels) + (c.whiteners ? "_whiteners" : "_conics");
                         });

/// The lists of square tiles that a caller makes: every splat in every tile, front to back.
struct FullLists {
    std::vector<int32_t> offsets, splats;
    int size;
    explicit FullLists(const ScreenScene& s, int tile_size = 16) : size(tile_size) {
        const int tiles = ((s.width + size - 1) / size) * ((s.height + size - 1) / size);
        for (int t = 0; t < tiles; ++t) {
            offsets.push_back(int32_t(splats.size()));
            splats.insert(splats.end(), s.order.begin(), s.order.end());
        }
        offsets.push_back(int32_t(splats.size()));
    }
    TileLists lists() const { return {.tile_size = uint32_t(size), .offsets = offsets, .splats = splats}; }
};

TEST(OperatorBlendLists, CallersListsGiveTheSameImageAndGradient) {
    ScreenScene s = screen_scene(41, 50, SplatKind::mixed, 5, false, 61, 47);
    quiet_fragile_pixels(s);
    const Arrays arrays(s);
    const FullLists full(s);
    const BlendedImage image = operators().blend(arrays.splats(), full.lists(), arrays.options());
    expect_image(image, reference::blend(s.splats, s.order, s.width, s.height), s);
    expect_gradient(arrays.backward(image, false),
                    reference::blend_backward(s.splats, s.order, s.width, s.height, s.features_gradient,
                                              s.alphas_gradient),
                    false);
}

/// Tiles smaller than the device's, tiles that cut them, and one that is larger than the image.
TEST(OperatorBlendLists, TilesOfAnyMultipleOfFourGiveTheSameImageAndGradient) {
    ScreenScene s = screen_scene(141, 50, SplatKind::mixed, 5, false, 61, 47);
    quiet_fragile_pixels(s);
    const Arrays arrays(s);
    const auto expected = reference::blend(s.splats, s.order, s.width, s.height);
    const auto gradient = reference::blend_backward(s.splats, s.order, s.width, s.height, s.features_gradient,
                                                    s.alphas_gradient);
    for (const int size : {4, 12, 20, 24, 1024}) {
        SCOPED_TRACE(size);
        const FullLists full(s, size);
        const BlendedImage image = operators().blend(arrays.splats(), full.lists(), arrays.options());
        expect_image(image, expected, s);
        expect_gradient(arrays.backward(image, true), gradient, true);
    }
}

/// Each tile lists one splat, which covers the whole image. So a pixel shows whose tile it is.
TEST(OperatorBlendLists, APixelDrawsTheListOfItsOwnTile) {
    for (const int size : {4, 12, 16}) {
        const int width = 40, height = 33, columns = (width + size - 1) / size,
                  rows = (height + size - 1) / size;
        const auto tiles = size_t(columns * rows);
        std::vector<float> means(2 * tiles, 20), conics, opacities(tiles, 0.5f), features;
        std::vector<int32_t> offsets, listed;
        for (size_t t = 0; t < tiles; ++t) {
            conics.insert(conics.end(), {1e-8f, 0, 1e-8f});
            features.push_back(float(t + 1));
            offsets.push_back(int32_t(t));
            listed.push_back(int32_t(t));
        }
        offsets.push_back(int32_t(tiles));
        const BlendedImage image = operators().blend({means, conics, false, opacities, features, 1},
                                                     TileLists{uint32_t(size), offsets, listed},
                                                     {.width = uint32_t(width), .height = uint32_t(height)});
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                ASSERT_NEAR(image.features[size_t(y * width + x)], 0.5 * (y / size * columns + x / size + 1),
                            1e-3)
                    << size << " " << x << " " << y;
    }
}

/// A list of many splats, of which each reaches few of the device's tiles, takes the memory of these.
TEST(OperatorBlendLists, ALargeTileTakesTheMemoryOfWhatIsDrawn) {
    const size_t count = 20000;
    const uint32_t side = 1024;
    std::vector<float> means, conics, opacities(count, 0.5f), features(count, 1.0f);
    std::vector<int32_t> listed;
    Random random(142);
    for (size_t i = 0; i < count; ++i) {
        means.insert(means.end(), {float(random.uniform(0, side)), float(random.uniform(0, side))});
        conics.insert(conics.end(), {1, 0, 1});
        listed.push_back(int32_t(i));
    }
    const std::vector<int32_t> offsets{0, int32_t(count)};
    const ScreenSplats splats{means, conics, false, opacities, features, 1};
    const BlendOptions options{.width = side, .height = side};
    const BlendedImage image = operators().blend(splats, TileLists{side, offsets, listed}, options);
    const std::vector<float> depths(count, 1.0f);
    EXPECT_EQ(image.features, operators().blend(splats, DepthOrder{depths}, options).features);
}

TEST(OperatorBlendLists, MorePairsThanAnImageCanHaveAreRefused) {
    const size_t count = 300000;
    const std::vector<float> means(2 * count, 1000), opacities(count, 0.5f), features(count, 1.0f);
    std::vector<float> conics;
    std::vector<int32_t> listed;
    for (size_t i = 0; i < count; ++i) {
        conics.insert(conics.end(), {1e-8f, 0, 1e-8f});
        listed.push_back(int32_t(i));
    }
    const std::vector<int32_t> offsets{0, int32_t(count)};
    EXPECT_THROW(operators().blend({means, conics, false, opacities, features, 1},
                                   TileLists{2048, offsets, listed}, {.width = 2048, .height = 2048}),
                 RunError);
}

TEST(OperatorBlendLists, AListedSplatThatDrawsNothingHasNoGradient) {
    ScreenScene s = screen_scene(143, 20, SplatKind::ordinary, 3, false, 32, 32);
    const FullLists full(s);
    Arrays arrays(s);
    arrays.opacities[s.order[0]] = 0;
    arrays.features[3 * s.order[1]] = NAN;
    const BlendedImage image = operators().blend(arrays.splats(), full.lists(), arrays.options());
    const ScreenGradient gradient = arrays.backward(image, true);
    for (const uint32_t splat : {s.order[0], s.order[1]}) EXPECT_EQ(gradient.opacities[splat], 0);
    for (const auto* values : {&gradient.means2d, &gradient.conics, &gradient.opacities, &gradient.features})
        for (const float value : *values) ASSERT_TRUE(std::isfinite(value));
}

/// A splat without one of its colours is left out, whichever channel it is.
TEST(OperatorBlend, ASplatWithoutAColourIsSkipped) {
    for (const size_t channel : {size_t(0), size_t(3), size_t(5)}) {
        const ScreenScene s = screen_scene(144, 30, SplatKind::ordinary, 6, false, 40, 33);
        const uint32_t lost = s.order[2];
        Arrays damaged(s), without(s);
        damaged.features[6 * lost + channel] = NAN;
        without.radii[2 * lost] = 0;
        const BlendedImage image = damaged.blend();
        EXPECT_EQ(image.skipped_nonfinite, 1u);
        EXPECT_EQ(image.features, without.blend().features);
        EXPECT_EQ(image.alphas, without.blend().alphas);
    }
}

TEST(OperatorBlendLists, TheOrderIsThatOfTheLists) {
    const ScreenScene s = screen_scene(42, 30, SplatKind::ordinary, 3, false, 32, 32);
    const Arrays arrays(s);
    ScreenScene backwards = s;
    std::ranges::reverse(backwards.order);
    const FullLists full(backwards);
    const BlendedImage image = operators().blend(arrays.splats(), full.lists(), arrays.options());
    expect_image(image, reference::blend(s.splats, backwards.order, s.width, s.height), backwards);
}

TEST(OperatorBlendLists, SplatsOfNoListMayHoldAnything) {
    ScreenScene s = screen_scene(59, 20, SplatKind::ordinary, 3, false, 32, 32);
    const uint32_t first = s.order[0], second = s.order[1];
    s.order.erase(s.order.begin());
    const FullLists full(s);
    Arrays damaged(s);
    damaged.conics[3 * first] = damaged.means2d[2 * first] = NAN;
    EXPECT_EQ(operators().blend(damaged.splats(), full.lists(), damaged.options()).skipped_nonfinite, 0u);
    damaged.conics[3 * second] = NAN;
    EXPECT_EQ(operators().blend(damaged.splats(), full.lists(), damaged.options()).skipped_nonfinite, 1u);
}

TEST(OperatorBlendLists, WrongListsAreRefused) {
    const ScreenScene s = screen_scene(43, 5, SplatKind::ordinary, 3, false, 32, 16);
    const Arrays arrays(s);
    const auto refused = [&](std::vector<int32_t> offsets, std::vector<int32_t> splats,
                             uint32_t tile_size = 16) {
        try {
            operators().blend(arrays.splats(), TileLists{tile_size, offsets, splats}, arrays.options());
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_EQ(refused({0, 1}, {0}), "offsets has 2 values; its shape [tiles + 1] needs 3");
    EXPECT_EQ(refused({0, 2, 1}, {0, 1}), "offsets decrease at tile 1");
    EXPECT_EQ(refused({0, 1, 3}, {0, 1}), "offsets end at 3, and the lists have 2 entries");
    EXPECT_EQ(refused({0, 1, 2}, {0, 5}), "a list with splat 5 of 5");
    EXPECT_NE(refused({0, 1, 2}, {0, 1}, 5), "");
}

TEST(OperatorBlendMask, MaskedTilesShowTheBackground) {
    ScreenScene s = screen_scene(44, 60, SplatKind::ordinary, 4, false, 40, 33);
    quiet_fragile_pixels(s);
    const Arrays arrays(s);
    std::vector<uint8_t> mask(3 * 3, 1);
    mask[4] = mask[8] = 0;
    BlendOptions options = arrays.options();
    options.tile_mask = mask;
    const BlendedImage image = operators().blend(arrays.splats(), arrays.order(), options);
    reference::ScreenImage expected = reference::blend(s.splats, s.order, s.width, s.height);
    std::vector<double> through(4, 0.0);  // of the background's gradient
    for (int y = 0; y < s.height; ++y)
        for (int x = 0; x < s.width; ++x) {
            const size_t at = size_t(y) * 40 + size_t(x);
            if (mask[size_t(y / 16 * 3 + x / 16)]) continue;
            expected.alphas[at] = 0;
            for (size_t c = 0; c < 4; ++c) {
                expected.features[at * 4 + c] = s.splats.background[c];
                through[c] += s.features_gradient[at * 4 + c];
                s.features_gradient[at * 4 + c] = 0;
            }
            s.alphas_gradient[at] = 0;
        }
    expect_image(image, expected, s);
    auto gradient = reference::blend_backward(s.splats, s.order, s.width, s.height, s.features_gradient,
                                              s.alphas_gradient);
    for (size_t c = 0; c < 4; ++c) gradient.values.background[c] += through[c];
    expect_gradient(arrays.backward(image, true), gradient, true);
}

TEST(OperatorBlend, TwoImagesMayWaitForTheirGradients) {
    ScreenScene a = screen_scene(45, 40, SplatKind::ordinary, 3, false, 40, 33),
                b = screen_scene(46, 300, SplatKind::mixed, 5, true, 61, 47);
    quiet_fragile_pixels(a);
    quiet_fragile_pixels(b);
    const Arrays first(a), second(b);
    const BlendedImage of_first = first.blend(), of_second = second.blend();
    const ScreenGradient alone = first.backward(of_first, true);
    second.backward(of_second, false);
    const ScreenGradient again = first.backward(of_first, true);
    EXPECT_EQ(alone.means2d, again.means2d);
    EXPECT_EQ(alone.features, again.features);
    expect_gradient(again,
                    reference::blend_backward(a.splats, a.order, a.width, a.height, a.features_gradient,
                                              a.alphas_gradient),
                    true);
}

/// The record is the last that uses the device.
TEST(OperatorBlend, ARecordMayOutliveItsOperators) {
    const ScreenScene s = screen_scene(60, 20, SplatKind::ordinary, 3, false, 40, 33);
    const Arrays arrays(s);
    BlendedImage image =
        Operators(open_test_device(true)).blend(arrays.splats(), arrays.order(), arrays.options());
    EXPECT_THROW(arrays.backward(image, false), InputError);
    image.record.reset();
}

TEST(OperatorBlend, ValuesThatAreNotFiniteAreLeftOutAndCounted) {
    const ScreenScene s = screen_scene(47, 20, SplatKind::ordinary, 3, false, 40, 33);
    Arrays arrays(s);
    const BlendedImage whole = arrays.blend();
    EXPECT_EQ(whole.skipped_nonfinite, 0u);
    const uint32_t lost = s.order[0];
    for (const auto& damage : std::vector<std::function<void(Arrays&)>>{
             [&](Arrays& d) { d.means2d[2 * lost] = NAN; }, [&](Arrays& d) { d.conics[3 * lost] = -1; },
             [&](Arrays& d) { d.conics[3 * lost + 1] = 1e9f; },
             [&](Arrays& d) { d.opacities[lost] = INFINITY; }, [&](Arrays& d) { d.depths[lost] = NAN; },
             [&](Arrays& d) { d.features[3 * lost + 2] = NAN; }}) {
        Arrays damaged(s);
        damage(damaged);
        const BlendedImage image = damaged.blend();
        EXPECT_EQ(image.skipped_nonfinite, 1u);
        for (const float value : image.features) ASSERT_TRUE(std::isfinite(value));
        const ScreenGradient gradient = damaged.backward(image, true);
        for (const auto* values :
             {&gradient.means2d, &gradient.conics, &gradient.opacities, &gradient.features})
            for (const float value : *values) ASSERT_TRUE(std::isfinite(value));
    }
}

TEST(OperatorBlend, SplatsThatAreLeftOutMayHoldAnything) {
    const ScreenScene s = screen_scene(55, 20, SplatKind::ordinary, 3, false, 40, 33);
    Arrays without(s), damaged(s);
    const uint32_t lost = s.order[0];
    without.radii[2 * lost] = damaged.radii[2 * lost + 1] = 0;
    damaged.means2d[2 * lost] = damaged.conics[3 * lost] = damaged.opacities[lost] =
        damaged.features[3 * lost] = NAN;
    const BlendedImage image = damaged.blend();
    EXPECT_EQ(image.skipped_nonfinite, 0u);
    EXPECT_EQ(image.features, without.blend().features);
}

TEST(OperatorBlend, NegativeDepthsAreInOrder) {
    ScreenScene s = screen_scene(48, 30, SplatKind::ordinary, 3, false, 40, 33);
    const Arrays plain(s);
    Arrays shifted(s);
    // A quarter of the depths stays above zero.
    std::vector<float> sorted = shifted.depths;
    std::ranges::sort(sorted);
    for (float& depth : shifted.depths) depth -= sorted[22];
    EXPECT_EQ(plain.blend().features, shifted.blend().features);
}

TEST(OperatorBlend, NothingToDrawIsTheBackground) {
    for (const size_t count : {size_t(0), size_t(5)}) {
        ScreenScene s = screen_scene(49, count, SplatKind::ordinary, 3, false, 20, 11);
        s.radii.assign(s.radii.size(), 0);
        const Arrays arrays(s);
        const BlendedImage image = arrays.blend();
        for (size_t i = 0; i < image.features.size(); ++i)
            ASSERT_EQ(image.features[i], arrays.background[i % 3]);
        for (const float alpha : image.alphas) ASSERT_EQ(alpha, 0);
        const ScreenGradient gradient = arrays.backward(image, true);
        for (const float value : gradient.means2d) EXPECT_EQ(value, 0);
        EXPECT_EQ(gradient.features.size(), 3 * count);
        EXPECT_NE(gradient.background[0], 0);
    }
}

TEST(OperatorBlend, WithoutGradientsTheImageIsTheSame) {
    const ScreenScene s = screen_scene(52, 60, SplatKind::mixed, 3, false, 61, 47);
    const Arrays arrays(s);
    BlendOptions options = arrays.options();
    options.gradients = false;
    const BlendedImage image = operators().blend(arrays.splats(), arrays.order(), options);
    EXPECT_EQ(image.record, nullptr);
    EXPECT_EQ(image.features, arrays.blend().features);
}

TEST(OperatorBlend, WrongSizesAreRefused) {
    const ScreenScene s = screen_scene(53, 5, SplatKind::ordinary, 3, false, 32, 16);
    const auto refused = [&](const std::function<void(Arrays&)>& change) {
        Arrays arrays(s);
        change(arrays);
        try {
            arrays.blend();
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_EQ(refused([](Arrays& a) { a.means2d.pop_back(); }),
              "means2d has 9 values; its shape [M, 2] needs 10");
    EXPECT_EQ(refused([](Arrays& a) { a.conics.pop_back(); }),
              "conics has 14 values; its shape [M, 3] needs 15");
    EXPECT_EQ(refused([](Arrays& a) { a.features.pop_back(); }),
              "features has 14 values; its shape [M, D] needs 15");
    EXPECT_EQ(refused([](Arrays& a) { a.depths.pop_back(); }), "depths has 4 values; its shape [M] needs 5");
    EXPECT_EQ(refused([](Arrays& a) { a.radii.pop_back(); }),
              "radii has 9 values; its shape [M, 2] needs 10");
    EXPECT_EQ(refused([](Arrays& a) { a.background.pop_back(); }),
              "background has 2 values; its shape [D] needs 3");
    const Arrays arrays(s);
    const BlendedImage image = arrays.blend();
    EXPECT_THROW(operators().blend_backward(*image.record, {}, {}, false), InputError);
}

/// Large arrays are read where they are. The image is that of a copy, and the gradient does not need them any more.
TEST(OperatorBlend, LentArraysMayGoAfterTheCall) {
    for (const size_t channels : {size_t(3), size_t(6)}) {
        const ScreenScene s = screen_scene(56, 9000, SplatKind::mixed, channels, false, 61, 47);
        BlendedImage image;
        {
            Arrays lent(s);
            image = lent.blend();
            for (auto* values : {&lent.means2d, &lent.conics, &lent.features})
                std::ranges::fill(*values, 1e9f);
        }
        Arrays odd(s);  // at addresses that the device cannot use
        const auto moved = [](std::vector<float>& values, std::vector<float>& kept) {
            kept.assign(values.size() + 1, 0.0f);
            std::ranges::copy(values, kept.begin() + 1);
            return std::span<const float>(kept).subspan(1);
        };
        std::vector<float> means, conics, features;
        ScreenSplats splats = odd.splats();
        splats.means2d = moved(odd.means2d, means);
        splats.conics = moved(odd.conics, conics);
        splats.features = moved(odd.features, features);
        const BlendedImage copied = operators().blend(splats, odd.order(), odd.options());
        EXPECT_EQ(image.features, copied.features);
        EXPECT_EQ(odd.backward(image, false).features, odd.backward(copied, false).features);
    }
}

/// Footprints that a caller's low-pass, or none, leaves far thinner than a pixel.
TEST(OperatorBlend, SharpFootprintsMatchTheReference) {
    for (const bool whiteners : {false, true})
        for (const double width : {0.05, 0.2, 0.4}) {
            ScreenScene s = screen_scene(57, 60, SplatKind::ordinary, 4, true, 61, 47);
            Random random(58);
            for (size_t i = 0; i < s.splats.size(); ++i) {
                // A covariance of 8 px by `width` px, turned.
                const double angle = random.uniform(0, 3), c = std::cos(angle), n = std::sin(angle);
                const double l = 64, w = width * width, det = l * w;
                const double xx = c * c * l + n * n * w, xy = c * n * (l - w), yy = n * n * l + c * c * w;
                const double shape[3] = {whiteners ? std::sqrt(yy / (2 * det)) : yy / det,
                                         whiteners ? xy / yy : -xy / det,
                                         whiteners ? std::sqrt(1 / (2 * yy)) : xx / det};
                for (size_t k = 0; k < 3; ++k) s.splats.conics[3 * i + k] = double(float(shape[k]));
            }
            s.splats.whiteners = whiteners;
            quiet_fragile_pixels(s);
            const Arrays arrays(s);
            const BlendedImage image = arrays.blend();
            expect_image(image, reference::blend(s.splats, s.order, s.width, s.height), s);
            const auto expected = reference::blend_backward(s.splats, s.order, s.width, s.height,
                                                            s.features_gradient, s.alphas_gradient);
            expect_gradient(arrays.backward(image, true), expected, true);
        }
}

/// A needle of 400 px by half a pixel: the products of its conic's determinant agree in their first 5 digits.
TEST(OperatorBlend, WhitenersKeepTheDigitsThatConicsLose) {
    const double angle = 0.7, long_axis = 400 * 400, short_axis = 0.55 * 0.55;
    const double c = std::cos(angle), s = std::sin(angle);
    const double xx = c * c * long_axis + s * s * short_axis, xy = c * s * (long_axis - short_axis),
                 yy = s * s * long_axis + c * c * short_axis, det = long_axis * short_axis;
    const auto error_of = [&](bool whiteners) {
        ScreenScene scene{
            64, 64, {}, {3}, {1, 1}, {0}, std::vector<double>(64 * 64), std::vector<double>(64 * 64)};
        scene.splats = {{32.3, 31.8}, {}, {0.9}, {1}, {0}, 1, whiteners};
        scene.splats.conics = whiteners
                                  ? std::vector{std::sqrt(yy / (2 * det)), xy / yy, std::sqrt(1 / (2 * yy))}
                                  : std::vector{yy / det, -xy / det, xx / det};
        const reference::ScreenImage exact = reference::blend(scene.splats, scene.order, 64, 64);
        const BlendedImage image = Arrays(scene).blend();
        double worst = 0;
        for (size_t i = 0; i < image.alphas.size(); ++i)
            if (!is_fragile(scene, int(i % 64), int(i / 64)))
                worst = std::max(worst, std::abs(double(image.alphas[i]) - exact.alphas[i]));
        return worst;
    };
    const double by_conics = error_of(false), by_whiteners = error_of(true);
    printf("    alpha: %.1e by conics, %.1e by whiteners\n", by_conics, by_whiteners);
    EXPECT_LT(by_whiteners, 1e-5);
    EXPECT_GT(by_conics, 20 * by_whiteners);
}

/// Where the host can read the planes of an image, it does so in place.
TEST(OperatorBlend, MemoryOfAGpuChangesNoByte) {
    const ScreenScene s = screen_scene(55, 200, SplatKind::mixed, 5, false, 61, 47);
    const Arrays arrays(s);
    const BlendedImage expected = arrays.blend();
    const ScreenGradient gradient = arrays.backward(expected, true);
    for (const auto access : {gpu::HostAccess::none, gpu::HostAccess::write}) {
        const std::shared_ptr<gpu::Device> other = open_test_device(true);
        other->limit_host_access(access);
        Operators own(other);
        const BlendedImage image = own.blend(arrays.splats(), arrays.order(), arrays.options());
        EXPECT_EQ(image.features, expected.features);
        EXPECT_EQ(image.alphas, expected.alphas);
        const ScreenGradient again =
            own.blend_backward(*image.record, arrays.features_gradient, arrays.alphas_gradient, true);
        EXPECT_EQ(again.means2d, gradient.means2d);
        EXPECT_EQ(again.features, gradient.features);
        EXPECT_EQ(again.absolute, gradient.absolute);
    }
}

TEST(OperatorBlend, FourThreadsGetTheBytesOfOne) {
    const ScreenScene s = screen_scene(54, 200, SplatKind::mixed, 5, false, 61, 47);
    const Arrays arrays(s);
    const BlendedImage alone = arrays.blend();
    const ScreenGradient gradient = arrays.backward(alone, false);
    std::vector<int> same(4, 0);
    std::vector<std::thread> threads;
    for (size_t t = 0; t < 4; ++t)
        threads.emplace_back([&, t] {
            for (int round = 0; round < 5; ++round) {
                const BlendedImage image = arrays.blend();
                same[t] += image.features == alone.features &&
                           arrays.backward(image, false).means2d == gradient.means2d;
            }
        });
    for (std::thread& thread : threads) thread.join();
    for (const int count : same) EXPECT_EQ(count, 5);
}

}  // namespace
}  // namespace ewa::test
