// SPDX-License-Identifier: Apache-2.0
// What the panel of edits computes: bins of histograms, and the words of edits.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <numeric>
#include <set>
#include <span>
#include <sstream>

#include "edit/edits.h"
#include "edit/shapes.h"
#include "edit/steps.h"
#include "ewa/error.h"
#include "support/soon.h"
#include "viewer/editor/edit_words.h"
#include "viewer/editor/editor.h"
#include "viewer/editor/histogram.h"
#include "viewer/editor/texts.h"

namespace ewa::viewer {
namespace {

using edit::Adjustment;

/// 0, 1, ..., n - 1.
std::vector<double> counting(size_t n) {
    std::vector<double> values(n);
    std::iota(values.begin(), values.end(), 0.0);
    return values;
}

uint32_t total(const std::vector<uint32_t>& counts) {
    return std::accumulate(counts.begin(), counts.end(), 0u);
}

TEST(HelpTexts, NameEachKeyOnce) {
    std::set<std::string> keys;
    const auto add = [&](std::span<const texts::HelpRow> rows) {
        for (const texts::HelpRow& row : rows) EXPECT_TRUE(keys.emplace(row.keys).second) << row.keys;
    };
    add(texts::kViewHelp);
    keys.clear();  // the tools take some of them in the other tab
    for (const texts::HelpGroup& group : texts::kHelpGroups)
        if (group.rows.data() != texts::kViewHelp) add(group.rows);
    for (const texts::ToolText& tool : texts::kTools)
        if (tool.tool != Tool::view && *tool.key) add(std::array{texts::HelpRow{tool.key, tool.name}});
    for (const char* key : {"Del", "Ctrl+Z", "Ctrl+A", "Ctrl+D", "Ctrl+I", "H", "[ ]", "K", "Space", "Tab"})
        EXPECT_TRUE(keys.contains(key)) << key;
}

TEST(Histogram, CountsWhatIsLeftAndWhatIsSelected) {
    std::vector<double> values = counting(512);
    values.push_back(std::numeric_limits<double>::quiet_NaN());
    std::vector<uint8_t> states(values.size(), 0);
    states[0] = edit::kDeleted | edit::kSelected;
    states[1] = edit::kSelected;
    states[511] = edit::kSelected | edit::kHidden;
    const Histogram bins = histogram({"x"}, values, states);
    ASSERT_EQ(bins.bins(), kMostBins);
    EXPECT_EQ(bins.low, 1);
    EXPECT_EQ(bins.high, 511);
    EXPECT_EQ(total(bins.left), 511u);
    EXPECT_EQ(total(bins.selected), 2u);
    EXPECT_EQ(bins.selected.front(), 1u);
    EXPECT_EQ(bins.selected.back(), 1u);
    for (const uint32_t count : bins.left) EXPECT_LE(count, 3u);
}

TEST(Histogram, FarValuesAreInTheOutermostBins) {
    std::vector<double> values = counting(10'000);
    values[5] = -1e9;
    values[6] = 1e9;
    values[7] = std::numeric_limits<double>::infinity();
    const Histogram bins = histogram({"x"}, values, std::vector<uint8_t>(values.size(), 0));
    EXPECT_GT(bins.low, -100);
    EXPECT_LT(bins.high, 10'100);
    EXPECT_EQ(total(bins.left), 10'000u);
    EXPECT_EQ(range_of_bins(bins, 0, kMostBins - 1), "x=-inf..inf");
    EXPECT_TRUE(range_of_bins(bins, 0, 10).starts_with("x=.."));
    EXPECT_TRUE(range_of_bins(bins, 10, kMostBins - 1).ends_with(".."));
}

TEST(Histogram, TheRangeOfBinsTakesTheirSplats) {
    Gaussians splats;
    splats.resize(1000);
    for (size_t i = 0; i < splats.size(); ++i) splats.means[3 * i] = float(0.37 * double(i * i % 1000));
    const Histogram bins = histogram({"x"}, column_values("x", splats, {}), {});
    for (const auto& [first, last] : {std::pair<size_t, size_t>{0, 9}, {17, 17}, {30, 200}, {250, 255}}) {
        const auto taken = edit::parse_filter(range_of_bins(bins, first, last), "range")(splats, {});
        uint32_t expected = 0;
        for (size_t bin = first; bin <= last; ++bin) expected += bins.left[bin];
        EXPECT_EQ(std::count(taken.begin(), taken.end(), true), expected) << first << " to " << last;
    }
}

TEST(Histogram, DecadesHaveEqualWidths) {
    const Histogram bins = histogram({.name = "scale", .decades = true}, {0, 0.01, 0.1, 1, 10, 100}, {});
    EXPECT_NEAR(bins.border(0), 0.01, 1e-12);
    EXPECT_NEAR(bins.border(kMostBins / 2), 1, 1e-12);
    EXPECT_NEAR(bins.border(kMostBins), 100, 1e-9);
    EXPECT_EQ(bins.left.front(), 2u) << "a flat splat counts as a small one";
}

TEST(Histogram, WholeNumbersHaveABinEach) {
    const Histogram bins = histogram({.name = "views", .whole = true}, {2, 3, 3, 7}, {});
    EXPECT_EQ(bins.left, (std::vector<uint32_t>{1, 2, 0, 0, 0, 1}));
    EXPECT_EQ(range_of_bins(bins, 1, 2), "views=3..4");
    EXPECT_EQ(range_of_bins(bins, 0, 1), "views=..3");
}

TEST(Histogram, NoValuesAndEqualValuesHaveBinsToo) {
    EXPECT_EQ(total(histogram({"x"}, {}, {}).left), 0u);
    const Histogram same = histogram({"x"}, {5, 5, 5}, {});
    EXPECT_LT(same.low, 5);
    EXPECT_GT(same.high, 5);
    EXPECT_EQ(total(same.left), 3u);
}

TEST(Histogram, ColumnsAreThoseOfFilters) {
    Gaussians splats;
    splats.resize(1);
    splats.quaternions[0] = 1;
    for (const HistogramColumn& column : histogram_columns(false)) {
        EXPECT_EQ(column_values(column.name, splats, {}).size(), 1u) << column.name;
        EXPECT_NO_THROW(edit::parse_filter(column.name + "=0..", "")) << column.name;
    }
    EXPECT_EQ(histogram_columns(true).back().name, edit::kViews);
    EXPECT_THROW(column_values(edit::kViews, splats, {}), InputError);
    EXPECT_THROW(column_values("width", splats, {}), InputError);
}

/// A colour after an adjustment, from its formula.
std::array<double, 4> adjusted(const Adjustment& a, std::array<double, 4> color) {
    for (size_t c = 0; c < 3; ++c) {
        color[c] = color[c] * double(a.tint[c]) + double(a.brightness);
        color[c] = ((color[c] - 0.5) * double(a.contrast) + 0.5) / double(a.white);
    }
    color[3] *= double(a.opacity);
    return color;
}

/// The adjustment of a text that adjustment_text() has written.
Adjustment read(const std::string& text) {
    Adjustment result;
    std::istringstream parts(text);
    for (std::string part; std::getline(parts, part, ';');) {
        const size_t equals = part.find('=');
        const std::string name = part.substr(0, equals);
        std::istringstream numbers(part.substr(equals + 1));
        char comma = 0;
        auto& [red, green, blue] = result.tint;
        if (name == "tint") numbers >> red >> comma >> green >> comma >> blue;
        if (name == "brightness") numbers >> result.brightness;
        if (name == "contrast") numbers >> result.contrast;
        if (name == "white") numbers >> result.white;
        if (name == "opacity") numbers >> result.opacity;
    }
    return result;
}

TEST(AdjustmentEdits, LeadFromOneAdjustmentToTheOther) {
    const std::array<Adjustment, 6> all{Adjustment{},
                                        {.tint = {0.5f, 1, 0.25f}},
                                        {.brightness = -0.2f, .opacity = 0.5f},
                                        {.contrast = 1.5f, .white = 0.8f},
                                        {.tint = {1, 0.7f, 0.9f}, .brightness = 0.1f, .contrast = 0.6f},
                                        {.tint = {0.9f, 0.9f, 0.9f}, .white = 2, .opacity = 0.1f}};
    for (const Adjustment& from : all)
        for (const Adjustment& to : all) {
            const std::array<double, 4> color{0.9, 0.4, -0.1, 0.3};
            std::array<double, 4> now = adjusted(from, color);
            const auto edits = adjustment_edits(from, to);
            EXPECT_LE(edits.size(), 2u);
            EXPECT_EQ(edits.empty(), from == to);
            for (const edit::Words& words : edits) {
                EXPECT_EQ(words.name, "adjust");
                now = adjusted(read(words.value), now);
            }
            for (size_t c = 0; c < 4; ++c) EXPECT_NEAR(now[c], adjusted(to, color)[c], 1e-6);
        }
}

TEST(AdjustmentEdits, AreStepsOfAdjustFromAnyPlaceOfTheSliders) {
    std::vector<Adjustment> all{{}};
    for (const float brightness : {-0.5f, 0.5f})
        for (const float contrast : {0.2f, 3.0f})
            for (const float white : {0.2f, 3.0f})
                for (const std::array<float, 3>& tint :
                     {std::array{1.0f, 1.0f, 1.0f}, {0.01f, 0.01f, 0.01f}, {1.0f, 0.01f, 0.5f}})
                    all.push_back({tint, brightness, contrast, white, 0.01f});
    for (const Adjustment& from : all)
        for (const Adjustment& to : all) {
            std::array<double, 4> now = adjusted(from, {0.9, 0.4, -0.1, 0.3});
            for (const edit::Words& words : adjustment_edits(from, to)) {
                EXPECT_NO_THROW(edit::parse(words.name, words.value));
                now = adjusted(read(words.value), now);
            }
            for (size_t c = 0; c < 4; ++c)
                EXPECT_NEAR(now[c], adjusted(to, {0.9, 0.4, -0.1, 0.3})[c], 1e-3) << adjustment_text(from);
        }
}

TEST(AdjustmentEdits, SpeakOfWhatChangesAlone) {
    EXPECT_EQ(adjustment_text({}), "");
    EXPECT_EQ(adjustment_text({.tint = {1, 0.5f, 0.25f}, .opacity = 0.5f}), "tint=1,0.5,0.25;opacity=0.5");
    const Adjustment bright{.brightness = 0.25f};
    EXPECT_EQ(adjustment_edits({}, bright), (std::vector<edit::Words>{{"adjust", "brightness=0.25"}}));
    EXPECT_EQ(adjustment_edits(bright, {}), (std::vector<edit::Words>{{"adjust", "brightness=-0.25"}}));
    EXPECT_EQ(adjustment_edits(bright, {.brightness = 0.25f, .opacity = 0.5f}),
              (std::vector<edit::Words>{{"adjust", "opacity=0.5"}}));
}

TEST(HasKey, TakesEachAlternativeWithItsModifiers) {
    const std::string keys = "Ctrl+D or Ctrl+Shift+A";
    EXPECT_TRUE(has_key(keys, 'D', false, true));
    EXPECT_TRUE(has_key(keys, 'A', true, true));
    EXPECT_FALSE(has_key(keys, 'A', false, true));
    EXPECT_FALSE(has_key(keys, 'D', false, false));
    EXPECT_FALSE(has_key("", 'D', false, false));
    EXPECT_TRUE(has_key("Ctrl+=", '=', true, true)) << "as plus";
    constexpr int kBackspace = 259, kDelete = 261;  // of GLFW
    for (const int key : {kBackspace, kDelete})
        EXPECT_TRUE(has_key(texts::edit_panel::kDelete.keys, key, false, false));
}

TEST(HasKey, NoTwoEditsOrToolsShareAKey) {
    std::vector<std::string> all{texts::kUndo.keys, texts::kRedo.keys};
    for (const auto& edit : texts::edit_panel::kKeyedEdits) all.emplace_back(edit.keys);
    for (const texts::ToolText& tool : texts::kTools)
        if (*tool.key) all.emplace_back(tool.key);
    std::vector<int> found(all.size(), 0);
    constexpr int kLastKey = 348;
    for (int key = 0; key <= kLastKey; ++key)
        for (const bool shift : {false, true})
            for (const bool control : {false, true}) {
                int here = 0;
                for (size_t i = 0; i < all.size(); ++i) {
                    const int has = has_key(all[i], key, shift, control) ? 1 : 0;
                    found[i] += has;
                    here += has;
                }
                EXPECT_LE(here, 1) << key;
            }
    for (size_t i = 0; i < all.size(); ++i) EXPECT_GE(found[i], 1) << all[i];
}

TEST(SelectionTitle, SaysHowWhichShapeSelects) {
    EXPECT_EQ(selection_title("all"), "Select all");
    EXPECT_EQ(selection_title("none"), "Select none");
    EXPECT_EQ(selection_title("invert"), texts::edit_panel::kInvert.name);
    EXPECT_EQ(selection_title("grow=0.1"), texts::edit_panel::kGrow.name);
    EXPECT_EQ(selection_title("opacity=..0.1"), "Select by opacity");
    EXPECT_EQ(selection_title("remove:" + edit::box_shape({0, 0, 0}, {1, 1, 1})), "Remove by box");
    EXPECT_EQ(selection_title("and:" + edit::sphere_shape({0, 0, 0}, 1)), "Intersect by sphere");
    Camera camera;
    camera.width = camera.height = 100;
    camera.fx = camera.fy = 100;
    EXPECT_EQ(selection_title(edit::rectangle_shape(camera, {1, 2}, {30, 40.5}) + ";front"),
              "Select by rectangle");
    EXPECT_EQ(selection_title("add:" + edit::polygon_shape(camera, {{1, 2}, {30, 2}, {30, 40}, {2, 40}})),
              "Add by polygon");
}

TEST(EditNews, SaysWhatWasDoneAndWithHowManySplats) {
    EditSnapshot first;
    first.left = 10'000;
    EditSnapshot selected = first;
    selected.steps = {{"Select by box", {{"select", "box=0,0,0,1,1,1"}}}};
    selected.done = 1;
    selected.selected = 7163;
    selected.milliseconds = 2.4;
    EXPECT_EQ(edit_news(first, selected), "Select by box, 7,163 splats, 2 ms");
    EditSnapshot deleted = selected;
    deleted.steps.push_back({"Delete", {{"delete", ""}}});
    deleted.done = 2;
    deleted.left = 2837;
    deleted.selected = 0;
    deleted.values_version = 1;
    EXPECT_EQ(edit_news(selected, deleted), "Delete, 7,163 splats, 2 ms");
    EditSnapshot undone = selected;
    undone.steps = deleted.steps;
    EXPECT_EQ(edit_news(deleted, undone), "Undone: Delete, 7,163 splats, 2 ms");
    EXPECT_EQ(edit_news(undone, deleted), "Redone: Delete, 7,163 splats, 2 ms");
    EditSnapshot opened = first;
    opened.steps = deleted.steps;
    EXPECT_EQ(edit_news(deleted, opened), "Undone: 2 edits, 7,163 splats, 0 ms");
    // Another edit in place of an undone one.
    EditSnapshot hidden = selected;
    hidden.steps.push_back({"Hide", {{"hide", ""}}});
    hidden.done = 2;
    hidden.selected = 0;
    hidden.hidden = 7163;
    EXPECT_EQ(edit_news(undone, hidden), "Hide, 7,163 splats, 2 ms");
    // A rule that removes nothing takes the selection away alone.
    EditSnapshot nothing = selected;
    nothing.steps.push_back({"Remove large splats", {{"select", "scale=9.."}, {"delete", ""}}});
    nothing.done = 2;
    nothing.selected = 0;
    EXPECT_EQ(edit_news(selected, nothing), "Remove large splats, 0 splats, 2 ms");
    EXPECT_EQ(edit_news(deleted, first), "") << "another scene";
}

TEST(BrokenLines, EndBetweenWordsAndNumbers) {
    EXPECT_EQ(broken_lines("", 10), "");
    EXPECT_EQ(broken_lines("--select sphere=0.125,-1.5,2,0.5;front --delete", 20),
              "--select \nsphere=0.125,-1.5,2,\n0.5;front --delete");
    EXPECT_EQ(broken_lines("0.940075879 1 2", 4), "0.940075879 \n1 2");
}

TEST(PartText, SaysTheShareWithoutExponents) {
    EXPECT_EQ(part_text(0, 73'284), "0 splats (0 %)");
    EXPECT_EQ(part_text(0, 0), "0 splats (0 %)");
    EXPECT_EQ(part_text(3406, 90'854), "3,406 splats (3.75 %)");
    EXPECT_EQ(part_text(73'284, 73'284), "73,284 splats (100 %)");
    EXPECT_EQ(part_text(1, 10'000'000), "1 splat (< 0.001 %)");
}

TEST(EditSnapshot, TheMiddleIsThatOfWhatAMoveChanges) {
    auto splats = std::make_shared<Gaussians>();
    splats->resize(4);
    for (size_t i = 0; i < 4; ++i) {
        splats->means[3 * i] = std::array{1.0f, 2.0f, 3.0f, 10.0f}[i];
        splats->quaternions[4 * i] = 1;
    }
    constexpr size_t kBudget = 1000;
    Editor editor(
        {}, [] {}, kBudget);
    editor.enter("scene", {}, splats, {}, false);
    const auto middle = [&] {
        EXPECT_TRUE(test::soon([&] {
            editor.take();
            return !editor.busy();
        }));
        editor.take();
        return editor.snapshot().middle.x;
    };
    EXPECT_EQ(middle(), 4);
    editor.select("x=9..", edit::Operation::set);
    EXPECT_EQ(middle(), 10);
    EXPECT_EQ(editor.snapshot().steps.front().title, "Select by x");
    editor.perform({"Lock", {{"lock", ""}}});
    EXPECT_EQ(middle(), 2) << "a move leaves what is locked";
    EXPECT_FALSE(editor.snapshot().bounds);
    ASSERT_TRUE(editor.snapshot().bounds_of_all);
    EXPECT_EQ((*editor.snapshot().bounds_of_all)[1].x, 3);
}

TEST(EditedScenes, AreShownWhileTheyAreActive) {
    auto splats = std::make_shared<Gaussians>();
    splats->resize(1);
    constexpr size_t kBudget = 1000;
    Editor editor(
        {}, [] {}, kBudget);
    editor.enter("first", {}, splats, {}, false);
    editor.show(0, false);
    EXPECT_TRUE(editor.scene(0).shown) << "the only one";
    editor.add("second", {}, splats);
    EXPECT_EQ(editor.active(), 1u);
    editor.show(1, false);
    EXPECT_EQ(editor.active(), 0u);
    EXPECT_FALSE(editor.scene(1).shown);
    editor.show(0, false);
    EXPECT_TRUE(editor.scene(0).shown) << "the only one that is shown";
    editor.activate(1);
    EXPECT_TRUE(editor.scene(1).shown);
    editor.show(0, false);
    EXPECT_EQ(editor.active(), 1u);
}

TEST(PlacementText, MovesTurnsAndScalesAboutThePoint) {
    const glm::dvec3 about(3, -2, 7);
    EXPECT_EQ(placement_text(about, {.position = about}), "");
    EXPECT_EQ(placement_text(about, {.position = {4, -2, 6.5}}), "move=1,0,-0.5");
    const Placement placement{.position = {1, 2, 3}, .degrees = {90, 0, 90}, .scale = 2};
    const glm::dmat4 matrix = edit::parse_transform({placement_text(about, placement)});
    EXPECT_NEAR(glm::length(glm::dvec3(matrix * glm::dvec4(about, 1)) - placement.position), 0, 1e-9);
    // About x, y becomes z, which the turn about z leaves; about z, x becomes y.
    EXPECT_NEAR(glm::length(glm::dvec3(matrix[1]) - glm::dvec3(0, 0, 2)), 0, 1e-9);
    EXPECT_NEAR(glm::length(glm::dvec3(matrix[0]) - glm::dvec3(0, 2, 0)), 0, 1e-9);
}

/// A training takes selections, deletes and locks alone, and no undo of what it has.
TEST(LiveEdits, AreRefusedAtOnce) {
    Gaussians two;
    two.resize(2);
    two.quaternions[0] = two.quaternions[4] = 1;
    Editor editor(
        "ewa", [] {}, 1000);
    editor.enter("two", {}, std::make_shared<const Gaussians>(two), {}, false);
    editor.settings.live = true;
    const auto settled = [&] {
        std::string note;
        EXPECT_TRUE(test::soon([&] {
            note += editor.take().note;
            return !editor.busy();
        }));
        return note;
    };
    editor.perform({"Select all", {{"select", "all"}}});
    EXPECT_EQ(settled(), "");
    EXPECT_EQ(editor.snapshot().selected, 2u);
    EXPECT_EQ(editor.snapshot().scene, editor.scene(0).id);
    editor.perform({"Move", {{"transform", "move=1,0,0"}}});
    EXPECT_EQ(settled(), texts::kLiveRefuses);
    EXPECT_EQ(editor.snapshot().done, 1u);
    editor.settings.sent = 1;
    editor.undo();
    EXPECT_EQ(settled(), texts::kLiveUndo);
    EXPECT_EQ(editor.snapshot().done, 1u);
    editor.settings.sent = 0;
    editor.undo();
    EXPECT_EQ(settled(), "");
    EXPECT_EQ(editor.snapshot().done, 0u);
}

TEST(PasteShape, TakesABoxOrASphere) {
    EditSettings settings;
    EXPECT_TRUE(paste_shape(" box = -1,-2,-3,4,5,6\n", settings));
    EXPECT_EQ(settings.box_low, glm::dvec3(-1, -2, -3));
    EXPECT_EQ(settings.box_high, glm::dvec3(4, 5, 6));
    EXPECT_TRUE(paste_shape("sphere=1,2,3,0.5", settings));
    EXPECT_EQ(settings.sphere_center, glm::dvec3(1, 2, 3));
    EXPECT_EQ(settings.sphere_radius, 0.5);
    const EditSettings before = settings;
    for (const char* text :
         {"", "box", "box=1,2,3", "box=4,0,0,1,1,1", "sphere=1,2,3,0", "sphere=1,2,nan,1", "opacity=0..1"})
        EXPECT_FALSE(paste_shape(text, settings)) << text;
    EXPECT_EQ(settings.box_low, before.box_low);
    EXPECT_EQ(settings.sphere_radius, before.sphere_radius);
}

}  // namespace
}  // namespace ewa::viewer
