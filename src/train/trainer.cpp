// SPDX-License-Identifier: Apache-2.0
// One training step: its training image, its rates, one submission, and what the schedule does after it. Also what
// a training needs before it begins: its plan and an estimate of its memory.
#include "ewa/trainer.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstring>
#include <deque>
#include <exception>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "core/random.h"
#include "ewa/error.h"
#include "ewa/splat_edit.h"
#include "gpu/executor.h"
#include "pipeline/backward.h"
#include "pipeline/frame_buffers.h"
#include "pipeline/share.h"
#include "pipeline/strategy.h"
#include "train/batch.h"
#include "train/collect.h"
#include "train/image_cache.h"
#include "train/run_input.h"
#include "train/schedule.h"

namespace ewa {
namespace {

using namespace pipeline;
using Clock = std::chrono::steady_clock;

constexpr int kTimedEvery = 100;  // steps, where several are in flight
// Of the threshold that adds splats, with points: edges of opaque spheres have larger gradients than soft footprints.
constexpr float kPointsThreshold = 8;
constexpr double kResetOpacity = 0.01;  // 3DGS: upper bound of opacities after a reset

double milliseconds(Clock::duration time) {
    return std::chrono::duration<double, std::milli>(time).count();
}

double logit(double p) {
    return std::log(p / (1 - p));
}

std::array<float, 3> random_background(int step, uint64_t seed) {
    const auto u = core::uniform4({uint32_t(step), 0x62636b67u, uint32_t(seed), uint32_t(seed >> 32)});
    return {float(u[0]), float(u[1]), float(u[2])};
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

/// A rank's part of the first splats.
Gaussians share_of(Gaussians start, const Ranks& ranks) {
    if (ranks.size() == 1) return start;
    check_share(uint32_t(start.size()), ranks.size());
    const Range range = range_of(uint32_t(start.size()), ranks.rank(), ranks.size());
    std::vector<uint32_t> indices(range.splats);
    std::iota(indices.begin(), indices.end(), range.first);
    select_splats(start, indices);
    return start;
}

/// What rank 0 asks the others to take part in.
enum class Call : uint64_t { end, wait, step, state, restore, gaussians, figures };

}  // namespace

struct Trainer::State {
    std::shared_ptr<gpu::Device> device;
    std::shared_ptr<Ranks> ranks;
    TrainOptions options;
    train::Schedule schedule;
    double extent;
    passes::PassCache cache;
    gpu::Executor executor;
    train::ImageCache images;
    const Plan plan;
    Model model;
    FrameBuffers frame;
    std::vector<train::ImageCache> smaller;  // by downsample level, from 1; freed after its last step
    Exposures exposures;
    Motions motions;
    uint32_t instance_capacity;
    /// A step that is submitted and not finished.
    struct Flight {
        int step;
        double weight;  // of its image's pixels
    };
    std::deque<Flight> in_flight;
    StepReport report;
    StepTimes times;  // sums, over `timed_steps` steps for the passes
    int timed_steps = 0;
    std::optional<train::Batch> batch;  // empty: a step has one view
    uint64_t most_own_bytes = 0;        // of the state that this rank has held after a step

    State(std::shared_ptr<gpu::Device> d, const Dataset& dataset, const std::vector<int>& frames,
          const Gaussians& ready, double length, const TrainOptions& o, std::shared_ptr<Ranks> r)
        : device(std::move(d)),
          ranks(std::move(r)),
          options(o),
          schedule(train::schedule_for(o)),
          extent(length),
          cache(*device),
          executor(*device, cache.config().frames_in_flight),
          images(*device, cache.config(), dataset, frames, train::cache_share(o, 0), ready.origin),
          plan(plan_for(train::plan_request(ready, o, images.any_masked()))),
          model(upload_model(*device, share_of(ready, *ranks), plan.moment_buffers(), plan.statistics)),
          instance_capacity(first_capacity(ready.size())) {
        for (int halvings = 1; halvings <= o.halvings; ++halvings)
            smaller.emplace_back(*device, cache.config(), dataset, frames, train::cache_share(o, halvings),
                                 model.origin, 1 << halvings);
        if (plan.exposure) exposures = Exposures(*device, images.count());
        if (plan.motion) {
            std::vector<MotionBasis> bases;
            for (const int frame_index : frames)
                bases.push_back(
                    motion_basis(dataset.frames[size_t(frame_index)].camera, ready, o.refine_focal, extent));
            motions = Motions(*device, bases);
        }
        take_share(uint32_t(ready.size()));
        report.splats = model.share.all;
        if (o.batch > 1 || ranks->size() > 1) batch.emplace(ranks);
    }

