// SPDX-License-Identifier: Apache-2.0
// A training: what it needs before it begins, its steps, and what it tells of itself.
#include "ewa/trainer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <exception>
#include <glm/geometric.hpp>
#include <utility>

#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "portions/collect.h"
#include "train/memory_estimate.h"
#include "train/splat_cap.h"
#include "train/trainer_state.h"

namespace ewa {

using namespace pipeline;
using train::Call;

namespace {

using Clock = std::chrono::steady_clock;

double milliseconds(Clock::duration time) {
    return std::chrono::duration<double, std::milli>(time).count();
}

/// The length that rates and thresholds are relative to: the extent of the cameras. Cameras in one place (a
/// panorama, a single image) have no extent; then it is the median distance of the splats from them.
double extent_for(const Dataset& dataset, const std::vector<int>& frames, const Gaussians& start) {
    const double extent = scene_extent(dataset, frames);
    if (extent > 0) return extent;
    const glm::dvec3 eye = dataset.frames[size_t(frames.front())].camera.position();
    std::vector<double> distances;
    for (size_t i = 0; i < start.size(); ++i) {
        const double distance = glm::length(start.world_mean(i) - eye);
        if (std::isfinite(distance) && distance > 0) distances.push_back(distance);
    }
    if (distances.empty()) return 1;
    const auto middle = distances.begin() + std::ptrdiff_t(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    return *middle;
}

/// Sorts splats so that neighbours in space are neighbours in memory: a tile then reads contiguous splats.
/// ADC keeps that order, since children are stored beside their parent; MCMC loses it gradually. Means become
/// relative to an origin near them. Quaternions far from unit length are normalised: the learning rate
/// assumes about 1.
/// Opacities are fitted to the kernel.
Gaussians prepared(Gaussians start, Footprint kernel) {
    fit_opacities(start, kernel == Footprint::density);
    select_splats(start, morton_order(start));
    settle_origin(start);
    for (size_t i = 0; i < start.size(); ++i) {
        float* q = &start.quaternions[4 * i];
        const double largest = std::max({std::abs(q[0]), std::abs(q[1]), std::abs(q[2]), std::abs(q[3])});
        if (!(largest > 0 && std::isfinite(largest)) || (largest > 0.1 && largest < 10)) continue;
        double sum = 0;
        for (int k = 0; k < 4; ++k) sum += (q[k] / largest) * (q[k] / largest);
        for (int k = 0; k < 4; ++k) q[k] = float(q[k] / largest / std::sqrt(sum));
    }
    return start;
}

/// Throws InputError unless each band of each image has a row of tiles. images: of the lowest resolution.
void check_bands(const TrainOptions& options, const passes::KernelConfig& config,
                 const train::ImageCache& images) {
    for (size_t i = 0; i < images.count(); ++i) {
        const uint32_t height = images.camera(i).height;
        const uint32_t most = (height + config.tile_height - 1) / config.tile_height;
        if (uint32_t(options.bands) > most)
            throw InputError("--bands " + std::to_string(options.bands) + ": an image with " +
                             std::to_string(height) + " rows of pixels takes at most --bands " +
                             std::to_string(most));
    }
}

/// Limits a device's memory for as long as the trainer is made, or longer if that succeeds.
class LimitedMemory {
  public:
    LimitedMemory(std::shared_ptr<gpu::Device> device, uint64_t bytes)
        : device_(bytes > 0 ? std::move(device) : nullptr) {
        if (device_) device_->limit_memory(bytes, {});
    }
    ~LimitedMemory() {
        if (device_ && !kept_) device_->limit_memory(0, {});
    }
    LimitedMemory(const LimitedMemory&) = delete;
    LimitedMemory& operator=(const LimitedMemory&) = delete;
    void keep() { kept_ = true; }

  private:
    std::shared_ptr<gpu::Device> device_;
    bool kept_ = false;
};

/// The number of rank 0. Devices of other ranks may have more or less memory. Collective.
uint32_t agreed(Ranks& ranks, uint32_t own) {
    const uint64_t word = own;
    return uint32_t(ranks.gather(std::span(&word, 1)).front());
}

}  // namespace

Trainer::State::State(std::shared_ptr<gpu::Device> d, const Dataset& dataset, const std::vector<int>& frames,
                      const Gaussians& ready, double length, const TrainOptions& o, std::shared_ptr<Ranks> r,
                      int portions_of_rank)
    : device(std::move(d)),
      ranks(std::move(r)),
      options(o),
      schedule(train::schedule_for(o, frames.size())),
      extent(length),
      cache(*device),
      executor(*device, cache.config().frames_in_flight),
      images(*device, cache.config(), dataset, frames, train::cache_share(o, 0), ready.origin),
      plan(plan_for(train::plan_request(ready, o, images.any_masked(), frames.size()))),
      portions(*device, ranks, ready,
               {.count = portions_of_rank,
                .limit = o.device_memory_bytes,
                .moments = plan.moment_buffers(),
                .statistics = plan.statistics}),
      several(portions, o.bands),
      // The first frame tells how many there are. With a limit, a capacity for all splats might not fit.
      instance_capacity(first_capacity(portions.streamed() ? 0 : ready.size())) {
    for (int halvings = 1; halvings <= o.halvings; ++halvings)
        smaller.emplace_back(*device, cache.config(), dataset, frames, train::cache_share(o, halvings),
                             ready.origin, 1 << halvings);
    if (plan.exposure) exposures = Exposures(*device, images.count());
    if (plan.motion) {
        std::vector<MotionBasis> bases;
        for (const int frame_index : frames)
            bases.push_back(
                motion_basis(dataset.frames[size_t(frame_index)].camera, ready, o.refine_focal, extent));
        motions = Motions(*device, bases);
    }
    report.splats = portions.splats();
    check_bands(o, cache.config(), smaller.empty() ? images : smaller.back());
}

void Trainer::State::call(Call what) const {
    const auto word = uint64_t(what);
    if (ranks->size() > 1) ranks->gather(std::span(&word, 1));
}

Call Trainer::State::next_call() const {
    const uint64_t none = 0;
    return Call(ranks->gather(std::span(&none, 1)).front());
}

Trainer::Trainer(std::shared_ptr<gpu::Device> device, const Dataset& dataset,
                 const std::vector<int>& train_frames, Gaussians start, const TrainOptions& options,
                 std::shared_ptr<Ranks> ranks) {
    if (train_frames.empty())
        throw InputError("there is no training image; a larger --test-every leaves more of them");
    train::check_start(start.size(), options);
    train::check_training(options, ranks->size());
    const double extent = extent_for(dataset, train_frames, start);
    TrainOptions resolved = resolve(options, dataset);
    resolved.max_splats = agreed(*ranks, splat_cap(*device, dataset, train_frames, start, resolved).splats);
    const auto count = int(agreed(*ranks, uint32_t(train::portions_for(*device, dataset, train_frames, start,
                                                                       resolved, ranks->size()))));
    if (resolved.device_memory_bytes > 0 && device->memory_limit() > 0)
        throw InputError(
            "another training has limited this device's memory: a device takes one such training");
    LimitedMemory limited(device, resolved.device_memory_bytes);
    if (count > 1) resolved.image_cache_bytes = train::limited_cache(resolved);
    state_ = std::make_unique<State>(std::move(device), dataset, train_frames,
                                     prepared(std::move(start), options.render.kernel), extent, resolved,
                                     std::move(ranks), count);
    limited.keep();
}

Trainer::~Trainer() {
    if (state_ && state_->options.device_memory_bytes > 0) state_->device->limit_memory(0, {});
    // After an exception the other ranks may be in the middle of something else.
    if (!state_ || state_->ranks->rank() != 0 || std::uncaught_exceptions() > 0) return;
    try {
        state_->call(Call::end);
    } catch (const std::exception&) {
        // A rank that does not answer has ended.
    }
}

void Trainer::follow() {
    for (;;) switch (state_->next_call()) {
            case Call::end:
                return;
            case Call::wait:
                break;
            case Call::step:
                take_step();
                break;
            case Call::state:
                join_state(nullptr);
                break;
            case Call::restore:
                share_state(nullptr);
                break;
            case Call::gaussians:
                join_gaussians();
                break;
            case Call::render:
                join_renders({});
                break;
            case Call::figures:
                join_figures();
                break;
        }
}

void Trainer::keep_waiting() const {
    state_->call(Call::wait);
}

StepReport Trainer::step() {
    state_->call(Call::step);
    return take_step();
}

StepReport Trainer::take_step() {
    State& s = *state_;
    const auto start = Clock::now();
    const int first = s.report.step + 1, last = std::min(s.report.step + s.options.batch, s.options.steps);
    s.optimise(first, last);
    const auto optimised = Clock::now();
    for (int step = first; step <= last; ++step) s.follow_up(step);
    const auto end = Clock::now();
    s.report.step = last;
    s.report.splats = s.portions.splats();
    s.most_own_bytes = std::max(s.most_own_bytes, s.portions.state_bytes(s.portions.own_splats()));
    s.report.seconds += std::chrono::duration<double>(end - start).count();
    s.times.steps += last - first + 1;
    s.times.step += milliseconds(end - start);
    s.times.refinement += milliseconds(end - optimised);
    return s.report;
}
std::vector<Exposure> Trainer::exposures() const {
    state_->finish_all();
    return state_->plan.exposure ? state_->exposures.download() : std::vector<Exposure>();
}
std::vector<CameraMotion> Trainer::camera_motions() const {
    state_->finish_all();
    return state_->plan.motion ? state_->motions.download() : std::vector<CameraMotion>();
}
uint32_t Trainer::splats() const {
    return state_->portions.splats();
}
uint32_t Trainer::max_splats() const {
    return state_->options.max_splats;
}
size_t Trainer::images_on_disk() const {
    return state_->images.on_disk();
}
int Trainer::steps_done() const {
    return state_->report.step;
}

StepReport Trainer::report() const {
    state_->finish_all();
    return state_->report;
}

double Trainer::extent() const {
    return state_->extent;
}

std::vector<PlanLine> Trainer::plan() const {
    return describe(state_->plan, state_->portions.sh_degree(), state_->portions.splats());
}

StepTimes Trainer::step_times() const {
    const State& s = *state_;
    StepTimes times = s.times;
    times.step /= std::max(1, times.steps);
    times.refinement /= std::max(1, times.steps);
    for (PassTime& time : times.passes) time.milliseconds /= std::max(1, s.timed_steps);
    return times;
}
std::vector<PlanLine> plan_lines(const Gaussians& start, const TrainOptions& options, bool masks) {
    const Plan plan = plan_for(train::plan_request(start, options, masks));
    return describe(plan, start.sh_degree, start.size());
}

}  // namespace ewa
