// SPDX-License-Identifier: Apache-2.0
// The names of the files in a run's folder.
#pragma once
#include <array>
#include <optional>
#include <string>
#include <string_view>

namespace ewa::report {

inline constexpr const char *kConfigFile = "config.json", *kMetricsFile = "metrics.jsonl",
                            *kCheckpointFile = "checkpoint.ewa", *kTimesFile = "times.json",
                            *kSplatsFile = "splats.ply", *kSummaryFile = "summary.json",
                            *kReportFile = "report.html", *kOldExposuresFile = "exposures.json",
                            *kAppearanceFile = "appearance.json", *kCamerasFile = "cameras.json",
                            *kSkyFile = "sky.json", *kEventsFile = "events.out.tfevents.0.ewa";

/// The files that `ewa train` writes beside its renders.
inline constexpr std::array kRunFiles{kConfigFile,  kMetricsFile, kCheckpointFile, kTimesFile,
                                      kSplatsFile,  kSummaryFile, kReportFile,     kOldExposuresFile,
                                      kCamerasFile, kEventsFile,  kAppearanceFile, kSkyFile};

/// With --robust: a mask for each training image that shows what the others do not.
inline constexpr const char* kPassersByFolder = "passers_by";

/// The COLMAP model of the refined cameras.
inline constexpr std::array kCameraModelFiles{"cameras/sparse/0/cameras.bin", "cameras/sparse/0/images.bin",
                                              "cameras/sparse/0/points3D.bin"};

/// The step of splats that --keep keeps, such as splats_007000.ply. Empty for other names.
std::optional<int> step_of_kept_splats(std::string_view name);
std::string name_of_kept_splats(int step);

/// Whether a file of a run has this name.
bool is_run_file(std::string_view name);

}  // namespace ewa::report
