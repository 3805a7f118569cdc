// SPDX-License-Identifier: Apache-2.0
// Splats that photos contradict, of a wall with floaters in front of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "ewa/error.h"
#include "ewa/renderer.h"
#include "ewa/splat_edit.h"
#include "gpu/test_device.h"
#include "pipeline/contradicted.h"
#include "scene/framing.h"
#include "shared/constants.h"
#include "support/random_scene.h"
#include "support/temp_folder.h"

namespace ewa::test {
namespace {

using pipeline::ComparedPhotos;
using pipeline::Contradicted;
using pipeline::PhotoScores;

struct Blob {
    glm::dvec3 mean;
    double deviation, opacity, grey;
};

Gaussians splats_of(const std::vector<Blob>& blobs) {
    Gaussians g;
    g.resize(blobs.size());
    for (size_t i = 0; i < blobs.size(); ++i) {
        const Blob& b = blobs[i];
        for (size_t k = 0; k < 3; ++k) {
            g.means[3 * i + k] = float(b.mean[int(k)]);
            g.log_scales[3 * i + k] = float(std::log(b.deviation));
            g.sh[3 * i + k] = float((b.grey - shared::COLOR_OFFSET) / shared::SH_C0);
        }
        g.quaternions[4 * i] = 1;
        g.opacity_logits[i] = float(std::log(b.opacity / (1 - b.opacity)));
    }
    return g;
}

constexpr size_t kFloaters = 5;

/// Noisy photos of a wall, and the wall with dark floaters, which are its last splats.
class ContradictedSplats : public testing::Test {
  protected:
    void SetUp() override {
        constexpr int kSide = 32, kPhotos = 10;
        constexpr double kSpacing = 0.19;
        std::vector<Blob> blobs;
        for (int y = 0; y < kSide; ++y)
            for (int x = 0; x < kSide; ++x)
                blobs.push_back({{kSpacing * (x - 0.5 * kSide), kSpacing * (y - 0.5 * kSide), 0},
                                 0.12,
                                 0.9,
                                 0.6 + 0.3 * ((x / 4 + y / 4) % 2)});
        wall_ = splats_of(blobs);
        for (const auto& [x, y] : {std::pair{-0.7, 0.0}, {0.7, 0.1}, {0.1, 0.5}, {-0.1, -0.5}, {0.0, 0.0}})
            blobs.push_back({{x, y, -1}, 0.15, 0.9, 0.05});
        floated_ = splats_of(blobs);
        for (int i = 0; i < kPhotos; ++i) {
            const double turn = -0.45 + 0.1 * i, height = 0.5 * std::sin(2.0 * i);
            Camera camera = scene::look_at({4 * std::sin(turn), height, -4 * std::cos(turn)}, {0, 0, 0},
                                           {0, 1, 0}, 64, 48);
            camera.fx = camera.fy = 60;
            Frame frame;
            frame.name = std::to_string(i) + ".png";
            frame.image_path = folder_ / frame.name;
            frame.image_exists = true;
            frame.camera = frame.source = frame.pinhole = camera;
            photos_.frames.push_back(frame);
        }
        photos_.load = load_training_image;
        photos_.options.background = {0.2f, 0.5f, 0.8f};
        write_photos(1, 0);
    }

    /// Each photo is the render of the wall, times a factor, plus an offset and noise.
    void write_photos(float factor, float offset) { write_photos_of(wall_, factor, offset); }
    void write_photos_of(const Gaussians& splats, float factor, float offset) {
        Random random(5);
        Renderer renderer(device(), splats, photos_.options);
        for (const Frame& frame : photos_.frames) {
            Image photo = renderer.render(frame.camera).color;
            for (float& value : photo.pixels)
                value = std::clamp(factor * value + offset + 0.03f * float(random.normal()), 0.0f, 1.0f);
            save_image(frame.image_path, photo);
        }
    }

    Contradicted found(const Gaussians& splats) const {
        std::vector<uint32_t> left(splats.size());
        std::iota(left.begin(), left.end(), 0u);
        return pipeline::contradicted_splats(device(), splats, left, photos_);
    }

    void expect_floaters() const {
        const Contradicted of_all = found(floated_);
        EXPECT_EQ(of_all.count, kFloaters);
        for (size_t i = 0; i < floated_.size(); ++i)
            EXPECT_EQ(of_all.flags[i], i >= wall_.size()) << "splat " << i;
        const Contradicted of_wall = found(wall_);
        EXPECT_EQ(of_wall.count, 0u);
        EXPECT_EQ(of_wall.before, of_wall.after);
        EXPECT_GT(of_all.before, 3 * of_all.after);
        EXPECT_NEAR(of_all.after, of_wall.before, 1e-9);
    }

