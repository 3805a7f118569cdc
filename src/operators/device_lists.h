// SPDX-License-Identifier: Apache-2.0
// The lists of a caller's tiles as lists of the device's tiles.
#pragma once
#include <cstdint>
#include <functional>
#include <vector>

#include "ewa/operators.h"
#include "passes/kernel_config.h"
#include "pipeline/frame_buffers.h"

namespace ewa::operators {

struct DeviceLists {
    std::vector<uint32_t> splats, tile_starts, tile_counts;
    std::vector<uint32_t> sorted_indices, first_instances;  // each splat's places in the lists
};

/// Whether an instance needs the part of its tile in which it counts, because borders of the caller's tiles cross the device's.
bool have_parts(const TileLists& lists, const passes::KernelConfig& config);

/// Lists for the device's tiles: the splats of the caller's tiles that a tile overlaps, in their order, if they reach it.
/// reserve: called with the number of instances before memory is taken for them. Throws InputError for wrong lists.
DeviceLists device_lists(const ScreenSplats& splats, const TileLists& lists, const pipeline::Sizes& sizes,
                         const passes::KernelConfig& config, const std::function<void(uint32_t)>& reserve);

}  // namespace ewa::operators
