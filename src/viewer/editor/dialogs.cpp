// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/dialogs.h"

#include <imgui.h>

#include <algorithm>
#include <cctype>
#include <utility>

#include "core/folders.h"
#include "core/messages.h"
#include "core/text.h"
#include "core/typing.h"
#include "ewa/splat_files.h"
#include "viewer/editor/save_choices.h"
#include "viewer/editor/texts.h"
#include "viewer/editor/theme.h"
#include "viewer/overlay.h"
#include "viewer/view_state.h"

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

/// The file to write. A name without an extension gets that of the chosen format.
fs::path Dialogs::target() const {
    const fs::path typed = path_.path();
    if (typed.empty()) return typed;
    std::error_code error;
    const fs::path whole = fs::absolute(typed, error).lexically_normal();
    return io::row_of_name(whole) ? whole : with_format(whole, *row_);
}

std::vector<fs::path> Dialogs::originals() const {
    std::vector<fs::path> files_opened;
    for (size_t i = 0; i < editor_.scenes(); ++i)
        if (const fs::path& file = editor_.scene(i).file; !written_.contains(file))
            files_opened.push_back(file);
    return files_opened;
}

void Dialogs::write(const fs::path& out, bool all_scenes) {
    last_ = {scene().file, out, scene().name, all_scenes};
    written_.insert(out);
    editor_.save(out, all_scenes);
    shown_ = go_on_ ? &Dialogs::draw_saving : nullptr;
}

/// Calls `on`, which may open other scenes. Files that were written before may then be originals.
void Dialogs::pass(const std::function<void()>& on) {
    last_ = {};
    written_.clear();
    if (on) on();
}

void Dialogs::save_as() {
    if (editor_.scenes() == 0) return state_.say(texts::files::kNothingToSave);
    if (editor_.saving()) return state_.say(texts::files::kStillSaving);
    row_ = first_row(scene().file);
    path_.set(proposed_file(scene().file, scene().name, *row_, scene().part));
    all_ = all_ && editor_.scenes() > 1;
    shown_ = &Dialogs::draw_save;
}

void Dialogs::confirm_save() {
    const fs::path out = target();
    if (!path_.accept(out, refusal(out, originals()))) return;
    try {
        core::make_folder(out.parent_path());
        write(out, all_);
    } catch (const std::exception& error) {
        path_.complain(core::one_line(error.what()));
    }
}

/// Once all edits are done, and no save is on its way.
void Dialogs::ask_or_pass() {
    if (editor_.unsaved()) return void(shown_ = &Dialogs::draw_leave);
    if (shown_ == &Dialogs::draw_saving) shown_ = publish_.running() ? &Dialogs::draw_publish : nullptr;
    pass(std::exchange(go_on_, nullptr));
}

void Dialogs::draw_formats(const Gaussians* splats, size_t count) {
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
        if (ImGui::Selectable(name.c_str(), &each == row_, kRowFlags, ImVec2(0, lines))) {
            if (const fs::path typed = path_.path(); !typed.empty()) path_.set(with_format(typed, each));
            row_ = &each;
        }
    }
    ImGui::PopStyleColor();
    ImGui::EndTable();
}

/// What the chosen format does not keep, in the room that the longest of these texts needs.
void Dialogs::draw_losses(const Gaussians& splats) const {
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
    modal_text(text_of(*row_));
    reserve(top, height + ImGui::GetStyle().ItemSpacing.y);
}

void Dialogs::draw_save() {
    if (editor_.scenes() == 0) return void(shown_ = nullptr);
    if (!begin_modal(texts::files::kSaveAsTitle)) return;
    if (const io::FormatRow* typed = io::row_of_name(path_.path()); typed && typed->writable()) row_ = typed;
    const Gaussians* splats = (all_ ? editor_.snapshot().drawn : editor_.snapshot().splats).get();
    draw_formats(splats, !splats ? 0 : all_ ? splats->size() : editor_.snapshot().left);
    if (splats) draw_losses(*splats);
    if (editor_.scenes() > 1) {
        if (modal_radio(texts::files::kScopeActive, !all_)) all_ = false;
        ImGui::SameLine();
        if (modal_radio(texts::files::kScopeAll, all_)) all_ = true;
    }
    if (begin_form(path_, &files_)) end_form();
    const char* save = path_.replaces() ? texts::files::kReplace : texts::files::kSave;
    const Choice choice = draw_choices(save, nullptr, texts::files::kCancel, !path_.path().empty());
    if (choice == Choice::confirm) confirm_save();
    if (choice == Choice::cancel) {
        go_on_ = nullptr;
        shown_ = nullptr;
    }
    end_modal(shown_ != nullptr);
}

bool Dialogs::draw_open(const std::function<void(const fs::path&)>& open) {
    if (!begin_modal(texts::files::kOpenTitle)) return true;
    if (begin_form(path_, nullptr)) end_form();
    std::optional<fs::path> chosen = draw_recent();
    if (chosen) path_.set(*chosen);
    const Choice choice =
        draw_choices(texts::files::kOpen, nullptr, texts::files::kCancel, !path_.path().empty());
    if (choice == Choice::confirm) chosen = path_.path();
    std::error_code error;
    if (chosen && !fs::exists(*chosen, error)) {
        path_.complain(texts::files::kNoSuchFile);
        chosen.reset();
    }
    const bool stays = choice != Choice::cancel && !chosen;
    end_modal(stays);
    if (chosen) open(*chosen);
    return stays;
}

