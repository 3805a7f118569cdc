// SPDX-License-Identifier: Apache-2.0
// Going on where an earlier run of the same options in the same folder was ended.
#pragma once
#include <chrono>
#include <filesystem>
#include <string>

#include "cli/train_run.h"
#include "report/summary.h"

namespace ewa::cli {

/// What a checkpoint says about its run: version, the dataset's fingerprint, and the options that decide the
/// result. The device is added once it is open.
report::Json checkpoint_settings(const TrainArguments& arguments, const std::string& fingerprint);

/// Throws InputError that names what differs where a run of `now` would not end as the checkpoint's would
/// have.
void check_resumable(const std::filesystem::path& path, const std::string& stored, const report::Json& now);

/// A remark where version or device differ, since then the bytes may; else an empty text.
std::string resume_remark(const std::string& stored, const report::Json& now);

/// When a checkpoint is due. every: steps; 0: by the clock, every 30 seconds, but seldom enough that saving
/// takes less than 2 percent of the time.
class SavePace {
  public:
    explicit SavePace(int every) : every_(every) {}
    bool due(int step) const;
    void saved(double seconds_taken);

  private:
    using Clock = std::chrono::steady_clock;
    int every_;
    Clock::time_point last_ = Clock::now();
    double pause_ = 30;  // seconds
};

}  // namespace ewa::cli
