// SPDX-License-Identifier: Apache-2.0
// The largest number of splats of a training, unless its options name it.
#include "train/splat_cap.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/typing.h"
#include "ewa/error.h"
#include "ewa/trainer.h"

namespace ewa {
namespace {

// Splats per pixel of an image, times the square root of the number of images: each image shows less that is new than the
// one before.
constexpr double kSplatsPerPixel = 0.6;
// 30,000 steps can have 3 million, as the papers' largest scenes. Splats that come late have few steps left.
constexpr double kSplatsPerStep = 100;
constexpr double kMemoryShare =
    0.8;  // of the device's; the rest is for other programs, and for errors of the estimate

/// The largest number up to `most`, and not below that of the start, with which a training fits in so many bytes.
uint32_t fitting(const gpu::Device& device, const Dataset& dataset, const std::vector<int>& frames,
                 const Gaussians& start, TrainOptions options, uint32_t most, double bytes) {
    const auto fits = [&](uint32_t splats) {
        options.max_splats = splats;
        return double(estimate_memory(device, dataset, frames, start, options).total()) <= bytes;
    };
    if (fits(most)) return most;
    auto low = uint32_t(start.size()), high = most;
    while (high - low > most / 100) {
        const uint32_t middle = low + (high - low) / 2;
        (fits(middle) ? low : high) = middle;
    }
    return low;
}

}  // namespace

SplatCap splat_cap(const gpu::Device& device, const Dataset& dataset, const std::vector<int>& train_frames,
                   const Gaussians& start, const TrainOptions& options) {
    if (options.max_splats != kAutomaticMaxSplats) return {options.max_splats, "as asked for"};
    const auto first = uint32_t(start.size());
    const double pixels = train::pixels_of(dataset, train_frames), photos = double(train_frames.size());
    const double by_pixels = kSplatsPerPixel * pixels / std::sqrt(photos);
    const double by_steps = first + kSplatsPerStep * options.steps;
    SplatCap cap{uint32_t(std::min({by_pixels, by_steps, 1e9})),
                 fmt::format("{} with {:.3g} million pixels have detail for no more",
                             core::counted(train_frames.size(), "photo"), pixels / 1e6)};
    if (by_steps < by_pixels) cap.reason = "100 more for each step";
    if (options.device_memory_bytes == 0) {
        const uint32_t fit =
            fitting(device, dataset, train_frames, start, options, std::max(cap.splats, first),
                    kMemoryShare * double(device_info(device).memory_bytes));
        if (fit < cap.splats) cap = {fit, "the device's memory has room for them"};
    }
    if (cap.splats < options.least_max_splats) cap = {options.least_max_splats, "as before"};
    if (cap.splats < first) cap = {first, "as many as there are to start from"};
    return cap;
}

}  // namespace ewa

namespace ewa::train {

void check_start(size_t splats, const TrainOptions& options) {
    if (splats == 0) throw InputError("there are no splats to start from; --init random makes some");
    if (options.max_splats != kAutomaticMaxSplats && splats > options.max_splats)
        throw InputError(fmt::format("there are {} splats to start from, more than --max-splats {}", splats,
                                     options.max_splats));
}

double pixels_of(const Dataset& dataset, const std::vector<int>& frames) {
    double pixels = 0;
    for (const int i : frames) {
        const Camera& camera = dataset.frames[size_t(i)].camera;
        pixels += double(camera.width) * camera.height;
    }
    return pixels;
}

}  // namespace ewa::train
