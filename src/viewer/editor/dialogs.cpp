// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/dialogs.h"

#include <imgui.h>

#include <algorithm>
#include <cctype>
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
#include "viewer/editor/texts.h"
#include "viewer/editor/theme.h"
#include "viewer/overlay.h"

namespace ewa::viewer {
namespace {

namespace fs = std::filesystem;

constexpr float kFormatLines = 9,
                kFormatShare = 0.35f;  // height of the formats: lines, and at most of the window
constexpr float kChosenRow = 0.45f;    // opacity of the accent

/// The text with a capital, unless its first word has one.
std::string sentence(std::string_view text) {
    std::string words(text);
    const std::string first = words.substr(0, words.find(' '));
    if (first == core::lower(first) && !words.empty())
        words[0] = char(std::toupper(static_cast<unsigned char>(words[0])));
    return words;
}

/// The row for a copy of the file: its own format if ewa writes that, or else PLY.
const io::FormatRow* first_row(const fs::path& file) {
    const io::FormatRow* row = io::row_of_name(file);
    return row && row->writable() ? row : &io::row_of(SplatFormat::ply);
}

}  // namespace

enum class DialogKind { none, save, publish, leave, journal, saving, other };

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

    std::function<bool()> draw_other;  // a dialog of another part
    std::function<void()> go_on;       // after the save; null: nothing
    bool offers = false;               // journals are looked for
    std::vector<Editor::Left> left;