void Dialogs::draw_leave() {
    if (!begin_modal(texts::files::kLeaveTitle)) return;
    std::string names;
    for (size_t i = 0; i < editor_.scenes(); ++i)
        if (editor_.scene(i).unsaved)
            names += (names.empty() ? "" : ", ") + core::one_line(editor_.scene(i).name);
    modal_text(names + texts::files::kUnsavedEdits);
    const Choice choice = draw_choices(texts::files::kSave, texts::files::kDontSave, texts::files::kCancel);
    if (choice != Choice::none) shown_ = publish_.running() ? &Dialogs::draw_publish : nullptr;
    const std::function<void()> then = go_on_;
    if (choice == Choice::other || choice == Choice::cancel) go_on_ = nullptr;
    end_modal(choice == Choice::none || shown_ != nullptr);
    if (choice == Choice::other) {
        editor_.discard();
        pass(then);
    } else if (choice == Choice::confirm) {
        for (size_t i = 0; i < editor_.scenes() && !scene().unsaved; ++i)
            if (editor_.scene(i).unsaved) editor_.activate(i);
        if (editor_.saving())
            shown_ = &Dialogs::draw_saving;
        else
            save();
    }
}

void Dialogs::draw_journal() {
    if (!begin_modal(texts::files::kJournalTitle)) return;
    size_t edits = 0;
    for (const Editor::Left& each : left_) edits += each.journal.steps.size();
    const fs::path file = scene().file;
    modal_text(texts::files::kEndedUnsaved + core::counted(edits, "edit") + " of " +
               core::one_line(file.filename().string()) + ".");
    const Choice choice = draw_choices(texts::files::kJournalRestore, texts::files::kJournalDiscard,
                                       texts::files::kJournalLater);
    if (choice != Choice::none) shown_ = nullptr;
    end_modal(shown_ != nullptr);
    std::error_code error;
    if (choice == Choice::other)
        for (const Editor::Left& each : left_)
            if (const fs::path journal = edit::journal_of(file, each.part); !edit::in_use(journal))
                fs::remove(journal, error);
    if (choice == Choice::confirm) editor_.restore(std::move(left_));
    if (choice != Choice::none) left_.clear();
}

void Dialogs::draw_saving() {
    if (!begin_modal(texts::files::kSavingTitle)) return;
    modal_text(editor_.saving() ? texts::files::kWriting + core::one_line(last_.file.string()) + " ..."
                                : std::string(texts::files::kFinishing));
    if (draw_choices(nullptr, nullptr, texts::files::kCancel) == Choice::cancel) {
        go_on_ = nullptr;
        shown_ = nullptr;
    }
    end_modal(shown_ != nullptr);
}

void Dialogs::draw_publish() {
    if (!publish_.draw()) shown_ = nullptr;
}

void Dialogs::draw_other() {
    if (!draw_other_() && shown_ == &Dialogs::draw_other) shown_ = nullptr;
}

Dialogs::Dialogs(ViewState& state, Editor& editor, FileDialog& files)
    : state_(state), editor_(editor), files_(files), publish_(editor, files, state.wake) {}

void Dialogs::save() {
    if (editor_.scenes() == 0 || editor_.saving() || last_.file.empty() || last_.original != scene().file ||
        last_.name != scene().name)
        return save_as();
    write(last_.file, last_.all);
}

void Dialogs::publish(const fs::path& views) {
    if (editor_.scenes() == 0) return state_.say(texts::files::kNothingToSave);
    publish_.begin(views);
    shown_ = &Dialogs::draw_publish;
}

void Dialogs::leave(std::function<void()> go_on) {
    go_on_ = std::move(go_on);
    if (!editor_.busy() && !editor_.saving()) return ask_or_pass();
    shown_ = &Dialogs::draw_saving;
}

void Dialogs::ask_path(const std::string& why, std::function<void(const fs::path&)> open) {
    path_.set({});
    path_.complain(core::one_line(why));
    show([this, open = std::move(open)] { return draw_open(open); });
}

void Dialogs::show(std::function<bool()> draw) {
    if (open()) return;
    draw_other_ = std::move(draw);
    shown_ = &Dialogs::draw_other;
}

void Dialogs::draw() {
    int& flags = ImGui::GetIO().ConfigFlags;
    if (open() && (flags & ImGuiConfigFlags_NavEnableKeyboard) == 0) {
        flags |= ImGuiConfigFlags_NavEnableKeyboard;
        keyboard_ = true;
    } else if (!open() && std::exchange(keyboard_, false)) {
        flags &= ~ImGuiConfigFlags_NavEnableKeyboard;
    }
    const bool before = std::exchange(drawn_, open());
    if (open())
        (this->*shown_)();
    else if (before)
        close_modal();
}

void Dialogs::take() {
    path_.take(files_);
    publish_.take();
    if (editor_.busy() || editor_.saving()) return;
    if (std::exchange(offers_, false) && editor_.snapshot().done == 0 && !open()) {
        left_ = editor_.left_journals();
        if (!left_.empty()) shown_ = &Dialogs::draw_journal;
        state_.redraw(Loop::kRedraws);
    }
    // A save that has failed, and scenes that were not saved, leave unsaved edits.
    if (shown_ != &Dialogs::draw_saving) return;
    ask_or_pass();
    state_.redraw(Loop::kRedraws);
}

}  // namespace ewa::viewer
