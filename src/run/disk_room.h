// SPDX-License-Identifier: Apache-2.0
// Whether the files of a run fit on their disk.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>

#include "ewa/train_options.h"

namespace ewa::train {

/// Compares the free space on the disk of `folder`, which must exist, with the size of the run's files. Throws RunError if not even
/// splats.ply and checkpoint of the first splats fit. Returns a remark if the files of a run with `most` splats may not fit, else
/// an empty text. Files of an earlier run in the folder count as free space, because they are replaced. first, most: the numbers of
/// the first splats and of the most splats. options: with a resolved SH degree.
std::string check_disk_room(const std::filesystem::path& folder, uint64_t first, uint64_t most,
                            const TrainOptions& options);

/// The text that ends an error about a full disk: how the run can be continued. step: the last step of the training. checkpoint,
/// splats: the steps of checkpoint.ewa and of splats.ply; -1: no such file.
std::string after_full_disk(int step, int checkpoint, int splats);

}  // namespace ewa::train
