// SPDX-License-Identifier: Apache-2.0
// What the loss and the backward passes of FramePasses read besides a frame.
//
// Each training image may have an exposure: an affine map of colours, learned beside the splats. The
// published code of 3DGS does the same for captures with automatic exposure; see include/ewa/exposure.h.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "ewa/exposure.h"
#include "pipeline/forward.h"
#include "pipeline/motions.h"

namespace ewa::pipeline {

/// Exposures of all training images, with Adam's moments.
struct Exposures {
    uint32_t photos = 0;
    gpu::Buffer values, moments1, moments2;

    Exposures() = default;
    Exposures(gpu::Device& device, size_t photos);
    uint64_t bytes() const { return 4ull * shared::EXPOSURE_FLOATS * photos; }  // of each buffer
    std::vector<Exposure> download() const;

    /// A photo's exposure and moments, for other ranks.
    using Words = std::array<uint64_t, 3 * shared::EXPOSURE_FLOATS / 2>;
    Words words(uint32_t photo) const;
    void set(uint32_t photo, std::span<const uint64_t> words);
};

/// A step of one training image's exposure.
struct ExposureUse {
    const Exposures* exposures = nullptr;
    uint32_t photo = 0;
    float rate = 0;
    uint32_t visit = 1;  // number of this image's step, from 1
};

struct Rates {
    float mean = 0, opacity = 0, quaternion = 0, scale = 0, sh0 = 0, sh_rest = 0;
    uint32_t step = 1;      // Adam's, from 1
    uint32_t views = 1;     // of a step: see batch_rates
    bool nesterov = false;  // the step looks ahead: see adam_shares
    uint64_t seed = 0;      // of the rounding of packed moments
    // With plan.regularised: d(loss)/d(opacity) and d(loss)/d(scale along one axis) of every splat.
    float opacity_weight = 0, scale_weight = 0;
};

/// SPEC_MODE of the update: UPDATE_* bits.
uint32_t update_mode(const Plan& plan);

/// Terms of a loss before they are weighted.
struct LossTerms {
    double l1 = 0, l2 = 0, ssim = 0, alpha = 0, depth = 0;
};
LossTerms terms_of(const shared::Counts& counts);
double loss_of(const LossWeights& weights, const LossTerms& terms);
double loss_of(const LossWeights& weights, const shared::Counts& counts);

}  // namespace ewa::pipeline
