// SPDX-License-Identifier: Apache-2.0
#include "train/needs.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/typing.h"
#include "ewa/error.h"
#include "pipeline/plan.h"
#include "train/schedule.h"

namespace ewa::train {
namespace {

// Splats per pixel of an image, times the square root of the number of images: each image shows less that is new than the
// one before.
constexpr double kSplatsPerPixel = 0.6;
// 30,000 steps can have 3 million, as the papers' largest scenes. Splats that come late have few steps left.
constexpr double kSplatsPerStep = 100;
constexpr double kFinalShare = 2.0 / 3;  // docs/experiments/growth.md#fewer-splats-at-the-end
constexpr double kMemoryShare =
    0.8;  // of the device's; the rest is for other programs, and for errors of the estimate

}  // namespace

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

size_t cap_by_pixels(const Dataset& dataset, const std::vector<int>& frames) {
    return frames.empty()
               ? 0
               : size_t(kSplatsPerPixel * pixels_of(dataset, frames) / std::sqrt(double(frames.size())));
}

uint64_t limited_cache(const TrainOptions& options) {
    return std::min(options.image_cache_bytes, options.device_memory_bytes / 4);
}

Needs::Needs(const gpu::Device& device, const Dataset& dataset, const std::vector<int>& frames,
             const Gaussians& start, const TrainOptions& options)
    : device_(device),
      dataset_(dataset),
      frames_(frames),
      options_(options),
      start_(start.size()),
      estimator_(passes::config_for(device.limits()), dataset, frames, start, options) {}

/// The largest number up to `most`, and not below that of the start, with which a training fits in the device's memory.
uint32_t Needs::fitting(uint32_t most) {
    const double bytes = kMemoryShare * double(device_info(device_).memory_bytes);
    const auto fits = [&](uint32_t splats) { return double(estimator_.up_to(splats).total()) <= bytes; };
    if (fits(most)) return most;
    auto low = uint32_t(start_), high = most;
    while (high - low > most / 100) {
        const uint32_t middle = low + (high - low) / 2;
        (fits(middle) ? low : high) = middle;
    }
    return low;
}

size_t Needs::fitting_start() {
    const MemoryEstimate needed = estimator_.up_to(uint32_t(start_));
    const double bytes = kMemoryShare * double(device_info(device_).memory_bytes) - double(needed.images),
                 own = double(needed.total() - needed.images);
    return own <= bytes ? start_ : size_t(std::max(1.0, double(start_) * bytes / own));
}

SplatCap Needs::cap() {
    if (options_.max_splats != kAutomaticMaxSplats) return {options_.max_splats, "as asked for"};
    const auto first = uint32_t(start_);
    const double pixels = pixels_of(dataset_, frames_);
    const auto by_pixels = double(cap_by_pixels(dataset_, frames_));
    const double by_steps = first + kSplatsPerStep * options_.steps;
    SplatCap cap{uint32_t(std::min({by_pixels, by_steps, 1e9})),
                 fmt::format("{} with {:.3g} million pixels have detail for no more",
                             core::counted(frames_.size(), "photo"), pixels / 1e6)};
    if (by_steps < by_pixels) cap.reason = "100 more for each step";
    if (options_.device_memory_bytes == 0) {
        const uint32_t fit = fitting(std::max(cap.splats, first));
        if (fit < cap.splats) cap = {fit, "the device's memory has room for them"};
    }
    if (cap.splats < options_.least_max_splats) cap = {options_.least_max_splats, "as before"};
    if (cap.splats < first) cap = {first, "as many as there are to start from"};
    return cap;
}

uint32_t Needs::final_splats(uint32_t max_splats) const {
    if (options_.final_splats != kAutomaticFinalSplats) return options_.final_splats;
    return start_ >= max_splats ? 0 : std::max(uint32_t(start_), uint32_t(kFinalShare * max_splats));
}

int Needs::portions(uint32_t max_splats, int ranks) {
    // A tenth of the limit: while one is in use with its gradients, most of the device is free for others.
    constexpr uint64_t kPart = 10;
    constexpr uint64_t kMost = 256;        // portions
    constexpr uint64_t kLeastSplats = 64;  // of the start, in a portion
    const uint64_t limit = options_.device_memory_bytes, own = start_ / uint64_t(ranks);
    if (limit == 0 || own < 2 * kLeastSplats) return 1;
    const MemoryEstimate whole = estimator_.up_to(max_splats);
    const uint64_t model = whole.model / uint64_t(ranks);
    // The frame's part is a guess that some trainings exceed by half.
    if (model + 2 * whole.frame + whole.images <= limit) return 1;
    const uint64_t wanted = (model * kPart + limit - 1) / limit;
    return int(std::clamp<uint64_t>(wanted, 2, std::clamp<uint64_t>(own / kLeastSplats, 2, kMost)));
}

}  // namespace ewa::train

namespace ewa {

SplatCap splat_cap(const gpu::Device& device, const Dataset& dataset, const std::vector<int>& train_frames,
                   const Gaussians& start, const TrainOptions& options) {
    check(start);
    const TrainOptions resolved = resolve(options, dataset, train_frames);
    return train::Needs(device, dataset, train_frames, start, resolved).cap();
}

MemoryEstimate estimate_memory(const gpu::Device& device, const Dataset& dataset,
                               const std::vector<int>& train_frames, const Gaussians& start,
                               const TrainOptions& options) {
    check(start);
    const TrainOptions resolved = resolve(options, dataset, train_frames);
    train::Needs needs(device, dataset, train_frames, start, resolved);
    return needs.memory(needs.cap().splats);
}

std::vector<PlanLine> plan_lines(const Gaussians& start, const TrainOptions& options, bool masks) {
    check(start);
    check(options.render);
    const pipeline::Plan plan = pipeline::plan_for(train::plan_request(start, options, masks));
    return pipeline::describe(plan, start.sh_degree, start.size());
}

}  // namespace ewa
