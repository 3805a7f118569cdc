// SPDX-License-Identifier: Apache-2.0
// The device memory of a training, before it begins. The buffers' sizes come from the functions that the frame itself
// uses. The number of pairs of a splat and a list is estimated from the first splats in the training views.
#include "train/memory_estimate.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>
#include <numbers>
#include <optional>
#include <vector>

#include "core/parallel.h"
#include "pipeline/appearances.h"
#include "pipeline/frame_buffers.h"
#include "pipeline/model.h"
#include "pipeline/plan.h"
#include "pipeline/views.h"
#include "shared/constants.h"
#include "train/image_cache.h"
#include "train/schedule.h"

namespace ewa::train {

using namespace pipeline;

/// A splat as a view sees it.
struct SeenSplat {
    double a = 0, b = 0, c = 0;  // covariance, px^2
    double opacity = 0;
    double y = 0;  // of the mean, px
};

/// A training view, and the sampled splats that it sees.
struct SampledView {
    const Camera* camera = nullptr;
    std::vector<SeenSplat> seen;
};

namespace {

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

/// Empty if the splat's mean is not in the image.
std::optional<SeenSplat> project(const Gaussians& g, size_t i, const Camera& camera) {
    const glm::dvec3 p = camera.rotation * g.world_mean(i) + camera.translation;
    if (!(p.z > shared::NEAR_PLANE)) return {};
    const double x = camera.fx * p.x / p.z + camera.cx, y = camera.fy * p.y / p.z + camera.cy;
    if (!(x >= 0 && x < camera.width && y >= 0 && y < camera.height)) return {};
    const float* q = &g.quaternions[4 * i];
    const glm::dmat3 turn = glm::mat3_cast(glm::normalize(glm::dquat(q[0], q[1], q[2], q[3])));
    SeenSplat f{.a = shared::LOW_PASS, .b = 0, .c = shared::LOW_PASS, .y = y};
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

double standard_area(const SeenSplat& f) {
    return std::sqrt(std::max(f.a * f.c - f.b * f.b, 0.0));  // px^2
}

/// Sums over sampled splats that a view sees.
struct Footprints {
    double splats = 0;
    double sides = 0;  // of the bounding box, lists: width / list width + height / list height
    double area = 0;   // of the ellipse, lists
};

/// The share of a height around y that lies in the rows of a band.
double share_of(const Band& band, double y, double height) {
    if (band.rows == 0) return 1;
    const double low = std::max(y - height / 2, double(band.first)),
                 high = std::min(y + height / 2, double(band.first + band.rows));
    return std::max(high - low, 0.0) / height;
}

/// Adds the ellipse {alpha >= ALPHA_MIN} of a splat that has at least this opacity, as far as it lies in the band. list: width and
/// height in px of what has a list.
void add_footprint(Footprints& sum, const SeenSplat& f, double least_opacity, const Camera& camera,
                   const glm::dvec2& list, const Band& band) {
    const double opacity = std::max(f.opacity, least_opacity);
    const double reach = 2 * std::log(opacity / shared::ALPHA_MIN);  // squared, in standard deviations
    if (!(reach > 0)) return;
    const double width = std::min(2 * std::sqrt(reach * f.a), double(camera.width)),
                 height = std::min(2 * std::sqrt(reach * f.c), double(camera.height));
    const double area = std::min(std::numbers::pi * reach * standard_area(f), 0.785 * width * height);
    const double share = share_of(band, f.y, height);
    sum.splats += share;
    sum.sides += share * (width / list.x + height / list.y);
    sum.area += share * area / (list.x * list.y);
}

std::vector<SampledView> sampled_views(const Gaussians& start, const Dataset& dataset,
                                       const std::vector<int>& frames, size_t stride) {
    std::vector<SampledView> views(std::min(frames.size(), kViews));
    core::on_all_cores(views.size(), [&](size_t v) {
        views[v].camera = &dataset.frames[size_t(frames[v * frames.size() / views.size()])].camera;
        views[v].seen.reserve(start.size() / stride + 1);
        for (size_t i = 0; i < start.size(); i += stride)
            if (const auto footprint = project(start, i, *views[v].camera))
                views[v].seen.push_back(*footprint);
    });
    return views;
}

/// Mean over the views and their pixels. The integral of a splat's alpha is opacity times 2 pi times its standard area.
double optical_depth(const std::vector<SampledView>& views, size_t stride) {
    double sum = 0;
    for (const SampledView& view : views) {
        double alphas = 0;
        for (const SeenSplat& f : view.seen) alphas += f.opacity * 2 * std::numbers::pi * standard_area(f);
        sum += alphas * double(stride) / (double(view.camera->width) * view.camera->height);
    }
    return sum / double(views.size());
}

/// The parts of a view that ranks draw.
std::vector<Band> bands_of(const passes::KernelConfig& config, uint32_t height, int bands) {
    std::vector<Band> all;
    for (int band = 0; bands > 1 && band < bands; ++band)
        all.push_back(band_of(config, height, uint32_t(bands), uint32_t(band)));
    return all.empty() ? std::vector<Band>(1) : all;
}

/// The splats at the end: with mcmc as many as its schedule makes, with adc at most.
uint32_t final_splats(size_t start, const TrainOptions& options) {
    const Schedule schedule = schedule_for(options);
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
                photo_bytes_of(frame, frame.camera.width >> h, frame.camera.height >> h, options.loss);
            if (cached + bytes <= cache_share(options, h))
                cached += bytes;
            else
                other = std::max(other, bytes);
        }
        sum += cached + other;
    }
    return sum;
}

}  // namespace

