// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/edit_panel.h"

#include <imgui.h>

#include <utility>

#include "viewer/editor/panel_controls.h"
#include "viewer/view_state.h"

namespace ewa::viewer {

void EditPanel::draw(Editor& editor, ViewState& state) {
    // Asks for another frame if it waits for something.
    const auto draw = [&](auto& part) {
        part.draw(editor);
        if (part.waiting()) state.redraw();
    };
    const bool live = editor.settings.live;
    if (!editor.snapshot().splats) return ImGui::TextDisabled("%s", say::kNoScene);
    if (live) ImGui::TextWrapped("%s", say::kLive);
    if (ui::section(say::kSelection, true)) selection_.draw(editor);
    if (live) return clean_.end(editor);
    if (ui::section(say::kMove, false)) move_.draw(editor);
    if (ui::section(say::kColours, false)) {
        draw(colours_);
        state.settings.look.plain = editor.snapshot().selected > 0 && !editor.preview_count();
    }
    const bool jump = std::exchange(show_cleaning_, false);
    const bool clean = ui::section(say::kClean, false, jump);
    if (jump) ImGui::SetScrollHereY(0);
    clean ? draw(clean_) : clean_.end(editor);
    if (ui::section(say::kHistogram, false)) draw(histogram_);
    if (ui::section(say::kScenes, editor.scenes() > 1)) draw_scenes(editor);
    if (ui::section(say::kHistory, false)) draw_history(editor);
}

void perform_on_selection(Editor& editor, const char* title, std::vector<edit::Words> edits) {
    if (editor.snapshot().selected == 0) {
        edits.insert(edits.begin(), {"select", "all"});
        edits.push_back({"select", "none"});
    }
    editor.perform({title, std::move(edits)});
}

}  // namespace ewa::viewer
