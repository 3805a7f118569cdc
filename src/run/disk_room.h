// SPDX-License-Identifier: Apache-2.0
// Whether the files of a run fit on their disk.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>

#include "ewa/train_options.h"

namespace ewa::train {

/// Compares the free space on the disk of `folder`, which must exist, with the size of the run's files. Throws RunError if not even
/// splats.ply and checkpoint of the first splats fit. Returns a remark if those of `most` splats may not fit, else an empty text.
/// Files of an earlier run in the folder count as free space, because they are replaced.
/// most: the largest number of splats. options: with a concrete SH degree.
std::string check_disk_room(const std::filesystem::path& folder, uint64_t first, uint64_t most,
                            const TrainOptions& options);

/// The end of an error after the disk was full: how the run can be continued.
/// step: the last one that was trained. checkpoint, splats: the steps of checkpoint.ewa and of splats.ply, -1: there is none.
std::string after_full_disk(int step, int checkpoint, int splats);

}  // namespace ewa::train
