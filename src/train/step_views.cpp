// SPDX-License-Identifier: Apache-2.0
#include "train/step_views.h"

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "core/random.h"

namespace ewa::train {

using namespace pipeline;

namespace {

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

/// What is learned of all views of a step together. Every rank has their gradients.
void update_learned(TrainingParts& parts, int first, int last) {
    constexpr uint32_t kAnyInstances = std::numeric_limits<uint32_t>::max();
    if (parts.plan.appearance != AppearanceModel::ppisp && !parts.plan.sky) return;
    std::vector<uint32_t> photos;
    for (int step = first; step <= last; ++step) photos.push_back(uint32_t(parts.index_of(step)));
    gpu::Recording recording(parts.device->limits());
    const passes::Recorder on{recording, parts.tools.cache};
    const double rate = parts.schedule.camera_rate(last) * std::sqrt(double(photos.size()));
    record_cameras_update(on, parts.learned.appearances, parts.tools.frame, photos, float(rate),
                          kAnyInstances);
    if (parts.plan.sky) record_update_sky(parts, on, first, last, kAnyInstances);
    parts.tools.executor.run(recording);
}

}  // namespace

Rates rates_of(const TrainingParts& parts, int step) {
    Rates r;
    const double fading = parts.schedule.fading(step), gain = fading * parts.schedule.gain(step);
    r.mean = float(gain * parts.schedule.mean_rate(step, parts.extent));
    r.opacity = float(fading * parts.schedule.opacity_gain(step) * parts.options.opacity_rate);
    r.quaternion = float(gain * parts.options.quaternion_rate);
    r.scale = float(gain * parts.options.scale_rate);
    r.sh0 = float(gain * parts.options.sh0_rate);
    r.sh_rest = float(gain * parts.options.sh_rest_rate);
    r.step = uint32_t(step);
    r.nesterov = parts.schedule.nesterov;
    r.seed = parts.options.seed;
    if (parts.plan.regularised) {
        r.opacity_weight = float(parts.options.opacity_weight / parts.portions.splats());
        r.scale_weight = float(parts.options.scale_weight / (3.0 * parts.portions.splats() * parts.extent));
    }
    return r;
}

Noise noise_of(const TrainingParts& parts, int step) {
    // Sigma is a square of lengths. Divided by the extent it is a length again, as in a scene of unit extent.
    const double amplitude = parts.options.noise_rate * parts.schedule.mean_rate(step, 1) / parts.extent;
    return {.amplitude = float(amplitude),
            .max_length = float(parts.extent),
            .seed = parts.options.seed,
            .step = uint32_t(step),
            .frozen = parts.frozen > 0};
}

portions::StepView view_of(TrainingParts& parts, int step, ImageCache& seen, int sh_degree, uint32_t slot) {
    const size_t index = parts.index_of(step);
    const CameraUse camera = seen.camera(index);
    const FrameInputs inputs{.camera = camera,
                             .background = background_of(step, parts.options),
                             .sky = parts.sky(),
                             .sh_degree = sh_degree};
    const bool affine = parts.plan.appearance == AppearanceModel::affine;
    const double rate = affine ? parts.schedule.exposure_rate(step) : parts.schedule.appearance_rate(step);
    const AppearanceUse appearance{&parts.learned.appearances, uint32_t(index), slot, float(rate),
                                   parts.visit_of(step)};
    const bool learned = !parts.learned.appearances.empty();
    const auto weight = std::make_shared<double>(1);
    return {
        .inputs = inputs,
        .request = parts.request_of(camera),
        .record_loss =
            [&parts, appearance, learned, weight, index, slot, &seen](const FramePasses& on) {
                const auto& photo = seen.photo(index);
                *weight = photo.weight;
                on.loss(photo.texels, photo.masked, learned ? &appearance : nullptr, photo.cut,
                        {photo.depths ? &photo.depths : nullptr, photo.depth_pixels});
                if (parts.plan.sky) on.sky_gradient(parts.learned.sky, slot);
            },
        .weight = [weight] { return *weight; },
        .learned = [&parts, index, slot] { return parts.learned.words(uint32_t(index), slot); },
        .learn = [&parts, index, slot](
                     std::span<const uint64_t> words) { parts.learned.set(uint32_t(index), slot, words); }};
}

portions::StepView plain_view(const TrainingParts& parts, const FrameInputs& inputs) {
    return {.inputs = inputs,
            .request = parts.request_of(inputs.camera),
            .record_loss = {},
            .weight = {},
            .learned = {},
            .learn = {}};
}

void record_update_sky(const TrainingParts& parts, const passes::Recorder& on, int first, int last,
                       uint32_t capacity) {
    const auto views = uint32_t(last - first + 1);
    const double rate = parts.schedule.sky_rate(last) * std::sqrt(double(views));
    record_sky_update(on, parts.learned.sky, parts.tools.frame, views, float(rate),
                      uint32_t((first - 1) / parts.options.batch + 1), capacity);
}

void optimise_several(TrainingParts& parts, int first, int last) {
    ImageCache& seen = parts.images_at(first);
    const int sh_degree = parts.schedule.degree(first);
    std::vector<portions::StepView> views;
    for (int number = first; number <= last; ++number)
        views.push_back(view_of(parts, number, seen, sh_degree, uint32_t(number - first)));
    const portions::StepParts step = parts.step_parts();
    Rates of_step = rates_of(parts, last);
    of_step.views = uint32_t(views.size());
    Noise of_noise = noise_of(parts, last);
    of_noise.amplitude *= float(std::sqrt(double(views.size())));
    portions::StepSums drawn = parts.several.draw(step, views);
    update_learned(parts, first, last);
    parts.several.update(
        step, batch_rates(of_step), sh_degree,
        [&](const passes::Recorder& on, const Model& moved) {
            if (parts.options.strategy == Strategy::mcmc)
                record_noise(on, moved, parts.tools.frame, of_noise);
        },
        drawn);
    parts.log.timed_steps += int(views.size());
    parts.log.add(drawn);
}

}  // namespace ewa::train
