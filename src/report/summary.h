// SPDX-License-Identifier: Apache-2.0
// The figures of a training run as JSON: summary.json and the lines of metrics.jsonl.
#pragma once
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "ewa/summary.h"

namespace ewa::core {
class JsonField;
}

namespace ewa::report {

/// Keys keep their order, so that the files of two runs can be compared line by line.
using Json = nlohmann::ordered_json;

using ewa::MetricsLine;
using ewa::Summary;

Json to_json(const Summary& summary);
/// A sentence, without a full stop, on how far refinement has moved the cameras.
std::string cameras_text(const CameraMoves& moves);

/// Whether more than one in a thousand updates were shortened. Ordinary scenes have fewer.
bool shortens_many(const Summary& summary);

/// The number under this key; NaN for null. Throws InputError if there is neither.
double number_or_nan(const core::JsonField& field, const char* key);

Json to_json(const MetricsLine& line);
/// The inverse of to_json. Throws InputError that names what is missing or wrong.
MetricsLine metrics_line(const core::JsonField& field);
/// The lines of metrics.jsonl. Throws InputError that names the first wrong line.
std::vector<MetricsLine> parse_metrics(const std::string& text);
std::string metrics_text(const std::vector<MetricsLine>& lines);

/// Writes one JSON object a line. Each reaches the operating system at once, so a run can be watched, and a
/// killed run keeps its lines. The file begins with the lines of the earlier run.
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
