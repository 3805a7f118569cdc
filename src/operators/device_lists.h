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

/// Whether an instance must say in which part of its tile it counts: the caller's tiles cut the device's.
bool have_parts(const TileLists& lists, const passes::KernelConfig& config);

/// A device's tile lists the splats of the caller's tiles that it overlaps, in their order, without those that end outside of it.
/// reserve: called with the number of instances before memory is taken for them. Throws InputError for wrong lists.
DeviceLists device_lists(const ScreenSplats& splats, const TileLists& lists, const pipeline::Sizes& sizes,
                         const passes::KernelConfig& config, const std::function<void(uint32_t)>& reserve);

}  // namespace ewa::operators
