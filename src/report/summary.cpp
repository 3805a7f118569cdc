// SPDX-License-Identifier: Apache-2.0
#include "report/summary.h"

#include <cerrno>
#include <cmath>
#include <cstring>
#include <sstream>

#include "ewa/error.h"

namespace ewa::report {
namespace {

Json figure(const std::optional<double>& value) {
    return value && std::isfinite(*value) ? Json(*value) : Json(nullptr);
}

Json figure(double value) {
    return figure(std::optional(value));
}

}  // namespace

Json to_json(const Summary& s) {
    Json json;
    json["steps"] = s.steps;
    json["seconds"] = figure(s.seconds);
    json["seconds_per_step"] = s.steps > 0 ? figure(s.seconds / s.steps) : Json(nullptr);
    json["wall_seconds"] = figure(s.wall_seconds);
    json["splats"] = s.splats;
    json["test_psnr"] = figure(s.test_psnr);
    json["test_ssim"] = figure(s.test_ssim);
    json["train_psnr"] = figure(s.train_psnr);
    json["device"] = s.device;
    json["peak_device_bytes"] = s.peak_device_bytes;
    json["peak_host_bytes"] = s.peak_host_bytes;
    json["seed"] = s.seed;
    json["skipped_nonfinite"] = s.skipped_nonfinite;
    json["dropped_updates"] = s.dropped_updates;
    json["limited_steps"] = s.limited_steps;
    json["strategy"] = s.strategy;
    json["interrupted"] = s.interrupted;
    json["version"] = s.version;
    json["command"] = s.command;
    return json;
}

Json to_json(const MetricsLine& line) {
    Json json;
    json["step"] = line.step;
    json["seconds"] = figure(line.seconds);
    json["wall_seconds"] = figure(line.wall_seconds);
    json["loss"] = figure(line.loss);
    json["splats"] = line.splats;
    if (line.test_psnr) json["test_psnr"] = figure(line.test_psnr);
    if (line.test_ssim) json["test_ssim"] = figure(line.test_ssim);
    return json;
}

std::vector<MetricsLine> parse_metrics(const std::string& text) {
    std::vector<MetricsLine> lines;
    std::istringstream stream(text);
    std::string line;
    while (std::getline(stream, line)) {
        try {
            const Json json = Json::parse(line);
            const auto number = [&](const char* name) {
                const Json& value = json.at(name);
                return value.is_null() ? std::nan("") : value.get<double>();
            };
            MetricsLine& read = lines.emplace_back();
            read.step = json.at("step").get<int>();
            read.seconds = number("seconds");
            read.wall_seconds = number("wall_seconds");
            read.loss = number("loss");
            read.splats = json.at("splats").get<uint32_t>();
            if (json.contains("test_psnr")) read.test_psnr = number("test_psnr");
            if (json.contains("test_ssim")) read.test_ssim = number("test_ssim");
        } catch (const Json::exception& error) {
            throw InputError("line " + std::to_string(lines.size() + 1) +
                             " of the metrics is not one: " + error.what());
        }
    }
    return lines;
}

std::string metrics_text(const std::vector<MetricsLine>& lines) {
    std::string text;
    for (const MetricsLine& line : lines) text += to_json(line).dump() + '\n';
    return text;
}

MetricsLog::MetricsLog(const std::filesystem::path& path, const std::vector<MetricsLine>& earlier)
    : path_(path), file_(path, std::ios::trunc) {
    if (!file_) throw RunError("cannot create " + path_.string() + ": " + std::strerror(errno));
    for (const MetricsLine& line : earlier) append(line);
}

void MetricsLog::append(const MetricsLine& line) {
    // Device and driver names and paths may hold bytes that are not UTF-8; those become U+FFFD.
    file_ << to_json(line).dump(-1, ' ', false, Json::error_handler_t::replace) << '\n' << std::flush;
    if (!file_) throw RunError("cannot write " + path_.string() + ": " + std::strerror(errno));
}

}  // namespace ewa::report
