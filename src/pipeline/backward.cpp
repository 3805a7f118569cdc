// SPDX-License-Identifier: Apache-2.0
#include "pipeline/backward.h"

#include <cmath>

#include "shared/constants.h"

namespace ewa::pipeline {
namespace {

void record_mean(gpu::Recording& recording, Kernels& kernels, const Frame& frame, uint32_t target,
                 float scale) {
    const passes::Shape& shape = kernels.shape();
    const Sizes& s = frame.sizes;
    const auto& reduce = kernels.get<passes::Reduce>();
    reduce.record(recording, shape, {frame.partials, frame.reduced, frame.counts},
                  {s.partials, s.reduce_block, 0, 1});
    reduce.record(recording, shape, {frame.reduced, frame.partials, frame.counts},
                  {s.reduce_blocks, s.reduce_blocks, target, scale});
}

}  // namespace

double loss_of(const shared::Counts& counts) {
    return (1 - shared::SSIM_WEIGHT) * double(counts.l1) + shared::SSIM_WEIGHT * (1 - double(counts.ssim));
}

void record_loss(gpu::Recording& recording, Kernels& kernels, const Frame& frame, const CameraUse& camera,
                 const std::array<float, 3>& background, const gpu::Buffer& photo, bool masked,
                 const ExposureUse* exposure) {
    const passes::Shape& shape = kernels.shape();
    const Sizes& s = frame.sizes;
    const double share = 1.0 / (3.0 * camera.width * camera.height);
    const shared::LossPush push{{camera.width, camera.height},
                                s.stride,
                                s.plane_floats,
                                float(-shared::SSIM_WEIGHT * share),
                                float((1 - shared::SSIM_WEIGHT) * share)};
    const shared::MaskPush mask{{camera.width, camera.height}, s.stride, s.plane_floats};
    const gpu::Buffer& drawn = exposure ? frame.exposed : frame.planes;
    const gpu::Buffer& image = masked ? frame.masked : drawn;
    if (exposure) record_expose(recording, kernels, frame, camera.width, camera.height, *exposure);
    if (masked)
        kernels.get<passes::MaskPictures>().record(recording, shape,
                                                   {photo, drawn, frame.target, frame.masked}, mask);
    else
        kernels.get<passes::UnpackTarget>().record(recording, shape, {photo, frame.target},
                                                   {{background[0], background[1], background[2]},
                                                    {camera.width, camera.height},
                                                    s.stride,
                                                    s.plane_floats});
    kernels.get<passes::LossColumns>().record(recording, shape, {image, frame.target, frame.moments}, push);
    kernels.get<passes::LossRows>().record(recording, shape,
                                           {frame.moments, frame.derivatives, frame.partials}, push);
    record_mean(recording, kernels, frame, 2, float(share));
    kernels.get<passes::LossBackwardColumns>().record(recording, shape, {frame.derivatives, frame.blurred},
                                                      push);
    kernels.get<passes::LossBackwardRows>().record(
        recording, shape, {frame.blurred, image, frame.target, frame.image_gradient, frame.partials}, push);
    if (masked)
        kernels.get<passes::MaskGradient>().record(recording, shape, {photo, frame.image_gradient}, mask);
    record_mean(recording, kernels, frame, 1, float(share));
    if (exposure) record_expose_backward(recording, kernels, frame, camera.width, camera.height, *exposure);
}

void record_backward(gpu::Recording& recording, Kernels& kernels, const Plan& plan, const Model& model,
                     const Frame& frame, const CameraUse& camera, const std::array<float, 3>& background,
                     const Sorted& sorted, const Rates& rates) {
    const passes::Shape& shape = kernels.shape();
    kernels.get<passes::BlendBackward>(plan.absolute ? 1u : 0u)
        .record(recording, shape,
                {frame.records, *sorted.splats, frame.tile_starts, frame.planes, frame.image_gradient,
                 frame.slots},
                blend_push(kernels, frame, camera, background));

    // What a gradient alone does not have stands in for itself: the kernel leaves those bindings alone.
    const gpu::Buffer& moments2 = plan.adam ? model.moments2 : model.moments1;
    const gpu::Buffer& statistics = plan.statistics ? model.statistics : frame.partials;
    const uint32_t mode = (plan.adam ? 0u : 1u) | (plan.statistics ? 2u : 0u) | (plan.regularised ? 4u : 0u) |
                          (plan.absolute ? 8u : 0u);
    const double step = rates.step;
    kernels.get<passes::Update>(uint32_t(plan.sh_degree), uint32_t(plan.kernel), mode)
        .record(recording, shape,
                {model.params, *camera.buffer, camera.offset, frame.records, frame.slots, model.moments1,
                 moments2, frame.tile_counts, frame.first_instances, *sorted.places, frame.counts,
                 model.params, model.moments1, moments2, statistics},
                {model.splats,
                 model.planes(),
                 frame.instance_capacity,
                 rates.mean,
                 rates.opacity,
                 rates.quaternion,
                 rates.scale,
                 rates.sh0,
                 rates.sh_rest,
                 float(1 / (1 - std::pow(shared::ADAM_BETA1, step))),
                 float(1 / (1 - std::pow(shared::ADAM_BETA2, step))),
                 {0.5f * float(camera.width), 0.5f * float(camera.height)},
                 rates.opacity_weight,
                 rates.scale_weight});
}

}  // namespace ewa::pipeline
