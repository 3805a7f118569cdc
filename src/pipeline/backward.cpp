// SPDX-License-Identifier: Apache-2.0
#include "pipeline/backward.h"

#include "passes/passes.h"
#include "pipeline/adam.h"
#include "shared/constants.h"

namespace ewa::pipeline {
namespace {

// Weight of the regulariser of exposures. The loss has gradients of the order of 0.1, so this is too weak to
// matter, except where the loss is flat: all exposures change one way, and the splats the other way.
constexpr float kPull = 1e-3f;

/// Writes frame.planes with the exposure applied to frame.exposed.
void record_expose(gpu::Recording& recording, passes::PassCache& cache, const FrameBuffers& frame,
                   const ExposureUse& use) {
    cache.get<passes::Expose>().record(
        recording, {.image = frame.planes, .exposures = use.exposures->values, .exposed = frame.exposed},
        {.image = frame.sizes.image(), .photo = use.photo});
}

/// Turns frame.image_gradient from dL/d(exposed image) into dL/d(image). The exposure takes a step of Adam.
void record_expose_backward(gpu::Recording& recording, passes::PassCache& cache, const FrameBuffers& frame,
                            const ExposureUse& use) {
    const Exposures& e = *use.exposures;
    cache.get<passes::ExposeBackward>().record(recording,
                                               {.image = frame.planes,
                                                .exposures = e.values,
                                                .image_gradient = frame.image_gradient,
                                                .sums = frame.exposure_sums},
                                               {.image = frame.sizes.image(), .photo = use.photo});
    const auto [bias1, bias2] = adam_biases(use.visit);
    cache.get<passes::ExposureUpdate>().record(recording,
                                               {.sums = frame.exposure_sums,
                                                .exposures = e.values,
                                                .moments1 = e.moments1,
                                                .moments2 = e.moments2,
                                                .counts = frame.counts},
                                               {.photo = use.photo,
                                                .blocks = frame.sizes.exposure_blocks,
                                                .rate = use.rate,
                                                .pull = kPull,
                                                .bias1 = bias1,
                                                .bias2 = bias2,
                                                .instance_capacity = frame.instance_capacity});
}

/// Adds each row of frame.partials, in two steps. target: shared::REDUCE_TO_*.
void record_mean(gpu::Recording& recording, passes::PassCache& cache, const FrameBuffers& frame,
                 uint32_t target, uint32_t rows, float scale) {
    const Sizes& s = frame.sizes;
    const auto reduce = cache.get<passes::Reduce>();
    reduce.record(recording, {.source = frame.partials, .sums = frame.reduced, .counts = frame.counts},
                  {.items = s.partials,
                   .block = s.reduce_block,
                   .target = shared::REDUCE_TO_SUMS,
                   .rows = rows,
                   .scale = 1});
    reduce.record(
        recording, {.source = frame.reduced, .sums = frame.partials, .counts = frame.counts},
        {.items = s.reduce_blocks, .block = s.reduce_blocks, .target = target, .rows = rows, .scale = scale});
}

shared::UpdatePush update_push(const Model& model, const FrameBuffers& frame, const Rates& rates) {
    const auto [bias1, bias2] = adam_biases(rates.step);
    return {.splats = model.splats,
            .planes = model.planes(),
            .instance_capacity = frame.instance_capacity,
            .mean_rate = rates.mean,
            .opacity_rate = rates.opacity,
            .quaternion_rate = rates.quaternion,
            .scale_rate = rates.scale,
            .sh0_rate = rates.sh0,
            .sh_rest_rate = rates.sh_rest,
            .bias1 = bias1,
            .bias2 = bias2,
            .half_size = {0.5f * float(frame.sizes.width), 0.5f * float(frame.sizes.height)},
            .opacity_weight = rates.opacity_weight,
            .scale_weight = rates.scale_weight,
            .seed = {uint32_t(rates.seed), uint32_t(rates.seed >> 32)},
            .step = rates.step};
}

}  // namespace

uint32_t update_mode(const Plan& plan) {
    uint32_t mode = 0;
    if (!plan.adam) mode |= shared::UPDATE_GRADIENT_ONLY;
    if (plan.statistics) mode |= shared::UPDATE_STATISTICS;
    if (plan.regularised) mode |= shared::UPDATE_REGULARISED;
    if (plan.absolute) mode |= shared::UPDATE_ABSOLUTE;
    if (plan.packed_moments) mode |= shared::UPDATE_PACKED_MOMENTS;
    if (plan.motion) mode |= shared::UPDATE_MOTION;
    return mode;
}

Exposures::Exposures(gpu::Device& device, size_t count)
    : photos(uint32_t(count)),
      values(device, "exposures", bytes()),
      moments1(device, "exposure moments1", bytes()),
      moments2(device, "exposure moments2", bytes()) {
    const std::vector<Exposure> start(count, kIdentityExposure);
    values.upload(std::span<const Exposure>(start));
    zero(moments1);
    zero(moments2);
}

std::vector<Exposure> Exposures::download() const {
    return values.download<Exposure>(photos);
}

namespace {

constexpr size_t kExposureWords = shared::EXPOSURE_FLOATS / 2;

}  // namespace

Exposures::Words Exposures::words(uint32_t photo) const {
    Words words;
    size_t at = 0;
    for (const gpu::Buffer* buffer : {&values, &moments1, &moments2}) {
        buffer->download(std::as_writable_bytes(std::span(words).subspan(at, kExposureWords)),
                         8 * kExposureWords * photo);
        at += kExposureWords;
    }
    return words;
}

void Exposures::set(uint32_t photo, std::span<const uint64_t> words) {
    size_t at = 0;
    for (gpu::Buffer* buffer : {&values, &moments1, &moments2}) {
        buffer->upload(words.subspan(at, kExposureWords), 8 * kExposureWords * photo);
        at += kExposureWords;
    }
}

double loss_of(double l1, double ssim) {
    return (1 - shared::SSIM_WEIGHT) * l1 + shared::SSIM_WEIGHT * (1 - ssim);
}

double loss_of(const shared::Counts& counts) {
    return loss_of(double(counts.l1), double(counts.ssim));
}

void record_loss(gpu::Recording& recording, passes::PassCache& cache, const FrameBuffers& frame,
                 const FrameInputs& inputs, const gpu::Buffer& photo, bool masked,
                 const ExposureUse* exposure) {
    const shared::ImageLayout layout = frame.sizes.image();
    const Band whole{.rows = layout.size[1], .own_end = layout.size[1]};
    const Band& band = inputs.band.rows > 0 ? inputs.band : whole;
    const uint32_t height = inputs.band.rows > 0 ? inputs.camera.height : layout.size[1];
    const double share = 1.0 / (3.0 * layout.size[0] * height);
    const shared::LossPush push{.image = layout,
                                .ssim_scale = float(-shared::SSIM_WEIGHT * share),
                                .l1_scale = float((1 - shared::SSIM_WEIGHT) * share),
                                .own = {band.own_begin, band.own_end}};
    const uint32_t first_pixel = band.first * layout.size[0];
    const shared::MaskPush mask{.image = layout, .first_pixel = first_pixel};
    const gpu::Buffer& render = exposure ? frame.exposed : frame.planes;
    const gpu::Buffer& image = masked ? frame.masked : render;
    const passes::Constants colors{
        {shared::SPEC_COLOR_FLOATS, photo.texel() == gpu::Texel::rgba32f ? 1u : 0u}};
    if (exposure) record_expose(recording, cache, frame, *exposure);
    if (masked)
        cache.get<passes::MaskPictures>(colors).record(
            recording, {.photo = photo, .image = render, .target = frame.target, .masked = frame.masked},
            mask);
    else
        cache.get<passes::UnpackTarget>(colors).record(
            recording, {.photo = photo, .planes = frame.target},
            {.background = {inputs.background[0], inputs.background[1], inputs.background[2]},
             .image = layout,
             .first_pixel = first_pixel});
    cache.get<passes::LossColumns>().record(
        recording, {.image = image, .target = frame.target, .moments = frame.moments}, push);
    cache.get<passes::LossRows>().record(
        recording, {.moments = frame.moments, .derivatives = frame.derivatives, .partials = frame.partials},
        push);
    record_mean(recording, cache, frame, shared::REDUCE_TO_SSIM, 1, float(share));
    cache.get<passes::LossBackwardColumns>().record(
        recording, {.derivatives = frame.derivatives, .blurred = frame.blurred}, push);
    cache.get<passes::LossBackwardRows>().record(recording,
                                                 {.blurred = frame.blurred,
                                                  .image = image,
                                                  .target = frame.target,
                                                  .image_gradient = frame.image_gradient,
                                                  .partials = frame.partials},
                                                 push);
    if (masked)
        cache.get<passes::MaskGradient>(colors).record(
            recording, {.photo = photo, .image_gradient = frame.image_gradient}, mask);
    record_mean(recording, cache, frame, shared::REDUCE_TO_L1, 2, float(share));
    if (exposure) record_expose_backward(recording, cache, frame, *exposure);
}

namespace {

/// A driver may limit the iterations of an invocation: each strip of the tiles has its own dispatch.
template <class Backward>
void record_rays_backward(const FramePasses& on, const passes::Pass<Backward>& backward,
                          const FrameInputs& inputs, const Sorted& sorted) {
    const FrameBuffers& frame = on.frame;
    const shared::BlendPush blend = blend_push(on.cache.config(), frame, inputs.background);
    on.recording.fill(frame.slots, 0, 0, frame.sizes.slots);
    for (uint32_t strip = 0; strip < passes::strips_of(backward.config); ++strip)
        backward.record(on.recording,
                        {{.records = frame.records,
                          .splats = *sorted.splats,
                          .tile_starts = frame.tile_starts,
                          .planes = frame.planes,
                          .image_gradient = frame.image_gradient,
                          .slots = frame.slots,
                          .rays = frame.rays,
                          .camera = camera_part(inputs),
                          .counts = frame.counts}},
                        {.blend = blend, .samples = inputs.samples, .strip = strip});
}

/// The gradient of integration along rays, to model.moments1.
void record_backward_of_rays(const FramePasses& on, const Model& model, const FrameInputs& inputs,
                             const Sorted& sorted) {
    const auto& [recording, cache, plan, frame] = on;
    const gpu::SpecConstant kernel{shared::SPEC_KERNEL, uint32_t(plan.kernel)};
    if (plan.integrator == Integrator::ray)
        record_rays_backward(on, cache.get<passes::BlendRaysBackward>({kernel}), inputs, sorted);
    else
        record_rays_backward(on,
                             cache.get<passes::MarchRaysBackward>(
                                 {kernel, {shared::SPEC_MODE, march_chunk(inputs.samples, 8)}}),
                             inputs, sorted);
    cache.get<passes::GatherRays>({{shared::SPEC_SH_DEGREE, plan.evaluated_degree(inputs.sh_degree)}, kernel})
        .record(recording,
                {.params = model.params,
                 .camera = camera_part(inputs),
                 .records = frame.records,
                 .slots = frame.slots,
                 .tile_counts = frame.tile_counts,
                 .first_instances = frame.first_instances,
                 .counts = frame.counts,
                 .sorted_indices = *sorted.indices,
                 .gradients = model.moments1},
                update_push(model, frame, {}));
}

/// Blending: passes::BlendBackward or BlendPointsBackward.
template <class Blending>
void record_blend_backward_as(const FramePasses& on, const FrameInputs& inputs, const Sorted& sorted,
                              const passes::Constants& variant) {
    const auto& [recording, cache, plan, frame] = on;
    cache.get<Blending>(variant).record(recording,
                                        {.records = frame.records,
                                         .splats = *sorted.splats,
                                         .tile_starts = frame.tile_starts,
                                         .planes = frame.planes,
                                         .image_gradient = frame.image_gradient,
                                         .slots = frame.slots},
                                        blend_push(cache.config(), frame, inputs.background));
}

passes::UpdateBuffers update_buffers(const Plan& plan, const Model& model, const FrameBuffers& frame,
                                     const CameraUse& camera, const Sorted& sorted) {
    // Packed moments and a gradient alone have no buffer of second moments, and a gradient no statistics. The kernel
    // does not use those bindings, but they need a buffer.
    const gpu::Buffer& moments2 = model.second_moments();
    const gpu::Buffer& statistics = plan.statistics ? model.statistics : frame.partials;
    return {.params = model.params,
            .camera = {*camera.buffer, camera.offset, sizeof(shared::CameraBlock)},
            .records = frame.records,
            .slots = frame.slots,
            .moments1 = model.moments1,
            .moments2 = moments2,
            .tile_counts = frame.tile_counts,
            .first_instances = frame.first_instances,
            .counts = frame.counts,
            .params_out = model.params,
            .moments1_out = model.moments1,
            .moments2_out = moments2,
            .statistics = statistics,
            .sorted_indices = *sorted.indices};
}

}  // namespace

void record_blend_backward(const FramePasses& on, const FrameInputs& inputs, const Sorted& sorted) {
    record_blend_backward_as<passes::BlendBackward>(
        on, inputs, sorted,
        {{shared::SPEC_MODE, on.plan.absolute ? shared::BLEND_BACKWARD_ABSOLUTE : 0},
         {shared::SPEC_KERNEL, uint32_t(on.plan.kernel)}});
}

void record_backward(const FramePasses& on, const Model& model, const FrameInputs& inputs,
                     const Sorted& sorted, const Rates& rates, const MotionUse* motion) {
    if (on.plan.rays()) return record_backward_of_rays(on, model, inputs, sorted);
    const auto& [recording, cache, plan, frame] = on;
    passes::Constants updating{{shared::SPEC_SH_DEGREE, plan.evaluated_degree(inputs.sh_degree)},
                               {shared::SPEC_MODE, update_mode(plan)}};
    const passes::UpdateBuffers buffers = update_buffers(plan, model, frame, inputs.camera, sorted);
    const shared::UpdatePush push = update_push(model, frame, rates);
    if (plan.points()) {
        record_blend_backward_as<passes::BlendPointsBackward>(
            on, inputs, sorted,
            {{shared::SPEC_MODE, plan.absolute ? shared::BLEND_BACKWARD_ABSOLUTE : 0},
             {shared::SPEC_NEAREST, plan.nearest}});
        cache.get<passes::UpdatePoints>(updating).record(recording, {buffers}, push);
        return;
    }
    record_blend_backward(on, inputs, sorted);
    updating.push_back({shared::SPEC_KERNEL, uint32_t(plan.kernel)});
    const gpu::Buffer& motion_sums = plan.motion ? frame.motion_sums : frame.partials;
    cache.get<passes::Update>(updating).record(recording, {buffers, motion_sums}, push);
    if (plan.motion) record_motion_sums(recording, cache, frame);
    if (motion) record_motion_update(recording, cache, frame, *motion);
}

}  // namespace ewa::pipeline
