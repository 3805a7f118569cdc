// SPDX-License-Identifier: Apache-2.0
// The device memory of a training, before it begins. The buffers' sizes come from the functions that the frame itself
// uses. The number of (splat, tile) pairs is estimated from the first splats in the training views.
#include "train/memory_estimate.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <numbers>
#include <optional>
#include <vector>

#include "ewa/trainer.h"
#include "pipeline/frame_buffers.h"
#include "pipeline/model.h"
#include "pipeline/plan.h"
#include "pipeline/views.h"
#include "shared/constants.h"
#include "train/image_cache.h"
#include "train/schedule.h"

namespace ewa {
namespace {

using namespace pipeline;

constexpr size_t kSplats = 20000, kViews = 24;  // samples; more change the estimate by less than a percent
// Splats from points start transparent. Within a hundred steps their footprints are those of this opacity, or of their
// own if that is higher (fox_270, fox_540, still_life).
constexpr double kLeastOpacity = 0.5;
// Optical depth of the first splats, as the views see them in the mean. From points it is about 1 (fox_270, still_life).
// Above this bound, as with random splats (15) or trained ones, the image is opaque already: opacities do not rise, and
// splats that multiply do not cover more.
constexpr double kOpaque = 4;
// Fitted to the same trainings. 0.5 would keep the covered area.
constexpr double kAdcShrink = 0.4, kMcmcShrink = 0.16;
// The capacity grows to 9/8 of what a frame needs, whenever one needs more than there is.
constexpr double kCapacity = 17.0 / 16;
constexpr uint64_t kMostPairs = 0xe0000000u;
constexpr uint64_t kRefineBytes = 16;  // a splat, of a refinement's own lists

/// A splat as a view sees it.
struct Footprint2D {
    double a = 0, b = 0, c = 0;  // covariance, px^2
    double opacity = 0;
    double y = 0;  // of the mean, px
};

/// Empty if the splat's mean is not in the image.
std::optional<Footprint2D> project(const Gaussians& g, size_t i, const Camera& camera) {
    const glm::dvec3 p = camera.rotation * g.world_mean(i) + camera.translation;
    if (!(p.z > shared::NEAR_PLANE)) return {};
    const double x = camera.fx * p.x / p.z + camera.cx, y = camera.fy * p.y / p.z + camera.cy;
    if (!(x >= 0 && x < camera.width && y >= 0 && y < camera.height)) return {};
    const float* q = &g.quaternions[4 * i];
    const glm::dmat3 turn = glm::mat3_cast(glm::normalize(glm::dquat(q[0], q[1], q[2], q[3])));
    Footprint2D f{.a = shared::LOW_PASS, .b = 0, .c = shared::LOW_PASS, .y = y};
    for (int axis = 0; axis < 3; ++axis) {
        const glm::dvec3 v =
            camera.rotation * turn[axis] * std::exp(double(g.log_scales[3 * i + size_t(axis)]));
        const double u = camera.fx * (v.x - p.x / p.z * v.z) / p.z,
                     w = camera.fy * (v.y - p.y / p.z * v.z) / p.z;
        f.a += u * u;
        f.b += u * w;
        f.c += w * w;
    }
    f.opacity = 1 / (1 + std::exp(-double(g.opacity_logits[i])));
    if (!std::isfinite(f.a + f.c) || !std::isfinite(f.opacity)) return {};
    return f;
}

double standard_area(const Footprint2D& f) {
    return std::sqrt(std::max(f.a * f.c - f.b * f.b, 0.0));  // px^2
}

/// Sums over sampled splats that a view sees.
struct Footprints {
    double splats = 0;
    double sides = 0;  // of the bounding box, tiles: width / tile width + height / tile height
    double area = 0;   // of the ellipse, tiles
};

/// The share of a height around y that lies in the rows of a band.
double share_of(const Band& band, double y, double height) {
    if (band.rows == 0) return 1;
    const double low = std::max(y - height / 2, double(band.first)),
                 high = std::min(y + height / 2, double(band.first + band.rows));
    return std::max(high - low, 0.0) / height;
}

/// Adds the ellipse {alpha >= ALPHA_MIN} of a splat that has at least this opacity, as far as it lies in the band.
void add_footprint(Footprints& sum, const Footprint2D& f, double least_opacity, const Camera& camera,
                   const passes::KernelConfig& config, const Band& band) {
    const double opacity = std::max(f.opacity, least_opacity);
    const double reach = 2 * std::log(opacity / shared::ALPHA_MIN);  // squared, in standard deviations
    if (!(reach > 0)) return;
    const double width = std::min(2 * std::sqrt(reach * f.a), double(camera.width)),
                 height = std::min(2 * std::sqrt(reach * f.c), double(camera.height));
    const double area = std::min(std::numbers::pi * reach * standard_area(f), 0.785 * width * height);
    const double share = share_of(band, f.y, height);
    sum.splats += share;
    sum.sides += share * (width / config.tile_width + height / config.tile_height);
    sum.area += share * area / (config.tile_width * config.tile_height);
}

/// A training view, and the sampled splats that it sees.
struct View {
    const Camera* camera = nullptr;
    std::vector<Footprint2D> seen;
};

std::vector<View> sampled_views(const Gaussians& start, const Dataset& dataset,
                                const std::vector<int>& frames, size_t stride) {
    std::vector<View> views(std::min(frames.size(), kViews));
    for (size_t v = 0; v < views.size(); ++v) {
        views[v].camera = &dataset.frames[size_t(frames[v * frames.size() / views.size()])].camera;
        for (size_t i = 0; i < start.size(); i += stride)
            if (const auto footprint = project(start, i, *views[v].camera))
                views[v].seen.push_back(*footprint);
    }
    return views;
}

/// Mean over the views and their pixels. The integral of a splat's alpha is opacity times 2 pi times its standard area.
double optical_depth(const std::vector<View>& views, size_t stride) {
    double sum = 0;
    for (const View& view : views) {
        double alphas = 0;
        for (const Footprint2D& f : view.seen) alphas += f.opacity * 2 * std::numbers::pi * standard_area(f);
        sum += alphas * double(stride) / (double(view.camera->width) * view.camera->height);
    }
    return sum / double(views.size());
}

/// The pictures that ranks draw of a view.
std::vector<Band> bands_of(const passes::KernelConfig& config, uint32_t height, int bands) {
    std::vector<Band> all;
    for (int band = 0; bands > 1 && band < bands; ++band)
        all.push_back(band_of(config, height, uint32_t(bands), uint32_t(band)));
    return all.empty() ? std::vector<Band>(1) : all;
}

/// (Splat, tile) pairs of the picture that has most of them, for `splats` splats that descend from `start`.
/// - A convex shape at a random place of a grid touches 1 + sides + area cells in the mean.
/// - Splats that multiply share what their parents covered, but not all of it: sides shrink with a power of the number,
///   areas with its square.
uint64_t estimated_pairs(const Gaussians& start, const Dataset& dataset, const std::vector<int>& frames,
                         const TrainOptions& options, uint32_t splats, const passes::KernelConfig& config) {
    const size_t stride = start.size() / kSplats + 1;
    const std::vector<View> views = sampled_views(start, dataset, frames, stride);
    const bool opaque = optical_depth(views, stride) > kOpaque;
    const double growth = opaque ? 1 : double(splats) / double(start.size());
    const double shrink = std::pow(growth, options.strategy == Strategy::mcmc ? -kMcmcShrink : -kAdcShrink);
    double most = 0;
    for (const View& view : views)
        for (const Band& band : bands_of(config, uint32_t(view.camera->height), options.bands)) {
            Footprints sum;
            for (const Footprint2D& f : view.seen)
                add_footprint(sum, f, opaque ? 0 : kLeastOpacity, *view.camera, config, band);
            const double pairs = sum.splats + shrink * sum.sides + shrink * shrink * sum.area;
            most = std::max(most, pairs * double(stride) * growth);
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
    TrainOptions options = resolve(given, dataset);
    options.max_splats = splat_cap(device, dataset, train_frames, start, options).splats;
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
        uint32_t rows = 0;
        for (const Band& band : bands_of(config, uint32_t(frame.camera.height), options.bands))
            rows = std::max(rows, band.rows);
        const FrameRequest request{.splats = estimate.splats,
                                   .width = uint32_t(frame.camera.width),
                                   .height = rows > 0 ? rows : uint32_t(frame.camera.height),
                                   .instances = uint32_t(pairs),
                                   .gradients = true,
                                   .masks = frame.masks == MaskUse::ignore,
                                   .exposure = plan.exposure,
                                   .overlaid = true,
                                   .motion = plan.motion};
        const Sizes sizes = sizes_for(config, request);
        const uint64_t instances = sizes.overlay + 2 * sizes.instance_words;
        const uint64_t second = grows ? array + kRefineBytes * estimate.splats : 0;
        estimate.frame = std::max(estimate.frame, sizes.total() - instances + std::max(instances, second));
    }
    if (options.batch > 1 || options.bands > 1)
        estimate.frame +=
            ViewBuffers::most_bytes(plan, estimate.splats, uint64_t(options.batch), uint64_t(options.bands));
    estimate.images = image_bytes(dataset, train_frames, options);
    return estimate;
}

namespace train {

uint64_t limited_cache(const TrainOptions& options) {
    return std::min(options.image_cache_bytes, options.device_memory_bytes / 4);
}

int portions_for(const gpu::Device& device, const Dataset& dataset, const std::vector<int>& frames,
                 const Gaussians& start, const TrainOptions& options, int ranks) {
    // A tenth of the limit: while one is in use with its gradients, most of the device is free for others.
    constexpr uint64_t kPart = 10;
    constexpr uint64_t kMost = 256;        // of portions
    constexpr uint64_t kLeastSplats = 64;  // of the start, in a portion
    const uint64_t limit = options.device_memory_bytes, own = start.size() / uint64_t(ranks);
    if (limit == 0 || own < 2 * kLeastSplats) return 1;
    const MemoryEstimate whole = estimate_memory(device, dataset, frames, start, options);
    const uint64_t model = whole.model / uint64_t(ranks);
    // The frame's part is a guess that some trainings exceed by half.
    if (model + 2 * whole.frame + whole.images <= limit) return 1;
    const uint64_t wanted = (model * kPart + limit - 1) / limit;
    return int(std::clamp<uint64_t>(wanted, 2, std::clamp<uint64_t>(own / kLeastSplats, 2, kMost)));
}

}  // namespace train

}  // namespace ewa
