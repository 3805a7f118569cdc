// SPDX-License-Identifier: Apache-2.0
// The views of an evaluation: each is compared while the next is drawn.
#include <gtest/gtest.h>

#include <filesystem>
#include <numeric>
#include <stdexcept>

#include "ewa/error.h"
#include "gpu/test_device.h"
#include "run/evaluation.h"
#include "train/synthetic.h"

namespace ewa::test {
namespace {

class EvaluationOfViews : public testing::Test {
  protected:
    EvaluationOfViews() { make_synthetic(made_, 20, 5, 40, 32, 3); }

    /// frames_before: as many are begun before the evaluation is ended by an exception.
    Evaluation evaluate(bool psnr_alone, int frames_before = 100) {
        std::vector<int> frames(made_.dataset.frames.size());
        std::iota(frames.begin(), frames.end(), 0);
        return train::evaluate_views(
            train::view_renderer_of(device(), made_.truth, {}), made_.dataset, frames, {}, {},
            [&] {
                if (frames_before-- == 0) throw std::runtime_error("enough");
            },
            [&](size_t i, const train::RenderedView& view, const EvalFrame& figures) {
                places_.push_back(i);
                EXPECT_EQ(figures.name, made_.dataset.frames[i].name);
                EXPECT_EQ(figures.psnr, psnr(view.rendering, view.photo));
                EXPECT_EQ(figures.ssim, psnr_alone ? 0 : ssim(view.rendering, view.photo));
            },
            {}, psnr_alone);
    }

    Synthetic made_;
    std::vector<size_t> places_;
};

TEST_F(EvaluationOfViews, ComparesEveryViewWithItsOwnImageInOrder) {
    const Evaluation whole = evaluate(false);
    EXPECT_EQ(places_, (std::vector<size_t>{0, 1, 2, 3, 4}));
    ASSERT_EQ(whole.frames.size(), 5u);
    double psnr = 0, ssim = 0;
    for (const EvalFrame& frame : whole.frames) {
        psnr += frame.psnr / 5;
        ssim += frame.ssim / 5;
    }
    EXPECT_GT(psnr, 40);  // the images are renders of these splats
    EXPECT_NEAR(whole.psnr, psnr, 1e-9);
    EXPECT_NEAR(whole.ssim, ssim, 1e-12);
    EXPECT_EQ(evaluate(true).psnr, whole.psnr);
}

TEST_F(EvaluationOfViews, DrawsSeveralAtOnceAndEachHasItsAppearance) {
    std::vector<Appearance> appearances;
    for (int i = 0; i < 5; ++i) {
        Exposure exposure = kIdentityExposure;
        exposure[0] = 0.5f + 0.1f * float(i);
        appearances.emplace_back(exposure);
    }
    const train::ViewRenderer one = train::view_renderer_of(device(), made_.truth, {});
    std::vector<size_t> calls;
    const train::ViewRenderer two{2, [&](std::span<const Camera> cameras) {
                                      calls.push_back(cameras.size());
                                      return one.images(cameras);
                                  }};
    train::evaluate_views(two, made_.dataset, {0, 1, 2, 3, 4}, {}, appearances, {},
                          [&](size_t i, const train::RenderedView& view, const EvalFrame&) {
                              const Image own = one.images(std::span(&made_.dataset.frames[i].camera, 1))[0];
                              EXPECT_EQ(view.rendering.pixels, with_appearance(own, appearances[i]).pixels);
                              places_.push_back(i);
                          });
    EXPECT_EQ(places_, (std::vector<size_t>{0, 1, 2, 3, 4}));
    EXPECT_EQ(calls, (std::vector<size_t>{2, 2, 1}));
}

TEST_F(EvaluationOfViews, EndsByTheExceptionOfAFrame) {
    EXPECT_THROW(evaluate(false, 3), std::runtime_error);
    EXPECT_EQ(places_, (std::vector<size_t>{0, 1}));  // the third was not yet compared
    places_.clear();
    std::filesystem::remove(made_.dataset.frames[2].image_path);
    EXPECT_THROW(evaluate(false), InputError);
    EXPECT_EQ(places_, (std::vector<size_t>{0, 1}));
}

}  // namespace
}  // namespace ewa::test