    /// Notes which splats of `all` the model has.
    void take_share(uint32_t all) {
        model.share = {ranks, range_of(all, ranks->rank(), ranks->size()).first, all};
    }

    /// Of rank 0: begins what all ranks do together.
    void call(Call what) const {
        const auto word = uint64_t(what);
        if (ranks->size() > 1) ranks->gather(std::span(&word, 1));
    }
    /// Of the other ranks: what rank 0 begins.
    Call next_call() const {
        const uint64_t none = 0;
        return Call(ranks->gather(std::span(&none, 1)).front());
    }

    Rates rates(int step) const {
        Rates r;
        r.mean = float(schedule.mean_rate(step, extent));
        r.opacity = float(options.opacity_rate);
        r.quaternion = float(options.quaternion_rate);
        r.scale = float(options.scale_rate);
        r.sh0 = float(options.sh0_rate);
        r.sh_rest = float(schedule.sh_rest_rate);
        r.step = uint32_t(step);
        r.seed = options.seed;
        if (plan.regularised) {
            r.opacity_weight = float(options.opacity_weight / model.share.all);
            r.scale_weight = float(options.scale_weight / (3.0 * model.share.all * extent));
        }
        return r;
    }

    Noise noise(int step) const {
        // Sigma is a square of lengths. Divided by the extent it is a length again, as in a scene of unit extent.
        const double amplitude = options.noise_rate * schedule.mean_rate(step, 1) / extent;
        return {.amplitude = float(amplitude),
                .max_length = float(extent),
                .seed = options.seed,
                .step = uint32_t(step)};
    }

    /// The training images at this step's resolution. Frees those of lower resolutions: resolutions only rise.
    train::ImageCache& images_at(int step) {
        const size_t halvings = size_t(schedule.halvings_at(step));
        if (smaller.size() > halvings) finish_all();
        while (smaller.size() > halvings) smaller.pop_back();
        return halvings == 0 ? images : smaller.back();
    }

    /// What a step needs of the frame's buffers.
    FrameRequest request_of(const CameraUse& camera) const {
        return {.splats = model.splats,
                .width = camera.width,
                .height = camera.height,
                .instances = instance_capacity,
                .gradients = true,
                .masks = plan.masks,
                .exposure = plan.exposure,
                .overlaid = true,
                .motion = plan.motion};
    }

    MotionUse motion_of(int step, size_t index, uint32_t visit) const {
        return {.motions = &motions,
                .photo = uint32_t(index),
                .rate = float(schedule.pose_rate(step)),
                .extent = float(extent),
                .visit = visit};
    }

    /// All that changes from step to step is a pure function of the step's number: a step can be repeated.
    void record_step(gpu::Recording& recording, int step, size_t index, const train::ImageCache::Photo& photo,
                     const CameraUse& camera) {
        const uint32_t visit = uint32_t(size_t(step - 1) / images.count() + 1);
        const ExposureUse exposure{&exposures, uint32_t(index), float(schedule.exposure_rate(step)), visit};
        const MotionUse motion = motion_of(step, index, visit);
        const FrameInputs inputs{
            .camera =
                plan.motion ? record_move_camera(recording, cache, motions, uint32_t(index), camera) : camera,
            .background =
                options.random_background ? random_background(step, options.seed) : options.render.background,
            .keep_overflow = !in_flight.empty(),
            .sh_degree = schedule.degree(step)};
        const Sorted sorted = record_forward(recording, cache, plan, model, frame, inputs);
        record_loss(recording, cache, frame, inputs, photo.texels, photo.masked,
                    plan.exposure ? &exposure : nullptr);
        record_backward(recording, cache, plan, model, frame, inputs, sorted, rates(step),
                        plan.motion ? &motion : nullptr);
        if (options.strategy == Strategy::mcmc) record_noise(recording, cache, model, frame, noise(step));
    }

