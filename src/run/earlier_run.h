// SPDX-License-Identifier: Apache-2.0
// Whether a new run may write into a folder that an earlier run has used.
#pragma once
#include <filesystem>

#include "ewa/run_options.h"

namespace ewa::train {

/// Throws InputError if the folder has the result or the checkpoint of a run which the new one would replace. The
/// message says which run that is, and which options help. A folder that does not exist is free.
/// With options.resume, only a result without a checkpoint is refused. The splats of a run that was killed before its
/// first checkpoint count as free. With options.force, no run is refused.
/// Also throws InputError if the folder is a dataset, a folder of images, or has files that are of no run but have the names of a
/// run's files.
void check_free(const std::filesystem::path& path, const RunOptions& options);

}  // namespace ewa::train
