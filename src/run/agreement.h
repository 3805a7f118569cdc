// SPDX-License-Identifier: Apache-2.0
// The ranks of a run agree on what they train before they begin.
#pragma once
#include <nlohmann/json.hpp>

#include "ewa/device.h"
#include "ewa/gaussians.h"
#include "ewa/run_options.h"

namespace ewa::train {

/// Each rank compares its options that decide the result with those of rank 0, before it loads the first splats. If rank 0 resumes
/// a run, the other ranks take the options of rank 0. Collective. A rank whose option differs throws InputError with the option and
/// both values.
void agree_on_options(RunOptions& options);

/// Rank 0 sends the settings of its checkpoint (checkpoint_settings) to the others, and returns when all agree. The other ranks
/// take rank 0's options that decide the result, which in a resumed run come from its checkpoint. Collective. fingerprint: of this
/// rank's dataset. start: this rank's first splats. Throws InputError on every rank if one has another version, dataset, first
/// splats or kind of device than rank 0. The text names the first such rank, and the difference.
void agree(RunOptions& options, const nlohmann::ordered_json& settings, const std::string& fingerprint,
           const Gaussians& start, const gpu::Device& device);

}  // namespace ewa::train
