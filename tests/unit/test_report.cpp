// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "core/html.h"
#include "core/json_field.h"
#include "ewa/error.h"
#include "folders/run_folder.h"
#include "image/image_files.h"
#include "report/chart.h"
#include "report/html.h"
#include "report/pictures.h"
#include "report/summary.h"
#include "report/tensorboard.h"
#include "support/file_limit.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using namespace ewa::report;

TEST(Report, SummaryHasTheKeysThatScriptsRead) {
    Summary summary;
    summary.steps = 200;
    summary.seconds = 4;
    summary.test_psnr = 21.5;
    summary.seed = std::numeric_limits<uint64_t>::max();
    const Json written = to_json(summary);
    for (const char* key :
         {"steps", "seconds", "seconds_per_step", "splats", "test_psnr", "test_ssim", "train_psnr", "device",
          "peak_device_bytes", "peak_host_bytes", "seed", "skipped_nonfinite", "wall_seconds",
          "dropped_updates", "version", "command", "strategy"})
        EXPECT_TRUE(written.contains(key)) << key;
    EXPECT_DOUBLE_EQ(written["seconds_per_step"].get<double>(), 0.02);
    EXPECT_EQ(written["seed"].get<uint64_t>(), std::numeric_limits<uint64_t>::max());
    EXPECT_TRUE(written["test_ssim"].is_null());
}

TEST(Report, FiguresThatDoNotExistAreNull) {
    Summary summary;
    summary.test_psnr = std::numeric_limits<double>::infinity();
    const Json written = to_json(summary);
    EXPECT_TRUE(written["test_psnr"].is_null());
    EXPECT_TRUE(written["seconds_per_step"].is_null());
    EXPECT_EQ(Json::parse(written.dump()), written);
}

TEST(Report, MetricsHaveTestFiguresOnlyWhereEvaluated) {
    MetricsLine line;
    line.step = 3;
    const Json plain = to_json(line);
    for (const char* key : {"step", "seconds", "wall_seconds", "loss", "splats"})
        EXPECT_TRUE(plain.contains(key)) << key;
    EXPECT_FALSE(plain.contains("test_psnr"));
    line.test_psnr = 20;
    line.test_ssim = 0.5;
    EXPECT_EQ(to_json(line)["test_psnr"], 20);
    EXPECT_EQ(to_json(line)["test_ssim"], 0.5);
    EXPECT_FALSE(to_json(line).contains("train_psnr"));
    line.train_psnr = 25.5;
    EXPECT_EQ(to_json(line)["train_psnr"], 25.5);
    const auto read_back = [](const MetricsLine& written) {
        const auto parsed = nlohmann::json::parse(to_json(written).dump());
        return metrics_line({parsed, "a line"});
    };
    EXPECT_EQ(read_back(line).train_psnr, 25.5);
    EXPECT_FALSE(to_json(line).contains("removed"));
    EXPECT_FALSE(read_back(line).edit);
    line.edit = EditCounts{4, 3, 0};
    EXPECT_EQ(to_json(line)["removed"], 4);
    EXPECT_EQ(read_back(line).edit->frozen, 3u);
    EXPECT_EQ(read_back(line).edit->unfrozen, 0u);
    line.test_figures = {{"cc_psnr", 21.5}, {"ms_ssim", std::nan("")}};
    EXPECT_EQ(to_json(line)["test_cc_psnr"], 21.5);
    EXPECT_TRUE(to_json(line)["test_ms_ssim"].is_null());
    const MetricsLine read = read_back(line);
    ASSERT_EQ(read.test_figures.size(), 2u);
    EXPECT_EQ(read.test_figures[0].name, "cc_psnr");
    EXPECT_EQ(read.test_figures[0].value, 21.5);
    EXPECT_TRUE(std::isnan(read.test_figures[1].value));
}

/// The events in a file of TFRecords.
std::vector<std::string> events_in(const std::filesystem::path& path) {
    std::vector<std::string> events;
    const std::string bytes = test::file_bytes(path);
    for (size_t at = 0; at < bytes.size();) {
        uint64_t length = 0;
        std::memcpy(&length, &bytes.at(at), sizeof(length));
        events.push_back(bytes.substr(at + 12, length));
        at += 16 + length;
        EXPECT_LE(at, bytes.size());
    }
    return events;
}

