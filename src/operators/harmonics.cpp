// SPDX-License-Identifier: Apache-2.0
// The operators of spherical harmonics.
#include "operators/context.h"
#include "passes/passes.h"

namespace ewa {
namespace {

using operators::check_size;

struct HarmonicsShape {
    uint32_t splats = 0, views = 0;
    size_t pairs() const { return size_t(splats) * views; }
};

HarmonicsShape check_harmonics(const HarmonicsArrays& h) {
    if (h.degree > kMaxHarmonicsDegree)
        throw InputError("spherical harmonics of degree " + std::to_string(h.degree) + "; the highest is " +
                         std::to_string(kMaxHarmonicsDegree));
    if (h.coefficient_count < (h.degree + 1) * (h.degree + 1))
        throw InputError(std::to_string(h.coefficient_count) + " coefficients; degree " +
                         std::to_string(h.degree) + " needs " +
                         std::to_string((h.degree + 1) * (h.degree + 1)));
    if (h.channels == 0) throw InputError("spherical harmonics of 0 channels");
    const size_t row = size_t(h.coefficient_count) * h.channels, splats = h.coefficients.size() / row;
    check_size("coefficients", h.coefficients.size(), splats * row, "[N, K, D]");
    const size_t views = splats ? h.directions.size() / (3 * splats) : 0;
    check_size("directions", h.directions.size(), 3 * splats * views, "[C, N, 3]");
    if (!h.masks.empty()) check_size("masks", h.masks.size(), splats * views, "[C, N]");
    return {uint32_t(splats), uint32_t(views)};
}

shared::HarmonicsPush push_of(const HarmonicsArrays& h, const HarmonicsShape& shape) {
    return {.splats = shape.splats,
            .views = shape.views,
            .coefficients = h.coefficient_count,
            .channels = h.channels};
}

void upload_harmonics(gpu::Device& device, operators::HarmonicsBuffers& b, const HarmonicsArrays& h) {
    b.directions.lend(device, h.directions);
    b.coefficients.lend(device, h.coefficients);
    b.masks.lend(device, h.masks);
}

passes::Constants variant_of(const HarmonicsArrays& h, bool direction_gradients) {
    return {{shared::SPEC_SH_DEGREE, h.degree},
            {shared::SPEC_MODE, (h.masks.empty() ? 0 : shared::HARMONICS_MASKED) |
                                    (direction_gradients ? shared::HARMONICS_DIRECTIONS : 0) |
                                    (h.channels == 3 ? shared::HARMONICS_RGB : 0)}};
}

}  // namespace

std::vector<float> Operators::spherical_harmonics(const HarmonicsArrays& h) {
    const HarmonicsShape shape = check_harmonics(h);
    const size_t count = shape.pairs() * h.channels;
    if (count == 0) return {};
    const std::lock_guard lock(context_->mutex);
    gpu::Device& device = *context_->device;
    operators::HarmonicsBuffers& b = context_->harmonics;
    upload_harmonics(device, b, h);
    b.colors.reserve(device, 4 * count);
    gpu::Recording recording(device.limits());
    passes::Recorder{recording, context_->cache}.record(
        passes::Harmonics{.directions = b.directions.buffer(),
                          .coefficients = b.coefficients.buffer(),
                          .masks = b.masks.buffer(),
                          .colors = b.colors.buffer(),
                          .rgb_coefficients = b.coefficients.buffer()},
        push_of(h, shape), variant_of(h, false));
    context_->executor.run(recording);
    b.give_back();
    return b.colors.download<float>(count);
}

HarmonicsGradient Operators::spherical_harmonics_backward(const HarmonicsArrays& h,
                                                          std::span<const float> colors_gradient,
                                                          bool direction_gradients) {
    const HarmonicsShape shape = check_harmonics(h);
    check_size("the gradient of colours", colors_gradient.size(), shape.pairs() * h.channels, "[C, N, D]");
    HarmonicsGradient out;
    if (shape.pairs() == 0) {
        out.coefficients.resize(h.coefficients.size());
        return out;
    }
    const std::lock_guard lock(context_->mutex);
    gpu::Device& device = *context_->device;
    operators::HarmonicsBuffers& b = context_->harmonics;
    upload_harmonics(device, b, h);
    b.colors.lend(device, colors_gradient);
    b.coefficients_gradient.reserve(device, h.coefficients.size_bytes());
    b.directions_gradient.reserve(device, direction_gradients ? h.directions.size_bytes() : 12);
    gpu::Recording recording(device.limits());
    passes::Recorder{recording, context_->cache}.record(
        passes::HarmonicsBackward{.directions = b.directions.buffer(),
                                  .coefficients = b.coefficients.buffer(),
                                  .masks = b.masks.buffer(),
                                  .colors_gradient = b.colors.buffer(),
                                  .coefficients_gradient = b.coefficients_gradient.buffer(),
                                  .directions_gradient = b.directions_gradient.buffer(),
                                  .rgb_coefficients = b.coefficients.buffer()},
        push_of(h, shape), variant_of(h, direction_gradients));
    context_->executor.run(recording);
    b.give_back();
    out.coefficients = b.coefficients_gradient.download<float>(h.coefficients.size());
    if (direction_gradients) out.directions = b.directions_gradient.download<float>(h.directions.size());
    return out;
}

}  // namespace ewa
