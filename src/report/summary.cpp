// SPDX-License-Identifier: Apache-2.0
#include "report/summary.h"

#include <spdlog/fmt/fmt.h>

#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>

#include "core/atomic_file.h"
#include "core/json_field.h"
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

Json to_json(const CameraMoves& moves) {
    return {{"median_degrees", moves.median_degrees},
            {"largest_degrees", moves.largest_degrees},
            {"median_percent_of_extent", 100 * moves.median_share},
            {"largest_percent_of_extent", 100 * moves.largest_share},
            {"least_focal_factor", moves.least_focal},
            {"largest_focal_factor", moves.largest_focal},
            {"test_cameras_aligned", moves.test_aligned}};
}

std::string cameras_text(const CameraMoves& moves) {
    std::string text = fmt::format(
        "cameras turned by {:.3g} degrees (median; largest {:.3g}) and moved by {:.3g} % of the extent "
        "(largest {:.3g})",
        moves.median_degrees, moves.largest_degrees, 100 * moves.median_share, 100 * moves.largest_share);
    if (moves.least_focal != 1 || moves.largest_focal != 1)
        text += fmt::format(", focal lengths times {:.4f} to {:.4f}", moves.least_focal, moves.largest_focal);
    return text;
}

Json to_json(const Summary& s) {
    Json json = {{"steps", s.steps},
                 {"seconds", figure(s.seconds)},
                 {"seconds_per_step", s.steps > 0 ? figure(s.seconds / s.steps) : Json(nullptr)},
                 {"wall_seconds", figure(s.wall_seconds)},
                 {"splats", s.splats},
                 {"max_splats", s.max_splats},
                 {"test_psnr", figure(s.test_psnr)},
                 {"test_ssim", figure(s.test_ssim)},
                 {"train_psnr", figure(s.train_psnr)},
                 {"device", s.device},
                 {"peak_device_bytes", s.peak_device_bytes},
                 {"peak_host_bytes", s.peak_host_bytes},
                 {"seed", s.seed},
                 {"skipped_nonfinite", s.skipped_nonfinite},
                 {"dropped_updates", s.dropped_updates},
                 {"limited_steps", s.limited_steps},
                 {"strategy", s.strategy},
                 {"interrupted", s.interrupted},
                 {"version", s.version},
                 {"command", s.command}};
    for (const Figure& one : s.test_figures) json["test_" + one.name] = figure(one.value);
    if (s.cameras) json["cameras"] = to_json(*s.cameras);
    if (s.chunks)
        json["chunks"] = {{"count", s.chunks->chunks},
                          {"device_memory_bytes", s.chunks->limit},
                          {"state_bytes", s.chunks->state_bytes},
                          {"streamed_bytes_per_step", figure(s.chunks->streamed_bytes)},
                          {"streaming_ms_per_step", figure(s.chunks->streaming)}};
    for (const RankFigures& rank : s.ranks)
        json["ranks"].push_back({{"name", rank.name},
                                 {"sent_bytes_per_view", figure(rank.sent_bytes)},
                                 {"exchange_ms_per_view", figure(rank.exchange)},
                                 {"waiting_ms_per_view", figure(rank.waiting)},
                                 {"state_bytes", figure(rank.own_bytes)},
                                 {"peak_device_bytes", figure(rank.peak_device_bytes)}});
    return json;
}

Json to_json(const MetricsLine& line) {
    Json json{{"step", line.step},
              {"seconds", figure(line.seconds)},
              {"wall_seconds", figure(line.wall_seconds)},
              {"loss", figure(line.loss)},
              {"splats", line.splats}};
    if (line.test_psnr) json["test_psnr"] = figure(line.test_psnr);
    if (line.test_ssim) json["test_ssim"] = figure(line.test_ssim);
    if (line.train_psnr) json["train_psnr"] = figure(line.train_psnr);
    for (const Figure& one : line.test_figures) json["test_" + one.name] = figure(one.value);
    if (line.edit) {
        json["removed"] = line.edit->removed;
        json["frozen"] = line.edit->frozen;
        json["unfrozen"] = line.edit->unfrozen;
    }
    return json;
}

bool shortens_many(const Summary& summary) {
    return double(summary.limited_steps) > 1e-3 * double(summary.steps) * double(summary.splats);
}

double number_or_nan(const core::JsonField& field, const char* key) {
    return field.value().contains(key) ? field.number(key, std::nan("")) : field.number(key);
}

MetricsLine metrics_line(const core::JsonField& field) {
    MetricsLine line;
    line.step = int(field.whole("step", INT32_MAX));
    line.seconds = number_or_nan(field, "seconds");
    line.wall_seconds = number_or_nan(field, "wall_seconds");
    line.loss = number_or_nan(field, "loss");
    line.splats = uint32_t(field.whole("splats", UINT32_MAX));
    const auto known = [&](const std::string& key) { return field.value().contains(key); };
    if (known("test_psnr")) line.test_psnr = number_or_nan(field, "test_psnr");
    if (known("test_ssim")) line.test_ssim = number_or_nan(field, "test_ssim");
    if (known("train_psnr")) line.train_psnr = number_or_nan(field, "train_psnr");
    for (const Metric& metric : all_metrics())
        if (const std::string key = "test_" + metric.name;
            metric.name != "psnr" && metric.name != "ssim" && known(key))
            line.test_figures.push_back({metric.name, number_or_nan(field, key.c_str())});
    const auto splats = [&](const char* key) { return uint32_t(field.whole(key, UINT32_MAX)); };
    if (known("removed")) line.edit = EditCounts{splats("removed"), splats("frozen"), splats("unfrozen")};
    return line;
}

std::vector<MetricsLine> parse_metrics(const std::string& text) {
    std::vector<MetricsLine> lines;
    std::istringstream stream(text);
    std::string line;
    while (std::getline(stream, line)) {
        const std::string name = "line " + std::to_string(lines.size() + 1) + " of the metrics";
        lines.push_back(metrics_line(core::JsonField::of_text(line, name)));
    }
    return lines;
}

std::string metrics_text(const std::vector<MetricsLine>& lines) {
    std::string text;
    for (const MetricsLine& line : lines) text += to_json(line).dump() + '\n';
    return text;
}

MetricsLog::MetricsLog(const std::filesystem::path& path, const std::vector<MetricsLine>& earlier)
    : path_(path) {
    core::write_text_file(path, metrics_text(earlier));
    file_.open(path, std::ios::app);
    if (!file_) throw RunError("cannot create " + path_.string() + ": " + std::strerror(errno));
}

void MetricsLog::append(const MetricsLine& line) {
    // Device and driver names and paths may hold bytes that are not UTF-8; those become U+FFFD.
    file_ << to_json(line).dump(-1, ' ', false, Json::error_handler_t::replace) << '\n' << std::flush;
    if (!file_) core::fail_to_write(path_, "cannot be written", {errno, std::generic_category()});
}

}  // namespace ewa::report
