// SPDX-License-Identifier: Apache-2.0
// Whether the files of a run fit on their disk.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>

#include "ewa/train_options.h"

namespace ewa::train {

/// Compares the free space of the disk that has `folder`, which must exist, with what the run's files will take. Throws
/// RunError if not even splats and checkpoint of the first splats fit. Returns a remark if those of the largest number of
/// splats may not, else an empty text. Files of an earlier run in the folder count as room: they are replaced.
/// most: the largest number of splats. options: with a concrete SH degree.
std::string check_disk_room(const std::filesystem::path& folder, uint64_t first, uint64_t most,
                            const TrainOptions& options);

/// How a run can be continued after its disk was full, for the end of an error.
/// step: the last one that was trained. checkpoint, splats: the steps of checkpoint.ewa and of splats.ply, -1: there is none.
std::string after_full_disk(int step, int checkpoint, int splats);

}  // namespace ewa::train
