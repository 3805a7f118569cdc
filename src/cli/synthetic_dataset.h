// SPDX-License-Identifier: Apache-2.0
// Photographing a mesh scene as a command shows it: progress, Ctrl-C, and what there is to say afterwards.
#pragma once
#include <filesystem>

#include "ewa/synthetic_dataset.h"

namespace ewa::cli {

/// SyntheticDataset::interrupted says that Ctrl-C ended it.
SyntheticDataset photograph_with_progress(const DeviceOptions& device, const std::filesystem::path& scene,
                                          const std::filesystem::path& folder,
                                          const SyntheticOptions& options, bool quiet);

}  // namespace ewa::cli