TEST(Report, EventsForTensorBoardHaveTheEarlierLinesToo) {
    const test::TempFolder folder;
    MetricsLine line;
    line.step = 10;
    line.seconds = 2;
    line.train_psnr = std::numeric_limits<double>::infinity();
    EventsLog log(folder / folders::kEventsFile, {line}, 1e9);
    line.step = 20;
    line.seconds = 4;
    line.test_figures = {{"flip", 0.25}};
    log.append(line);
    const std::vector<std::string> events = events_in(folder / folders::kEventsFile);
    ASSERT_EQ(events.size(), 3u);
    EXPECT_NE(events[0].find("brain.Event:2"), std::string::npos);
    EXPECT_EQ(events[1].find("test/flip"), std::string::npos);
    EXPECT_EQ(events[1].find("train/psnr"), std::string::npos) << "not finite";
    EXPECT_NE(events[2].find("test/flip"), std::string::npos);
    // A value: its tag, then field 2 as four bytes. Five steps a second.
    const std::string rate("train/steps_per_second\x15\x00\x00\xa0\x40", 27);
    EXPECT_NE(events[2].find(rate), std::string::npos);
    // The checksums of the first length, 24 bytes, as TensorFlow writes them.
    EXPECT_EQ(test::file_bytes(folder / folders::kEventsFile).substr(0, 12),
              std::string("\x18\0\0\0\0\0\0\0\xa3\x7f\x4b\x22", 12));
}

TEST(Report, MetricsLogCanBeReadWhileItGrows) {
    const test::TempFolder folder;
    const auto path = folder / "metrics.jsonl";
    MetricsLog log(path);
    for (int step = 1; step <= 2; ++step) {
        MetricsLine line;
        line.step = step;
        log.append(line);
        std::ifstream file(path);
        std::string text;
        int lines = 0;
        while (std::getline(file, text)) EXPECT_EQ(Json::parse(text)["step"], ++lines);
        EXPECT_EQ(lines, step);
    }
}

TEST(Report, MetricsLogSaysWhenTheDiskIsFull) {
    const test::TempFolder folder;
    MetricsLog log(folder / "metrics.jsonl");
    log.append({});
    EXPECT_THROW(MetricsLog("/nowhere/at/all/metrics.jsonl"), RunError);
    if (!test::FileLimit::exists()) GTEST_SKIP() << "no limit on the size of files";
    const test::FileLimit full(4);
    EXPECT_THROW(log.append({}), RunError);
}

TEST(Report, HtmlEscapes) {
    EXPECT_EQ(escape_html("<a href=\"x\">&'\x01"), "&lt;a href=&quot;x&quot;&gt;&amp;&#39;");
    EXPECT_EQ(escape_html("größe"), "größe");
}

TEST(Report, ShortNumbers) {
    EXPECT_EQ(short_number(0), "0");
    EXPECT_EQ(short_number(1234), "1.23k");
    EXPECT_EQ(short_number(2.5e9), "2.5G");
    EXPECT_EQ(short_number(-0.25), "-0.25");
}

ReportView made_up_view(const std::string& name, double psnr, int side = 16) {
    const Image picture(side, side, 3);
    ReportView view = small_view(name, picture, picture, psnr, 0.5);
    add_full_size(view, picture, picture);
    return view;
}

ReportData made_up_data() {
    ReportData data;
    data.title = "<script>alert(1)</script>";
    data.summary.steps = 100;
    data.summary.command = "ewa train 'a & b'";
    data.summary.version = "9.8.7";
    data.summary.device = "llvmpipe <x>";
    for (int i = 1; i <= 100; ++i) {
        MetricsLine line;
        line.step = i;
        line.wall_seconds = i * 0.5;
        line.loss = i == 50 ? std::numeric_limits<double>::quiet_NaN() : 1.0 / i;
        line.splats = 1000 + 10 * i;
        if (i % 10 == 0) line.test_psnr = 20 + i * 0.1;
        line.train_psnr = 21 + i * 0.1;
        data.metrics.push_back(line);
    }
    data.times = {100, 10, 1, {{"project", 1.5}, {"blend", 4.5}}};
    data.plan = {{"SH buffers", "no view-dependent colour", 45000000}};
    data.remarks = {"3 images are missing and skipped"};
    data.settings = {{"steps", "100"}};
    data.views = {made_up_view("a\"b.jpg", 23.456)};
    return data;
}

