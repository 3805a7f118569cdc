// SPDX-License-Identifier: Apache-2.0
// Functions that collect data of all portions on rank 0, or divide data among them. Call them only when all steps are finished. All
// but check_fits and chunk_figures are collective.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "ewa/summary.h"
#include "train/state_stream.h"
#include "train/training_parts.h"

namespace ewa::train {

/// Save and restore a training's state. Rank 0 passes the writer or reader; other ranks pass null.
void save(TrainingParts& parts, StateWriter* to);
void restore(TrainingParts& parts, StateReader* from);
/// Throws InputError if step, SH degree, origin or arrays of the state do not fit this training.
void check_fits(TrainingParts& parts, StateReader& from);

/// The splats of all portions, on rank 0. Other ranks get none.
Gaussians gaussians_of(TrainingParts& parts);
/// All ranks together render the cameras that rank 0 passes. Only rank 0 gets the images.
std::vector<Image> render(TrainingParts& parts, std::span<const Camera> cameras);

std::vector<RankFigures> rank_figures(const TrainingParts& parts);
std::optional<ChunkFigures> chunk_figures(const TrainingParts& parts);

}  // namespace ewa::train
