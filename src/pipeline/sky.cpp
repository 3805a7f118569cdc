// SPDX-License-Identifier: Apache-2.0
#include "pipeline/sky.h"

#include <algorithm>

#include "passes/passes.h"
#include "pipeline/adam.h"
#include "shared/constants.h"

namespace ewa::pipeline {
namespace {

constexpr float kGrey = 0.5f;

shared::SkyPush sky_push(const FrameBuffers& frame, uint32_t size, const Band& band) {
    return {.image = frame.sizes.image(), .size = size, .first_row = band.rows > 0 ? band.first : 0};
}

}  // namespace

SkyTexels::SkyTexels(gpu::Device& device, const SkyMap& map)
    : size(uint32_t(map.size)), values(device, "sky", bytes()) {
    values.upload(std::span<const float>(map.texels));
}

LearnedSky::LearnedSky(gpu::Device& device, uint32_t views)
    : LearnedTable(device,
                   {.name = "sky",
                    .moments = "sky_moments",
                    .slot_floats = 3 * kLearnedSkySize * kLearnedSkySize,
                    .views = views},
                   std::vector<float>(3ull * kLearnedSkySize * kLearnedSkySize, kGrey)),
      size(kLearnedSkySize),
      before(device, "sky before", bytes()) {}

SkyMap LearnedSky::download() const {
    return {int(size), LearnedTable::download()};
}

void FramePasses::add_sky() const {
    record(passes::AddSky{.planes = frame.planes, .camera = camera(), .sky = *inputs.sky.texels},
           sky_push(frame, inputs.sky.size, inputs.band), {lenses()});
}

void FramePasses::sky_gradient(const LearnedSky& sky, uint32_t slot) const {
    recording.fill(sky.slots, 0, sky.bytes() * slot, sky.bytes());
    record(passes::SkyGradient{.planes = frame.planes,
                               .image_gradient = frame.image_gradient,
                               .camera = camera(),
                               .slots = sky.slots,
                               .counts = frame.counts},
           {.sky = sky_push(frame, sky.size, inputs.band), .slot = 3 * sky.size * sky.size * slot},
           {lenses()});
}

void record_sky_update(const passes::Recorder& on, const LearnedSky& sky, const FrameBuffers& frame,
                       uint32_t views, float rate, uint32_t step, uint32_t capacity) {
    const auto [bias1, bias2] = adam_biases(step);
    on.recording.copy(sky.values, 0, sky.before, 0, sky.bytes());
    on.record(passes::SkyUpdate{.slots = sky.slots,
                                .before = sky.before,
                                .sky = sky.values,
                                .moments1 = sky.moments1,
                                .moments2 = sky.moments2,
                                .counts = frame.counts},
              {.size = sky.size,
               .views = views,
               .rate = rate,
               .bias1 = bias1,
               .bias2 = bias2,
               .instance_capacity = capacity});
}

}  // namespace ewa::pipeline
