// SPDX-License-Identifier: Apache-2.0
#include "pipeline/backward.h"

#include <utility>

#include "pipeline/adam.h"
#include "pipeline/appearances.h"
#include "pipeline/methods.h"
#include "shared/constants.h"

namespace ewa::pipeline {
namespace {

shared::UpdateBlock update_values(const Model& model, const FrameBuffers& frame, const Rates& rates) {
    const AdamShares shares = adam_shares(rates.nesterov, rates.step);
    return {.splats = model.splats,
            .planes = model.planes(),
            .instance_capacity = frame.instance_capacity,
            .mean_rate = rates.mean,
            .opacity_rate = rates.opacity,
            .quaternion_rate = rates.quaternion,
            .scale_rate = rates.scale,
            .sh0_rate = rates.sh0,
            .sh_rest_rate = rates.sh_rest,
            .moment_share = shares.moment,
            .gradient_share = shares.gradient,
            .bias2 = adam_biases(rates.step)[1],
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
    if (plan.loss.depth > 0) mode |= shared::UPDATE_DEPTH;
    return mode;
}

LossTerms terms_of(const shared::Counts& counts) {
    return {counts.l1, counts.l2, counts.ssim, counts.alpha, counts.depth};
}

double loss_of(const LossWeights& weights, const LossTerms& terms) {
    double loss = weights.l1 * terms.l1 + weights.ssim * (1 - terms.ssim);
    if (weights.l2 > 0) loss += weights.l2 * terms.l2;
    if (weights.alpha > 0) loss += weights.alpha * terms.alpha;
    if (weights.depth > 0) loss += weights.depth * terms.depth;
    return loss;
}

double loss_of(const LossWeights& weights, const shared::Counts& counts) {
    return loss_of(weights, terms_of(counts));
}

/// Adds `items` floats of each row of frame.partials, in two steps unless they are one block. target: that of the first row,
/// shared::REDUCE_TO_*.
void FramePasses::mean_of_partials(uint32_t target, uint32_t items, uint32_t rows, float scale) const {
    passes::Reduce pass{.source = frame.partials, .sums = frame.reduced, .counts = frame.counts};
    if (const uint32_t block = frame.sizes.reduce_block; items > block) {
        record(pass,
               {.items = items, .block = block, .target = shared::REDUCE_TO_SUMS, .rows = rows, .scale = 1});
        std::swap(pass.source, pass.sums);
        items = (items + block - 1) / block;
    }
    record(pass, {.items = items, .block = items, .target = target, .rows = rows, .scale = scale});
}

/// The terms of the loss that the plan has, and their gradient by the image.
void FramePasses::compare(const gpu::Buffer& image, const shared::LossPush& push, float share) const {
    const bool similarity = plan.loss.ssim > 0, squares = plan.loss.l2 > 0;
    if (similarity) {
        record(passes::LossColumns{.image = image, .target = frame.target, .moments = frame.moments}, push);
        record(
            passes::LossRows{
                .moments = frame.moments, .derivatives = frame.derivatives, .partials = frame.partials},
            push);
        record(passes::LossBackwardColumns{.derivatives = frame.derivatives, .blurred = frame.blurred}, push);
    }
    const uint32_t mode = (similarity ? shared::LOSS_SSIM : 0) | (squares ? shared::LOSS_SQUARES : 0);
    // A binding that a mode does not use needs a buffer.
    record(passes::LossBackwardRows{.blurred = similarity ? frame.blurred : frame.target,
                                    .image = image,
                                    .target = frame.target,
                                    .image_gradient = frame.image_gradient,
                                    .partials = frame.partials},
           push, {{shared::SPEC_MODE, mode}});
    mean_of_partials(similarity ? shared::REDUCE_TO_SSIM : shared::REDUCE_TO_L1, frame.sizes.partials,
                     2u + similarity + squares, share);
}

/// The alpha of a cut-out photo as a term of the loss, and the gradient by the transmittance, which is 0 for other photos.
void FramePasses::compare_alpha(const gpu::Buffer& photo, bool cut, const shared::MaskPush& at,
                                const shared::LossPush& loss) const {
    const uint64_t plane = uint64_t(at.image.plane_floats) * 4;
    if (!cut) return recording.fill(frame.image_gradient, 0, shared::PLANE_T * plane, plane);
    const uint32_t height = inputs.band.rows > 0 ? inputs.camera.height : at.image.size[1];
    const double share = 1.0 / (double(at.image.size[0]) * height);
    record(passes::AlphaLoss{.photo = photo,
                             .planes = frame.planes,
                             .image_gradient = frame.image_gradient,
                             .partials = frame.partials},
           {.image = at.image,
            .first_pixel = at.first_pixel,
            .own = {loss.own[0], loss.own[1]},
            .scale = float(plan.loss.alpha * share)},
           {{shared::SPEC_COLOR_FLOATS, photo.texel() == gpu::Texel::rgba32f ? 1u : 0u}});
    // The partial sums of one channel.
    mean_of_partials(shared::REDUCE_TO_ALPHA, frame.sizes.partials / 3, 1, float(share));
}

/// The depths of a photo as a term of the loss, and the gradient by the planes of depth and transmittance.
void FramePasses::compare_depth(const DepthUse& depths, const shared::MaskPush& at,
                                const shared::LossPush& loss) const {
    const shared::ImageLayout& image = at.image;
    const uint64_t plane = uint64_t(image.plane_floats) * 4;
    if (plan.loss.alpha == 0) recording.fill(frame.image_gradient, 0, shared::PLANE_T * plane, plane);
    if (!depths.map) return recording.fill(frame.image_gradient, 0, shared::PLANE_DEPTH * plane, plane);
    const uint32_t height = inputs.band.rows > 0 ? inputs.camera.height : image.size[1];
    const double share = 1.0 / (depths.pixels > 0 ? double(depths.pixels) : double(image.size[0]) * height);
    record(passes::DepthLoss{.planes = frame.planes,
                             .depths = *depths.map,
                             .image_gradient = frame.image_gradient,
                             .partials = frame.partials},
           {.image = image,
            .first_pixel = at.first_pixel,
            .own = {loss.own[0], loss.own[1]},
            .scale = float(plan.loss.depth * share)});
    // The partial sums of one channel.
    mean_of_partials(shared::REDUCE_TO_DEPTH, frame.sizes.partials / 3, 1, float(share));
}

/// Composites a photo over the background, into frame.target.
void FramePasses::unpack(const gpu::Buffer& photo) const {
    const shared::ImageLayout layout = frame.sizes.image();
    record(passes::UnpackTarget{.photo = photo, .planes = frame.target},
           {.background = {inputs.background[0], inputs.background[1], inputs.background[2]},
            .image = layout,
            .first_pixel = inputs.band.first * layout.size[0]},
           {{shared::SPEC_COLOR_FLOATS, photo.texel() == gpu::Texel::rgba32f ? 1u : 0u}});
}

void FramePasses::write_values(const Model& model, const Rates& rates) const {
    const shared::UpdateBlock values = update_values(model, frame, rates);
    recording.write(frame.update_values, 0, std::as_bytes(std::span(&values, 1)));
}

void FramePasses::prepare(const Model& model, const gpu::Buffer& photo, const Rates& rates) const {
    recording.copy(*inputs.camera.buffer, inputs.camera.offset, frame.step_camera, 0,
                   sizeof(shared::CameraBlock));
    clear_counts();
    write_values(model, rates);
    unpack(photo);
}

void FramePasses::loss(const gpu::Buffer& photo, bool masked, const AppearanceUse* appearance, bool cut,
                       const DepthUse& depths) const {
    const shared::ImageLayout layout = frame.sizes.image();
    const Band whole{.rows = layout.size[1], .own_end = layout.size[1]};
    const Band& band = inputs.band.rows > 0 ? inputs.band : whole;
    const uint32_t height = inputs.band.rows > 0 ? inputs.camera.height : layout.size[1];
    const double share = 1.0 / (3.0 * layout.size[0] * height);
    const shared::LossPush push{.image = layout,
                                .ssim_scale = float(-plan.loss.ssim * share),
                                .l1_scale = float(plan.loss.l1 * share),
                                .l2_scale = float(plan.loss.l2 * share),
                                .own = {band.own_begin, band.own_end}};
    const uint32_t first_pixel = band.first * layout.size[0];
    const shared::MaskPush mask{.image = layout, .first_pixel = first_pixel};
    const gpu::Buffer& render = appearance ? frame.exposed : frame.planes;
    const gpu::Buffer& image = masked ? frame.masked : render;
    const passes::Constants colors{
        {shared::SPEC_COLOR_FLOATS, photo.texel() == gpu::Texel::rgba32f ? 1u : 0u}};
    if (appearance) apply_appearance(*appearance);
    if (masked)
        record(
            passes::MaskImages{
                .photo = photo, .image = render, .target = frame.target, .masked = frame.masked},
            mask, colors);
    else if (!inputs.prepared)
        unpack(photo);
    compare(image, push, float(share));
    if (masked)
        record(passes::MaskGradient{.photo = photo, .image_gradient = frame.image_gradient}, mask, colors);
    if (plan.loss.alpha > 0) compare_alpha(photo, cut, mask, push);
    if (plan.loss.depth > 0) compare_depth(depths, mask, push);
    if (appearance) appearance_backward(*appearance);
}

/// Gradients of blending, which are left in frame.slots.
void FramePasses::blend_backward(const Sorted& sorted) const {
    const bool depth = plan.loss.depth > 0;
    passes_of(*plan.method)
        .blend_backward(
            *this,
            {{.records = frame.records,
              .splats = *sorted.splats,
              .tile_starts = frame.tile_starts,
              .planes = frame.planes},
             frame.image_gradient,
             frame.slots},
            blend_push(cache.config(), frame, inputs.background),
            {shared::SPEC_MODE, (plan.absolute ? shared::BLEND_BACKWARD_ABSOLUTE : 0) |
                                    (plan.loss.alpha > 0 || depth ? shared::BLEND_BACKWARD_ALPHA : 0) |
                                    (depth ? shared::BLEND_BACKWARD_FOURTH : 0)});
}

void FramePasses::backward(const Model& model, const Sorted& sorted, const Rates& rates,
                           const MotionUse* motion) const {
    blend_backward(sorted);
    if (!inputs.prepared) write_values(model, rates);
    const gpu::Buffer& moments2 = model.second_moments();
    // Packed moments and a gradient alone have no buffer of second moments, and a gradient no statistics. The kernel
    // does not use those bindings, but they need a buffer.
    const passes::UpdateBuffers buffers{.params = model.params,
                                        .camera = camera(),
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
                                        .statistics = plan.statistics ? model.statistics : frame.partials,
                                        .sorted_indices = *sorted.indices,
                                        .values = frame.update_values};
    passes_of(*plan.method)
        .update(*this, buffers, update_values(model, frame, rates), {shared::SPEC_MODE, update_mode(plan)});
    if (plan.motion) record_motion_sums(*this, frame, inputs.camera.lenses == shared::LENSES_ROLLING);
    if (motion) record_motion_update(*this, frame, *motion);
}

}  // namespace ewa::pipeline
