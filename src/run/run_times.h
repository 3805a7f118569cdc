// SPDX-License-Identifier: Apache-2.0
// times.json: the times of a run up to its checkpoint. Times differ between equal runs, so they are not in the checkpoint, whose
// bytes are equal.
//
//   {"metrics": [[step, seconds, wall_seconds], ...], "checkpoints": [[step, seconds, wall_seconds], ...]}
//
// The metrics are the lines of metrics.jsonl so far. "checkpoints" has the last two, since times.json is replaced before
// checkpoint.ewa: after a kill between the two writes, it still has the times of the earlier checkpoint.
#pragma once
#include <filesystem>
#include <vector>

#include "ewa/step_report.h"
#include "ewa/summary.h"
#include "report/step_time.h"

namespace ewa::train {

/// The times of a run after a step, in seconds, as in Summary.
struct TimesAt {
    int step = 0;
    double seconds = 0, wall_seconds = 0;
};

struct RunTimes {
    std::vector<TimesAt> metrics, checkpoints;
};

/// Adds a checkpoint's times, and removes those of all others but the one before it.
void add_checkpoint(RunTimes& times, const TimesAt& checkpoint);

/// The mean times of a step in the report's form.
report::StepTime report_times(const StepTimes& times);

/// The times of the metrics.
std::vector<TimesAt> times_of(const std::vector<MetricsLine>& metrics);

/// The metrics without their times, which become 0.
std::vector<MetricsLine> without_times(std::vector<MetricsLine> metrics);

/// Sets the times of metrics lines from stored lines with the same index and step.
void take_times(std::vector<MetricsLine>& metrics, const RunTimes& times);

/// Replaces the file as a whole. Throws RunError.
void write_times(const std::filesystem::path& path, const RunTimes& times);

/// Throws InputError if the file is missing, damaged or has a time that is not finite.
RunTimes read_times(const std::filesystem::path& path);

/// The times of a checkpoint, read from times.json. own: the times in the checkpoint itself, where versions before times.json wrote
/// them; these are then returned. Also sets the times of `metrics`. If the file cannot be read, returns `own`.
TimesAt restored_times(const std::filesystem::path& path, TimesAt own, std::vector<MetricsLine>& metrics);

}  // namespace ewa::train
