// SPDX-License-Identifier: Apache-2.0
// The settings in a checkpoint, and whether a run may continue from it.
#pragma once
#include <chrono>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "ewa/run_options.h"
#include "train/checkpoint.h"

namespace ewa::train {

/// 16 hexadecimal digits that differ between datasets. They are a hash of the name, split and camera of each frame, and of the size
/// and the first 64 KiB of its image and mask. A frame without a file counts with name and camera. points: also hashes the
/// positions of the points.
std::string dataset_fingerprint(const Dataset& dataset, const Split& split, bool points = false);

/// The settings of a checkpoint: version, the dataset's fingerprint, and the options that decide the result.
/// The run adds the device.
nlohmann::ordered_json checkpoint_settings(const RunOptions& options, const std::string& fingerprint);

/// Lets a run continue from the checkpoint at `path`. Automatic options get the checkpoint's strategy, appearance and background.
/// If the checkpoint's run has another number of steps, the options keep the SH degree and resolution that the checkpoint has
/// reached (TrainOptions::least_sh_degree, most_halvings). An automatic max_splats does not fall below the checkpoint's. Returns
/// the number of steps of the checkpoint's run. Throws InputError if the checkpoint's step is after the last step of the new
/// options. asked: the options before resolve().
int continue_from(const std::filesystem::path& path, const Checkpoint& earlier, const RunOptions& asked,
                  RunOptions& options);

/// The name of the checkpoint's setting that --robust adds. Its value is fingerprint_of the masks.
inline constexpr const char* kMasksSetting = "passers_by";

/// Throws InputError that names the first difference, except in the number of steps, if a run with the settings `now`
/// would continue differently. stored: the settings of the checkpoint at `path`.
void check_resumable(const std::filesystem::path& path, const std::string& stored,
                     const nlohmann::ordered_json& now);

/// A remark if version or device differ, since the result's bytes may then differ. Else an empty text.
std::string resume_remark(const std::string& stored, const nlohmann::ordered_json& now);

/// Says when to save a checkpoint by the clock: every 30 seconds, or less often so that saving takes less than 2 percent of
/// the time.
class SavePace {
  public:
    bool due() const;
    void saved(double seconds_taken);

  private:
    using Clock = std::chrono::steady_clock;
    Clock::time_point last_ = Clock::now();
    double pause_ = 30;  // seconds
};

}  // namespace ewa::train
