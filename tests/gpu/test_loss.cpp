// SPDX-License-Identifier: Apache-2.0
// The loss kernels against the CPU reference, and the training image's unpacking.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <variant>

#include "gpu/guarded.h"
#include "gpu/reference_inputs.h"
#include "passes/passes.h"
#include "pipeline/backward.h"
#include "pipeline/frame_inputs.h"
#include "reference/loss.h"

namespace ewa::test {
namespace {

struct LossInputs {
    Image rendered, photo;            // RGB, beyond [0, 1] in places; RGBA
    reference::Raster image, target;  // in double, the training image over the background
    std::array<float, 3> background{0.2f, 0.5f, 0.8f};
};

LossInputs random_inputs(uint64_t seed, int width, int height) {
    Random random(seed);
    LossInputs in;
    in.rendered = random_target(seed, width, height);
    for (float& value : in.rendered.pixels)
        if (random.bits() % 8 == 0) value = float(random.uniform(-0.5, 1.5));
    const Image target = random_target(seed + 1, width, height);
    in.photo = Image(width, height, 4);
    in.target = reference::Raster(width, height, 3);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const float alpha = x % 3 == 0 ? 1.0f : float(random.uniform());
            in.photo.at(x, y)[3] = alpha;
            for (int k = 0; k < 3; ++k) {
                in.photo.at(x, y)[k] = target.at(x, y)[k];
                const double color = target.at(x, y)[k];
                in.target.at(x, y)[k] =
                    color * alpha + double(in.background[size_t(k)]) * (1 - double(alpha));
            }
            // Where both are equal |x - y| has no slope.
            if (x % 6 == 3 && y % 2 == 0)
                for (int k = 0; k < 3; ++k) in.rendered.at(x, y)[k] = target.at(x, y)[k];
        }
    in.image = reference::to_double(in.rendered);
    return in;
}

class Loss : public testing::TestWithParam<std::pair<int, int>> {};

TEST_P(Loss, ValueAndGradientMatchTheReference) {
    const int width = GetParam().first, height = GetParam().second;
    const LossInputs in = random_inputs(uint64_t(width * 1000 + height), width, height);
    Rig& r = rig();
    GuardedFrame guarded(r.config(), {1, uint32_t(width), uint32_t(height), 1, true, false});
    pipeline::FrameBuffers& frame = guarded.frame;
    const auto planes = pack_planes(in.image, 3, frame.sizes.stride);
    frame.planes.upload(std::span<const float>(planes));
    const gpu::Buffer photo = pipeline::upload_photo(*device(), in.photo);
    const pipeline::CameraUse camera{nullptr, 0, uint32_t(width), uint32_t(height)};
    r.run([&](gpu::Recording& recording) {
        pipeline::FramePasses{{recording, r.cache}, {}, frame, {camera, in.background}}.loss(photo);
    });
    EXPECT_TRUE(guarded.intact());

    const reference::Loss cpu = reference::image_loss(in.image, in.target);
    const shared::Counts counts = frame.read_counts();
    // A float32 sum in blocks of subgroups; the terms are of order one.
    EXPECT_NEAR(counts.l1, cpu.l1, 2e-7 + 1e-6 * cpu.l1);
    EXPECT_NEAR(counts.squared, cpu.squared, 1e-7 + 1e-6 * cpu.squared);
    EXPECT_NEAR(counts.ssim, cpu.ssim, 5e-7);  // each value divides small differences of moments
    EXPECT_NEAR(pipeline::loss_of({}, counts), cpu.loss, 1e-6);

    const auto gradient = frame.image_gradient.download<float>(frame.sizes.image_gradient / 4);
    const auto target = frame.target.download<float>(frame.sizes.target / 4);
    double worst = 0, largest = 0, worst_target = 0;
    for (int c = 0; c < 3; ++c)
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const size_t at =
                    size_t(c) * frame.sizes.plane_floats + size_t(y) * frame.sizes.stride + size_t(x);
                worst = std::max(worst, std::abs(gradient[at] - cpu.gradient.at(x, y)[c]));
                largest = std::max(largest, std::abs(cpu.gradient.at(x, y)[c]));
                worst_target = std::max(worst_target, std::abs(target[at] - in.target.at(x, y)[c]));
            }
    printf("    gradient %.1e of %.1e, ssim %.1e\n", worst, largest, std::abs(counts.ssim - cpu.ssim));
    EXPECT_LT(worst_target, 2e-7);
    EXPECT_LT(worst, 1e-5 * largest);  // variances are float32 differences of moments
}

