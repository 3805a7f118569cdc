// SPDX-License-Identifier: Apache-2.0
// What a training run leaves in numbers: summary.json and the lines of metrics.jsonl.
#pragma once
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace ewa::report {

/// Keys keep the order they were written in, so that two runs' files can be compared line by line.
using Json = nlohmann::ordered_json;

/// A figure that does not exist (no test set, nothing evaluated) is null in the file; so is one that is not
/// finite, which JSON has no number for (the PSNR of equal pictures).
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

/// The whole number of 0 to `most` that an object holds under this name. Throws InputError that says so.
uint64_t whole_number(const Json& object, const char* name, uint64_t most);
/// The number, not a number for null. Throws InputError where there is neither.
double number_or_nan(const Json& object, const char* name);

struct MetricsLine {
    int step = 0;
    double seconds = 0, wall_seconds = 0, loss = 0;
    uint32_t splats = 0;
    std::optional<double> test_psnr, test_ssim;
};

Json to_json(const MetricsLine& line);
/// The line that to_json wrote. Throws InputError that names what is missing or wrong.
MetricsLine metrics_line(const Json& json);
/// The lines of a metrics.jsonl, each as to_json wrote it. Throws InputError that names the line.
std::vector<MetricsLine> parse_metrics(const std::string& text);
std::string metrics_text(const std::vector<MetricsLine>& lines);

/// Appends one JSON object a line and hands each to the operating system at once, so that a run can be
/// watched, and an interrupted one keeps what it had. Starts a file of the lines given.
class MetricsLog {
  public:
    /// Throws RunError when the file cannot be created.
    explicit MetricsLog(const std::filesystem::path& path, const std::vector<MetricsLine>& earlier = {});

    /// Throws RunError when the line cannot be written.
    void append(const MetricsLine& line);

  private:
    std::filesystem::path path_;
    std::ofstream file_;
};

}  // namespace ewa::report
