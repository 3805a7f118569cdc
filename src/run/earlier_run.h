// SPDX-License-Identifier: Apache-2.0
// Whether a new run may write into a folder that an earlier run has used.
#pragma once
#include <filesystem>

#include "ewa/run_options.h"

namespace ewa::train {

/// Throws InputError if the new run would replace the result or the checkpoint of an earlier run in the folder. The message
/// describes that run, and names the options to continue it, to replace it, or to use another folder. A folder that does not exist
/// passes. With options.resume, the only refused folder is one with a result but no checkpoint. Splats without a result pass if a
/// run was killed before its first checkpoint. With options.force, no earlier run is refused. Also throws InputError if the folder
/// is a dataset or a folder of images, or if it has no run but files with the names of a run's files.
void check_free(const std::filesystem::path& path, const RunOptions& options);

}  // namespace ewa::train