    /// The sum of g is the change of E by the opacity, to the first order.
    void expect_sums_are_changes_of_the_error() const {
        constexpr double kStep = 0.01;
        const PhotoScores scores = pipeline::photo_scores(device(), floated_, photos_);
        for (const size_t i : {wall_.size(), wall_.size() / 2 + 16}) {
            const auto error = [&](double factor) {
                Gaussians changed = floated_;
                const double opacity = factor / (1 + std::exp(-double(floated_.opacity_logits[i])));
                changed.opacity_logits[i] = float(std::log(opacity / (1 - opacity)));
                return pipeline::photo_scores(device(), changed, photos_).error;
            };
            const double change = (error(1 + kStep) - error(1 - kStep)) / (2 * kStep);
            EXPECT_NEAR(scores.sums[i], change, 0.02 * std::abs(change) + 0.1) << "splat " << i;
            EXPECT_GE(scores.sizes[i], std::abs(scores.sums[i]));
        }
    }

    TempFolder folder_;
    Gaussians wall_, floated_;
    ComparedPhotos photos_;
};

TEST_F(ContradictedSplats, AreTheFloaters) {
    expect_floaters();
}

TEST_F(ContradictedSplats, AreTheFloatersUnderFittedColours) {
    photos_.fit_colors = true;
    write_photos(0.6f, 0.2f);
    expect_floaters();
}

/// The error falls with the opacity of these splats at first, but the photos need them.
TEST_F(ContradictedSplats, AreNotThoseThatShouldBeFainter) {
    Gaussians fainter = floated_;
    for (size_t i = wall_.size(); i < fainter.size(); ++i)
        fainter.opacity_logits[i] = float(std::log(0.6 / (1 - 0.6)));
    write_photos_of(fainter, 1, 0);
    const PhotoScores scores = pipeline::photo_scores(device(), floated_, photos_);
    constexpr double kFirstLimit = 300;
    for (size_t i = wall_.size(); i < floated_.size(); ++i)
        EXPECT_GT(scores.sums[i], kFirstLimit * scores.error / double(floated_.size())) << "splat " << i;
    EXPECT_EQ(found(floated_).count, 0u);
}

TEST_F(ContradictedSplats, SumsAreChangesOfTheError) {
    expect_sums_are_changes_of_the_error();
    photos_.fit_colors = true;
    write_photos(0.6f, 0.2f);
    expect_sums_are_changes_of_the_error();
}

TEST_F(ContradictedSplats, MaskedPixelsDoNotCount) {
    Image grey(64, 48, 1);
    for (size_t i = 0; i < grey.pixels.size(); ++i) grey.pixels[i] = i % 64 < 40 ? 0.5f : 1.0f;
    for (Frame& frame : photos_.frames) frame.left_out = std::make_shared<const Image>(grey);
    expect_sums_are_changes_of_the_error();
    for (Frame& frame : photos_.frames) frame.left_out = std::make_shared<const Image>(Image(64, 48, 1));
    const PhotoScores scores = pipeline::photo_scores(device(), floated_, photos_);
    EXPECT_EQ(scores.error, 0);
    EXPECT_EQ(scores.values, 0);
    for (const double size : scores.sizes) EXPECT_EQ(size, 0);
    EXPECT_EQ(found(floated_).count, 0u);
}

TEST_F(ContradictedSplats, AreOfThoseThatAreLeft) {
    std::vector<uint32_t> left;
    for (uint32_t i = 0; i < floated_.size(); ++i)
        if (i != wall_.size() + 1) left.push_back(i);
    const Contradicted most = pipeline::contradicted_splats(device(), floated_, left, photos_);
    EXPECT_EQ(most.count, kFloaters - 1);
    EXPECT_FALSE(most.flags[wall_.size() + 1]);
    EXPECT_TRUE(most.flags[wall_.size()]);
    EXPECT_EQ(pipeline::contradicted_splats(device(), floated_, {}, photos_).count, 0u);
}

TEST_F(ContradictedSplats, AComparisonEndsBeforeAPhoto) {
    size_t calls = 0;
    const auto stop = [&](size_t photo, size_t photos, size_t round) {
        EXPECT_EQ(photo, ++calls);
        EXPECT_EQ(photos, photos_.frames.size());
        EXPECT_EQ(round, 1u);
        if (photo == 3) throw InputError("stopped");
    };
    expect_error<InputError>([&] { pipeline::photo_scores(device(), wall_, photos_, 1, stop); }, {"stopped"});
    EXPECT_EQ(calls, 3u);
}

}  // namespace
}  // namespace ewa::test
