// SPDX-License-Identifier: Apache-2.0
// Photographing a mesh scene as a command shows it: progress, Ctrl-C, and what there is to say afterwards.
#pragma once
#include <filesystem>

#include "ewa/photograph.h"

namespace ewa::cli {

/// Photographs::interrupted says that Ctrl-C ended it.
Photographs photograph_with_progress(const DeviceOptions& device, const std::filesystem::path& scene,
                                     const std::filesystem::path& folder, const PhotographOptions& options,
                                     bool quiet);

}  // namespace ewa::cli