TEST(Report, HtmlHoldsEverythingAndNothingFromOutside) {
    const std::string html = html_report(made_up_data());
    for (const char* part : {"&lt;script&gt;", "ewa train &#39;a &amp; b&#39;", "9.8.7", "llvmpipe &lt;x&gt;",
                             "a&quot;b.jpg", "23.46 dB", "data:image/jpeg;base64,/9j/", "<svg", "project",
                             "SH buffers", "no view-dependent colour", "3 images are missing",
                             "all held-out views (mean)", "prefers-color-scheme: dark"})
        EXPECT_NE(html.find(part), std::string::npos) << part;
    for (const char* part :
         {"<script>alert", "src=\"http", "http://", "https://", "url(", "<link", "nan", "@import"})
        EXPECT_EQ(html.find(part), std::string::npos) << part;
}

TEST(Report, WarnsOnlyOfWhatMatters) {
    ReportData data = made_up_data();
    data.notes = {"at most 500 splats: by the pixels"};
    data.summary.splats = 1000;
    data.summary.limited_steps = 100;  // of 100,000 updates
    data.earlier_steps = 40;
    std::string html = html_report(data);
    EXPECT_NE(html.find("<p class=\"soft\">at most 500 splats"), std::string::npos);
    EXPECT_NE(html.find("<p class=\"warn\">3 images are missing"), std::string::npos);
    EXPECT_NE(html.find("after the run was resumed at step 40"), std::string::npos);
    EXPECT_EQ(html.find("were shortened"), std::string::npos);
    data.summary.limited_steps = 101;
    html = html_report(data);
    EXPECT_NE(html.find("<p class=\"warn\">101 steps were too long"), std::string::npos);
}

size_t count_of(const std::string& text, const std::string& part) {
    size_t count = 0;
    for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
    return count;
}

TEST(Report, ViewsAreSortedWorstFirstAndOpenAtFullSize) {
    std::vector<ReportView> views = {made_up_view("b.jpg", 30), made_up_view("c.jpg", INFINITY),
                                     made_up_view("a.jpg", 20)};
    sort_views(views);
    const std::string html = views_html(views, true);
    const size_t a = html.find(">a.jpg<"), b = html.find(">b.jpg<"), c = html.find(">c.jpg<");
    EXPECT_LT(a, b);
    EXPECT_LT(b, c);
    EXPECT_LT(c, html.size());
    EXPECT_NE(html.find("Held-out views"), std::string::npos);
    EXPECT_NE(html.find("3 views, sorted by PSNR with the worst first"), std::string::npos);
    for (const char* link : {"href=\"#full-1\"", "id=\"full-1\"", "href=\"#view-1\"", "id=\"view-1\"",
                             "href=\"#full-3\"", "id=\"full-3\""})
        EXPECT_NE(html.find(link), std::string::npos) << link;
    EXPECT_EQ(count_of(html, "type=\"range\""), 3u);
    EXPECT_EQ(html.find("bounds the size"), std::string::npos);
    EXPECT_NE(views_html(views, false).find("Training views"), std::string::npos);
    EXPECT_EQ(views_html({}, true), "");
}

/// Black pixels of a mask of another size are tinted.
TEST(Report, ShowsMaskedPixelsOfTrainingImages) {
    Image image(32, 16, 3), mask(2, 1, 1);
    std::ranges::fill(image.pixels, 0.25f);
    mask.pixels = {1, 0};
    const LeftOutView view = left_out_view("<a>.jpg", image, mask, 0.5);
    test::TempFolder folder;
    const Image shown =
        load_image(folder.write("a.jpg", std::string(view.picture.begin(), view.picture.end())));
    ASSERT_EQ(shown.width, 32);
    EXPECT_NEAR(shown.at(4, 8)[0], 0.25, 0.03);
    EXPECT_GT(shown.at(28, 8)[0], 0.6);
    EXPECT_LT(shown.at(28, 8)[1], 0.2);
    const std::string html = left_out_html({view});
    EXPECT_NE(html.find("Masked by --robust"), std::string::npos);
    EXPECT_NE(html.find("&lt;a&gt;.jpg</b> <span>50.0 %"), std::string::npos);
    EXPECT_EQ(left_out_html({}), "");
}

