// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/random.h"
#include "pipeline/image_reader.h"
#include "portions/refine.h"
#include "train/training.h"

namespace ewa::train {

using namespace pipeline;

namespace {

constexpr int kTimedEvery = 100;  // steps, where several are in flight
// Of the threshold that adds splats, with points: edges of opaque spheres have larger gradients than soft footprints.
constexpr float kPointsThreshold = 8;
constexpr double kResetOpacity = 0.01;  // 3DGS: upper bound of opacities after a reset
double logit(double p) {
    return std::log(p / (1 - p));
}

/// origin: of the model.
Region region_of(const TrainOptions& options, const glm::dvec3& origin) {
    Region region = kEverywhere;
    if (options.region)
        for (size_t k = 0; k < region.size(); ++k)
            region[k] = float((*options.region)[k] - origin[int(k % 3)]);
    return region;
}

Ball ball_of(const CameraBall& cameras, const glm::dvec3& origin) {
    const glm::vec3 middle(cameras.middle - origin);
    return {middle.x, middle.y, middle.z, float(cameras.radius)};
}

/// What the step's splats are drawn over.
std::array<float, 3> background_of(int step, const TrainOptions& options) {
    const bool random = options.random_background;
    if (!random && options.background_noise == 0) return options.render.background;
    const auto u =
        core::uniform4({uint32_t(step), 0x62636b67u, uint32_t(options.seed), uint32_t(options.seed >> 32)});
    if (random) return {float(u[0]), float(u[1]), float(u[2])};
    std::array<float, 3> color = options.render.background;
    for (size_t c = 0; c < 3; ++c) color[c] += float(options.background_noise * (u[c] - 0.5));
    return color;
}

}  // namespace

Rates Training::rates(int step) const {
    Rates r;
    const double fading = schedule_.fading(step), gain = fading * schedule_.gain(step);
    r.mean = float(gain * schedule_.mean_rate(step, extent_));
    r.opacity = float(fading * schedule_.opacity_gain(step) * options_.opacity_rate);
    r.quaternion = float(gain * options_.quaternion_rate);
    r.scale = float(gain * options_.scale_rate);
    r.sh0 = float(gain * options_.sh0_rate);
    r.sh_rest = float(gain * options_.sh_rest_rate);
    r.step = uint32_t(step);
    r.nesterov = schedule_.nesterov;
    r.seed = options_.seed;
    if (plan_.regularised) {
        r.opacity_weight = float(options_.opacity_weight / portions_.splats());
        r.scale_weight = float(options_.scale_weight / (3.0 * portions_.splats() * extent_));
    }
    return r;
}

Noise Training::noise(int step) const {
    // Sigma is a square of lengths. Divided by the extent it is a length again, as in a scene of unit extent.
    const double amplitude = options_.noise_rate * schedule_.mean_rate(step, 1) / extent_;
    return {.amplitude = float(amplitude),
            .max_length = float(extent_),
            .seed = options_.seed,
            .step = uint32_t(step)};
}

ImageCache& Training::images_at(int step) {
    const auto level = size_t(schedule_.halvings_at(step));
    if (images_.frees(level)) finish_all();
    return images_.at(level);
}

FrameRequest Training::request_of(const CameraUse& camera) const {
    return {.splats = portions_.largest(),
            .width = camera.width,
            .height = camera.height,
            .instances = tools_.instance_capacity,
            .gradients = true,
            .masks = plan_.masks,
            .appearance = plan_.appearance,
            .overlaid = true,
            .motion = plan_.motion,
            .readouts = learned_.motions.readouts(),
            .rays = plan_.rays(),
            .loss = plan_.loss};
}

void Training::record_fused(gpu::Recording& recording, int step, size_t index,
                            const portions::StepView& view) {
    FrameInputs inputs = view.inputs;
    inputs.keep_overflow = !in_flight_.empty();
    if (plan_.motion)
        inputs.camera =
            record_move_camera({recording, tools_.cache}, learned_.motions, uint32_t(index), inputs.camera);
    const MotionUse motion{.motions = &learned_.motions,
                           .photo = uint32_t(index),
                           .rate = float(schedule_.pose_rate(step)),
                           .extent = float(extent_),
                           .visit = visit_of(step)};
    const Model& model = portions_.use(0, portions::Portions::Need::state);
    const FramePasses on{{recording, tools_.cache}, plan_, tools_.frame, inputs};
    const Sorted sorted = on.forward(model);
    view.record_loss(on);
    const auto photo = uint32_t(index);
    record_cameras_update(on, learned_.appearances, tools_.frame, std::span(&photo, 1),
                          float(schedule_.camera_rate(step)), tools_.frame.instance_capacity);
    if (plan_.sky) record_update_sky(on, step, step, tools_.frame.instance_capacity);
    on.backward(model, sorted, rates(step), plan_.motion ? &motion : nullptr);
    if (options_.strategy == Strategy::mcmc) record_noise(on, model, tools_.frame, noise(step));
}

void Training::submit(int step) {
    ImageCache& seen = images_at(step);
    const size_t index = index_of(step);
    const portions::StepView view = view_of(step, seen, schedule_.degree(step));
    const CameraUse& camera = view.inputs.camera;
    // Buffers of another size, and an image from disk, take the place of what a step in flight reads.
    if (!seen.cached(index) || camera.width != tools_.frame.sizes.width ||
        camera.height != tools_.frame.sizes.height)
        finish_all();
    while (in_flight_.size() >= tools_.frames_in_flight()) finish_oldest();
    if (in_flight_.empty())
        tools_.frame.reserve(tools_.cache.device(), tools_.cache.config(), request_of(camera));
    gpu::Recording recording(device_->limits());
    record_fused(recording, step, index, view);
    if (schedule_.halvings_at(step + 1) == schedule_.halvings_at(step)) seen.prepare(index_of(step + 1));
    tools_.frame.record_counts(recording, slot_of(step));
    tools_.executor.submit(recording, is_timed(step));
    in_flight_.push_back({step, view.weight()});
    compile_next_degree(step, index, seen);
    // An image from disk may be gone when its step has to be repeated: no other step follows before it is done.
    if (!seen.cached(index)) finish_all();
}

void Training::compile_next_degree(int step, size_t index, ImageCache& seen) {
    const int next = schedule_.degree(step) + 1;
    if (device_->limits().cpu || !seen.cached(index) || next <= compiled_degree_) return;
    if (next > schedule_.degree(options_.steps)) return;
    compiled_degree_ = next;
    gpu::Recording unused(device_->limits());
    record_fused(unused, step, index, view_of(step, seen, next));
}

void Training::finish_oldest() {
    const auto [step, weight] = in_flight_.front();
    tools_.executor.wait();
    const shared::Counts counts = tools_.frame.read_counts(slot_of(step));
    if (counts.instances > tools_.frame.instance_capacity) {
        const std::deque<Flight> again = std::exchange(in_flight_, {});
        while (tools_.executor.unfinished()) tools_.executor.wait();
        tools_.instance_capacity = grown_capacity(counts.instances);
        for (const Flight& repeated : again) {
            submit(repeated.step);
            finish_all();
        }
        return;
    }
    check_rays_finished(counts);
    in_flight_.pop_front();
    log_.add({.loss = loss_of(plan_.loss, counts),
              .psnr = -10 * std::log10(double(counts.squared) / weight),
              .skipped_nonfinite = counts.skipped_nonfinite,
              .dropped_updates = counts.dropped_updates,
              .limited_steps = counts.limited_steps});
    if (!is_timed(step)) return;
    ++log_.timed_steps;
    log_.add_passes(tools_.executor.timings());
}

void Training::finish_all() {
    while (!in_flight_.empty()) finish_oldest();
}

bool Training::must_finish(int step) const {
    return step == options_.steps || schedule_.prunes(step) ||
           (options_.strategy == Strategy::mcmc && schedule_.relocates(step)) ||
           (options_.strategy == Strategy::adc &&
            (schedule_.densifies(step) || schedule_.resets_opacity(step)));
}

void Training::optimise(int first, int last) {
    if (!fused()) return optimise_several(first, last);
    submit(first);
    if (must_finish(first) || tools_.frames_in_flight() == 1) finish_all();
}

portions::StepView Training::view_of(int step, ImageCache& seen, int sh_degree, uint32_t slot) {
    const size_t index = index_of(step);
    const CameraUse camera = seen.camera(index);
    const FrameInputs inputs{
        .camera = camera, .background = background_of(step, options_), .sky = sky(), .sh_degree = sh_degree};
    const bool affine = plan_.appearance == AppearanceModel::affine;
    const double rate = affine ? schedule_.exposure_rate(step) : schedule_.appearance_rate(step);
    const AppearanceUse appearance{&learned_.appearances, uint32_t(index), slot, float(rate), visit_of(step)};
    const bool learned = !learned_.appearances.empty();
    const auto weight = std::make_shared<double>(1);
    return {.inputs = inputs,
            .request = request_of(camera),
            .record_loss =
                [this, appearance, learned, weight, index, slot, &seen](const FramePasses& on) {
                    const auto& photo = seen.photo(index);
                    *weight = photo.weight;
                    on.loss(photo.texels, photo.masked, learned ? &appearance : nullptr, photo.cut,
                            {photo.depths ? &photo.depths : nullptr, photo.depth_pixels});
                    if (plan_.sky) on.sky_gradient(learned_.sky, slot);
                },
            .weight = [weight] { return *weight; },
            .learned = [this, index, slot] { return learned_.words(uint32_t(index), slot); },
            .learn = [this, index,
                      slot](std::span<const uint64_t> words) { learned_.set(uint32_t(index), slot, words); }};
}

void Training::optimise_several(int first, int last) {
    ImageCache& seen = images_at(first);
    const int sh_degree = schedule_.degree(first);
    std::vector<portions::StepView> views;
    for (int step = first; step <= last; ++step)
        views.push_back(view_of(step, seen, sh_degree, uint32_t(step - first)));
    const portions::StepParts parts = step_parts();
    Rates of_step = rates(last);
    of_step.views = uint32_t(views.size());
    Noise of_noise = noise(last);
    of_noise.amplitude *= float(std::sqrt(double(views.size())));
    portions::StepSums drawn = several_.draw(parts, views);
    update_learned(first, last);
    several_.update(
        parts, batch_rates(of_step), sh_degree,
        [&](const passes::Recorder& on, const Model& moved) {
            if (options_.strategy == Strategy::mcmc) record_noise(on, moved, tools_.frame, of_noise);
        },
        drawn);
    log_.timed_steps += int(views.size());
    log_.add(drawn);
}

void Training::update_learned(int first, int last) {
    constexpr uint32_t kAnyInstances = std::numeric_limits<uint32_t>::max();
    if (plan_.appearance != AppearanceModel::ppisp && !plan_.sky) return;
    std::vector<uint32_t> photos;
    for (int step = first; step <= last; ++step) photos.push_back(uint32_t(index_of(step)));
    gpu::Recording recording(device_->limits());
    const passes::Recorder on{recording, tools_.cache};
    const double rate = schedule_.camera_rate(last) * std::sqrt(double(photos.size()));
    record_cameras_update(on, learned_.appearances, tools_.frame, photos, float(rate), kAnyInstances);
    if (plan_.sky) record_update_sky(on, first, last, kAnyInstances);
    tools_.executor.run(recording);
}

void Training::record_update_sky(const passes::Recorder& on, int first, int last, uint32_t capacity) {
    const auto views = uint32_t(last - first + 1);
    const double rate = schedule_.sky_rate(last) * std::sqrt(double(views));
    record_sky_update(on, learned_.sky, tools_.frame, views, float(rate),
                      uint32_t((first - 1) / options_.batch + 1), capacity);
}

portions::StepParts Training::step_parts() {
    return {tools_.cache,
            tools_.executor,
            plan_,
            tools_.frame,
            tools_.instance_capacity,
            [this] { log_.add_passes(tools_.executor.timings()); },
            learned_.words_of_view()};
}

Image Training::render_own(std::span<const Camera> cameras) {
    std::vector<gpu::Buffer> blocks;
    for (const Camera& camera : cameras)
        blocks.push_back(upload_camera(*device_, camera, tools_.cache.config(), portions_.origin()));
    std::vector<portions::StepView> views;
    for (size_t i = 0; i < cameras.size(); ++i) {
        FrameInputs inputs = inputs_of(blocks[i], cameras[i], options_.render);
        inputs.sky = sky();
        views.push_back({.inputs = inputs,
                         .request = request_of(inputs.camera),
                         .record_loss = {},
                         .weight = {},
                         .learned = {},
                         .learn = {}});
    }
    portions::StepParts parts = step_parts();
    parts.submitted = [] {};
    if (!several_.draw_views(parts, views)) return {};
    return ImageReader(tools_.frame).image(shared::PLANE_R, 3);
}

void Training::refine(const std::function<void(const Phase&)>& refine) {
    tools_.frame.free_instances();  // the second copy of an array takes its place
    if (portions_.streamed()) {
        // A value a splat of any portion, and no image: with mcmc one portion holds all new splats until they are level.
        tools_.frame = {};
        tools_.frame.reserve(*device_, tools_.cache.config(),
                             {.splats = portions_.largest(), .width = 1, .height = 1, .instances = 1});
    }
    refine({tools_.cache, tools_.executor, tools_.frame});
    if (portions_.streamed()) tools_.frame = {};
}

void Training::prune(int step) {
    if (portions_.splats() <= options_.final_splats) return;
    std::vector<std::vector<float>> largest(size_t(portions_.count()));
    portions::StepParts parts = step_parts();
    parts.submitted = [] {};
    const auto at_once = size_t(portions_.ranks().size());
    for (size_t first = 0; first < images_.count(); first += at_once) {
        std::vector<portions::StepView> views;
        for (size_t i = first; i < std::min(first + at_once, images_.count()); ++i) {
            CameraUse camera = images_.full().camera(i);
            if (plan_.motion) {
                gpu::Recording recording(device_->limits());
                camera = record_move_camera({recording, tools_.cache}, learned_.motions, uint32_t(i), camera);
                tools_.executor.run(recording);
            }
            views.push_back({.inputs = {.camera = camera, .sh_degree = schedule_.degree(step)},
                             .request = request_of(camera),
                             .record_loss = {},
                             .weight = {},
                             .learned = {},
                             .learn = {}});
        }
        several_.raise_weights(parts, views, largest);
    }
    if (fused()) several_.free_buffers();
    refine([&](const Phase& phase) { keep_largest(portions_, phase, largest, options_.final_splats); });
}

void Training::follow_up(int step) {
    if (schedule_.prunes(step)) return prune(step);
    if (options_.strategy == Strategy::adc) control_density(step);
    if (options_.strategy != Strategy::mcmc || !schedule_.relocates(step)) return;
    const McmcRules rules{.dead_opacity = options_.dead_opacity,
                          .growth = schedule_.growth,
                          .max_splats = options_.max_splats,
                          .spread = schedule_.copy_spread,
                          .kernel = options_.render.kernel,
                          .seed = options_.seed,
                          .step = uint32_t(step),
                          .region = region_of(options_, portions_.origin())};
    refine([&](const Phase& phase) { refine_mcmc(portions_, phase, rules); });
}

void Training::control_density(int step) {
    if (schedule_.densifies(step)) {
        DensifyRules rules;
        rules.grow_gradient =
            float(plan_.absolute ? options_.grow_gradient_absolute : options_.grow_gradient);
        if (options_.render.points) rules.grow_gradient *= kPointsThreshold;
        rules.split = schedule_.even_splits ? shared::SPLIT_EVEN : shared::SPLIT_DRAWN;
        rules.split_scale = float(options_.split_scale * extent_);
        rules.prune_logit = options_.render.points ? -std::numeric_limits<float>::infinity()
                                                   : float(logit(options_.prune_opacity));
        rules.prune_scale = schedule_.was_reset(step) ? float(options_.prune_scale * extent_) : 0.0f;
        rules.seed = options_.seed;
        rules.step = uint32_t(step);
        rules.max_splats = options_.max_splats;
        rules.region = region_of(options_, portions_.origin());
        if (schedule_.bounded) rules.ball = ball_of(cameras_, portions_.origin());
        refine([&](const Phase& phase) { densify(portions_, phase, rules); });
    }
    if (schedule_.resets_opacity(step)) {
        portions_.visit(portions::Portions::Need::state, [&](int, const Model& model) {
            gpu::Recording recording(device_->limits());
            record_reset_opacity({recording, tools_.cache}, model, float(logit(kResetOpacity)));
            tools_.executor.run(recording);
            portions_.changed();
        });
    }
}

bool Training::is_timed(int step) const {
    return tools_.frames_in_flight() == 1 || step % kTimedEvery == 1;
}

}  // namespace ewa::train
