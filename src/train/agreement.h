// SPDX-License-Identifier: Apache-2.0
// The ranks of a run agree on what they train before they begin.
#pragma once
#include <nlohmann/json.hpp>

#include "ewa/device.h"
#include "ewa/run.h"

namespace ewa::train {

/// Rank 0: tells the others the settings of its checkpoint (checkpoint_settings) and returns when all agree.
/// Another rank: takes the options of rank 0 that decide the result, which a resumed run has from its checkpoint. Collective.
/// fingerprint: of this rank's dataset. Throws InputError on every rank, which names the first rank that has another
/// version, dataset or kind of device than rank 0, and what differs.
void agree(RunOptions& options, const nlohmann::ordered_json& settings, const std::string& fingerprint,
           const gpu::Device& device);

}  // namespace ewa::train
