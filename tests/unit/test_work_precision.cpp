// SPDX-License-Identifier: Apache-2.0
// The diagram of error against run time.
#include "report/chart.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace ewa::report {
namespace {

WorkPrecision two_points() {
    WorkPrecision diagram;
    diagram.title = "A & B";
    diagram.series.push_back({"way <1>", true, {{"few", 1, 0.1, 0.2}, {"many", 100, 0.001, 0.002}}});
    return diagram;
}

TEST(WorkPrecision, DrawsEveryPointAndEscapesText) {
    const std::string svg = work_precision_svg(two_points());
    size_t circles = 0;
    for (size_t at = 0; (at = svg.find("<circle", at)) != std::string::npos; ++at) ++circles;
    EXPECT_EQ(circles, 3u);  // two points and the legend's
    EXPECT_NE(svg.find("A &amp; B"), std::string::npos);
    EXPECT_NE(svg.find("way &lt;1&gt;"), std::string::npos);
    EXPECT_EQ(svg.find("nan"), std::string::npos);
}

TEST(WorkPrecision, LeavesOutWhatHasNoLogarithm) {
    WorkPrecision diagram = two_points();
    diagram.series[0].points[0].error = 0;
    EXPECT_EQ(work_precision_svg(diagram), "");
    diagram.series[0].points[0].error = NAN;
    EXPECT_EQ(work_precision_svg(diagram), "");
}

TEST(WorkPrecision, JsonHoldsThePoints) {
    const auto json = work_precision_json(two_points());
    EXPECT_EQ(json.at("series")[0].at("points")[1].at("time"), 100);
    EXPECT_EQ(json.at("series")[0].at("points")[1].at("error"), 0.001);
}

TEST(WorkPrecision, TablesAndVerdictsAreInJson) {
    WorkPrecision diagram = two_points();
    diagram.series[0].points[1].verdict = "on the <front>";
    diagram.tables.push_back(
        {"Causes", {"cause", "alone", "without it"}, {{"order & overlap", {0.25, 1e-3}}}, "note"});
    const auto json = work_precision_json(diagram);
    EXPECT_EQ(json.at("series")[0].at("points")[1].at("verdict"), "on the <front>");
    EXPECT_EQ(json.at("tables")[0].at("title"), "Causes");
    EXPECT_EQ(json.at("tables")[0].at("note"), "note");
    EXPECT_EQ(json.at("tables")[0].at("rows")[0].at("cause"), "order & overlap");
    EXPECT_EQ(json.at("tables")[0].at("rows")[0].at("without it"), 1e-3);
}

TEST(WorkPrecision, SeriesOfOneHueShareItsColour) {
    WorkPrecision diagram = two_points();
    diagram.series[0].hue = 2;
    diagram.series.push_back({"dashed", true, {{"a", 2, 0.3}, {"b", 20, 0.1}}, true, 2});
    const std::string svg = work_precision_svg(diagram);
    EXPECT_NE(svg.find("stroke-dasharray"), std::string::npos);
    EXPECT_NE(svg.find("#009e73"), std::string::npos);
    EXPECT_EQ(svg.find("#0072b2"), std::string::npos);
}

}  // namespace
}  // namespace ewa::report
