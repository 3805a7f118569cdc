// SPDX-License-Identifier: Apache-2.0
#include <imgui.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <exception>

#include "core/text.h"
#include "viewer/editor/panel_controls.h"
#include "viewer/editor/panel_sections.h"
#include "viewer/editor/theme.h"
#include "viewer/editor/tool_parts.h"

namespace ewa::viewer {
namespace {

constexpr float kHistogramHeight = 6;   // heights of the text
constexpr float kRangeOpacity = 0.25f;  // of the accent behind the range that is dragged

/// The numbers of the highest bar in 0 to 1.
float bar_height(uint32_t count, uint32_t most, bool logarithms) {
    if (most == 0) return 0;
    if (logarithms) return float(std::log1p(double(count)) / std::log1p(double(most)));
    return float(count) / float(most);
}

}  // namespace

HistogramSection::HistogramSection()
    : counting_(
          [values = std::vector<double>(), of = std::weak_ptr<const Gaussians>(),
           column = std::string()](const Request& request) mutable {
              Counted counted;
              counted.number = request.number;
              try {
                  if (of.lock() != request.splats || column != request.column.name) {
                      values = column_values(request.column.name, *request.splats, request.cameras);
                      of = request.splats;
                      column = request.column.name;
                  }
                  counted.histogram = histogram(request.column, values,
                                                request.states ? *request.states : std::vector<uint8_t>());
              } catch (const std::exception& error) {
                  of.reset();
                  counted.problem = error.what();
              }
              return counted;
          },
          [] {}) {}

bool HistogramSection::waiting() const {
    const auto counted = counting_.result();
    return asked_.number > 0 && (!counted || counted->number != asked_.number);
}

/// Asks for other counts where the splats, their states or the column are others.
void HistogramSection::ask(Editor& editor, const HistogramColumn& column) {
    const EditSnapshot& now = editor.snapshot();
    if (asked_.splats == now.splats && asked_.states == now.states && asked_.column.name == column.name)
        return;
    asked_ = {now.splats, now.states, editor.snapshot().cameras, column, asked_.number + 1};
    counting_.ask(asked_);
}

void HistogramSection::draw_bins(Editor& editor, const Histogram& histogram) {
    const ImVec2 size(ImGui::GetContentRegionAvail().x, kHistogramHeight * ImGui::GetTextLineHeight());
    ImGui::InvisibleButton("bins", size);
    const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
    ImDrawList& list = *ImGui::GetWindowDrawList();
    list.AddRectFilled(low, high, ImGui::GetColorU32(ImGuiCol_FrameBg), ImGui::GetStyle().FrameRounding);
    const float width = size.x / float(histogram.bins());
    const auto left_of = [&](size_t bin) { return low.x + std::floor(width * float(bin)); };
    const size_t last = histogram.bins() - 1;
    const float place = (ImGui::GetIO().MousePos.x - low.x) / width;
    const size_t pointed = size_t(std::clamp(place, 0.0f, float(last)));
    if (ImGui::IsItemActivated()) first_ = pointed;
    if (first_) first_ = std::min(*first_, last);
    if (first_) {
        const auto [from, to] = std::minmax({*first_, pointed});
        list.AddRectFilled(ImVec2(left_of(from), low.y), ImVec2(left_of(to + 1), high.y),
                           ImU32(accent(kRangeOpacity)));
        if (ImGui::IsItemDeactivated()) {
            first_.reset();
            editor.select(range_of_bins(histogram, from, to), held_operation(editor.settings));
        }
    }
    const uint32_t most = std::ranges::max(histogram.left);
    const ImU32 colors[] = {ImGui::GetColorU32(ImGuiCol_TextDisabled, 0.6f), ImU32(accent())};
    const std::vector<uint32_t>* counts[] = {&histogram.left, &histogram.selected};
    for (size_t kind = 0; kind < 2; ++kind)
        for (size_t bin = 0; bin <= last; ++bin) {
            const float bar = bar_height((*counts[kind])[bin], most, counts_ == 1);
            if (bar > 0)
                list.AddRectFilled(ImVec2(left_of(bin), high.y - std::max(1.0f, bar * size.y)),
                                   ImVec2(left_of(bin + 1), high.y), colors[kind]);
        }
    if (!ImGui::IsItemHovered() && !ImGui::IsItemActive()) return;
    ImGui::SetTooltip(
        "%s", fmt::format(say::kBin, histogram.border(pointed), histogram.border(pointed + 1),
                          core::grouped(histogram.left[pointed]), core::grouped(histogram.selected[pointed]))
                  .c_str());
}

void HistogramSection::draw(Editor& editor) {
    ImGui::PushID("histogram");
    const std::vector<HistogramColumn> columns = histogram_columns(bool(editor.snapshot().cameras));
    if (std::ranges::find(columns, column_, &HistogramColumn::name) == columns.end())
        column_ = columns.front().name;
    ui::label_left(say::kColumn);
    if (ImGui::BeginCombo("##column", column_.c_str(), ImGuiComboFlags_HeightLargest)) {
        for (const HistogramColumn& column : columns)
            if (ImGui::Selectable(column.name.c_str(), column.name == column_)) column_ = column.name;
        ImGui::EndCombo();
    }
    ask(editor, *std::ranges::find(columns, column_, &HistogramColumn::name));
    ui::segments(say::kCounts, counts_);
    const auto counted = counting_.result();
    const bool shown = counted && counted->problem.empty() && counted->histogram.column.name == column_;
    if (shown) {
        draw_bins(editor, counted->histogram);
        const Histogram& bins = counted->histogram;
        ImGui::Text("%.4g", bins.border(0));
        const std::string end = fmt::format("{:.4g}", bins.border(bins.bins()));
        ImGui::SameLine(ImGui::GetContentRegionMax().x - ImGui::CalcTextSize(end.c_str()).x);
        ImGui::TextUnformatted(end.c_str());
    } else if (counted && !waiting()) {
        ImGui::TextWrapped("%s", core::one_line(counted->problem).c_str());
    }
    ImGui::TextDisabled("%s", shown && !waiting() ? say::kDragRange : waiting() ? say::kCounting : "");
    ImGui::PopID();
}

}  // namespace ewa::viewer
