// SPDX-License-Identifier: Apache-2.0
// What a step draws and how far it moves the splats. All that changes from step to step is a pure function of the step's number.
#pragma once
#include <cstdint>

#include "pipeline/strategy.h"
#include "train/training_parts.h"

namespace ewa::train {

pipeline::Rates rates_of(const TrainingParts& parts, int step);
pipeline::Noise noise_of(const TrainingParts& parts, int step);

/// slot: of the view in the step.
portions::StepView view_of(TrainingParts& parts, int step, ImageCache& seen, int sh_degree,
                           uint32_t slot = 0);
/// A view that is drawn without a loss.
portions::StepView plain_view(const TrainingParts& parts, const pipeline::FrameInputs& inputs);

/// The update of the sky after these views.
void record_update_sky(const TrainingParts& parts, const passes::Recorder& on, int first, int last,
                       uint32_t capacity);

/// An optimisation step of several parts of views, or portions. Each of the views is a step of the schedule. Collective.
void optimise_several(TrainingParts& parts, int first, int last);

}  // namespace ewa::train
