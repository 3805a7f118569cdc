// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/dialogs.h"

#include <imgui.h>

#include <set>
#include <utility>

#include "core/folders.h"
#include "core/messages.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/splat_files.h"
#include "viewer/editor/modal.h"
#include "viewer/editor/publish_dialog.h"
#include "viewer/editor/save_choices.h"

namespace ewa::viewer {
namespace {

namespace fs = std::filesystem;

constexpr const char *kSaveAsTitle = "Save as", *kSaveIt = "Save", *kReplaceIt = "Replace",
                     *kDialogBack = "Cancel", *kScopeActive = "The active scene",
                     *kScopeAll = "All shown scenes, joined", *kKeepsAll = "It keeps everything.",
                     *kStillSaving = "the last save is not done yet", *kNothingToSave = "nothing is open";
constexpr const char *kLeaveTitle = "Unsaved edits", *kDontSave = "Don't save";
constexpr const char *kJournalTitle = "Edits of an earlier session", *kJournalRestore = "Restore",
                     *kJournalDiscard = "Discard", *kJournalLater = "Later";
constexpr const char* kSavingTitle = "Saving";
constexpr float kFormatLines = 8;

/// The row for a copy of the file: its own format if ewa writes that, or else PLY.
const io::FormatRow* first_row(const fs::path& file) {
    const io::FormatRow* row = io::row_of_name(file);
    return row && row->writable() ? row : &io::row_of(SplatFormat::ply);
}

}  // namespace

enum class DialogKind { none, save, publish, leave, journal, saving };

struct Dialogs::State {
    State(Editor& edited, FileDialog& dialog, std::function<void()> wake,
          std::function<void(const std::string&)> tell)
        : editor(edited), files(dialog), say(std::move(tell)), publish(edited, dialog, std::move(wake)) {}

    Editor& editor;
    FileDialog& files;
    std::function<void(const std::string&)> say;
    PublishDialog publish;
    DialogKind shown = DialogKind::none, drawn = DialogKind::none;
    bool keyboard = false;  // ImGui's keyboard navigation is on for a dialog

    // Save as.
    const io::FormatRow* row = nullptr;
    bool all = false;
    PathField path;
    struct Saved {
        fs::path original, file;
        std::string name;
        bool all = false;
    } last;
    std::set<fs::path> written;  // by this session, so they are no originals

    std::function<void()> go_on;  // after the save; null: nothing
    fs::path journal_file;
    edit::ReadJournal journal;

