// SPDX-License-Identifier: Apache-2.0
#include "pipeline/exposure.h"

#include <cmath>

#include "pipeline/model.h"
#include "shared/constants.h"

namespace ewa::pipeline {
namespace {

// Gradients of the loss by an exposure are of the order of 0.1: this decides nothing but the direction in
// which the loss is flat, all exposures moving one way and the splats the other.
constexpr float kPull = 1e-3f;

shared::ExposurePush push_of(const Frame& frame, uint32_t width, uint32_t height, const ExposureUse& use) {
    return {{width, height}, frame.sizes.stride, frame.sizes.plane_floats, use.photo};
}

}  // namespace

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

void record_expose(gpu::Recording& recording, Kernels& kernels, const Frame& frame, uint32_t width,
                   uint32_t height, const ExposureUse& use) {
    kernels.get<passes::Expose>().record(recording, kernels.shape(),
                                         {frame.planes, use.exposures->values, frame.exposed},
                                         push_of(frame, width, height, use));
}

void record_expose_backward(gpu::Recording& recording, Kernels& kernels, const Frame& frame, uint32_t width,
                            uint32_t height, const ExposureUse& use) {
    const Exposures& e = *use.exposures;
    kernels.get<passes::ExposeBackward>().record(
        recording, kernels.shape(), {frame.planes, e.values, frame.image_gradient, frame.exposure_sums},
        push_of(frame, width, height, use));
    const double visit = use.visit;
    kernels.get<passes::ExposureUpdate>().record(
        recording, {frame.exposure_sums, e.values, e.moments1, e.moments2, frame.counts},
        {use.photo, frame.sizes.exposure_blocks, use.rate, kPull,
         float(1 / (1 - std::pow(shared::ADAM_BETA1, visit))),
         float(1 / (1 - std::pow(shared::ADAM_BETA2, visit))), frame.instance_capacity});
}

}  // namespace ewa::pipeline
