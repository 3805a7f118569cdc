// SPDX-License-Identifier: Apache-2.0
// A training's curves in a file that TensorBoard reads.
#pragma once
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "report/summary.h"

namespace ewa::report {

/// Writes the figures of each line of metrics.jsonl as scalars: train/loss, train/psnr, train/splats, train/steps_per_second,
/// and test/ with the name of each metric. A figure that is not finite is skipped. As in MetricsLog, each line reaches the
/// operating system at once.
class EventsLog {
  public:
    /// Creates the file with the earlier lines. begin: when the run began, in seconds of Unix time. Throws RunError.
    EventsLog(const std::filesystem::path& path, const std::vector<MetricsLine>& earlier, double begin);

    /// Throws RunError if the line cannot be written.
    void append(const MetricsLine& line);

  private:
    std::string records_of(const MetricsLine& line);

    std::filesystem::path path_;
    double begin_;
    MetricsLine last_;
    std::ofstream file_;
};

}  // namespace ewa::report