TEST(Report, ShowsWhatHoldsTheCameras) {
    ReportData data;
    EXPECT_EQ(html_report(data).find("<h2>Cameras</h2>"), std::string::npos);
    data.cameras = {{"<a>.jpg", 312, 0.42, "b.jpg (88)"}, {"b.jpg", 88, 0, ""}};
    const std::string html = html_report(data);
    EXPECT_NE(html.find("<td>&lt;a&gt;.jpg</td><td class=\"number\">312</td><td class=\"number\">0.42</td>"
                        "<td>b.jpg (88)</td>"),
              std::string::npos);
    EXPECT_NE(html.find("<td>b.jpg</td><td class=\"number\">88</td><td class=\"number\">–</td>"),
              std::string::npos);
    data.cameras.resize(600);
    EXPECT_NE(html_report(data).find("600 photos, the largest error first; the first 500 are shown"),
              std::string::npos);
}

TEST(Report, ViewsKeepTheFileSmallAndSaySo) {
    std::vector<ReportView> views(5, made_up_view("v.jpg", 20));
    const ReportView::Jpeg large(kSmallBytes / 2);
    views[1].photo.clear();
    views[3].photo.clear();
    for (ReportView& view : views) view.small_photo = large;
    const std::string html = views_html(views, true);
    EXPECT_NE(
        html.find("Only 3 of the 5 views open at full size, spread from worst to best. Only the worst 1 "
                  "have small pictures. This bounds the size of the file."),
        std::string::npos)
        << html.substr(0, 400);
    EXPECT_EQ(count_of(html, "<figure"), 5u);  // every view has its figures
    EXPECT_EQ(count_of(html, "href=\"#full-2\""), 0u);
    EXPECT_EQ(count_of(html, "href=\"#full-3\">worse"), 1u);  // from the fifth
    EXPECT_LT(html.size(), kSmallBytes);
}

TEST(Report, FullSizeGoesFromTheWorstAndTheBestInwards) {
    using Order = std::vector<size_t>;
    EXPECT_EQ(full_size_order(0), Order{});
    EXPECT_EQ(full_size_order(1), Order{0});
    EXPECT_EQ(full_size_order(2), (Order{0, 1}));
    EXPECT_EQ(full_size_order(5), (Order{0, 4, 2, 1, 3}));
    Order all = full_size_order(100);
    std::sort(all.begin(), all.end());
    for (size_t i = 0; i < 100; ++i) ASSERT_EQ(all[i], i);
}

TEST(Report, FullSizeImagesHaveAllPixelsUpToALimit) {
    Image photo(30, 20, 3), wide(5000, 1, 3);
    photo.at(29, 19)[0] = 1;
    ReportView view = small_view("v", photo, photo, 20, 0.5);
    const size_t bytes = add_full_size(view, photo, photo);
    EXPECT_EQ(bytes, view.photo.size() + view.rendering.size());
    const Image decoded = image::decode(view.photo, "photo", 100);
    EXPECT_EQ(decoded.width, 30);
    EXPECT_EQ(decoded.height, 20);
    EXPECT_GT(decoded.at(29, 19)[0], 0.9f);
    EXPECT_LT(decoded.at(10, 10)[0], 0.1f);
    ReportView reduced = small_view("v", wide, wide, 20, 0.5);
    add_full_size(reduced, wide, wide);
    EXPECT_EQ(image::decode(reduced.photo, "photo", 5000).width, 2500);
    EXPECT_LT(image::decode(reduced.small_photo, "photo", 5000).width, 400);
}

TEST(Report, StagesAddUpToTheStep) {
    const StepTime time{
        50,
        20,
        2,
        {{"fill counts", 0.5}, {"project", 1}, {"depth order", 2}, {"tile order", 3}, {"blend", 4}}};
    std::vector<std::string> names;
    double sum = 0;
    for (const StageTime& stage : stages_of(time)) {
        names.push_back(stage.name);
        sum += stage.milliseconds;
        if (stage.name == "sort") {
            EXPECT_DOUBLE_EQ(stage.milliseconds, 5);
        }
        if (stage.name == "host and waiting") {
            EXPECT_DOUBLE_EQ(stage.milliseconds, 7.5);
        }
    }
    EXPECT_EQ(names, (std::vector<std::string>{"project", "sort", "blend", "other passes", "refinement",
                                               "host and waiting"}));
    EXPECT_DOUBLE_EQ(sum, 20);
    EXPECT_NE(step_time_html(time).find("Means over 50 steps"), std::string::npos);
    EXPECT_EQ(step_time_html(time).find("submits"), std::string::npos);
    StepTime with_host = time;
    with_host.host = 0.125;
    EXPECT_NE(step_time_html(with_host).find("submits the commands of a step in 0.125 ms"),
              std::string::npos);
}

