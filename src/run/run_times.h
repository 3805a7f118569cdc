// SPDX-License-Identifier: Apache-2.0
// times.json: the times of a run up to its checkpoint. They differ from run to run, and the checkpoint does not.
//
//   {"metrics": [[step, seconds, wall_seconds], ...], "checkpoints": [[step, seconds, wall_seconds], ...]}
//
// The metrics are the lines of metrics.jsonl so far. The checkpoints are this one and the one before, since times.json is
// replaced first: after a kill between the two files, it has the times of the checkpoint that is there.
#pragma once
#include <filesystem>
#include <vector>

#include "ewa/step_report.h"
#include "ewa/summary.h"
#include "report/step_time.h"

namespace ewa::train {

/// At a step: in seconds, as in Summary.
struct TimesAt {
    int step = 0;
    double seconds = 0, wall_seconds = 0;
};

struct RunTimes {
    std::vector<TimesAt> metrics, checkpoints;
};

/// Adds a checkpoint, and forgets all but the one before it.
void add_checkpoint(RunTimes& times, const TimesAt& checkpoint);

/// As the report has them.
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

/// The times of a checkpoint, from such a file. One of an earlier version has them itself: own. The metrics get theirs. Without
/// wall_seconds where the file lacks them.
TimesAt restored_times(const std::filesystem::path& path, TimesAt own, std::vector<MetricsLine>& metrics);

}  // namespace ewa::train
