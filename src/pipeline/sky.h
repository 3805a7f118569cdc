// SPDX-License-Identifier: Apache-2.0
// The sky behind the splats on the device: a map that is given, or one that training learns beside them.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "ewa/sky_map.h"
#include "pipeline/forward.h"

namespace ewa::pipeline {

inline constexpr uint32_t kLearnedSkySize = 128;  // texels a side

/// As SkyMap.
struct SkyTexels {
    uint32_t size = 0;
    gpu::Buffer values;

    SkyTexels() = default;
    SkyTexels(gpu::Device& device, const SkyMap& map);
    uint64_t bytes() const { return 4ull * 3 * size * size; }
};

/// With Adam's moments, and the gradient by each view of a step, in whole multiples of 1 / SKY_UNITS.
struct LearnedSky : SkyTexels {
    gpu::Buffer moments1, moments2, slots;
    gpu::Buffer before;  // the values, while they change

    LearnedSky() = default;
    /// Grey. views: of a step at most.
    LearnedSky(gpu::Device& device, uint32_t views);
    SkyMap download() const;

    /// What a step learns of a view, for other ranks. slot: its view in the step.
    size_t words_of_view() const { return bytes() / 8; }
    std::vector<uint64_t> words(uint32_t slot) const;
    void set(uint32_t slot, std::span<const uint64_t> words);
};

/// Adam's step after those of all views. step: of the optimiser, from 1. capacity: of instances; more in frame.counts change
/// nothing.
void record_sky_update(const passes::Recorder& on, const LearnedSky& sky, const FrameBuffers& frame,
                       uint32_t views, float rate, uint32_t step, uint32_t capacity);

}  // namespace ewa::pipeline
