// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/edit_panel.h"

#include <imgui.h>

#include <utility>

#include "viewer/editor/panel_controls.h"
#include "viewer/editor/panel_sections.h"

namespace ewa::viewer {

struct EditPanel::State {
    SelectionSection selection;
    MoveSection move;
    ColourSection colours;
    CleanSection clean;
    HistogramSection histogram;
    bool show_cleaning = false, redraw = false, plain = false;
};

EditPanel::EditPanel() : state_(std::make_unique<State>()) {}
EditPanel::~EditPanel() = default;

void EditPanel::show_cleaning() {
    state_->show_cleaning = true;
}

bool EditPanel::shows_colours() const {
    return state_->plain;
}

bool EditPanel::take_redraw() {
    return std::exchange(state_->redraw, false);
}

void EditPanel::draw(Editor& editor, bool live) {
    State& state = *state_;
    // Asks for another frame if it waits for something.
    const auto draw = [&](auto& part, const auto&... more) {
        part.draw(editor, more...);
        state.redraw = part.waiting() || state.redraw;
    };
    state.redraw = state.plain = false;
    if (!editor.snapshot().splats) return ImGui::TextDisabled("%s", say::kNoScene);
    if (live) ImGui::TextWrapped("%s", say::kLive);
    if (ui::section(say::kSelection, true)) draw(state.selection, live);
    if (live) return state.clean.end(editor);
    if (ui::section(say::kMove, false)) state.move.draw(editor);
    if (ui::section(say::kColours, false)) {
        draw(state.colours);
        state.plain = editor.snapshot().selected > 0 && !editor.preview_count();
    }
    const bool jump = std::exchange(state.show_cleaning, false);
    const bool clean = ui::section(say::kClean, false, jump);
    if (jump) ImGui::SetScrollHereY(0);
    clean ? state.clean.draw(editor) : state.clean.end(editor);
    if (ui::section(say::kHistogram, false)) draw(state.histogram);
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

edit::Cameras cameras_of(const Editor& editor) {
    return editor.snapshot().cameras;
}

}  // namespace ewa::viewer