/// Other weights than those of 3DGS. What a term of weight 0 needs is not there.
TEST_P(Loss, OfOtherWeightsMatchesTheReference) {
    const int width = GetParam().first, height = GetParam().second;
    LossInputs in = random_inputs(uint64_t(width * 500 + height), width, height);
    const gpu::Buffer photo = pipeline::upload_photo(*device(), in.photo);
    Rig& r = rig();
    for (const LossWeights& weights :
         {LossWeights{0, 0, 1}, LossWeights{0.3, 2.5, 0.1}, LossWeights{1, 0, 0}, LossWeights{0.2, 1, 0}}) {
        // A square grows linearly above 16.
        if (weights.ssim == 0) in.image.at(width / 2, height / 2)[1] = 20;
        SCOPED_TRACE(testing::Message() << weights.l1 << " " << weights.l2 << " " << weights.ssim);
        pipeline::FrameRequest request{1, uint32_t(width), uint32_t(height), 1, true, false};
        request.loss = weights;
        GuardedFrame guarded(r.config(), request);
        pipeline::FrameBuffers& frame = guarded.frame;
        EXPECT_EQ(frame.sizes.moments > 0, weights.ssim > 0);
        const uint32_t rows = 2 + (weights.ssim > 0 ? 1 : 0) + (weights.l2 > 0 ? 1 : 0);
        EXPECT_EQ(frame.sizes.partial_sums, 4 * rows * frame.sizes.partials);
        frame.planes.upload(std::span<const float>(pack_planes(in.image, 3, frame.sizes.stride)));
        const pipeline::FrameInputs inputs{{nullptr, 0, uint32_t(width), uint32_t(height)}, in.background};
        const pipeline::Plan plan{.loss = weights};
        r.run([&](gpu::Recording& recording) {
            recording.fill(frame.counts, 0, 0, sizeof(shared::Counts));
            pipeline::FramePasses{{recording, r.cache}, plan, frame, inputs}.loss(photo);
        });
        EXPECT_TRUE(guarded.intact());
        const reference::Loss cpu = reference::image_loss(in.image, in.target, weights);
        const shared::Counts counts = frame.read_counts();
        EXPECT_NEAR(counts.l1, cpu.l1, 2e-7 + 1e-6 * cpu.l1);
        EXPECT_NEAR(counts.squared, cpu.squared, 1e-7 + 1e-6 * cpu.squared);
        EXPECT_NEAR(counts.l2, weights.l2 > 0 ? cpu.l2 : 0, 1e-7 + 1e-6 * cpu.l2);
        EXPECT_NEAR(counts.ssim, weights.ssim > 0 ? cpu.ssim : 0, 5e-7);
        EXPECT_NEAR(pipeline::loss_of(weights, counts), cpu.loss, 2e-6 + 1e-6 * cpu.loss);
        const auto gradient = frame.image_gradient.download<float>(frame.sizes.image_gradient / 4);
        double worst = 0, largest = 0;
        for (int c = 0; c < 3; ++c)
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    const size_t at =
                        size_t(c) * frame.sizes.plane_floats + size_t(y) * frame.sizes.stride + size_t(x);
                    worst = std::max(worst, std::abs(gradient[at] - cpu.gradient.at(x, y)[c]));
                    largest = std::max(largest, std::abs(cpu.gradient.at(x, y)[c]));
                }
        EXPECT_LT(worst, 1e-5 * largest);
    }
}

