// SPDX-License-Identifier: Apache-2.0
// The part of a machine for one of several processes that train together.
#pragma once
#include "ewa/device.h"
#include "ewa/ranks.h"

namespace ewa::train {

/// Gives each rank of a machine its share of the cores, for a CPU device, and its own of several equal GPUs. Every rank
/// calls it, before any Vulkan function. Does nothing for a rank alone. Throws as open_device does.
void share_machine(Ranks& ranks, DeviceOptions& options);

}  // namespace ewa::train
