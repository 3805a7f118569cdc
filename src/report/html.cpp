// SPDX-License-Identifier: Apache-2.0
#include "report/html.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "core/messages.h"
#include "core/text.h"
#include "report/chart.h"
#include "report/pictures.h"
#include "report/style.h"

namespace ewa::report {
namespace {

// The error (of 1) that is shown brightest. Larger errors are obvious to the eye.
constexpr double kErrorFullScale = 0.25;
// A third of the page on a display with two pixels per point; keeps the file at a few megabytes.
constexpr int kPictureWidth = 720;

std::string figure(const std::string& value, const std::string& label) {
    return fmt::format("<div><b>{}</b><span>{}</span></div>", escape_html(value), escape_html(label));
}

std::string decibels(const std::optional<double>& psnr) {
    if (!psnr) return "–";
    return std::isinf(*psnr) ? "∞ dB" : fmt::format("{:.2f} dB", *psnr);
}

std::string duration(double seconds) {
    if (seconds < 100) return fmt::format("{:.1f} s", seconds);
    const long total = std::lround(seconds);
    if (total < 3600) return fmt::format("{} min {:02} s", total / 60, total % 60);
    return fmt::format("{} h {:02} min", total / 3600, total / 60 % 60);
}

std::string headline(const ReportData& data) {
    const Summary& s = data.summary;
    std::string html =
        fmt::format("<h1>{}</h1>\n<p class=\"soft\">{} steps on {}{}</p>\n", escape_html(data.title), s.steps,
                    escape_html(s.device), s.interrupted ? " — interrupted before the end" : "");
    for (const std::string& remark : data.remarks)
        html += "<p class=\"warn\">" + escape_html(remark) + "</p>\n";
    if (s.skipped_nonfinite > 0)
        html += fmt::format("<p class=\"warn\">{} splats with a value that is not finite are skipped.</p>\n",
                            s.skipped_nonfinite);
    if (s.limited_steps > 0)
        html +=
            fmt::format("<p class=\"warn\">{} steps were too long for their splat and were shortened.</p>\n",
                        s.limited_steps);
    if (s.dropped_updates > 0)
        html += fmt::format("<p class=\"warn\">{} parameter updates were not finite and were dropped.</p>\n",
                            s.dropped_updates);
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
        const Image error = error_map(view.rendering, view.photograph, kErrorFullScale);
        html += fmt::format(
            "<figure class=\"view\"><figcaption><b>{}</b> <span class=\"soft\">{}, SSIM {:.4f}</span>"
            "</figcaption><div class=\"trio\">\n",
            escape_html(view.name), decibels(view.psnr), view.ssim);
        const std::pair<const Image*, std::string> trio[] = {
            {&view.photograph, "image"},
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

std::string plan(const std::vector<LeftOut>& lines) {
    if (lines.empty()) return "";
    std::string html =
        "<h2>Work that this scene does not need</h2>\n<table><tr><th>skipped</th><th>reason</th>"
        "<th class=\"number\">saves</th></tr>\n";
    for (const LeftOut& line : lines)
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

std::string html_report(const ReportData& data) {
    return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
           "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
           escape_html(data.title) + " – ewa</title>\n<style>" + kStyle + "</style></head>\n<body><main>\n" +
           headline(data) + pictures(data) + charts(data.metrics) + passes(data.pass_times) + data.section +
           plan(data.plan) + settings(data) + "</main></body></html>\n";
}

}  // namespace ewa::report