    const EditedScene& scene() const { return editor.scene(editor.active()); }
    fs::path target() const;
    std::vector<fs::path> originals() const;
    void write(const fs::path& out, bool all_scenes);
    void pass(const std::function<void()>& on);
    void save_as();
    void confirm_save();
    void discard_journals() const;
    void draw_formats();
    void draw_save();
    void draw_leave();
    void draw_journal();
    void draw_saving();
    void draw_shown();
};

/// The file to write. A name without an extension gets that of the chosen format.
fs::path Dialogs::State::target() const {
    const fs::path typed = path.path();
    if (typed.empty()) return typed;
    std::error_code error;
    const fs::path whole = fs::absolute(typed, error).lexically_normal();
    return io::row_of_name(whole) ? whole : with_format(whole, *row);
}

std::vector<fs::path> Dialogs::State::originals() const {
    std::vector<fs::path> files_opened;
    for (size_t i = 0; i < editor.scenes(); ++i)
        if (const fs::path& file = editor.scene(i).file; !written.contains(file))
            files_opened.push_back(file);
    return files_opened;
}

void Dialogs::State::write(const fs::path& out, bool all_scenes) {
    last = {scene().file, out, scene().name, all_scenes};
    written.insert(out);
    editor.save(out, all_scenes);
    shown = go_on ? DialogKind::saving : DialogKind::none;
}

/// Calls `on`, which may open other scenes. Files that were written before may then be originals.
void Dialogs::State::pass(const std::function<void()>& on) {
    last = {};
    written.clear();
    if (on) on();
}

void Dialogs::State::save_as() {
    if (editor.scenes() == 0) return say(kNothingToSave);
    if (editor.saving()) return say(kStillSaving);
    row = first_row(scene().file);
    path.set(proposed_file(scene().file, scene().name, *row));
    all = all && editor.scenes() > 1;
    shown = DialogKind::save;
}

void Dialogs::State::confirm_save() {
    const fs::path out = target();
    if (!path.accept(out, refusal(out, originals()))) return;
    try {
        core::make_folder(out.parent_path());
        write(out, all);
    } catch (const std::exception& error) {
        path.complain(core::one_line(error.what()));
    }
}

/// The edits that the user gives up are not offered again.
void Dialogs::State::discard_journals() const {
    for (size_t i = 0; i < editor.scenes(); ++i) {
        const EditedScene& each = editor.scene(i);
        std::error_code error;
        if (each.unsaved && each.journal) fs::remove(each.journal->file(), error);
    }
}

void Dialogs::State::draw_formats() {
    const Gaussians* splats = all ? editor.splats().get() : editor.snapshot().splats.get();
    const size_t count = !splats ? 0 : all ? splats->size() : editor.snapshot().left;
    const float line = ImGui::GetTextLineHeightWithSpacing();
    constexpr auto kFlags =
        ImGuiTableFlags_ScrollY | ImGuiTableFlags_SizingFixedFit | ImGuiTableFlags_BordersOuter;
    if (ImGui::BeginTable("formats", 3, kFlags, ImVec2(modal_width(), kFormatLines * line))) {
        for (const io::FormatRow& each : io::format_rows()) {
            if (!each.writable()) continue;
            ImGui::TableNextColumn();
            const std::string name = std::string(each.name) + " (" + std::string(each.extension) + ")";
            if (ImGui::Selectable(
                    name.c_str(), &each == row,
                    ImGuiSelectableFlags_SpanAllColumns | ImGuiSelectableFlags_DontClosePopups)) {
                if (const fs::path typed = path.path(); !typed.empty()) path.set(with_format(typed, each));
                row = &each;
            }
            ImGui::TableNextColumn();
            ImGui::TextUnformatted(each.purpose.data(), each.purpose.data() + each.purpose.size());
            ImGui::TableNextColumn();
            const uint64_t bytes = splats ? usual_bytes(each, count, splats->sh_degree) : 0;
            ImGui::TextUnformatted(("about " + core::bytes_text(bytes)).c_str());
        }
        ImGui::EndTable();
    }
    const std::vector<std::string> lost = splats ? losses(*row, *splats) : std::vector<std::string>();
    for (const std::string& text : lost) modal_text("- " + text);
    if (lost.empty()) modal_text(kKeepsAll);
}

void Dialogs::State::draw_save() {
    if (editor.scenes() == 0) return void(shown = DialogKind::none);
    if (!begin_modal(kSaveAsTitle)) return;
    if (const io::FormatRow* typed = io::row_of_name(path.path()); typed && typed->writable()) row = typed;
    draw_formats();
    ImGui::Spacing();
    if (editor.scenes() > 1) {
        if (ImGui::RadioButton(kScopeActive, !all)) all = false;
        ImGui::SameLine();
        if (ImGui::RadioButton(kScopeAll, all)) all = true;
    }
    path.draw(files);
    const Choice choice =
        draw_choices(path.replaces() ? kReplaceIt : kSaveIt, nullptr, kDialogBack, !path.path().empty());
    if (choice == Choice::confirm) confirm_save();
    if (choice == Choice::cancel) {
        go_on = nullptr;
        shown = DialogKind::none;
    }
    end_modal(shown != DialogKind::none);
}

void Dialogs::State::draw_leave() {
    if (!begin_modal(kLeaveTitle)) return;
    std::string names;
    for (size_t i = 0; i < editor.scenes(); ++i)
        if (editor.scene(i).unsaved)
            names += (names.empty() ? "" : ", ") + core::one_line(editor.scene(i).name);
    modal_text(names + " has edits that are not saved.");
    const Choice choice = draw_choices(kSaveIt, kDontSave, kDialogBack);
    if (choice != Choice::none) shown = publish.running() ? DialogKind::publish : DialogKind::none;
    const std::function<void()> then = go_on;
    if (choice == Choice::other || choice == Choice::cancel) go_on = nullptr;
    end_modal(choice == Choice::none || shown != DialogKind::none);
    if (choice == Choice::other) {
        discard_journals();
        pass(then);
    } else if (choice == Choice::confirm) {
        for (size_t i = 0; i < editor.scenes() && !scene().unsaved; ++i)
            if (editor.scene(i).unsaved) editor.activate(i);
        const bool again = last.original == scene().file && last.name == scene().name && !last.file.empty();
        if (editor.saving())
            shown = DialogKind::saving;
        else if (again)
            write(last.file, last.all);
        else
            save_as();
    }
}

void Dialogs::State::draw_journal() {
    if (!begin_modal(kJournalTitle)) return;
    modal_text("ewa-view ended without saving " + core::counted(journal.steps.size(), "edit") + " of " +
               core::one_line(journal_file.filename().string()) + ".");
    const Choice choice = draw_choices(kJournalRestore, kJournalDiscard, kJournalLater);
    if (choice != Choice::none) shown = DialogKind::none;
    end_modal(shown != DialogKind::none);
    if (choice == Choice::confirm) editor.restore(journal);
    std::error_code error;
    if (choice == Choice::other) fs::remove(edit::journal_of(journal_file), error);
    if (choice != Choice::none) journal = {};
}

void Dialogs::State::draw_saving() {
    if (!begin_modal(kSavingTitle)) return;
    modal_text("Writing " + core::one_line(last.file.string()) + " ...");
    if (draw_choices(nullptr, nullptr, kDialogBack) == Choice::cancel) {
        go_on = nullptr;
        shown = DialogKind::none;
    }
    end_modal(shown != DialogKind::none);
}

void Dialogs::State::draw_shown() {
    drawn = shown;
    switch (shown) {
        case DialogKind::save:
            return draw_save();
        case DialogKind::publish:
            if (!publish.draw()) shown = DialogKind::none;
            return;
        case DialogKind::leave:
            return draw_leave();
        case DialogKind::journal:
            return draw_journal();
        case DialogKind::saving:
            return draw_saving();
        case DialogKind::none:
            return close_modal();
    }
}

Dialogs::Dialogs(Editor& editor, FileDialog& files, std::function<void()> wake,
                 std::function<void(const std::string&)> say)
    : state_(std::make_unique<State>(editor, files, std::move(wake), std::move(say))) {}

Dialogs::~Dialogs() = default;

void Dialogs::save() {
    State& state = *state_;
    if (state.editor.scenes() == 0) return state.say(kNothingToSave);
    if (state.editor.saving()) return state.say(kStillSaving);
    const EditedScene& scene = state.scene();
    const State::Saved& last = state.last;
    if (last.file.empty() || last.original != scene.file || last.name != scene.name) return state.save_as();
    state.write(last.file, last.all);
}

void Dialogs::save_as() {
    state_->save_as();
}

void Dialogs::publish() {
    State& state = *state_;
    if (state.editor.scenes() == 0) return state.say(kNothingToSave);
    state.publish.begin(views_file ? views_file() : fs::path());
    state.shown = DialogKind::publish;
}

void Dialogs::leave(std::function<void()> go_on) {
    State& state = *state_;
    if (!state.editor.unsaved()) return state.pass(go_on);
    state.go_on = std::move(go_on);
    state.shown = DialogKind::leave;
}

void Dialogs::offer_journal(const fs::path& file, size_t splats) {
    State& state = *state_;
    try {
        std::optional<edit::ReadJournal> left = Editor::left_journal(file, splats);
        if (!left || left->steps.empty()) return;
        state.journal = std::move(*left);
        state.journal_file = file;
        state.shown = DialogKind::journal;
    } catch (const std::exception& error) {
        state.say(error.what());
    }
}

void Dialogs::draw() {
    State& state = *state_;
    int& flags = ImGui::GetIO().ConfigFlags;
    if (open() && (flags & ImGuiConfigFlags_NavEnableKeyboard) == 0) {
        flags |= ImGuiConfigFlags_NavEnableKeyboard;
        state.keyboard = true;
    } else if (!open() && std::exchange(state.keyboard, false)) {
        flags &= ~ImGuiConfigFlags_NavEnableKeyboard;
    }
    if (open() || state.drawn != DialogKind::none) state.draw_shown();
}

bool Dialogs::open() const {
    return state_->shown != DialogKind::none;
}

bool Dialogs::take() {
    State& state = *state_;
    const bool chosen = state.path.take(state.files), published = state.publish.take();
    if (state.shown != DialogKind::saving || state.editor.saving()) return chosen || published;
    // A save that has failed, and scenes that were not saved, leave unsaved edits.
    const bool failed = state.editor.unsaved();
    state.shown = failed ? DialogKind::leave : DialogKind::none;
    if (failed) return true;
    if (const std::function<void()> go_on = std::exchange(state.go_on, nullptr)) state.pass(go_on);
    return true;
}

}  // namespace ewa::viewer
