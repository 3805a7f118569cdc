// SPDX-License-Identifier: Apache-2.0
// Kernels other than those that passes::config_for chooses for a device, to compare their times.
#pragma once
#include <string>

#include "passes/kernel_config.h"

namespace ewa::bench {

/// The configuration of a device with some choices replaced. text: NAME=VALUE,... with the names
///   tile=WIDTHxHEIGHT (px), quads=SPLATS of a batch, broadcast=shuffles|shared|uniform, sort=ranked|counted,
///   slots=sorted|emitted, counts=live|capacity, few=BLOCKS, scan=TURNS, elements=INVOCATIONS of a workgroup, interleave=DISTANCE.
/// Throws InputError, which quotes the choice, if a name is unknown or the device cannot run the value.
passes::KernelConfig config_with(const std::string& text, const gpu::Limits& limits);

}  // namespace ewa::bench
