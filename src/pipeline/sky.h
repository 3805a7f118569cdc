// SPDX-License-Identifier: Apache-2.0
// The sky behind the splats on the device: a map that is given, or one that training learns beside them.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "ewa/sky_map.h"
#include "pipeline/frame_passes.h"
#include "pipeline/learned_table.h"

namespace ewa::pipeline {

inline constexpr uint32_t kLearnedSkySize = 128;  // texels a side

/// A given SkyMap on the device.
struct SkyTexels {
    uint32_t size = 0;
    gpu::Buffer values;

    SkyTexels() = default;
    SkyTexels(gpu::Device& device, const SkyMap& map);
    uint64_t bytes() const { return 4ull * 3 * size * size; }
    SkyUse use() const { return {&values, size}; }
};

/// A sky that training learns. A view's slot has the gradient of that view as integers, in units of 1 / SKY_UNITS.
struct LearnedSky : LearnedTable {
    uint32_t size = 0;
    gpu::Buffer before;  // copy of the values during their update

    LearnedSky() = default;
    /// A grey sky. views: the most views of a step.
    LearnedSky(gpu::Device& device, uint32_t views);
    SkyMap download() const;
    SkyUse use() const { return {&values, size}; }
};

/// Records Adam's step of the sky, after all views of the step. step: of the optimiser, from 1. capacity: of (splat, tile)
/// instances. If frame.counts exceeds it, nothing changes.
void record_sky_update(const passes::Recorder& on, const LearnedSky& sky, const FrameBuffers& frame,
                       uint32_t views, float rate, uint32_t step, uint32_t capacity);

}  // namespace ewa::pipeline