    const EditedScene& scene() const { return editor.scene(editor.active()); }
    fs::path target() const;
    std::vector<fs::path> originals() const;
    void write(const fs::path& out, bool all_scenes);
    void pass(const std::function<void()>& on);
    void save_as();
    void confirm_save();
    void ask_or_pass();
    void draw_formats(const Gaussians* splats, size_t count);
    void draw_losses(const Gaussians& splats) const;
    void draw_save();
    bool draw_open(const std::function<void(const fs::path&)>& open);
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
    if (editor.scenes() == 0) return say(texts::files::kNothingToSave);
    if (editor.saving()) return say(texts::files::kStillSaving);
    row = first_row(scene().file);
    path.set(proposed_file(scene().file, scene().name, *row, scene().part));
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

/// Once all edits are done, and no save is on its way.
void Dialogs::State::ask_or_pass() {
    if (editor.unsaved()) return void(shown = DialogKind::leave);
    if (shown == DialogKind::saving) shown = publish.running() ? DialogKind::publish : DialogKind::none;
    pass(std::exchange(go_on, nullptr));
}

void Dialogs::State::draw_formats(const Gaussians* splats, size_t count) {
    constexpr auto kFlags = ImGuiTableFlags_ScrollY | ImGuiTableFlags_BordersOuter;
    constexpr auto kRowFlags = ImGuiSelectableFlags_SpanAllColumns | ImGuiSelectableFlags_DontClosePopups;
    const float height = std::min(kFormatLines * ImGui::GetTextLineHeightWithSpacing(),
                                  kFormatShare * ImGui::GetIO().DisplaySize.y);
    if (!ImGui::BeginTable("formats", 3, kFlags, ImVec2(modal_width(), height))) return;
    ImGui::TableSetupScrollFreeze(0, 1);
    ImGui::TableSetupColumn(texts::files::kFormat, ImGuiTableColumnFlags_WidthFixed);
    ImGui::TableSetupColumn(texts::files::kPurpose, ImGuiTableColumnFlags_WidthStretch);
    ImGui::TableSetupColumn(texts::files::kSize, ImGuiTableColumnFlags_WidthFixed);
    ImGui::TableHeadersRow();
    ImGui::PushStyleColor(ImGuiCol_Header, ImU32(accent(kChosenRow)));
    for (const io::FormatRow& each : io::format_rows()) {
        if (!each.writable()) continue;
        const std::string name = sentence(each.name) + " (" + std::string(each.extension) + ")";
        const std::string purpose = sentence(each.purpose);
        const uint64_t bytes = splats ? usual_bytes(each, count, splats->sh_degree) : 0;
        ImGui::TableNextRow();
        ImGui::TableSetColumnIndex(1);
        ImGui::PushTextWrapPos(0);
        ImGui::TextUnformatted(purpose.c_str());
        ImGui::PopTextWrapPos();
        const float lines = ImGui::GetItemRectSize().y;
        ImGui::TableSetColumnIndex(2);
        ImGui::TextUnformatted((texts::files::kAbout + core::bytes_text(bytes)).c_str());
        ImGui::TableSetColumnIndex(0);
        if (ImGui::Selectable(name.c_str(), &each == row, kRowFlags, ImVec2(0, lines))) {
            if (const fs::path typed = path.path(); !typed.empty()) path.set(with_format(typed, each));
            row = &each;
        }
    }
    ImGui::PopStyleColor();
    ImGui::EndTable();
}

/// What the chosen format does not keep, in the room that the longest of these texts needs.
void Dialogs::State::draw_losses(const Gaussians& splats) const {
    const auto text_of = [&](const io::FormatRow& format) {
        std::string text;
        for (const std::string& line : losses(format, splats)) text += (text.empty() ? "- " : "\n- ") + line;
        return text.empty() ? std::string(texts::files::kKeepsAll) : text;
    };
    float height = 0;
    for (const io::FormatRow& each : io::format_rows())
        if (each.writable())
            height =
                std::max(height, ImGui::CalcTextSize(text_of(each).c_str(), nullptr, false, modal_width()).y);
    const float top = ImGui::GetCursorPosY();
    modal_text(text_of(*row));
    reserve(top, height + ImGui::GetStyle().ItemSpacing.y);
}

void Dialogs::State::draw_save() {
    if (editor.scenes() == 0) return void(shown = DialogKind::none);
    if (!begin_modal(texts::files::kSaveAsTitle)) return;
    if (const io::FormatRow* typed = io::row_of_name(path.path()); typed && typed->writable()) row = typed;
    const Gaussians* splats = all ? editor.splats().get() : editor.snapshot().splats.get();
    draw_formats(splats, !splats ? 0 : all ? splats->size() : editor.snapshot().left);
    if (splats) draw_losses(*splats);
    if (editor.scenes() > 1) {
        if (modal_radio(texts::files::kScopeActive, !all)) all = false;
        ImGui::SameLine();
        if (modal_radio(texts::files::kScopeAll, all)) all = true;
    }
    if (begin_form()) {
        form_row(texts::files::kFile);
        path.draw(&files);
        end_form();
    }
    const char* save = path.replaces() ? texts::files::kReplace : texts::files::kSave;
    const Choice choice = draw_choices(save, nullptr, texts::files::kCancel, !path.path().empty());
    if (choice == Choice::confirm) confirm_save();
    if (choice == Choice::cancel) {
        go_on = nullptr;
        shown = DialogKind::none;
    }
    end_modal(shown != DialogKind::none);
}

bool Dialogs::State::draw_open(const std::function<void(const fs::path&)>& open) {
    if (!begin_modal(texts::files::kOpenTitle)) return true;
    if (begin_form()) {
        form_row(texts::files::kFile);
        path.draw(nullptr);
        end_form();
    }
    std::optional<fs::path> chosen = draw_recent();
    if (chosen) path.set(*chosen);
    const Choice choice =
        draw_choices(texts::files::kOpen, nullptr, texts::files::kCancel, !path.path().empty());
    if (choice == Choice::confirm) chosen = path.path();
    std::error_code error;
    if (chosen && !fs::exists(*chosen, error)) {
        path.complain(texts::files::kNoSuchFile);
        chosen.reset();
    }
    const bool stays = choice != Choice::cancel && !chosen;
    end_modal(stays);
    if (chosen) open(*chosen);
    return stays;
}

void Dialogs::State::draw_leave() {
    if (!begin_modal(texts::files::kLeaveTitle)) return;
    std::string names;
    for (size_t i = 0; i < editor.scenes(); ++i)
        if (editor.scene(i).unsaved)
            names += (names.empty() ? "" : ", ") + core::one_line(editor.scene(i).name);
    modal_text(names + texts::files::kUnsavedEdits);
    const Choice choice = draw_choices(texts::files::kSave, texts::files::kDontSave, texts::files::kCancel);
    if (choice != Choice::none) shown = publish.running() ? DialogKind::publish : DialogKind::none;
    const std::function<void()> then = go_on;
    if (choice == Choice::other || choice == Choice::cancel) go_on = nullptr;
    end_modal(choice == Choice::none || shown != DialogKind::none);
    if (choice == Choice::other) {
        editor.discard();
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
    if (!begin_modal(texts::files::kJournalTitle)) return;
    size_t edits = 0;
    for (const Editor::Left& each : left) edits += each.journal.steps.size();
    const fs::path file = scene().file;
    modal_text(texts::files::kEndedUnsaved + core::counted(edits, "edit") + " of " +
               core::one_line(file.filename().string()) + ".");
    const Choice choice = draw_choices(texts::files::kJournalRestore, texts::files::kJournalDiscard,
                                       texts::files::kJournalLater);
    if (choice != Choice::none) shown = DialogKind::none;
    end_modal(shown != DialogKind::none);
    std::error_code error;
    if (choice == Choice::other)
        for (const Editor::Left& each : left)
            if (const fs::path journal = edit::journal_of(file, each.part); !edit::in_use(journal))
                fs::remove(journal, error);
    if (choice == Choice::confirm) editor.restore(std::move(left));
    if (choice != Choice::none) left.clear();
}

void Dialogs::State::draw_saving() {
    if (!begin_modal(texts::files::kSavingTitle)) return;
    modal_text(editor.saving() ? texts::files::kWriting + core::one_line(last.file.string()) + " ..."
                               : std::string(texts::files::kFinishing));
    if (draw_choices(nullptr, nullptr, texts::files::kCancel) == Choice::cancel) {
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
        case DialogKind::other:
            if (!draw_other() && shown == DialogKind::other) shown = DialogKind::none;
            return;
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
    if (state.editor.scenes() == 0) return state.say(texts::files::kNothingToSave);
    if (state.editor.saving()) return state.say(texts::files::kStillSaving);
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
    if (state.editor.scenes() == 0) return state.say(texts::files::kNothingToSave);
    state.publish.begin(views_file ? views_file() : fs::path());
    state.shown = DialogKind::publish;
}

void Dialogs::leave(std::function<void()> go_on) {
    State& state = *state_;
    state.go_on = std::move(go_on);
    if (!state.editor.busy() && !state.editor.saving()) return state.ask_or_pass();
    state.shown = DialogKind::saving;
}

bool Dialogs::leaving() const {
    return state_->shown == DialogKind::leave;
}

void Dialogs::offer_journals() {
    state_->offers = true;
}

void Dialogs::ask_path(const std::string& why, std::function<void(const fs::path&)> open) {
    state_->path.set({});
    state_->path.complain(core::one_line(why));
    show([state = state_.get(), open = std::move(open)] { return state->draw_open(open); });
}

void Dialogs::show(std::function<bool()> draw) {
    if (open()) return;
    state_->draw_other = std::move(draw);
    state_->shown = DialogKind::other;
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
    if (state.editor.busy() || state.editor.saving()) return chosen || published;
    bool changed = chosen || published;
    if (std::exchange(state.offers, false) && state.editor.snapshot().done == 0 && !open()) {
        state.left = state.editor.left_journals();
        if (!state.left.empty()) state.shown = DialogKind::journal;
        changed = true;
    }
    // A save that has failed, and scenes that were not saved, leave unsaved edits.
    if (state.shown == DialogKind::saving) {
        state.ask_or_pass();
        changed = true;
    }
    return changed;
}

}  // namespace ewa::viewer
