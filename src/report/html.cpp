// SPDX-License-Identifier: Apache-2.0
#include "report/html.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "core/messages.h"
#include "core/text.h"
#include "report/chart.h"
#include "report/pictures.h"

namespace ewa::report {
namespace {

// The error (of 1) that is shown brightest. Larger errors are obvious to the eye.
constexpr double kErrorFullScale = 0.25;
// A third of the page on a display with two pixels per point; keeps the file at a few megabytes.
constexpr int kPictureWidth = 720;

/// It follows the reader's light or dark setting, and has rules for print.
constexpr const char* kStyle = R"css(
:root { color-scheme: light dark; --ink: #1d2227; --soft: #5d6872; --page: #fbfbf9; --card: #ffffff; --rule: #dfe3e6;
        --line: #1668a8; --warn: #9a5b00; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e6e9ec; --soft: #9aa5af; --page: #14171a; --card: #1c2024; --rule: #333a41; --line: #62b0ec;
          --warn: #e0a84a; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--ink); font: 15px/1.5 system-ui, "DejaVu Sans", sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 36px 24px 60px; }
h1 { font-size: 27px; line-height: 1.2; margin: 0; font-weight: 650; letter-spacing: -0.01em; }
h2 { font-size: 17px; margin: 40px 0 12px; font-weight: 650; }
p { margin: 6px 0; } .soft { color: var(--soft); } .warn { color: var(--warn); }
.figures { display: grid; grid-template-columns: repeat(4, 1fr); gap: 1px; margin: 24px 0 0;
           background: var(--rule); border: 1px solid var(--rule); border-radius: 8px; overflow: hidden; }
.figures div { background: var(--card); padding: 12px 16px; }
.figures b { display: block; font-size: 22px; white-space: nowrap; font-weight: 600; font-variant-numeric: tabular-nums; }
.figures span { color: var(--soft); font-size: 13px; }
.charts { display: grid; grid-template-columns: repeat(auto-fill, minmax(330px, 1fr)); gap: 16px; }
figure { margin: 0; }
.chart { background: var(--card); border: 1px solid var(--rule); border-radius: 8px; padding: 12px 12px 6px; }
.chart figcaption { font-weight: 600; font-size: 14px; margin: 0 4px 6px; }
.chart figcaption span { font-weight: 400; color: var(--soft); }
svg { display: block; width: 100%; height: auto; }
svg .grid { stroke: var(--rule); } svg .axis { stroke: var(--soft); }
svg .tick { fill: var(--soft); font-size: 12px; } svg .label { fill: var(--soft); font-size: 13px; }
svg polyline { fill: none; stroke: var(--line); stroke-width: 2; stroke-linejoin: round; }
svg .raw { stroke-width: 1; opacity: 0.35; } svg .dot { fill: var(--line); }
.view { margin: 0 0 22px; } .view figcaption { margin: 0 0 6px; }
.view figcaption b { font-weight: 600; overflow-wrap: anywhere; }
.trio { display: grid; grid-template-columns: repeat(3, 1fr); gap: 8px; }
.trio div { font-size: 13px; color: var(--soft); }
.trio img { display: block; width: 100%; border-radius: 4px; background: #000; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th { text-align: left; font-weight: 600; color: var(--soft); font-size: 13px; }
th, td { padding: 5px 12px 5px 0; border-bottom: 1px solid var(--rule); vertical-align: top; overflow-wrap: anywhere; }
td.number, th.number { text-align: right; white-space: nowrap; }
td.bar { width: 45%; } td.bar i { display: block; height: 10px; margin-top: 6px; background: var(--line); border-radius: 2px; }
.columns { display: grid; align-items: start; grid-template-columns: repeat(auto-fit, minmax(330px, 1fr)); gap: 0 40px; }
pre { background: var(--card); border: 1px solid var(--rule); border-radius: 8px; padding: 12px 16px; margin: 0;
      white-space: pre-wrap; overflow-wrap: anywhere; font: 13px/1.5 ui-monospace, "DejaVu Sans Mono", monospace; }
@media (max-width: 640px) { .figures { grid-template-columns: repeat(2, 1fr); } main { padding: 24px 14px; } }
@media print { main { max-width: none; } .view, .chart, tr { break-inside: avoid; } }
)css";

std::string figure(const std::string& value, const std::string& label) {
    return fmt::format("<div><b>{}</b><span>{}</span></div>", escape_html(value), escape_html(label));
}

std::string decibels(const std::optional<double>& psnr) {
    if (!psnr) return "–";
    return std::isinf(*psnr) ? "∞ dB" : fmt::format("{:.2f} dB", *psnr);
}

std::string duration(double seconds) {
    return seconds < 100 ? fmt::format("{:.1f} s", seconds) : core::duration_text(seconds);
}

std::string headline(const ReportData& data) {
    const Summary& s = data.summary;
    std::string html =
        fmt::format("<h1>{}</h1>\n<p class=\"soft\">{} steps on {}{}</p>\n", escape_html(data.title), s.steps,
                    escape_html(s.device), s.interrupted ? " — interrupted before the end" : "");
    for (const std::string& remark : data.remarks)
        html += "<p class=\"warn\">" + escape_html(remark) + "</p>\n";
    const std::pair<uint64_t, const char*> warnings[] = {
        {s.skipped_nonfinite, "splats with a value that is not finite are skipped."},
        {s.limited_steps, "steps were too long for their splat and were shortened."},
        {s.dropped_updates, "parameter updates were not finite and were dropped."}};
    for (const auto& [count, what] : warnings)
        if (count > 0) html += fmt::format("<p class=\"warn\">{} {}</p>\n", count, what);
    html += "<div class=\"figures\">";
    html += figure(decibels(s.test_psnr), "PSNR, held-out views");
    html += figure(s.test_ssim ? fmt::format("{:.4f}", *s.test_ssim) : "–", "SSIM, held-out views");
    html += figure(decibels(s.train_psnr), "PSNR, training views");
    html += figure(short_number(s.splats), "splats");
    html += figure(duration(s.seconds), fmt::format("training, of {} in total", duration(s.wall_seconds)));
    html += figure(s.steps > 0 ? fmt::format("{:.3g} ms", 1000 * s.seconds / s.steps) : "–", "per step");
    html += figure(core::bytes_text(s.peak_device_bytes), "peak device memory");
    html += figure(core::bytes_text(s.peak_host_bytes), "peak host memory");
    return html + "</div>\n";
}

std::string charts(const std::vector<MetricsLine>& metrics) {
    Chart loss_steps{"Loss", "step", "of the step's view; bold: running mean", {}, true, true};
    Chart loss_time{"Loss", "wall time, s", "of the step's view; bold: running mean", {}, true, true};
    Chart psnr_steps{"PSNR of held-out views", "step", "dB", {}, false, false};
    Chart psnr_time{"PSNR of held-out views", "wall time, s", "dB", {}, false, false};
    Chart splats{"Splats", "step", "", {}, false, true};
    for (const MetricsLine& line : metrics) {
        loss_steps.points.push_back({double(line.step), line.loss});
        loss_time.points.push_back({line.wall_seconds, line.loss});
        splats.points.push_back({double(line.step), double(line.splats)});
        if (!line.test_psnr) continue;
        psnr_steps.points.push_back({double(line.step), *line.test_psnr});
        psnr_time.points.push_back({line.wall_seconds, *line.test_psnr});
    }
    std::string html;
    for (const Chart& chart : {loss_steps, loss_time, psnr_steps, psnr_time, splats})
        html += chart_svg(chart);
    return html.empty() ? "" : "<h2>Training curves</h2>\n<div class=\"charts\">\n" + html + "</div>\n";
}

std::string pictures(const ReportData& data) {
    if (data.pictures.empty()) return "";
    std::string html = fmt::format("<h2>{}</h2>\n", data.held_out ? "Held-out views" : "Training views");
    for (const ReportPicture& view : data.pictures) {
        const Image error = error_map(view.rendering, view.original, kErrorFullScale);
        html += fmt::format(
            "<figure class=\"view\"><figcaption><b>{}</b> <span class=\"soft\">{}, SSIM {:.4f}</span>"
            "</figcaption><div class=\"trio\">\n",
            escape_html(view.name), decibels(view.psnr), view.ssim);
        const std::pair<const Image*, std::string> trio[] = {
            {&view.original, "image"},
            {&view.rendering, "render"},
            {&error, fmt::format("error, brightest from {:g} of full scale", kErrorFullScale)}};
        for (const auto& [image, label] : trio)
            html += fmt::format("<div><img alt=\"{0}\" src=\"{1}\">{0}</div>\n", label,
                                data_uri(*image, kPictureWidth));
        html += "</div></figure>\n";
    }
    return html;
}

std::string passes(const std::vector<NamedTime>& times) {
    if (times.empty()) return "";
    double total = 0, longest = 0;
    for (const NamedTime& time : times) {
        total += time.milliseconds;
        longest = std::max(longest, time.milliseconds);
    }
    std::string html =
        "<h2>Time of each pass in a step</h2>\n<table><tr><th>pass</th><th class=\"number\">ms</th>"
        "<th class=\"number\">share</th><th></th></tr>\n";
    for (const NamedTime& time : times)
        html += fmt::format(
            "<tr><td>{}</td><td class=\"number\">{:.3f}</td><td class=\"number\">{:.1f} %</td>"
            "<td class=\"bar\"><i style=\"width:{:.1f}%\"></i></td></tr>\n",
            escape_html(time.name), time.milliseconds, total > 0 ? 100 * time.milliseconds / total : 0,
            longest > 0 ? 100 * time.milliseconds / longest : 0);
    return html + fmt::format(
                      "<tr><td>total</td><td class=\"number\">{:.3f}</td><td></td><td></td></tr>\n</table>\n"
                      "<p class=\"soft\">Medians over the last steps.</p>\n",
                      total);
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
        html += fmt::format("<tr><td class=\"soft\">{}</td><td>{}</td></tr>\n",
                            escape_html(data.settings[i].first), escape_html(data.settings[i].second));
    }
    return html + "</table></div>\n";
}

}  // namespace

std::string html_page(const std::string& title, const std::string& body) {
    return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
           "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
           escape_html(title) + " – ewa</title>\n<style>" + kStyle + "</style></head>\n<body><main>\n" +
           body + "</main></body></html>\n";
}

std::string html_report(const ReportData& data) {
    return html_page(data.title, headline(data) + pictures(data) + charts(data.metrics) +
                                     passes(data.pass_times) + data.section + plan(data.plan) +
                                     settings(data));
}

}  // namespace ewa::report
