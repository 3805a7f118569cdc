// SPDX-License-Identifier: Apache-2.0
#include "train/fused_steps.h"

#include <chrono>
#include <cmath>
#include <utility>

#include "gpu/pipeline.h"
#include "train/step_views.h"

namespace ewa::train {

using namespace pipeline;

namespace {

constexpr int kTimedEvery = 100;  // steps, where several are in flight

}  // namespace

void FusedSteps::optimise(int step) {
    submit(step);
    if (must_finish(step) || parts_.tools.frames_in_flight() == 1) finish_all();
}

void FusedSteps::record(gpu::Recording& recording, int step, size_t index, const portions::StepView& view) {
    FrameInputs inputs = view.inputs;
    inputs.keep_overflow = !in_flight_.empty();
    if (parts_.plan.motion)
        inputs.camera = record_move_camera({recording, parts_.tools.cache}, parts_.learned.motions,
                                           uint32_t(index), inputs.camera);
    const MotionUse motion{.motions = &parts_.learned.motions,
                           .photo = uint32_t(index),
                           .rate = float(parts_.schedule.pose_rate(step)),
                           .extent = float(parts_.extent),
                           .visit = parts_.visit_of(step)};
    const Model& model = parts_.portions.holder().use(0, portions::Need::state);
    const FramePasses on{{recording, parts_.tools.cache}, parts_.plan, parts_.tools.frame, inputs};
    const Sorted sorted = on.forward(model);
    view.record_loss(on);
    const auto photo = uint32_t(index);
    record_cameras_update(on, parts_.learned.appearances, parts_.tools.frame, std::span(&photo, 1),
                          float(parts_.schedule.camera_rate(step)), parts_.tools.frame.instance_capacity);
    if (parts_.plan.sky) record_update_sky(parts_, on, step, step, parts_.tools.frame.instance_capacity);
    on.backward(model, sorted, rates_of(parts_, step), parts_.plan.motion ? &motion : nullptr);
    if (parts_.options.strategy == Strategy::mcmc)
        record_noise(on, model, parts_.tools.frame, noise_of(parts_, step));
}

bool FusedSteps::is_replayed(int step, const ImageCache& seen, size_t index) const {
    const Plan& plan = parts_.plan;
    const TrainOptions& options = parts_.options;
    const bool same = !plan.masks && !plan.motion && !plan.sky && plan.appearance == AppearanceModel::none &&
                      plan.loss.alpha == 0 && plan.loss.depth == 0 && !options.random_background &&
                      options.background_noise == 0;
    // Timestamps are commands too.
    const bool timed_as_all = parts_.tools.frames_in_flight() == 1 || !is_timed(step);
    return parts_.tools.cache.config().replayed_steps && same && timed_as_all && seen.cached(index);
}

void FusedSteps::submit_replayed(int step, const gpu::Buffer& photo, const portions::StepView& view) {
    FrameTools& tools = parts_.tools;
    const Model& model = parts_.portions.holder().use(0, portions::Need::state);
    const Noise noise = noise_of(parts_, step);
    const bool noisy = parts_.options.strategy == Strategy::mcmc;
    FrameInputs inputs = view.inputs;
    inputs.keep_overflow = !in_flight_.empty();
    gpu::Recording ahead(parts_.device->limits());
    FramePasses{{ahead, tools.cache}, parts_.plan, tools.frame, inputs}.prepare(model, photo,
                                                                                rates_of(parts_, step));
    if (noisy) record_noise_values(ahead, model, tools.frame, noise);
    const CameraUse& camera = view.inputs.camera;
    const Shape shape{.last_buffer = gpu::Buffer::last_serial(),
                      .width = camera.width,
                      .height = camera.height,
                      .lenses = camera.lenses,
                      .splats = model.splats,
                      .capacity = tools.frame.instance_capacity,
                      .sh_degree = view.inputs.sh_degree,
                      .wraps = camera.wraps,
                      .frozen = noise.frozen};
    const uint32_t slot = slot_of(step);
    if (kept_[slot] != shape) {
        kept_[slot] = {};
        ++parts_.log.times.recorded;
        inputs.prepared = true;
        inputs.camera.buffer = &tools.frame.step_camera;
        inputs.camera.offset = 0;
        gpu::Recording rest(parts_.device->limits());
        const FramePasses on{{rest, tools.cache}, parts_.plan, tools.frame, inputs};
        const Sorted sorted = on.forward(model);
        view.record_loss(on);
        on.backward(model, sorted, {});
        if (noisy) record_noise(on, model, tools.frame, noise, true);
        tools.frame.record_counts(rest, slot);
        tools.executor.keep(slot, rest, is_timed(step));
        kept_[slot] = shape;
    }
    tools.executor.submit(ahead, slot, is_timed(step));
}

void FusedSteps::submit(int step) {
    if (parts_.images.frees(size_t(parts_.schedule.halvings_at(step)))) finish_all();
    ImageCache& seen = parts_.images_at(step);
    const size_t index = parts_.index_of(step);
    const CameraUse camera = seen.camera(index);
    // Buffers of another size, and an image from disk, take the place of what a step in flight reads.
    if (!seen.cached(index) || camera.width != parts_.tools.frame.sizes.width ||
        camera.height != parts_.tools.frame.sizes.height)
        finish_all();
    while (in_flight_.size() >= parts_.tools.frames_in_flight()) finish_oldest();
    if (in_flight_.empty())
        parts_.tools.frame.reserve(parts_.tools.cache.device(), parts_.tools.cache.config(),
                                   parts_.request_of(camera));
    const int degree = parts_.schedule.degree(step);
    const auto start = std::chrono::steady_clock::now();
    const portions::StepView view = view_of(parts_, step, seen, degree);
    if (is_replayed(step, seen, index)) {
        submit_replayed(step, seen.photo(index).texels, view);
    } else {
        gpu::Recording recording(parts_.device->limits());
        record(recording, step, index, view);
        ++parts_.log.times.recorded;
        parts_.tools.frame.record_counts(recording, slot_of(step));
        parts_.tools.executor.submit(recording, is_timed(step));
    }
    const auto submitted = std::chrono::steady_clock::now();
    in_flight_.push_back({step, view.weight()});
    if (std::exchange(last_degree_, degree) == degree) {  // else it may have waited for the compiler
        parts_.log.times.host += std::chrono::duration<double, std::milli>(submitted - start).count();
        ++parts_.log.host_steps;
    }
    if (parts_.schedule.halvings_at(step + 1) == parts_.schedule.halvings_at(step))
        seen.prepare(parts_.index_of(step + 1));
    compile_next_degree(step, index, seen);
    // An image from disk may be gone when its step has to be repeated: no other step follows before it is done.
    if (!seen.cached(index)) finish_all();
}

void FusedSteps::compile_next_degree(int step, size_t index, ImageCache& seen) {
    const int next = parts_.schedule.degree(step) + 1;
    if (parts_.device->limits().cpu || !seen.cached(index) || next <= compiled_degree_) return;
    if (next > parts_.schedule.degree(parts_.options.steps)) return;
    compiled_degree_ = next;
    gpu::Recording unused(parts_.device->limits());
    record(unused, step, index, view_of(parts_, step, seen, next));
}

void FusedSteps::finish_oldest() {
    const auto [step, weight] = in_flight_.front();
    parts_.tools.executor.wait();
    const shared::Counts counts = parts_.tools.frame.read_counts(slot_of(step));
    if (counts.instances > parts_.tools.frame.instance_capacity) {
        const std::deque<Flight> again = std::exchange(in_flight_, {});
        while (parts_.tools.executor.unfinished()) parts_.tools.executor.wait();
        parts_.tools.instance_capacity = grown_capacity(counts.instances);
        for (const Flight& repeated : again) {
            submit(repeated.step);
            finish_all();
        }
        return;
    }
    in_flight_.pop_front();
    check_rays_finished(counts);
    parts_.log.add({.loss = loss_of(parts_.plan.loss, counts),
                    .psnr = -10 * std::log10(double(counts.squared) / weight),
                    .skipped_nonfinite = counts.skipped_nonfinite,
                    .dropped_updates = counts.dropped_updates,
                    .limited_steps = counts.limited_steps});
    if (!is_timed(step)) return;
    ++parts_.log.timed_steps;
    parts_.log.add_passes(parts_.tools.executor.timings());
}

void FusedSteps::finish_all() {
    while (!in_flight_.empty()) finish_oldest();
}

bool FusedSteps::must_finish(int step) const {
    return step == parts_.options.steps || parts_.schedule.prunes(step) ||
           (parts_.options.strategy == Strategy::mcmc && parts_.schedule.relocates(step)) ||
           (parts_.options.strategy == Strategy::adc &&
            (parts_.schedule.densifies(step) || parts_.schedule.resets_opacity(step)));
}

bool FusedSteps::is_timed(int step) const {
    return parts_.tools.frames_in_flight() == 1 || step % kTimedEvery == 1;
}

}  // namespace ewa::train
