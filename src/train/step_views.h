// SPDX-License-Identifier: Apache-2.0
// The views that a training step renders, and its learning rates. All that changes from step to step is a pure function of the
// step's number.
#pragma once
#include <cstdint>

#include "pipeline/strategy.h"
#include "train/training_parts.h"

namespace ewa::train {

pipeline::Rates rates_of(const TrainingParts& parts, int step);
pipeline::Noise noise_of(const TrainingParts& parts, int step);

/// The view of a step, with its loss. slot: number of the view in its optimisation step, from 0.
portions::StepView view_of(TrainingParts& parts, int step, ImageCache& seen, int sh_degree,
                           uint32_t slot = 0);
/// A view that is rendered without a loss.
portions::StepView plain_view(const TrainingParts& parts, const pipeline::FrameInputs& inputs);

/// Records the update of the learned sky after the views of the steps `first` to `last`. capacity: of (splat, tile) instances.
void record_update_sky(const TrainingParts& parts, const passes::Recorder& on, int first, int last,
                       uint32_t capacity);

/// An optimisation step with several views, bands of views, or portions of splats. Each view counts as a step of the schedule, from
/// `first` to `last`. Collective.
void optimise_several(TrainingParts& parts, int first, int last);

}  // namespace ewa::train
