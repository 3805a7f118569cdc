// SPDX-License-Identifier: Apache-2.0
// Training on images that are cut out by their alpha.
#include <gtest/gtest.h>

#include <cmath>

#include "ewa/renderer.h"
#include "ewa/trainer.h"
#include "gpu/test_device.h"
#include "support/thread_ranks.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

/// Splats within a unit of the origin, of which the images have colour and alpha.
const Synthetic& lone_object() {
    static const Synthetic* const made = [] {
        static Synthetic data;
        make_synthetic(data, 60, 8, 64, 48, 31);
        for (const Frame& frame : data.dataset.frames) {
            const auto render = reference::render(data.truth, frame.camera, {});
            Image image(64, 48, 4);
            for (int y = 0; y < 48; ++y)
                for (int x = 0; x < 64; ++x) {
                    const double alpha = 1 - *render.blended.transmittance.at(x, y);
                    for (int k = 0; k < 3; ++k)
                        image.at(x, y)[k] =
                            alpha > 0 ? float(render.blended.color.at(x, y)[k] / alpha) : 0.0f;
                    image.at(x, y)[3] = float(alpha);
                }
            save_image(frame.image_path, image);
        }
        data.dataset = load_dataset(data.folder.path(), {});
        return &data;
    }();
    return *made;
}

/// With black splats all around, which no black background shows.
Gaussians hidden_start() {
    Gaussians start = lone_object().truth;
    Random random(5);
    const size_t object = start.size();
    start.resize(object + 60);
    for (size_t i = object; i < start.size(); ++i) {
        for (size_t k = 0; k < 3; ++k) {
            start.means[3 * i + k] = float(random.uniform(-1.6, 1.6));
            start.log_scales[3 * i + k] = -2;
            start.sh[3 * i + k] = -1.8f;
        }
        start.quaternions[4 * i] = 1;
        start.opacity_logits[i] = 0;
    }
    return start;
}

/// Mean opacity of the renders where the images are empty.
double opacity_of_nothing(const Gaussians& splats) {
    Renderer renderer(device(), splats, {});
    double sum = 0, pixels = 0;
    for (const Frame& frame : lone_object().dataset.frames) {
        const Image photo = load_frame_image(frame), alpha = renderer.render(frame.camera).alpha;
        for (size_t i = 0; i < alpha.pixels.size(); ++i)
            if (photo.pixels[4 * i + 3] == 0) {
                sum += alpha.pixels[i];
                ++pixels;
            }
    }
    return sum / pixels;
}

struct CutResult {
    TrainerState state;
    Gaussians splats;
};

CutResult train_cut(TrainOptions options, int steps, int ranks = 1) {
    CutResult result;
    const Dataset& dataset = lone_object().dataset;
    run_ranks(ranks, [&](std::shared_ptr<Ranks> group) {
        Trainer trainer(ranks > 1 ? open_test_device(false) : device(), dataset, all_frames(dataset),
                        hidden_start(), options, group);
        if (group->rank() != 0) return trainer.follow();
        while (trainer.steps_done() < steps) trainer.step();
        trainer.keep_waiting();
        result = {trainer.state(), trainer.gaussians()};
    });
    return result;
}

TEST(CutOut, TheBackgroundOfAnObjectIsEmpty) {
    TrainOptions options = quick(120);
    const double usual = opacity_of_nothing(train_cut(options, 120).splats);
    options.loss.alpha = 0;
    const double without = opacity_of_nothing(train_cut(options, 120).splats);
    printf("    %.4f at the start, %.4f, %.4f without alpha\n", opacity_of_nothing(hidden_start()), usual,
           without);
    EXPECT_LT(usual, 0.2 * without);
}

/// From disk, by ranks, in a batch and in bands.
TEST(CutOut, HasTheSameBytesHoweverItIsDivided) {
    TrainOptions options = quick(12);
    options.batch = options.bands = 2;
    const CutResult whole = train_cut(options, 12);
    options.image_cache_bytes = 0;
    const CutResult from_disk = train_cut(options, 12);
    const CutResult ranks = train_cut(options, 12, 2);
    for (const CutResult* other : {&from_disk, &ranks}) {
        EXPECT_EQ(other->state.report.loss, whole.state.report.loss);
        for (size_t i = 0; i < whole.state.arrays.size(); ++i)
            EXPECT_TRUE(other->state.arrays[i].bytes == whole.state.arrays[i].bytes);
    }
    options.loss.alpha = 0;
    EXPECT_FALSE(train_cut(options, 12).splats.opacity_logits == whole.splats.opacity_logits);
}

/// Images whose alpha weights the pixels have no such term, nor have those that are opaque.
TEST(CutOut, OtherAlphaIsNoTerm) {
    Synthetic opaque;
    make_synthetic(opaque, 20, 3, 48, 36, 3);
    const Dataset weighted = load_dataset(lone_object().folder.path(), {.masks = MaskUse::ignore});
    for (const Dataset* dataset : {&weighted, static_cast<const Dataset*>(&opaque.dataset)}) {
        Gaussians trained[2];
        for (const bool with : {false, true}) {
            TrainOptions options = quick(6);
            options.loss.alpha = with ? 5 : 0;
            options.image_cache_bytes = with ? 0 : uint64_t(1) << 30;
            Trainer trainer(device(), *dataset, all_frames(*dataset), hidden_start(), options);
            while (trainer.steps_done() < 6) trainer.step();
            trained[with] = trainer.gaussians();
        }
        EXPECT_EQ(trained[0].means, trained[1].means);
        EXPECT_EQ(trained[0].opacity_logits, trained[1].opacity_logits);
    }
}

}  // namespace
}  // namespace ewa::test