/// The training image's alpha as the weight of a pixel.
TEST_P(Loss, OfMaskedPicturesMatchesTheReference) {
    const int width = GetParam().first, height = GetParam().second;
    LossInputs in = random_inputs(uint64_t(width * 31 + height), width, height);
    reference::Raster photo(width, height, 3), weights(width, height, 1);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            if (x % 4 == 1) in.photo.at(x, y)[3] = 0;
            weights.at(x, y)[0] = in.photo.at(x, y)[3];
            for (int k = 0; k < 3; ++k) photo.at(x, y)[k] = in.photo.at(x, y)[k];
        }
    Rig& r = rig();
    GuardedFrame guarded(r.config(), {1, uint32_t(width), uint32_t(height), 1, true, false, true});
    pipeline::FrameBuffers& frame = guarded.frame;
    const auto planes = pack_planes(in.image, 3, frame.sizes.stride);
    frame.planes.upload(std::span<const float>(planes));
    const gpu::Buffer texels = pipeline::upload_photo(*device(), in.photo);
    const pipeline::CameraUse camera{nullptr, 0, uint32_t(width), uint32_t(height)};
    r.run([&](gpu::Recording& recording) {
        pipeline::FramePasses{{recording, r.cache}, {}, frame, {camera, in.background}}.loss(texels, true);
    });
    EXPECT_TRUE(guarded.intact());

    const reference::Loss cpu = reference::image_loss(in.image, photo, weights);
    const shared::Counts counts = frame.read_counts();
    EXPECT_NEAR(counts.l1, cpu.l1, 2e-7 + 1e-6 * cpu.l1);
    EXPECT_NEAR(counts.squared, cpu.squared, 1e-7 + 1e-6 * cpu.squared);
    EXPECT_NEAR(counts.ssim, cpu.ssim, 5e-7);
    const auto gradient = frame.image_gradient.download<float>(frame.sizes.image_gradient / 4);
    double worst = 0, largest = 0;
    for (int c = 0; c < 3; ++c)
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const float g = gradient[size_t(c) * frame.sizes.plane_floats +
                                         size_t(y) * frame.sizes.stride + size_t(x)];
                if (weights.at(x, y)[0] == 0) {
                    EXPECT_EQ(g, 0);
                }
                worst = std::max(worst, std::abs(g - cpu.gradient.at(x, y)[c]));
                largest = std::max(largest, std::abs(cpu.gradient.at(x, y)[c]));
            }
    EXPECT_LT(worst, 1e-5 * largest);
    // What was drawn is left alone: the way back through the blend needs it.
    EXPECT_EQ(frame.planes.download<float>(planes.size()), planes);
}

/// The loss of each band of a picture, with its halo. Their sums are those of the picture.
TEST_P(Loss, OfBandsAddsUpToThatOfTheView) {
    const int width = GetParam().first, height = GetParam().second;
    const LossInputs in = random_inputs(uint64_t(width * 53 + height), width, height);
    reference::Raster photo(width, height, 3), weights(width, height, 1);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            weights.at(x, y)[0] = in.photo.at(x, y)[3];
            for (int k = 0; k < 3; ++k) photo.at(x, y)[k] = in.photo.at(x, y)[k];
        }
    Rig& r = rig();
    const gpu::Buffer texels = pipeline::upload_photo(*device(), in.photo);
    const uint32_t tile_rows = (uint32_t(height) + r.config().tile_height - 1) / r.config().tile_height;
    const pipeline::Plan plan{.loss = {0.7, 0.6, 0.2}};
    for (const bool masked : {false, true})
        for (const uint32_t bands : {1u, 2u, 3u, tile_rows}) {
            if (bands > tile_rows) continue;
            double l1 = 0, l2 = 0, squared = 0, ssim = 0;
            reference::Raster gradient(width, height, 3);
            for (uint32_t b = 0; b < bands; ++b) {
                const pipeline::Band band = pipeline::band_of(r.config(), uint32_t(height), bands, b);
                pipeline::FrameRequest request{1, uint32_t(width), band.rows, 1, true, false, masked};
                request.loss = plan.loss;
                GuardedFrame guarded(r.config(), request);
                pipeline::FrameBuffers& frame = guarded.frame;
                reference::Raster rows(width, int(band.rows), 3);
                for (int y = 0; y < int(band.rows); ++y)
                    for (int x = 0; x < width; ++x)
                        for (int c = 0; c < 3; ++c) rows.at(x, y)[c] = in.image.at(x, int(band.first) + y)[c];
                frame.planes.upload(std::span<const float>(pack_planes(rows, 3, frame.sizes.stride)));
                pipeline::FrameInputs inputs{{nullptr, 0, uint32_t(width), uint32_t(height)}, in.background};
                inputs.band = band;
                r.run([&](gpu::Recording& recording) {
                    pipeline::FramePasses{{recording, r.cache}, plan, frame, inputs}.loss(texels, masked);
                });
                EXPECT_TRUE(guarded.intact());
                const shared::Counts counts = frame.read_counts();
                l1 += counts.l1;
                l2 += counts.l2;
                squared += counts.squared;
                ssim += counts.ssim;
                const auto own = frame.image_gradient.download<float>(frame.sizes.image_gradient / 4);
                for (int y = 0; y < int(band.rows); ++y)
                    for (int x = 0; x < width; ++x)
                        for (int c = 0; c < 3; ++c)
                            gradient.at(x, int(band.first) + y)[c] +=
                                own[size_t(c) * frame.sizes.plane_floats + size_t(y) * frame.sizes.stride +
                                    size_t(x)];
            }
            const reference::Loss cpu = masked ? reference::image_loss(in.image, photo, weights, plan.loss)
                                               : reference::image_loss(in.image, in.target, plan.loss);
            EXPECT_NEAR(l1, cpu.l1, 2e-7 + 1e-6 * cpu.l1);
            EXPECT_NEAR(l2, cpu.l2, 2e-7 + 1e-6 * cpu.l2);
            EXPECT_NEAR(squared, cpu.squared, 1e-7 + 1e-6 * cpu.squared);
            EXPECT_NEAR(ssim, cpu.ssim, 5e-7);
            double worst = 0, largest = 0;
            for (size_t i = 0; i < gradient.values.size(); ++i) {
                worst = std::max(worst, std::abs(gradient.values[i] - cpu.gradient.values[i]));
                largest = std::max(largest, std::abs(cpu.gradient.values[i]));
            }
            EXPECT_LT(worst, 1e-5 * largest) << bands << " bands";
        }
}

