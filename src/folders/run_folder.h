// SPDX-License-Identifier: Apache-2.0
// The folder of a training run: the names and contents of its files.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "core/folders.h"

namespace ewa::folders {

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

/// The file with the port and the token under which a running training serves its state.
inline constexpr const char* kLiveFile = "live.json";

/// The renders of held-out and of training images.
inline constexpr const char *kTestFolder = "test", *kTrainFolder = "train";
/// With --robust: masks of objects that single training images show.
inline constexpr const char* kPassersByFolder = "passers_by";
/// With --inria: the files of INRIA's trainer.
inline constexpr const char* kInriaFolder = "inria";
/// The dataset that the run makes of a mesh scene, photos or a video.
inline constexpr const char* kMadeDataset = "dataset";
/// In a dataset that ewa makes of photos or a video: its record of input and options.
inline constexpr const char* kCaptureFile = "capture.json";

inline constexpr uint64_t kMostConfigBytes = 1u << 20;  // of config.json and capture.json

/// The COLMAP model of the refined cameras.
inline constexpr const char *kCamerasFolder = "cameras", *kCameraModel = "cameras/sparse/0";
inline constexpr std::array kCameraModelFiles{"cameras/sparse/0/cameras.bin", "cameras/sparse/0/images.bin",
                                              "cameras/sparse/0/points3D.bin"};

/// The step in the name of splats that --keep stores, such as splats_007000.ply. Empty for other names.
std::optional<int> step_of_kept_splats(std::string_view name);
std::string name_of_kept_splats(int step);

/// Whether a file of a run has this name.
bool is_run_file(std::string_view name);

/// Removes a symbolic link at the path, so that a later write does not follow the link. Returns the path.
const std::filesystem::path& without_link(const std::filesystem::path& path);

/// The path of a run's folder, which need not exist. The constructor reads and changes nothing.
class RunFolder {
  public:
    explicit RunFolder(std::filesystem::path path) : path_(std::move(path)) {}

    const std::filesystem::path& path() const { return path_; }
    /// The path of the file or folder with this name in the run's folder.
    std::filesystem::path operator/(std::string_view name) const { return path_ / name; }
    /// Whether the folder has this file.
    bool has(std::string_view name) const { return core::is_file(path_ / name); }

    /// Whether a run has begun here, finished or not: the folder has config.json, and another file of a run that has begun.
    /// Other programs also write a config.json.
    bool is_run() const;
    /// The options of the run by their present names. Empty if config.json cannot be read.
    nlohmann::json options() const;
    /// The splats that --keep stored, by their steps.
    std::map<int, std::filesystem::path> kept_splats() const;

    /// Creates the folder and locks it. Throws RunError if it cannot be created, or another process uses it.
    core::FolderLock lock() const;
    /// Removes symbolic links in the places of the run's files: a folder from an archive may have some, which lead out of it.
    void remove_links() const;
    /// Removes the checkpoint and the results of an earlier run, but not splats.ply and metrics.jsonl.
    void remove_results() const;

  private:
    std::filesystem::path path_;
};

/// Whether the folder has a run: see RunFolder::is_run.
bool is_run(const std::filesystem::path& folder);

/// Whether ewa has made the folder: a training run, or a dataset of photos. Images in it are not used as photos.
bool is_made_by_ewa(const std::filesystem::path& folder);

}  // namespace ewa::folders