TEST(Report, NoPassOfTrainingIsCalledACopy) {
    for (const char* pass : {"project",
                             "project_points",
                             "band_tiles",
                             "collect_visible",
                             "receive_records",
                             "blend",
                             "blend_points",
                             "add_sky",
                             "sky_gradient",
                             "sky_update",
                             "ppisp",
                             "ppisp_backward",
                             "ppisp_update",
                             "ppisp_camera_update",
                             "grid_slice",
                             "grid_slice_backward",
                             "grid_gradient",
                             "grid_update",
                             "unpack_target",
                             "mask_images",
                             "mask_gradient",
                             "loss_columns",
                             "loss_rows",
                             "loss_backward_columns",
                             "loss_backward_rows",
                             "reduce",
                             "blend_backward",
                             "blend_points_backward",
                             "sum_slots",
                             "update",
                             "update_points",
                             "update_views",
                             "move_camera",
                             "motion_update",
                             "perturb"})
        EXPECT_NE(stages_of({1, 20, 0, {{pass, 10}}}).front().name, "other passes") << pass;
}

TEST(Report, StagesOfOverlappingStepsAreScaledToTheStep) {
    double sum = 0;
    for (const StageTime& stage : stages_of({50, 20, 0, {{"project", 10}, {"blend", 30}}})) {
        sum += stage.milliseconds;
        if (stage.name == "blend") {
            EXPECT_DOUBLE_EQ(stage.milliseconds, 15);
        }
    }
    EXPECT_DOUBLE_EQ(sum, 20);
    EXPECT_EQ(step_time_html({}), "");
}

TEST(Report, ChartsTellTheirValues) {
    Chart chart{.title = "PSNR", .x_name = "step", .y_unit = "dB", .smooth = true, .second_name = "held out"};
    for (int i = 0; i < 40; ++i) chart.points.push_back({double(i), i < 39 ? 20.0 : 24.0});
    chart.second = {{10, 19.5}, {39, 18.25}};
    const std::string svg = chart_svg(chart);
    EXPECT_NE(svg.find("<title>step 5: 20 dB, mean 20</title>"), std::string::npos);
    EXPECT_NE(svg.find("<title>step 10: 20 dB, mean 20, held out 19.5</title>"), std::string::npos);
    // The mean of the last point is one of the points before it, too.
    EXPECT_NE(svg.find("class=\"readout\">step 39: 24 dB, mean 21.33, held out 18.25<"), std::string::npos);
    chart.points.clear();
    EXPECT_NE(chart_svg(chart).find("<title>step 10: held out 19.5 dB</title>"), std::string::npos);
}

TEST(Report, TheMeanOfAStraightLineIsTheLine) {
    Chart chart{.title = "Loss", .x_name = "step", .smooth = true};
    for (int i = 0; i < 100; ++i) chart.points.push_back({double(i), double(i)});
    const std::string svg = chart_svg(chart);
    for (const char* text : {"step 0: 0, mean 0<", "step 3: 3, mean 3<", "step 50: 50, mean 50<"})
        EXPECT_NE(svg.find(text), std::string::npos) << text;
}

TEST(Report, LongChartsAreThinnedOut) {
    Chart chart{.title = "Loss", .x_name = "step"};
    for (int i = 0; i < 100000; ++i) chart.points.push_back({double(i), 1.0 + i % 7});
    EXPECT_LE(count_of(chart_svg(chart), "<title>"), 301u);
}

TEST(Report, PsnrChartNeedsNoEvaluation) {
    ReportData data = made_up_data();
    for (MetricsLine& line : data.metrics) line.test_psnr.reset();
    const std::string html = html_report(data);
    EXPECT_NE(html.find("training view of the step"), std::string::npos);
    EXPECT_NE(html.find("<title>step 3: 21.3 dB, mean"), std::string::npos);
    EXPECT_EQ(html.find("all held-out views (mean)"), std::string::npos);
}

TEST(Report, HtmlOfARunWithoutAnything) {
    const std::string html = html_report({});
    EXPECT_EQ(html.find("<svg"), std::string::npos);
    EXPECT_NE(html.find("</html>"), std::string::npos);
}

TEST(Report, ChartNeedsTwoFinitePoints) {
    Chart chart{.title = "t", .x_name = "x", .points = {{0, 1}}};
    EXPECT_EQ(chart_svg(chart), "");
    chart.points.push_back({1, std::numeric_limits<double>::infinity()});
    EXPECT_EQ(chart_svg(chart), "");
    chart.points.push_back({2, 1});  // a flat line has no extent of its own
    EXPECT_NE(chart_svg(chart).find("<polyline"), std::string::npos);
}