TEST(LossBands, AreWholeTileRowsWithAHaloForTheWindow) {
    for (const uint32_t tile : {4u, 8u, 16u, 64u})
        for (const uint32_t height : {1u, 47u, 64u, 480u}) {
            passes::KernelConfig config;
            config.tile_height = tile;
            for (uint32_t bands = 1; bands <= (height + tile - 1) / tile; ++bands) {
                uint32_t next = 0;
                for (uint32_t b = 0; b < bands; ++b) {
                    const pipeline::Band band = pipeline::band_of(config, height, bands, b);
                    const uint32_t begin = band.first + band.own_begin, end = band.first + band.own_end;
                    EXPECT_EQ(begin, next);
                    EXPECT_LT(begin, end);
                    EXPECT_EQ(band.first % tile, 0u);
                    EXPECT_TRUE(band.first == 0 || begin - band.first >= shared::SSIM_RADIUS);
                    EXPECT_TRUE(band.first + band.rows == height ||
                                band.rows - band.own_end >= shared::SSIM_RADIUS);
                    EXPECT_LE(begin - band.first, 8u > tile ? 8u : tile);
                    EXPECT_LE(band.first + band.rows, height);
                    next = end;
                }
                EXPECT_EQ(next, height);
            }
        }
}

/// The window's first half: exact up to float32 rounding of eleven products.
TEST_P(Loss, MomentsAreBlurredDownTheColumns) {
    const int width = GetParam().first, height = GetParam().second;
    const LossInputs in = random_inputs(uint64_t(width * 77 + height), width, height);
    Rig& r = rig();
    const auto sizes =
        pipeline::sizes_for(r.config(), {1, uint32_t(width), uint32_t(height), 1, true, false});
    Guarded image("image", pack_planes(in.image, 3, sizes.stride), gpu::Texel::rgba32f),
        target("target", pack_planes(in.target, 3, sizes.stride), gpu::Texel::rgba32f),
        moments("moments", sizes.moments, gpu::Texel::rgba32f),
        blurred("blurred", sizes.derivatives, gpu::Texel::rgba32f);
    // Any nine planes do as derivatives: the moments' first nine.
    r.run([&](gpu::Recording& recording) {
        const shared::LossPush push{sizes.image(), 0, 0, 0, {}};
        r.cache.get<passes::LossColumns>().record(recording, {image, target, moments}, push);
        r.cache.get<passes::LossBackwardColumns>().record(recording, {moments, blurred}, push);
    });
    expect_intact({&image, &target, &moments, &blurred});
    const std::vector<double> window = reference::ssim_window();
    const auto down = [&](const auto& value, int y) {
        double sum = 0;
        for (int d = -5; d <= 5; ++d)
            if (y + d >= 0 && y + d < height) sum += window[size_t(d + 5)] * value(y + d);
        return sum;
    };
    const auto actual = moments.read<float>();
    const auto again = blurred.read<float>();
    double worst = 0, worst_again = 0;
    for (int c = 0; c < 3; ++c)
        for (int q = 0; q < 4; ++q)
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    const auto moment = [&](int row) {
                        const double a = in.image.at(x, row)[c], b = float(in.target.at(x, row)[c]);
                        return q == 0 ? a : q == 1 ? b : q == 2 ? a * a + b * b : a * b;
                    };
                    const auto index = [&](int row) {
                        return size_t(4 * c + q) * sizes.plane_floats + size_t(row) * sizes.stride +
                               size_t(x);
                    };
                    worst = std::max(worst, std::abs(actual[index(y)] - down(moment, y)));
                    if (4 * c + q >= 9) continue;
                    const auto value = [&](int row) { return double(actual[index(row)]); };
                    worst_again = std::max(worst_again, std::abs(again[index(y)] - down(value, y)));
                }
    EXPECT_LT(worst, 2e-6);
    EXPECT_LT(worst_again, 2e-6);
}

