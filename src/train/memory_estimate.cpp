// SPDX-License-Identifier: Apache-2.0
// The device memory of a training, before it begins. The buffers' sizes come from the functions that the frame itself
// uses. The number of (splat, tile) pairs is estimated from the first splats in the training views.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <numbers>

#include "ewa/trainer.h"
#include "pipeline/frame_buffers.h"
#include "pipeline/model.h"
#include "pipeline/plan.h"
#include "shared/constants.h"
#include "train/image_cache.h"
#include "train/run_input.h"
#include "train/schedule.h"

namespace ewa {
namespace {

using namespace pipeline;

constexpr size_t kSplats = 20000, kViews = 24;  // samples; more change the estimate by less than a percent
// Splats start transparent. Within a hundred steps their footprints are those of this opacity, or of their own if that
// is higher (fox_270, fox_540, still_life).
constexpr double kLeastOpacity = 0.5;
// Fitted to the same trainings. 0.5 would keep the covered area.
constexpr double kAdcShrink = 0.4, kMcmcShrink = 0.16;
// The capacity grows to 9/8 of what a frame needs, whenever one needs more than there is.
constexpr double kCapacity = 17.0 / 16;
constexpr uint64_t kMostPairs = 0xe0000000u;
constexpr uint64_t kRefineBytes = 16;  // a splat, of a refinement's own lists

/// Sums over sampled splats that a view sees.
struct Footprints {
    double splats = 0;
    double sides = 0;  // of the bounding box, tiles: width / tile width + height / tile height
    double area = 0;   // of the ellipse, tiles
};

/// Adds the ellipse {alpha >= ALPHA_MIN} of splat i, if its middle is in the image.
void add_footprint(Footprints& sum, const Gaussians& g, size_t i, const Camera& camera,
                   const passes::KernelConfig& config) {
    const glm::dvec3 p = camera.rotation * g.world_mean(i) + camera.translation;
    if (!(p.z > shared::NEAR_PLANE)) return;
    const double x = camera.fx * p.x / p.z + camera.cx, y = camera.fy * p.y / p.z + camera.cy;
    if (!(x >= 0 && x < camera.width && y >= 0 && y < camera.height)) return;
    const float* q = &g.quaternions[4 * i];
    const glm::dmat3 turn = glm::mat3_cast(glm::normalize(glm::dquat(q[0], q[1], q[2], q[3])));
    double a = shared::LOW_PASS, b = 0, c = shared::LOW_PASS;  // covariance, px^2
    for (int axis = 0; axis < 3; ++axis) {
        const glm::dvec3 v =
            camera.rotation * turn[axis] * std::exp(double(g.log_scales[3 * i + size_t(axis)]));
        const double u = camera.fx * (v.x - p.x / p.z * v.z) / p.z,
                     w = camera.fy * (v.y - p.y / p.z * v.z) / p.z;
        a += u * u;
        b += u * w;
        c += w * w;
    }
    const double opacity = std::max(1 / (1 + std::exp(-double(g.opacity_logits[i]))), kLeastOpacity);
    const double reach = 2 * std::log(opacity / shared::ALPHA_MIN);  // squared, in standard deviations
    if (!(reach > 0 && std::isfinite(a + c))) return;
    const double width = std::min(2 * std::sqrt(reach * a), double(camera.width)),
                 height = std::min(2 * std::sqrt(reach * c), double(camera.height));
    const double area =
        std::min(std::numbers::pi * reach * std::sqrt(std::max(a * c - b * b, 0.0)), 0.785 * width * height);
    sum.splats += 1;
    sum.sides += width / config.tile_width + height / config.tile_height;
    sum.area += area / (config.tile_width * config.tile_height);
}

/// (Splat, tile) pairs of the view that has most of them, for `splats` splats that descend from `start`.
/// - A convex shape at a random place of a grid touches 1 + sides + area cells in the mean.
/// - Splats that multiply share what their parents covered, but not all of it: sides shrink with a power of the number,
///   areas with its square.
uint64_t estimated_pairs(const Gaussians& start, const Dataset& dataset, const std::vector<int>& frames,
                         const TrainOptions& options, uint32_t splats, const passes::KernelConfig& config) {
    const size_t stride = start.size() / kSplats + 1;
    const double shrink = std::pow(double(start.size()) / splats,
                                   options.strategy == Strategy::mcmc ? kMcmcShrink : kAdcShrink);
    double most = 0;
    const size_t views = std::min(frames.size(), kViews);
    for (size_t v = 0; v < views; ++v) {
        const Camera& camera = dataset.frames[size_t(frames[v * frames.size() / views])].camera;
        Footprints sum;
        size_t samples = 0;
        for (size_t i = 0; i < start.size(); i += stride, ++samples)
            add_footprint(sum, start, i, camera, config);
        const double pairs = sum.splats + shrink * sum.sides + shrink * shrink * sum.area;
        most = std::max(most, pairs / double(samples) * splats);
    }
    return uint64_t(most * kCapacity);
}

/// The splats at the end: with mcmc as many as its schedule makes, with adc at most.
uint32_t final_splats(size_t start, const TrainOptions& options) {
    const train::Schedule schedule = train::schedule_for(options);
    double splats = double(start);
    for (int step = 1; step <= options.steps && splats < options.max_splats; ++step) {
        if (options.strategy == Strategy::mcmc && schedule.relocates(step))
            splats = std::max(splats, std::floor(schedule.growth * splats));
        if (options.strategy == Strategy::adc && schedule.densifies(step)) splats *= 2;
    }
    return uint32_t(std::max(double(start), std::min<double>(splats, options.max_splats)));
}

/// Bytes of the cached training images, and of one more if some are not cached.
uint64_t image_bytes(const Dataset& dataset, const std::vector<int>& frames, const TrainOptions& options) {
    uint64_t sum = 0;
    for (int h = 0; h <= options.halvings; ++h) {
        uint64_t cached = 0, other = 0;
        for (const int index : frames) {
            const Frame& frame = dataset.frames[size_t(index)];
            const uint64_t bytes =
                photo_bytes(frame.camera.width >> h, frame.camera.height >> h, frame.eight_bit);
            if (cached + bytes <= train::cache_share(options, h))
                cached += bytes;
            else
                other = std::max(other, bytes);
        }
        sum += cached + other;
    }
    return sum;
}

}  // namespace

MemoryEstimate estimate_memory(const gpu::Device& device, const Dataset& dataset,
                               const std::vector<int>& train_frames, const Gaussians& start,
                               const TrainOptions& given) {
    const TrainOptions options = resolve(given, dataset);
    const bool grows = options.strategy != Strategy::none;
    const Plan plan = plan_for(train::plan_request(start, options, false));
    const passes::KernelConfig config = passes::config_for(device.limits());
    MemoryEstimate estimate;
    estimate.splats = final_splats(start.size(), options);
    const uint64_t array = parameter_bytes(estimate.splats, start.sh_degree);
    estimate.model =
        (1 + uint64_t(plan.moment_buffers())) * array + (plan.statistics ? 8ull * estimate.splats : 0);
    const uint64_t pairs =
        std::clamp<uint64_t>(estimated_pairs(start, dataset, train_frames, options, estimate.splats, config),
                             first_capacity(start.size()), kMostPairs);
    for (const int index : train_frames) {
        const Frame& frame = dataset.frames[size_t(index)];
        const FrameRequest request{.splats = estimate.splats,
                                   .width = uint32_t(frame.camera.width),
                                   .height = uint32_t(frame.camera.height),
                                   .instances = uint32_t(pairs),
                                   .gradients = true,
                                   .masks = frame.masks == MaskUse::ignore,
                                   .exposure = plan.exposure,
                                   .overlaid = true};
        const Sizes sizes = sizes_for(config, request);
        const uint64_t instances = sizes.overlay + 2 * sizes.instance_words;
        const uint64_t second = grows ? array + kRefineBytes * estimate.splats : 0;
        estimate.frame = std::max(estimate.frame, sizes.total() - instances + std::max(instances, second));
    }
    estimate.images = image_bytes(dataset, train_frames, options);
    return estimate;
}

}  // namespace ewa
