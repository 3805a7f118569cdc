// SPDX-License-Identifier: Apache-2.0
// The numbers of a training run: summary.json and the lines of metrics.jsonl.
#pragma once
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace ewa::report {

/// Keys keep their order, so that the files of two runs can be compared line by line.
using Json = nlohmann::ordered_json;

/// A missing number (no test set, nothing evaluated) is null in the file. So is a number that is not finite,
/// such as the PSNR of equal images.
struct Summary {
    int steps = 0;
    double seconds = 0;       // training alone
    double wall_seconds = 0;  // with start-up, evaluation and saving
    uint32_t splats = 0;
    std::optional<double> test_psnr, test_ssim, train_psnr;
    std::string device;
    uint64_t peak_device_bytes = 0, peak_host_bytes = 0;
    uint64_t seed = 0;
    uint32_t skipped_nonfinite = 0;
    uint64_t dropped_updates = 0;
    uint64_t limited_steps = 0;
    std::string version, command, strategy;
    bool interrupted = false;
};

Json to_json(const Summary& summary);

/// The whole number from 0 to `most` under this name. Throws InputError if there is none.
uint64_t whole_number(const Json& object, const char* name, uint64_t most);
/// The number under this name, or NaN for null. Throws InputError if there is neither.
double number_or_nan(const Json& object, const char* name);

struct MetricsLine {
    int step = 0;
    double seconds = 0, wall_seconds = 0, loss = 0;
    uint32_t splats = 0;
    std::optional<double> test_psnr, test_ssim;
};

Json to_json(const MetricsLine& line);
/// Parses what to_json wrote. Throws InputError that names the missing or wrong value.
MetricsLine metrics_line(const Json& json);
/// Parses a metrics.jsonl. Throws InputError that names the line.
std::vector<MetricsLine> parse_metrics(const std::string& text);
std::string metrics_text(const std::vector<MetricsLine>& lines);

/// Writes metrics.jsonl line by line and flushes each line, so that a run can be watched and an interrupted
/// one keeps its lines.
class MetricsLog {
  public:
    /// Creates the file with the earlier lines. Throws RunError.
    explicit MetricsLog(const std::filesystem::path& path, const std::vector<MetricsLine>& earlier = {});

    /// Throws RunError if the line cannot be written.
    void append(const MetricsLine& line);

  private:
    std::filesystem::path path_;
    std::ofstream file_;
};

}  // namespace ewa::report
