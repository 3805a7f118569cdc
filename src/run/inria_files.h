// SPDX-License-Identifier: Apache-2.0
// A run in the layout of INRIA's trainer, which SIBR's viewers open.
#pragma once
#include <filesystem>

#include "ewa/gaussians.h"
#include "run/run_input.h"

namespace ewa::train {

/// Writes into folder/inria: cfg_args, cameras.json, input.ply and point_cloud/iteration_<step>/point_cloud.ply. input: its frames
/// have the cameras that belong to the splats. Throws RunError.
void save_inria(const std::filesystem::path& folder, const RunInput& input, const Gaussians& gaussians,
                int step);

/// Removes the splats that save_inria wrote for an earlier run: viewers take those of the largest step.
void remove_inria_splats(const std::filesystem::path& folder);

}  // namespace ewa::train
