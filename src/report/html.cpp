// SPDX-License-Identifier: Apache-2.0
#include "report/html.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "core/messages.h"
#include "core/text.h"
#include "core/typing.h"
#include "report/chart.h"
#include "report/page.h"

namespace ewa::report {
namespace {

constexpr size_t kMostCameras = 500;  // in a table, which bounds the size of the file

std::string figure(const std::string& value, const std::string& label) {
    return fmt::format("<div><b>{}</b><span>{}</span></div>", escape_html(value), escape_html(label));
}

std::string decibels_or_none(const std::optional<double>& psnr) {
    return psnr ? decibels(*psnr) : "–";
}

std::string duration(double seconds) {
    return seconds < 100 ? fmt::format("{:.1f} s", seconds) : core::duration_text(seconds);
}

std::string headline(const ReportData& data) {
    const Summary& s = data.summary;
    std::string html =
        fmt::format("<h1>{}</h1>\n<p class=\"soft\">{} steps on {}{}</p>\n", escape_html(data.title), s.steps,
                    escape_html(s.device), s.interrupted ? " — interrupted before the end" : "");
    for (const std::string& note : data.notes) html += "<p class=\"soft\">" + escape_html(note) + "</p>\n";
    for (const std::string& remark : data.remarks)
        html += "<p class=\"warn\">" + escape_html(remark) + "</p>\n";
    const std::pair<uint64_t, const char*> warnings[] = {
        {s.skipped_nonfinite, "splats with a value that is not finite are skipped."},
        {shortens_many(s) ? s.limited_steps : 0, "steps were too long for their splat and were shortened."},
        {s.dropped_updates, "parameter updates were not finite and were dropped."}};
    for (const auto& [count, what] : warnings)
        if (count > 0) html += fmt::format("<p class=\"warn\">{} {}</p>\n", count, what);
    if (s.cameras) {
        html += "<p>Refined poses: " + escape_html(cameras_text(*s.cameras)) + ".";
        if (s.cameras->test_aligned)
            html += " The cameras of held-out views were aligned to their images before these were scored.";
        html += "</p>\n";
    }
    html += "<div class=\"figures\">";
    html += figure(decibels_or_none(s.test_psnr), "PSNR, held-out views");
    html += figure(s.test_ssim ? fmt::format("{:.4f}", *s.test_ssim) : "–", "SSIM, held-out views");
    for (const Figure& one : s.test_figures)
        if (!std::isnan(one.value))
            html += figure(fmt::format("{:.4f}", one.value), one.name + ", held-out views");
    html += figure(decibels_or_none(s.train_psnr), "PSNR, training views");
    html += figure(short_number(s.splats), "splats");
    html += figure(duration(s.seconds), fmt::format("training, of {} in total", duration(s.wall_seconds)));
    html += figure(s.steps > 0 ? fmt::format("{:.3g} ms", 1000 * s.seconds / s.steps) : "–", "per step");
    html += figure(core::bytes_text(s.peak_device_bytes), "peak device memory");
    html += figure(core::bytes_text(s.peak_host_bytes), "peak host memory");
    return html + "</div>\n";
}

/// PSNR by step, or by time: training views at each line, and held-out views where they were evaluated.
Chart psnr_chart(const std::vector<MetricsLine>& metrics, bool by_time) {
    Chart chart{.title = "PSNR",
                .x_name = by_time ? "wall time" : "step",
                .x_unit = by_time ? "s" : "",
                .y_unit = "dB",
                .smooth = true,
                .name = "training view of the step (bold: mean)",
                .second_name = "all held-out views (mean)"};
    for (const MetricsLine& line : metrics) {
        const double x = by_time ? line.wall_seconds : line.step;
        if (line.train_psnr) chart.points.push_back({x, *line.train_psnr});
        if (line.test_psnr) chart.second.push_back({x, *line.test_psnr});
    }
    return chart;
}

std::string charts(const std::vector<MetricsLine>& metrics) {
    Chart loss{.title = "Loss",
               .x_name = "step",
               .smooth = true,
               .zero_based = true,
               .name = "training view of the step (bold: mean)"};
    Chart splats{.title = "Splats", .x_name = "step", .zero_based = true};
    for (const MetricsLine& line : metrics) {
        loss.points.push_back({double(line.step), line.loss});
        splats.points.push_back({double(line.step), double(line.splats)});
    }
    std::string html;
    for (const Chart& chart : {psnr_chart(metrics, false), psnr_chart(metrics, true), loss, splats})
        html += chart_svg(chart);
    return html.empty() ? "" : "<h2>Training curves</h2>\n<div class=\"charts\">\n" + html + "</div>\n";
}

std::string cameras(const std::vector<CameraRow>& rows) {
    if (rows.empty()) return "";
    const size_t shown = std::min(rows.size(), kMostCameras);
    std::string html = fmt::format(
        "<details><summary><h2>Cameras</h2></summary>\n<p class=\"soft\">What the reconstruction says of {}, "
        "the "
        "largest error first{}. The error is the median distance between points and where they were "
        "seen.</p>\n"
        "<table><tr><th>photo</th><th class=\"number\">points</th><th class=\"number\">error, px</th>"
        "<th>points in common with</th></tr>\n",
        core::counted(rows.size(), "photo"),
        shown < rows.size() ? fmt::format("; the first {} are shown", shown) : std::string());
    for (size_t i = 0; i < shown; ++i)
        html += fmt::format(
            "<tr><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td>{}</td></tr>\n",
            escape_html(rows[i].name), rows[i].points,
            rows[i].error > 0 ? fmt::format("{:.2f}", rows[i].error) : "–", escape_html(rows[i].together));
    return html + "</table></details>\n";
}

std::string plan(const std::vector<PlanLine>& lines) {
    if (lines.empty()) return "";
    std::string html =
        "<h2>Work that this scene does not need</h2>\n<table><tr><th>skipped</th><th>reason</th>"
        "<th class=\"number\">saves</th></tr>\n";
    for (const PlanLine& line : lines)
        html += fmt::format("<tr><td>{}</td><td>{}</td><td class=\"number\">{}</td></tr>\n",
                            escape_html(line.what), escape_html(line.why),
                            line.bytes_saved > 0 ? core::bytes_text(line.bytes_saved) : "");
    return html + "</table>\n";
}

std::string settings(const ReportData& data) {
    std::string html = "<h2>How to repeat this run</h2>\n";
    html += fmt::format("<pre>{}</pre>\n<p class=\"soft\">ewa {}, strategy {}, seed {}</p>\n",
                        escape_html(data.summary.command), escape_html(data.summary.version),
                        escape_html(data.summary.strategy), data.summary.seed);
    if (data.settings.empty()) return html;
    html += "<div class=\"columns\">";
    const size_t half = (data.settings.size() + 1) / 2;
    for (size_t i = 0; i < data.settings.size(); ++i) {
        if (i % half == 0) html += i == 0 ? "<table>" : "</table><table>";
        html += fmt::format("<tr><td class=\"soft\">{}</td><td class=\"wrap\">{}</td></tr>\n",
                            escape_html(data.settings[i].first), escape_html(data.settings[i].second));
    }
    return html + "</table></div>\n";
}

}  // namespace

std::string html_report(const ReportData& data) {
    return html_page(data.title, headline(data) + views_html(data.views, data.held_out) +
                                     left_out_html(data.left_out) + charts(data.metrics) +
                                     step_time_html(data.times, data.earlier_steps) +
                                     ranks_html(data.summary.ranks) + chunks_html(data.summary.chunks) +
                                     cameras(data.cameras) + plan(data.plan) + settings(data));
}

}  // namespace ewa::report
