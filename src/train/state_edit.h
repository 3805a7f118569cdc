// SPDX-License-Identifier: Apache-2.0
// Edits of a training's state: splats are removed, frozen, or learn again.
//
// A frozen splat has words of FROZEN_MOMENT in place of Adam's moments. No step and no refinement changes it. Moments follow their
// splat through refinements, between portions and into checkpoints, so the mark does too.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "ewa/splat_edit_request.h"
#include "ewa/step_report.h"
#include "ewa/summary.h"

namespace ewa::train {

/// Applies the edit to a state. The values, moments and statistics of all other splats keep their bytes. The edit's counts are of
/// splats that change. Throws InputError, before any change, for an index that is not below the number of splats, or if no splat
/// would be left.
EditCounts apply_edit(const SplatEdit& edit, TrainerState& state);

/// Whether splat i is frozen, by moments with the layout of the parameters.
bool is_frozen(std::span<const std::byte> moments, uint32_t planes, size_t i);
/// The number of frozen splats in such an array.
uint32_t count_frozen(std::span<const std::byte> moments, uint32_t planes);

}  // namespace ewa::train
