// SPDX-License-Identifier: Apache-2.0
// Divides a machine among several processes that train together.
#pragma once
#include "ewa/device.h"
#include "ewa/ranks.h"

namespace ewa::train {

/// Gives each rank on a machine its share of the cores if the device is a CPU, or one of several equal GPUs of its own. Every rank
/// calls it, before any Vulkan function. Does nothing for a rank alone. Throws as open_device does.
void share_machine(Ranks& ranks, DeviceOptions& options);

}  // namespace ewa::train