    /// Submits a step. Afterwards at most frames_in_flight steps are in flight.
    void submit(int step) {
        train::ImageCache& seen = images_at(step);
        const size_t index = train::frame_of_step(step, images.count(), options.seed);
        const CameraUse camera = seen.camera(index);
        // Buffers of another size, and an image from disk, take the place of what a step in flight reads.
        if (!seen.cached(index) || camera.width != frame.sizes.width || camera.height != frame.sizes.height)
            finish_all();
        while (in_flight.size() >= cache.config().frames_in_flight) finish_oldest();
        const auto& photo = seen.photo(index);
        if (schedule.halvings_at(step + 1) == schedule.halvings_at(step))
            seen.prepare(train::frame_of_step(step + 1, images.count(), options.seed));
        if (in_flight.empty()) frame.reserve(cache.device(), cache.config(), request_of(camera));
        gpu::Recording recording(device->limits());
        record_step(recording, step, index, photo, camera);
        frame.record_counts(recording, slot_of(step));
        executor.submit(recording, is_timed(step));
        in_flight.push_back({step, photo.weight});
        // An image from disk may be gone when its step has to be repeated: no other step follows before it is done.
        if (!seen.cached(index)) finish_all();
    }

    /// Where steps overlap, the queries between the commands would cost time.
    bool is_timed(int step) const { return cache.config().frames_in_flight == 1 || step % kTimedEvery == 1; }
    uint32_t slot_of(int step) const { return uint32_t(step) % cache.config().frames_in_flight; }

    /// Waits for the oldest step. If it had too many instances, neither it nor later ones have changed the model: they are
    /// all repeated, one by one, with more capacity.
    void finish_oldest() {
        const auto [step, weight] = in_flight.front();
        executor.wait();
        const shared::Counts counts = frame.read_counts(slot_of(step));
        if (counts.instances > frame.instance_capacity) {
            const std::deque<Flight> again = std::exchange(in_flight, {});
            while (executor.unfinished()) executor.wait();
            instance_capacity = grown_capacity(counts.instances);
            for (const Flight& repeated : again) {
                submit(repeated.step);
                finish_all();
            }
            return;
        }
        in_flight.pop_front();
        report.loss = loss_of(counts);
        report.psnr = -10 * std::log10(double(counts.squared) / weight);
        report.skipped_nonfinite = counts.skipped_nonfinite;
        report.dropped_updates += counts.dropped_updates;
        report.limited_steps += counts.limited_steps;
        if (!is_timed(step)) return;
        ++timed_steps;
        add_pass_times();
    }

    void add_pass_times() {
        for (const PassTime& time : executor.timings()) {
            const auto same = std::find_if(times.passes.begin(), times.passes.end(),
                                           [&](const PassTime& sum) { return sum.pass == time.pass; });
            if (same == times.passes.end())
                times.passes.push_back(time);
            else
                same->milliseconds += time.milliseconds;
        }
    }

    void finish_all() {
        while (!in_flight.empty()) finish_oldest();
    }

    /// Whether something happens after a step that needs its result.
    bool must_finish(int step) const {
        return step == options.steps || (options.strategy == Strategy::mcmc && schedule.relocates(step)) ||
               (options.strategy == Strategy::adc &&
                (schedule.densifies(step) || schedule.resets_opacity(step)));
    }

    void optimise(int step) {
        submit(step);
        if (must_finish(step) || cache.config().frames_in_flight == 1) finish_all();
    }

    train::BatchView view_of(int step, train::ImageCache& seen, int sh_degree) {
        const size_t index = train::frame_of_step(step, images.count(), options.seed);
        const CameraUse camera = seen.camera(index);
        const FrameInputs inputs{.camera = camera,
                                 .background = options.random_background
                                                   ? random_background(step, options.seed)
                                                   : options.render.background,
                                 .sh_degree = sh_degree};
        const ExposureUse exposure{&exposures, uint32_t(index), float(schedule.exposure_rate(step)),
                                   uint32_t(size_t(step - 1) / images.count() + 1)};
        const auto weight = std::make_shared<double>(1);
        return {.inputs = inputs,
                .request = request_of(camera),
                .record_loss =
                    [this, inputs, exposure, weight, index, &seen](gpu::Recording& recording) {
                        const auto& photo = seen.photo(index);
                        *weight = photo.weight;
                        record_loss(recording, cache, frame, inputs, photo.texels, photo.masked,
                                    plan.exposure ? &exposure : nullptr);
                    },
                .psnr =
                    [weight](const shared::Counts& counts) {
                        return -10 * std::log10(double(counts.squared) / *weight);
                    }};
    }

