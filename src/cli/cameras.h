// SPDX-License-Identifier: Apache-2.0
// Datasets from photos and videos, for the commands that take them.
#pragma once
#include <filesystem>
#include <string>

#include "cli/capture_progress.h"
#include "ewa/capture.h"

namespace ewa::cli {

/// Throws InputError if --frames is given with a folder of photos.
void refuse_frames(const std::string& frames, const std::filesystem::path& photos);

/// Makes a dataset of photos or a video. Shows progress, and prints how many cameras were found. after: time of the work that
/// follows. before: gives a line to print first. Throws InputError, RunError, and Interrupted if Ctrl-C ended the search.
void place_with_progress(const std::filesystem::path& input, const std::filesystem::path& folder,
                         const CaptureOptions& options, Progress& progress,
                         const CaptureProgressLine::After& after = {},
                         const CaptureProgressLine::Before& before = {});

}  // namespace ewa::cli
