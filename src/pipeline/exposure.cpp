// SPDX-License-Identifier: Apache-2.0
#include "pipeline/exposure.h"

#include <cmath>

#include "passes/loss.h"
#include "pipeline/model.h"
#include "shared/constants.h"

namespace ewa::pipeline {
namespace {

// Gradients of the loss by an exposure are of the order of 0.1. The pull is too weak to matter, except in the
// direction in which the loss is flat: all exposures change one way and the splats the other way.
constexpr float kPull = 1e-3f;

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

void record_expose(gpu::Recording& recording, passes::PassCache& cache, const FrameBuffers& frame,
                   const ExposureUse& use) {
    cache.get<passes::Expose>().record(
        recording, {.image = frame.planes, .exposures = use.exposures->values, .exposed = frame.exposed},
        {.image = frame.sizes.image(), .photo = use.photo});
}

void record_expose_backward(gpu::Recording& recording, passes::PassCache& cache, const FrameBuffers& frame,
                            const ExposureUse& use) {
    const Exposures& e = *use.exposures;
    cache.get<passes::ExposeBackward>().record(recording,
                                               {.image = frame.planes,
                                                .exposures = e.values,
                                                .image_gradient = frame.image_gradient,
                                                .sums = frame.exposure_sums},
                                               {.image = frame.sizes.image(), .photo = use.photo});
    const double visit = use.visit;
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
                                                .bias1 = float(1 / (1 - std::pow(shared::ADAM_BETA1, visit))),
                                                .bias2 = float(1 / (1 - std::pow(shared::ADAM_BETA2, visit))),
                                                .instance_capacity = frame.instance_capacity});
}

}  // namespace ewa::pipeline