    /// A step of several views, of which `last` is the last.
    void optimise_batch(int first, int last) {
        train::ImageCache& seen = images_at(first);
        const int sh_degree = schedule.degree(first);
        std::vector<train::BatchView> views;
        for (int step = first; step <= last; ++step) views.push_back(view_of(step, seen, sh_degree));
        const train::BatchParts parts{
            cache, executor, plan, model, frame, instance_capacity, [this] { add_pass_times(); }};
        train::BatchReport drawn = batch->draw(parts, views);
        Rates of_step = rates(last);
        of_step.views = uint32_t(views.size());
        Noise of_noise = noise(last);
        of_noise.amplitude *= float(std::sqrt(double(views.size())));
        const auto more = [&](gpu::Recording& recording) {
            if (options.strategy == Strategy::mcmc) record_noise(recording, cache, model, frame, of_noise);
        };
        batch->update(parts, batch_rates(of_step), model.share.first, sh_degree, more, drawn);
        timed_steps += int(views.size());
        report.loss = drawn.loss;
        report.psnr = drawn.psnr;
        report.skipped_nonfinite = uint32_t(drawn.skipped_nonfinite);
        report.dropped_updates += drawn.dropped_updates;
        report.limited_steps += drawn.limited_steps;
    }

    void follow_up(int step) {
        if (options.strategy == Strategy::adc) control_density(step);
        if (options.strategy != Strategy::mcmc || !schedule.relocates(step)) return;
        frame.free_instances();  // the second copy of an array takes its place
        refine_mcmc(cache, executor, model, frame,
                    {.dead_opacity = options.dead_opacity,
                     .growth = schedule.growth,
                     .max_splats = options.max_splats,
                     .spread = schedule.copy_spread,
                     .kernel = options.render.kernel,
                     .seed = options.seed,
                     .step = uint32_t(step)});
    }