struct MemoryEstimator::Sample {
    size_t stride;  // between splats
    std::vector<SampledView> views;
    bool opaque;

    Sample(const Gaussians& start, const Dataset& dataset, const std::vector<int>& frames)
        : stride(start.size() / kSplats + 1),
          views(sampled_views(start, dataset, frames, stride)),
          opaque(optical_depth(views, stride) > kOpaque) {}
};

MemoryEstimator::MemoryEstimator(const passes::KernelConfig& config, const Dataset& dataset,
                                 const std::vector<int>& frames, const Gaussians& start,
                                 const TrainOptions& options)
    : config_(config), dataset_(dataset), frames_(frames), start_(start), options_(options) {}

MemoryEstimator::~MemoryEstimator() = default;

/// Pairs of a splat and a list, of the image that has most of them, for `splats` splats that descend from the first ones. list_side:
/// tiles along a side of what has a list.
/// - A convex shape at a random place of a grid touches 1 + sides + area cells in the mean.
/// - Splats that multiply share what their parents covered, but not all of it: sides shrink with a power of the number,
///   areas with its square.
uint64_t MemoryEstimator::pairs(uint32_t splats, uint32_t list_side) {
    if (!sample_) sample_ = std::make_unique<const Sample>(start_, dataset_, frames_);
    const glm::dvec2 list(list_side * config_.tile_width, list_side * config_.tile_height);
    const bool opaque = sample_->opaque;
    const double growth = opaque ? 1 : double(splats) / double(start_.size());
    const double shrink = std::pow(growth, options_.strategy == Strategy::mcmc ? -kMcmcShrink : -kAdcShrink);
    std::vector<double> of_view(sample_->views.size());
    core::on_all_cores(of_view.size(), [&](size_t v) {
        const SampledView& view = sample_->views[v];
        for (const Band& band : bands_of(config_, uint32_t(view.camera->height), options_.bands)) {
            Footprints sum;
            for (const SeenSplat& f : view.seen)
                add_footprint(sum, f, opaque ? 0 : kLeastOpacity, *view.camera, list, band);
            const double seen = sum.splats + shrink * sum.sides + shrink * shrink * sum.area;
            of_view[v] = std::max(of_view[v], seen * double(sample_->stride) * growth);
        }
    });
    const double most = of_view.empty() ? 0 : std::ranges::max(of_view);
    return std::clamp<uint64_t>(uint64_t(most * kCapacity), first_capacity(start_.size()), kMostPairs);
}

MemoryEstimate MemoryEstimator::up_to(uint32_t max_splats) {
    TrainOptions options = options_;
    options.final_splats = thins_at_end(options_) ? max_splats : 0;
    options.max_splats = max_splats;
    const bool grows = options.strategy != Strategy::none;
    const bool cut =
        std::ranges::any_of(frames_, [&](int index) { return may_be_cut(dataset_.frames[size_t(index)]); });
    const Plan plan = plan_for(plan_request(start_, options, false, SIZE_MAX, cut));
    MemoryEstimate estimate;
    estimate.splats = final_splats(start_.size(), options);
    const uint64_t array = parameter_bytes(estimate.splats, start_.sh_degree);
    estimate.model =
        (1 + uint64_t(plan.moment_buffers())) * array + (plan.statistics ? 8ull * estimate.splats : 0);
    FrameRequest any = frame_request(plan, 1, 1);
    any.splats = estimate.splats;
    const auto instances_needed = uint32_t(pairs(estimate.splats, list_side(config_, any)));
    for (const int index : frames_) {
        const Frame& frame = dataset_.frames[size_t(index)];
        uint32_t rows = 0;
        for (const Band& band : bands_of(config_, uint32_t(frame.camera.height), options.bands))
            rows = std::max(rows, band.rows);
        FrameRequest request = frame_request(plan, uint32_t(frame.camera.width),
                                             rows > 0 ? rows : uint32_t(frame.camera.height));
        request.splats = estimate.splats;
        request.instances = instances_needed;
        request.masks = frame.alpha_weighs();
        request.readouts = frame.camera.readout.has_value();
        const Sizes sizes = sizes_for(config_, request);
        const uint64_t instances = sizes.overlay + 2 * sizes.instance_words;
        const uint64_t second = grows ? array + kRefineBytes * estimate.splats : 0;
        estimate.frame = std::max(estimate.frame, sizes.total() - instances + std::max(instances, second));
    }
    // Largest weights are found in a list of the splats that a view shows.
    if (options.batch > 1 || options.bands > 1 || plan.pruned)
        estimate.frame +=
            ViewBuffers::most_bytes(plan, estimate.splats, uint64_t(options.batch), uint64_t(options.bands));
    estimate.images = image_bytes(dataset_, frames_, options);
    estimate.images += 3 * 4ull * row_floats(plan.appearance) * frames_.size();  // with both moments
    return estimate;
}

}  // namespace ewa::train
