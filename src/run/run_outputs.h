// SPDX-License-Identifier: Apache-2.0
// The files that a run writes, and those that it reads.
#pragma once
#include <filesystem>

#include "run/run_input.h"

namespace ewa::train {

/// The run's folder, after a check that no file in it is an input. --config may be the config.json that the run
/// writes, since that has the same options. Throws InputError.
const std::filesystem::path& checked_folder(const RunInput& input);

}  // namespace ewa::train