INSTANTIATE_TEST_SUITE_P(Sizes, Loss,
                         testing::Values(std::pair{1, 1}, std::pair{17, 3}, std::pair{3, 17}, std::pair{4, 4},
                                         std::pair{61, 47}, std::pair{130, 90},
                                         std::pair{200, 140}),  // with 8 lanes, partial sums of two blocks
                         [](const auto& tested) {
                             return std::to_string(tested.param.first) + "x" +
                                    std::to_string(tested.param.second);
                         });

TEST(LossEdges, EqualPicturesHaveNoLossAndNoGradient) {
    const Image picture = random_target(5, 40, 30);
    Rig& r = rig();
    GuardedFrame guarded(r.config(), {1, 40, 30, 1, true, false});
    pipeline::FrameBuffers& frame = guarded.frame;
    const auto planes = pack_planes(reference::to_double(picture), 3, frame.sizes.stride);
    frame.planes.upload(std::span<const float>(planes));
    const gpu::Buffer photo = pipeline::upload_photo(*device(), picture);
    r.run([&](gpu::Recording& recording) {
        pipeline::FramePasses{{recording, r.cache}, {}, frame, {{nullptr, 0, 40, 30}, {1, 1, 1}}}.loss(photo);
    });
    EXPECT_EQ(frame.read_counts().l1, 0);
    EXPECT_EQ(frame.read_counts().squared, 0);
    EXPECT_NEAR(frame.read_counts().ssim, 1, 1e-6);
    // Against an L1 gradient of 0.8 / 3600 = 2e-4 a pixel.
    for (const float g : frame.image_gradient.download<float>(frame.sizes.image_gradient / 4))
        ASSERT_NEAR(g, 0, 1e-8);
}

TEST(Photo, EightBitAndFloatImagesUnpackTheSame) {
    Image picture(9, 5, 4);
    Random random(6);
    for (float& value : picture.pixels) value = float(random.integer(0, 255)) / 255.0f;
    Image wide = picture;
    wide.pixels[0] = 0.1234567f;
    Rig& r = rig();
    const auto unpack = [&](const Image& image, gpu::Texel texel) {
        const gpu::Buffer photo = pipeline::upload_photo(*device(), image);
        EXPECT_EQ(int(photo.texel()), int(texel));
        Guarded planes("planes", 12 * 5 * 3 * 4);
        r.run([&](gpu::Recording& recording) {
            r.cache.get<passes::UnpackTarget>({{shared::SPEC_COLOR_FLOATS, texel == gpu::Texel::rgba32f}})
                .record(recording, {photo, planes}, {{1, 0.5f, 0}, {{9, 5}, 12, 60}, 0});
        });
        expect_intact({&planes});
        return planes.read<float>();
    };
    const auto bytes = unpack(picture, gpu::Texel::rgba8), floats = unpack(wide, gpu::Texel::rgba32f);
    const float background[3] = {1, 0.5f, 0};
    for (int y = 0; y < 5; ++y)
        for (int x = 0; x < 9; ++x)
            for (int c = 0; c < 3; ++c) {
                const size_t at = size_t(60 * c + 12 * y + x);
                const float* p = picture.at(x, y);
                if (x + y + c > 0) {
                    EXPECT_NEAR(bytes[at], floats[at], 1.2e-7);  // one rounding of v / 255
                }
                EXPECT_NEAR(bytes[at], p[c] * p[3] + background[c] * (1 - p[3]), 2e-7);
            }
}

