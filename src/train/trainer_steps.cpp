// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/random.h"
#include "pipeline/picture.h"
#include "portions/refine.h"
#include "train/trainer_state.h"

namespace ewa {

using namespace pipeline;

namespace {

constexpr int kTimedEvery = 100;  // steps, where several are in flight
// Of the threshold that adds splats, with points: edges of opaque spheres have larger gradients than soft footprints.
constexpr float kPointsThreshold = 8;
constexpr double kResetOpacity = 0.01;  // 3DGS: upper bound of opacities after a reset
double logit(double p) {
    return std::log(p / (1 - p));
}

std::array<float, 3> random_background(int step, uint64_t seed) {
    const auto u = core::uniform4({uint32_t(step), 0x62636b67u, uint32_t(seed), uint32_t(seed >> 32)});
    return {float(u[0]), float(u[1]), float(u[2])};
}

}  // namespace

Rates Trainer::State::rates(int step) const {
    Rates r;
    const double fading = schedule.fading(step), gain = fading * schedule.gain(step);
    r.mean = float(gain * schedule.mean_rate(step, extent));
    r.opacity = float(fading * schedule.opacity_gain(step) * options.opacity_rate);
    r.quaternion = float(gain * options.quaternion_rate);
    r.scale = float(gain * options.scale_rate);
    r.sh0 = float(gain * options.sh0_rate);
    r.sh_rest = float(gain * options.sh_rest_rate);
    r.step = uint32_t(step);
    r.seed = options.seed;
    if (plan.regularised) {
        r.opacity_weight = float(options.opacity_weight / portions.splats());
        r.scale_weight = float(options.scale_weight / (3.0 * portions.splats() * extent));
    }
    return r;
}

Noise Trainer::State::noise(int step) const {
    // Sigma is a square of lengths. Divided by the extent it is a length again, as in a scene of unit extent.
    const double amplitude = options.noise_rate * schedule.mean_rate(step, 1) / extent;
    return {.amplitude = float(amplitude),
            .max_length = float(extent),
            .seed = options.seed,
            .step = uint32_t(step)};
}

train::ImageCache& Trainer::State::images_at(int step) {
    const size_t halvings = size_t(schedule.halvings_at(step));
    if (smaller.size() > halvings) finish_all();
    while (smaller.size() > halvings) smaller.pop_back();
    return halvings == 0 ? images : smaller.back();
}

FrameRequest Trainer::State::request_of(const CameraUse& camera) const {
    return {.splats = portions.largest(),
            .width = camera.width,
            .height = camera.height,
            .instances = instance_capacity,
            .gradients = true,
            .masks = plan.masks,
            .exposure = plan.exposure,
            .overlaid = true,
            .motion = plan.motion};
}

void Trainer::State::record_fused(gpu::Recording& recording, int step, size_t index,
                                  const portions::StepView& view) {
    FrameInputs inputs = view.inputs;
    inputs.keep_overflow = !in_flight.empty();
    if (plan.motion)
        inputs.camera = record_move_camera({recording, cache}, motions, uint32_t(index), inputs.camera);
    const MotionUse motion{.motions = &motions,
                           .photo = uint32_t(index),
                           .rate = float(schedule.pose_rate(step)),
                           .extent = float(extent),
                           .visit = visit_of(step)};
    const Model& model = portions.use(0, portions::Portions::Need::state);
    const FramePasses on{{recording, cache}, plan, frame, inputs};
    const Sorted sorted = on.forward(model);
    view.record_loss(on);
    on.backward(model, sorted, rates(step), plan.motion ? &motion : nullptr);
    if (options.strategy == Strategy::mcmc) record_noise(on, model, frame, noise(step));
}

void Trainer::State::submit(int step) {
    train::ImageCache& seen = images_at(step);
    const size_t index = train::frame_of_step(step, images.count(), options.seed);
    const portions::StepView view = view_of(step, seen, schedule.degree(step));
    const CameraUse& camera = view.inputs.camera;
    // Buffers of another size, and an image from disk, take the place of what a step in flight reads.
    if (!seen.cached(index) || camera.width != frame.sizes.width || camera.height != frame.sizes.height)
        finish_all();
    while (in_flight.size() >= cache.config().frames_in_flight) finish_oldest();
    if (in_flight.empty()) frame.reserve(cache.device(), cache.config(), request_of(camera));
    gpu::Recording recording(device->limits());
    record_fused(recording, step, index, view);
    if (schedule.halvings_at(step + 1) == schedule.halvings_at(step))
        seen.prepare(train::frame_of_step(step + 1, images.count(), options.seed));
    frame.record_counts(recording, slot_of(step));
    executor.submit(recording, is_timed(step));
    in_flight.push_back({step, view.weight()});
    // An image from disk may be gone when its step has to be repeated: no other step follows before it is done.
    if (!seen.cached(index)) finish_all();
}

void Trainer::State::finish_oldest() {
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

void Trainer::State::add_pass_times() {
    for (const PassTime& time : executor.timings()) {
        const auto same = std::find_if(times.passes.begin(), times.passes.end(),
                                       [&](const PassTime& sum) { return sum.pass == time.pass; });
        if (same == times.passes.end())
            times.passes.push_back(time);
        else
            same->milliseconds += time.milliseconds;
    }
}

void Trainer::State::finish_all() {
    while (!in_flight.empty()) finish_oldest();
}

bool Trainer::State::must_finish(int step) const {
    return step == options.steps || (options.strategy == Strategy::mcmc && schedule.relocates(step)) ||
           (options.strategy == Strategy::adc && (schedule.densifies(step) || schedule.resets_opacity(step)));
}

void Trainer::State::optimise(int first, int last) {
    if (!fused()) return optimise_several(first, last);
    submit(first);
    if (must_finish(first) || cache.config().frames_in_flight == 1) finish_all();
}

portions::StepView Trainer::State::view_of(int step, train::ImageCache& seen, int sh_degree) {
    const size_t index = train::frame_of_step(step, images.count(), options.seed);
    const CameraUse camera = seen.camera(index);
    const FrameInputs inputs{.camera = camera,
                             .background = options.random_background ? random_background(step, options.seed)
                                                                     : options.render.background,
                             .sh_degree = sh_degree};
    const ExposureUse exposure{&exposures, uint32_t(index), float(schedule.exposure_rate(step)),
                               visit_of(step)};
    const auto weight = std::make_shared<double>(1);
    return {
        .inputs = inputs,
        .request = request_of(camera),
        .record_loss =
            [this, exposure, weight, index, &seen](const FramePasses& on) {
                const auto& photo = seen.photo(index);
                *weight = photo.weight;
                on.loss(photo.texels, photo.masked, plan.exposure ? &exposure : nullptr);
            },
        .weight = [weight] { return *weight; },
        .learned =
            [this, index] {
                const auto words = exposures.words(uint32_t(index));
                return std::vector<uint64_t>(words.begin(), words.end());
            },
        .learn = [this, index](std::span<const uint64_t> words) { exposures.set(uint32_t(index), words); }};
}

void Trainer::State::optimise_several(int first, int last) {
    train::ImageCache& seen = images_at(first);
    const int sh_degree = schedule.degree(first);
    std::vector<portions::StepView> views;
    for (int step = first; step <= last; ++step) views.push_back(view_of(step, seen, sh_degree));
    const portions::StepParts parts = step_parts();
    Rates of_step = rates(last);
    of_step.views = uint32_t(views.size());
    Noise of_noise = noise(last);
    of_noise.amplitude *= float(std::sqrt(double(views.size())));
    portions::StepSums drawn = several.draw(parts, views);
    several.update(
        parts, batch_rates(of_step), sh_degree,
        [&](const passes::Recorder& on, const Model& moved) {
            if (options.strategy == Strategy::mcmc) record_noise(on, moved, frame, of_noise);
        },
        drawn);
    timed_steps += int(views.size());
    report.loss = drawn.loss;
    report.psnr = drawn.psnr;
    report.skipped_nonfinite = uint32_t(drawn.skipped_nonfinite);
    report.dropped_updates += drawn.dropped_updates;
    report.limited_steps += drawn.limited_steps;
}

portions::StepParts Trainer::State::step_parts() {
    return {cache,
            executor,
            plan,
            frame,
            instance_capacity,
            [this] { add_pass_times(); },
            plan.exposure ? std::tuple_size_v<Exposures::Words> : 0};
}

Image Trainer::State::render_own(std::span<const Camera> cameras) {
    std::vector<gpu::Buffer> blocks;
    for (const Camera& camera : cameras)
        blocks.push_back(upload_camera(*device, camera, cache.config(), portions.origin()));
    std::vector<portions::StepView> views;
    for (size_t i = 0; i < cameras.size(); ++i) {
        const FrameInputs inputs = inputs_of(blocks[i], cameras[i], options.render);
        views.push_back({.inputs = inputs,
                         .request = request_of(inputs.camera),
                         .record_loss = {},
                         .weight = {},
                         .learned = {},
                         .learn = {}});
    }
    portions::StepParts parts = step_parts();
    parts.submitted = [] {};
    if (!several.draw_pictures(parts, views)) return {};
    return Picture(frame).image(shared::PLANE_R, 3);
}

void Trainer::State::refine(const std::function<void(const Phase&)>& refine) {
    frame.free_instances();  // the second copy of an array takes its place
    if (portions.streamed()) {
        // A value a splat of any portion, and no picture: with mcmc one portion holds all new splats until they are level.
        frame = {};
        frame.reserve(*device, cache.config(),
                      {.splats = portions.largest(), .width = 1, .height = 1, .instances = 1});
    }
    refine({cache, executor, frame});
    if (portions.streamed()) frame = {};
}

void Trainer::State::follow_up(int step) {
    if (options.strategy == Strategy::adc) control_density(step);
    if (options.strategy != Strategy::mcmc || !schedule.relocates(step)) return;
    const McmcRules rules{.dead_opacity = options.dead_opacity,
                          .growth = schedule.growth,
                          .max_splats = options.max_splats,
                          .spread = schedule.copy_spread,
                          .kernel = options.render.kernel,
                          .seed = options.seed,
                          .step = uint32_t(step)};
    refine([&](const Phase& phase) { refine_mcmc(portions, phase, rules); });
}

void Trainer::State::control_density(int step) {
    if (schedule.densifies(step)) {
        DensifyRules rules;
        rules.grow_gradient = float(plan.absolute ? options.grow_gradient_absolute : options.grow_gradient);
        if (options.render.points) rules.grow_gradient *= kPointsThreshold;
        rules.revised_opacity = options.revised_opacity;
        rules.split_scale = float(options.split_scale * extent);
        rules.prune_logit = options.render.points ? -std::numeric_limits<float>::infinity()
                                                  : float(logit(options.prune_opacity));
        rules.prune_scale = schedule.was_reset(step) ? float(options.prune_scale * extent) : 0.0f;
        rules.seed = options.seed;
        rules.step = uint32_t(step);
        rules.max_splats = options.max_splats;
        refine([&](const Phase& phase) { densify(portions, phase, rules); });
    }
    if (schedule.resets_opacity(step)) {
        portions.visit(portions::Portions::Need::state, [&](int, const Model& model) {
            gpu::Recording recording(device->limits());
            record_reset_opacity({recording, cache}, model, float(logit(kResetOpacity)));
            executor.run(recording);
            portions.changed();
        });
    }
}

bool Trainer::State::is_timed(int step) const {
    return cache.config().frames_in_flight == 1 || step % kTimedEvery == 1;
}

}  // namespace ewa
