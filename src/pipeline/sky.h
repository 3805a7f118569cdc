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

/// As SkyMap.
struct SkyTexels {
    uint32_t size = 0;
    gpu::Buffer values;

    SkyTexels() = default;
    SkyTexels(gpu::Device& device, const SkyMap& map);
    uint64_t bytes() const { return 4ull * 3 * size * size; }
    SkyUse use() const { return {&values, size}; }
};

/// A sky that training learns. A slot has the gradient by its view, in whole multiples of 1 / SKY_UNITS.
struct LearnedSky : LearnedTable {
    uint32_t size = 0;
    gpu::Buffer before;  // the values, while they change

    LearnedSky() = default;
    /// Grey. views: of a step at most.
    LearnedSky(gpu::Device& device, uint32_t views);
    SkyMap download() const;
    SkyUse use() const { return {&values, size}; }
};

/// Adam's step after those of all views. step: of the optimiser, from 1. capacity: of instances; more in frame.counts change
/// nothing.
void record_sky_update(const passes::Recorder& on, const LearnedSky& sky, const FrameBuffers& frame,
                       uint32_t views, float rate, uint32_t step, uint32_t capacity);

}  // namespace ewa::pipeline