    void control_density(int step) {
        if (schedule.densifies(step)) {
            DensifyRules rules;
            rules.grow_gradient =
                float(plan.absolute ? options.grow_gradient_absolute : options.grow_gradient);
            if (options.render.points) rules.grow_gradient *= kPointsThreshold;
            rules.revised_opacity = options.revised_opacity;
            rules.split_scale = float(options.split_scale * extent);
            rules.prune_logit = options.render.points ? -std::numeric_limits<float>::infinity()
                                                      : float(logit(options.prune_opacity));
            rules.prune_scale = schedule.was_reset(step) ? float(options.prune_scale * extent) : 0.0f;
            rules.seed = options.seed;
            rules.step = uint32_t(step);
            rules.max_splats = options.max_splats;
            frame.free_instances();  // the second copy of an array takes its place
            densify(cache, executor, model, frame, rules);
        }
        if (schedule.resets_opacity(step)) {
            gpu::Recording recording(device->limits());
            record_reset_opacity(recording, cache, model, float(logit(kResetOpacity)));
            executor.run(recording);
        }
    }
};

Trainer::Trainer(std::shared_ptr<gpu::Device> device, const Dataset& dataset,
                 const std::vector<int>& train_frames, Gaussians start, const TrainOptions& options,
                 std::shared_ptr<Ranks> ranks) {
    if (train_frames.empty())
        throw InputError("there is no training image; a larger --test-every leaves more of them");
    train::check_start(start.size(), options);
    train::check_training(options, ranks->size());
    const double extent = extent_for(dataset, train_frames, start);
    state_ = std::make_unique<State>(std::move(device), dataset, train_frames,
                                     prepared(std::move(start), options.render.kernel), extent,
                                     resolve(options, dataset), std::move(ranks));
}

Trainer::~Trainer() {
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
                join_state();
                break;
            case Call::restore:
                share_state({});
                break;
            case Call::gaussians:
                join_gaussians();
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
    if (s.batch)
        s.optimise_batch(first, last);
    else
        s.optimise(first);
    const auto optimised = Clock::now();
    for (int step = first; step <= last; ++step) s.follow_up(step);
    const auto end = Clock::now();
    s.report.step = last;
    s.report.splats = s.model.share.all;
    uint64_t bytes = 0;
    for (const gpu::Buffer* buffer :
         {&s.model.params, &s.model.moments1, &s.model.moments2, &s.model.statistics})
        bytes += buffer->bytes();
    s.most_own_bytes = std::max(s.most_own_bytes, bytes);
    s.report.seconds += std::chrono::duration<double>(end - start).count();
    s.times.steps += last - first + 1;
    s.times.step += milliseconds(end - start);
    s.times.refinement += milliseconds(end - optimised);
    return s.report;
}

namespace {

struct NamedBuffer {
    const char* name;
    gpu::Buffer* buffer;
    uint64_t bytes;
    gpu::Texel texel;
};

/// The buffers that a run of `splats` splats keeps from step to step.
std::vector<NamedBuffer> buffers_of(const Plan& plan, Model& model, Exposures& exposures, Motions& motions,
                                    uint32_t splats) {
    const uint64_t bytes = parameter_bytes(splats, model.sh_degree);
    std::vector<NamedBuffer> buffers{{"params", &model.params, bytes, gpu::Texel::rgba32f},
                                     {"moments1", &model.moments1, bytes, gpu::Texel::rgba32ui}};
    if (plan.moment_buffers() > 1)
        buffers.push_back({"moments2", &model.moments2, bytes, gpu::Texel::rgba32ui});
    if (plan.statistics)
        buffers.push_back({"statistics", &model.statistics, 8ull * splats, gpu::Texel::none});
    if (plan.exposure)
        for (const auto& [name, buffer] : {std::pair{"exposures", &exposures.values},
                                           {"exp_moments1", &exposures.moments1},
                                           {"exp_moments2", &exposures.moments2}})
            buffers.push_back({name, buffer, exposures.bytes(), gpu::Texel::none});
    if (plan.motion)
        for (const auto& [name, buffer] : {std::pair{"motions", &motions.values},
                                           {"motion_moments1", &motions.moments1},
                                           {"motion_moments2", &motions.moments2}})
            buffers.push_back({name, buffer, motions.bytes(), gpu::Texel::none});
    if (plan.motion)
        buffers.push_back({"motion_bases", &motions.bases, motions.basis_bytes(), gpu::Texel::none});
    return buffers;
}

}  // namespace

TrainerState Trainer::state() const {
    state_->call(Call::state);
    return join_state();
}

TrainerState Trainer::join_state() const {
    State& s = *state_;
    s.finish_all();
    TrainerState state{s.report, s.model.sh_degree, {}};
    for (const NamedBuffer& named : buffers_of(s.plan, s.model, s.exposures, s.motions, s.model.capacity))
        state.arrays.push_back(
            {named.name, train::joined(*s.ranks, named.buffer->download<std::byte>(named.bytes))});
    const auto origin = std::as_bytes(std::span(&s.model.origin, 1));
    if (s.model.origin != glm::dvec3(0)) state.arrays.push_back({"origin", {origin.begin(), origin.end()}});
    return state;
}

void Trainer::restore(const TrainerState& state) {
    State& s = *state_;
    const uint32_t splats = state.report.splats;
    if (state.sh_degree != s.model.sh_degree || state.report.step > s.options.steps ||
        splats > s.options.max_splats || splats == 0)
        throw InputError(
            "the state does not fit this training: another SH degree, more steps or more splats");
    const auto buffers = buffers_of(s.plan, s.model, s.exposures, s.motions, splats);
    const bool moved = !state.arrays.empty() && state.arrays.back().name == "origin";
    glm::dvec3 origin(0);
    if (moved && state.arrays.back().bytes.size() == sizeof(origin))
        std::memcpy(&origin, state.arrays.back().bytes.data(), sizeof(origin));
    if (origin != s.model.origin)
        throw InputError("the state does not fit this training: its means are relative to another origin");
    if (state.arrays.size() != buffers.size() + moved)
        throw InputError(
            "the state does not fit this training: it is of another strategy or has moments of other bits");
    for (size_t i = 0; i < buffers.size(); ++i)
        if (state.arrays[i].name != buffers[i].name || state.arrays[i].bytes.size() != buffers[i].bytes)
            throw InputError("the state does not fit this training: it lacks " +
                             std::string(buffers[i].name) + " of " + std::to_string(splats) + " splats");
    s.call(Call::restore);
    share_state(state);
}

void Trainer::share_state(const TrainerState& state) {
    State& s = *state_;
    const int rank = s.ranks->rank(), ranks = s.ranks->size();
    s.finish_all();
    StepReport report = state.report;
    if (ranks > 1) {
        const auto own = train::told(*s.ranks, std::as_bytes(std::span(&state.report, 1)));
        std::memcpy(&report, own.data(), sizeof(report));
    }
    check_share(report.splats, ranks);
    const int sh_degree = s.model.sh_degree;
    const glm::dvec3 origin = s.model.origin;
    s.model = {};  // free its memory first
    s.model.splats = s.model.capacity = range_of(report.splats, rank, ranks).splats;
    s.model.sh_degree = sh_degree;
    s.model.origin = origin;
    s.take_share(report.splats);
    const auto bytes_of = [&](int of, size_t array) {
        const uint32_t splats = range_of(report.splats, of, ranks).splats;
        return buffers_of(s.plan, s.model, s.exposures, s.motions, splats)[array].bytes;
    };
    const auto buffers = buffers_of(s.plan, s.model, s.exposures, s.motions, s.model.splats);
    for (size_t i = 0; i < buffers.size(); ++i) {
        *buffers[i].buffer = gpu::Buffer(*s.device, buffers[i].name, buffers[i].bytes, buffers[i].texel);
        if (ranks == 1) {
            buffers[i].buffer->upload(std::span<const std::byte>(state.arrays[i].bytes));
            continue;
        }
        std::vector<uint64_t> sizes;
        for (int of = 0; of < ranks; ++of) sizes.push_back(bytes_of(of, i));
        const std::span<const std::byte> all =
            rank == 0 ? std::span<const std::byte>(state.arrays[i].bytes) : std::span<const std::byte>();
        buffers[i].buffer->upload(std::span<const std::byte>(train::part_of(*s.ranks, all, sizes)));
    }
    s.report = report;
    s.instance_capacity = std::max(s.instance_capacity, first_capacity(report.splats));
}

std::vector<Exposure> Trainer::exposures() const {
    state_->finish_all();
    return state_->plan.exposure ? state_->exposures.download() : std::vector<Exposure>();
}
std::vector<CameraMotion> Trainer::camera_motions() const {
    state_->finish_all();
    return state_->plan.motion ? state_->motions.download() : std::vector<CameraMotion>();
}
Gaussians Trainer::gaussians() const {
    state_->call(Call::gaussians);
    return join_gaussians();
}
Gaussians Trainer::join_gaussians() const {
    State& s = *state_;
    s.finish_all();
    Gaussians gaussians;
    if (s.ranks->size() == 1) {
        gaussians = download_model(s.model, s.model.params);
    } else {
        const auto bytes = train::joined(
            *s.ranks, s.model.params.download<std::byte>(parameter_bytes(s.model.splats, s.model.sh_degree)));
        if (s.ranks->rank() != 0) return gaussians;
        gaussians = gaussians_of(s.model,
                                 {reinterpret_cast<const float*>(bytes.data()), bytes.size() / sizeof(float)},
                                 s.model.share.all);
    }
    gaussians.density = state_->plan.kernel == Footprint::density;
    return gaussians;
}
uint32_t Trainer::splats() const {
    return state_->model.share.all;
}
size_t Trainer::images_on_disk() const {
    return state_->images.on_disk();
}
int Trainer::steps_done() const {
    return state_->report.step;
}

double Trainer::extent() const {
    return state_->extent;
}

std::vector<PlanLine> Trainer::plan() const {
    return describe(state_->plan, state_->model.sh_degree, state_->model.share.all);
}

StepTimes Trainer::step_times() const {
    const State& s = *state_;
    StepTimes times = s.times;
    times.step /= std::max(1, times.steps);
    times.refinement /= std::max(1, times.steps);
    for (PassTime& time : times.passes) time.milliseconds /= std::max(1, s.timed_steps);
    return times;
}

std::vector<RankFigures> Trainer::rank_figures() const {
    if (state_->ranks->size() == 1) return {};
    state_->call(Call::figures);
    return join_figures();
}

std::vector<RankFigures> Trainer::join_figures() const {
    const State& s = *state_;
    const train::Traffic& traffic = s.batch->traffic();
    const double views = std::max(1, s.times.steps);
    const std::array<double, 5> own{double(traffic.sent_bytes) / views, traffic.exchange / views,
                                    traffic.waiting / views, double(s.most_own_bytes),
                                    double(peak_device_bytes(*s.device))};
    const std::vector<uint64_t> all = s.ranks->gather(std::bit_cast<std::array<uint64_t, 5>>(own));
    std::vector<RankFigures> figures;
    for (size_t i = 0; i < all.size(); i += own.size()) {
        const auto value = [&](size_t k) { return std::bit_cast<double>(all[i + k]); };
        figures.push_back(
            {s.ranks->name(int(i / own.size())), value(0), value(1), value(2), value(3), value(4)});
    }
    return figures;
}

std::vector<PlanLine> plan_lines(const Gaussians& start, const TrainOptions& options, bool masks) {
    const Plan plan = plan_for(train::plan_request(start, options, masks));
    return describe(plan, start.sh_degree, start.size());
}

}  // namespace ewa
