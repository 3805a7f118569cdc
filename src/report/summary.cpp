#include "report/summary.h"

#include <cerrno>
#include <cmath>
#include <cstring>

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

MetricsLog::MetricsLog(const std::filesystem::path& path) : path_(path), file_(path, std::ios::trunc) {
    if (!file_) throw RunError("cannot create " + path_.string() + ": " + std::strerror(errno));
}

void MetricsLog::append(const MetricsLine& line) {
    // Device and driver names and paths may hold bytes that are not UTF-8; those become U+FFFD.
    file_ << to_json(line).dump(-1, ' ', false, Json::error_handler_t::replace) << '\n' << std::flush;
    if (!file_) throw RunError("cannot write " + path_.string() + ": " + std::strerror(errno));
}

}  // namespace ewa::report