TEST(Report, Base64) {
    auto encode = [](std::string_view text) {
        return core::base64({reinterpret_cast<const unsigned char*>(text.data()), text.size()});
    };
    EXPECT_EQ(encode(""), "");
    EXPECT_EQ(encode("f"), "Zg==");
    EXPECT_EQ(encode("fo"), "Zm8=");
    EXPECT_EQ(encode("foobar"), "Zm9vYmFy");  // RFC 4648, section 10
}

TEST(Report, ErrorMapIsDarkWhereEqualAndBrightWhereNot) {
    Image a(2, 1, 3), b(2, 1, 3);
    for (int c = 0; c < 3; ++c) b.at(1, 0)[c] = 1;
    const Image map = error_map(a, b, 0.25);
    EXPECT_LT(map.at(0, 0)[0], 0.05f);
    EXPECT_GT(map.at(1, 0)[0], 0.9f);
    EXPECT_GT(map.at(1, 0)[1], 0.9f);
}

TEST(Report, ErrorMapsBlendNeighbouringColours) {
    const Image black(1, 1, 3);
    Image grey(1, 1, 3);
    for (int c = 0; c < 3; ++c)
        grey.at(0, 0)[c] = 0.125f;  // half way between the first two of the five colours
    const Image map = value_error_map(black, grey, 1);
    EXPECT_NEAR(map.at(0, 0)[0], (0.001 + 0.342) / 2, 1e-6);
    EXPECT_NEAR(map.at(0, 0)[1], (0.000 + 0.062) / 2, 1e-6);
    EXPECT_NEAR(map.at(0, 0)[2], (0.014 + 0.429) / 2, 1e-6);
}

TEST(Report, ValueErrorMapLooksAtAlphaAndBeyondWhite) {
    Image a(5, 1, 4), b(5, 1, 3);
    for (int x = 0; x < 5; ++x) a.at(x, 0)[3] = 1;
    a.at(1, 0)[3] = 0;              // alpha
    b.at(2, 0)[1] = -1;             // below black
    b.at(3, 0)[2] = std::nanf("");  // in one
    a.at(4, 0)[0] = b.at(4, 0)[0] = INFINITY;
    const Image map = value_error_map(a, b, 0.25);
    for (const int x : {0, 4}) EXPECT_LT(map.at(x, 0)[0], 0.05f) << x;
    for (const int x : {1, 2, 3}) EXPECT_GT(map.at(x, 0)[0], 0.9f) << x;
}

std::vector<std::string> names_of(const std::vector<std::string>& frame_names) {
    std::vector<Frame> frames;
    for (const std::string& name : frame_names) {
        frames.emplace_back();
        frames.back().name = name;
    }
    std::vector<std::string> names;
    for (const auto& path : picture_names(frames)) names.push_back(path.string());
    return names;
}

TEST(Report, PictureNamesAreStems) {
    using Names = std::vector<std::string>;
    EXPECT_EQ(names_of({"0001.jpg", "0002.jpg"}), (Names{"0001", "0002"}));
    EXPECT_EQ(names_of({"images/1.jpg", "images/2.jpg"}), (Names{"1", "2"}));
    EXPECT_EQ(names_of({"a.b.jpg"}), (Names{"a.b"}));
    EXPECT_EQ(names_of({"r_1"}), (Names{"r_1"}));
}

TEST(Report, PictureNamesNeverCollideNorEscape) {
    using Names = std::vector<std::string>;
    EXPECT_EQ(names_of({"left/1.jpg", "right/1.jpg"}), (Names{"left/1", "right/1"}));
    EXPECT_EQ(names_of({"1.jpg", "1.png"}), (Names{"1.jpg", "1.png"}));
    EXPECT_EQ(names_of({"1.jpg", "1.jpg"}), (Names{"1.jpg", "1.jpg-2"}));
    EXPECT_EQ(names_of({"../../etc/1.jpg", "/2.jpg"}), (Names{"etc/1", "2"}));
    EXPECT_EQ(names_of({"a\\1.jpg", "b\\1.jpg"}), (Names{"a/1", "b/1"}));
    EXPECT_EQ(names_of({"", ".."}), (Names{"frame", "frame-2"}));
}

}  // namespace