TEST(Photo, MayBeRoundedToEightBits) {
    Image picture(2, 1, 3);
    picture.pixels = {-1, 0.1234567f, 0.5f, 1, 2, 0.999f};
    const gpu::Buffer photo = pipeline::upload_photo(*device(), picture, true);
    EXPECT_EQ(int(photo.texel()), int(gpu::Texel::rgba8));
    EXPECT_LE(pipeline::photo_bytes(2, 1, true), photo.bytes());
    EXPECT_EQ(photo.download<uint8_t>(8), (std::vector<uint8_t>{0, 31, 128, 255, 255, 255, 255, 255}));
    EXPECT_EQ(int(pipeline::upload_photo(*device(), picture).texel()), int(gpu::Texel::rgba32f));
}

TEST(Photo, RoundsHalvesUp) {
    // 0.49999997 is the largest float below a half.
    for (const float levels :
         {0.0f, 0.49999997f, 0.5f, 1.4999999f, 1.5f, 127.5f, 254.49998f, 254.5f, 255.0f}) {
        Image picture(1, 1, 3);
        std::ranges::fill(picture.pixels, levels / 255.0f);
        const auto texels = std::get<std::vector<uint8_t>>(pipeline::photo_texels(picture, true));
        // Exact in double. MinGW's roundf gives 1 for 0.49999997.
        const auto expected = uint8_t(std::floor(double(levels / 255.0f * 255.0f) + 0.5));
        EXPECT_EQ(texels, (std::vector<uint8_t>{expected, expected, expected, 255})) << levels;
    }
}

TEST(Reduce, AddsUpInAFixedOrder) {
    Rig& r = rig();
    for (const uint32_t items : {1u, 7u, 513u, 20000u}) {
        Random random(items);
        std::vector<float> values(3 * items);  // in three rows
        double sum[3] = {0, 0, 0};
        for (size_t i = 0; i < values.size(); ++i) sum[i / items] += values[i] = float(random.uniform(-1, 2));
        const uint32_t block = 512, blocks = (items + block - 1) / block;
        Guarded source("source", values), sums("sums", 3 * blocks * 4), unused("unused", 4),
            counts = zero_counts(), at_once = zero_counts();
        r.run([&](gpu::Recording& recording) {
            const auto reduce = r.cache.get<passes::Reduce>();
            reduce.record(recording, {source, sums, counts}, {items, block, shared::REDUCE_TO_SUMS, 3, 1});
            reduce.record(recording, {sums, unused, counts}, {blocks, blocks, shared::REDUCE_TO_L1, 3, 0.5f});
            reduce.record(recording, {sums, unused, counts},
                          {blocks, blocks, shared::REDUCE_TO_SSIM, 1, 2.0f});
            reduce.record(recording, {source, unused, at_once},
                          {items, items, shared::REDUCE_TO_L1, 3, 0.5f});
        });
        expect_intact({&source, &sums, &unused, &counts, &at_once});
        const auto read = counts.read<shared::Counts>()[0];
        EXPECT_NEAR(read.l1, 0.5 * sum[0], 1e-6 * items);
        EXPECT_NEAR(read.squared, 0.5 * sum[1], 1e-6 * items);
        EXPECT_NEAR(read.l2, 0.5 * sum[2], 1e-6 * items);
        EXPECT_NEAR(read.ssim, 2 * sum[0], 4e-6 * items);
        EXPECT_EQ(unused.read<uint32_t>()[0], kPoison);
        EXPECT_EQ(read.instances, 0u);
        // The sums of one block do not depend on whether it is added up in one step or in two.
        const auto once = at_once.read<shared::Counts>()[0];
        const std::array sums_once{once.l1, once.squared, once.l2};
        if (blocks == 1) {
            EXPECT_EQ(sums_once, (std::array{read.l1, read.squared, read.l2}));
        }
    }
}

}  // namespace
}  // namespace ewa::test
