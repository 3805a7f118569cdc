// SPDX-License-Identifier: Apache-2.0
// What a training joins of all portions on rank 0, and what it divides among them. All steps are finished. All but check_fits and
// chunk_figures are collective.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "ewa/summary.h"
#include "train/state_stream.h"
#include "train/training_parts.h"

namespace ewa::train {

/// Rank 0 writes the state or reads it; the others pass null.
void save(TrainingParts& parts, StateWriter* to);
void restore(TrainingParts& parts, StateReader* from);
/// Throws InputError if the state is not one of this training.
void check_fits(TrainingParts& parts, StateReader& from);

/// Only rank 0 gets a result.
Gaussians gaussians_of(TrainingParts& parts);
/// Those of rank 0 are drawn, by all ranks. Only rank 0 gets images.
std::vector<Image> render(TrainingParts& parts, std::span<const Camera> cameras);

std::vector<RankFigures> rank_figures(const TrainingParts& parts);
std::optional<ChunkFigures> chunk_figures(const TrainingParts& parts);

}  // namespace ewa::train
