// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/publish_dialog.h"

#include <imgui.h>

#include <algorithm>

#include "core/folders.h"
#include "core/process.h"
#include "core/text.h"
#include "viewer/editor/save_choices.h"
#include "viewer/editor/texts.h"

namespace ewa::viewer {
namespace {

namespace fs = std::filesystem;

struct PublishKind {
    SplatFormat format;
    const char *name, *hint;
};
constexpr PublishKind kPublishKinds[] = {
    {SplatFormat::page, texts::files::kPageName, texts::files::kPageHint},
    {SplatFormat::sog, texts::files::kSogName, texts::files::kSogHint},
    {SplatFormat::sog_levels, texts::files::kLevelsName, texts::files::kLevelsHint},
};
constexpr int kMostLevels = 16, kPublishLines = 5;

const io::FormatRow& row_of_kind(int kind) {
    return io::row_of(kPublishKinds[kind].format);
}

}  // namespace

PublishDialog::PublishDialog(Editor& editor, FileDialog& files, std::function<void()> wake)
    : editor_(editor),
      files_(files),
      publisher_(core::own_program().parent_path() / "ewa", std::move(wake)) {}

void PublishDialog::begin(const fs::path& views) {
    if (running()) return;
    views_ = views;
    with_views_ = done_ = false;
    problem_.clear();
    text_.clear();
    const std::string name = stem_of(editor_.scene(editor_.active()).name).string();
    const size_t count = std::min(name.size(), title_.size() - 1);
    std::copy_n(name.begin(), count, title_.begin());
    title_[count] = 0;
    choose(kind_);
}

void PublishDialog::choose(int kind) {
    kind_ = kind;
    const EditedScene& scene = editor_.scene(editor_.active());
    path_.set(proposed_file(scene.file, scene.name, row_of_kind(kind), scene.part));
}

bool PublishDialog::draw() {
    if (!begin_modal(texts::files::kPublish)) return true;
    Choice choice = Choice::none;
    if (running()) {
        draw_work();
        if (draw_choices(nullptr, nullptr, texts::files::kStop) == Choice::cancel) publisher_.stop();
    } else if (done_) {
        draw_done();
        choice = draw_choices(texts::files::kOpen, nullptr, texts::files::kClose);
        if (choice == Choice::confirm) open(format() == SplatFormat::page ? out_ : out_.parent_path());
    } else {
        draw_form();
        choice = draw_choices(path_.replaces() ? texts::files::kReplace : texts::files::kPublish, nullptr,
                              texts::files::kCancel, !path_.path().empty() && !editor_.busy());
        if (choice == Choice::confirm) start();
    }
    end_modal(choice != Choice::cancel);
    return choice != Choice::cancel;
}

SplatFormat PublishDialog::format() const {
    return kPublishKinds[kind_].format;
}

void PublishDialog::draw_form() {
    for (int i = 0; i < int(std::size(kPublishKinds)); ++i)
        if (modal_radio(kPublishKinds[i].name, kind_ == i)) choose(i);
    ImGui::TextDisabled("%s", kPublishKinds[kind_].hint);
    if (begin_form(path_, &files_)) {
        if (format() == SplatFormat::page) {
            form_row(texts::files::kTitle);
            ImGui::InputText("##title", title_.data(), title_.size());
        } else if (format() == SplatFormat::sog_levels) {
            form_row(texts::files::kLevels);
            ImGui::SliderInt("##levels", &levels_, 0, kMostLevels,
                             levels_ == 0 ? texts::files::kAsManyLevels : "%d", ImGuiSliderFlags_AlwaysClamp);
        } else {
            form_row("");
            ImGui::Dummy(ImVec2(0, ImGui::GetFrameHeight()));
        }
        end_form();
    }
    // The room for these is there with each kind.
    const float top = ImGui::GetCursorPosY();
    if (format() == SplatFormat::page && !views_.empty())
        ImGui::Checkbox(texts::files::kWithViews, &with_views_);
    if (editor_.busy()) modal_text(texts::files::kPublishBusy);
    reserve(top, ImGui::GetFrameHeightWithSpacing());
    if (!text_.empty()) modal_box("error", text_, kPublishLines);
}

void PublishDialog::draw_work() {
    const Publisher::Progress progress = publisher_.progress();
    modal_text(texts::files::kWriting + core::one_line(out_.string()));
    ImGui::ProgressBar(progress.share, ImVec2(modal_width(), 0.4f * ImGui::GetTextLineHeight()), "");
    modal_text(core::duration_text(progress.seconds));
    modal_box("work", progress.text, 2);
}

void PublishDialog::draw_done() {
    modal_text(wrote_);
    if (ImGui::Button(texts::files::kShowFolder)) open(out_.parent_path());
    ImGui::SameLine();
    if (ImGui::Button(texts::files::kCopyPath)) ImGui::SetClipboardText(out_.string().c_str());
    if (ImGui::TreeNode(texts::files::kDetails)) {
        modal_box("done", text_, kPublishLines);
        ImGui::TreePop();
    }
    if (!problem_.empty()) modal_text(problem_, true);
}

void PublishDialog::open(const fs::path& path) {
    problem_.clear();
    try {
        open_outside(path);
    } catch (const std::exception& error) {
        problem_ = error.what();
    }
}

void PublishDialog::start() {
    const fs::path typed = path_.path();
    if (typed.empty() || editor_.busy()) return;
    const fs::path out = with_format(fs::absolute(typed), row_of_kind(kind_));
    std::vector<fs::path> originals;
    for (size_t i = 0; i < editor_.scenes(); ++i) originals.push_back(editor_.scene(i).file);
    text_.clear();
    problem_.clear();
    if (!path_.accept(out, refusal(out, originals))) return;
    const EditedScene& scene = editor_.scene(editor_.active());
    const EditSnapshot& now = editor_.snapshot();
    PublishOrder order;
    order.scene = scene.file;
    order.out = out;
    if (format() == SplatFormat::page) order.title = title_.data();
    if (format() == SplatFormat::page && with_views_) order.views = views_;
    if (format() == SplatFormat::sog_levels) order.levels = levels_;
    const bool replays = scene.as_opened() && (now.done == 0 || scene.journaled);
    if (now.done > 0 && replays) order.edits = scene.journal();
    if (scene.file.empty() || !replays) {
        order.splats = now.splats;
        order.states = now.states;
    }
    out_ = out;
    left_ = now.left;
    publisher_.start(std::move(order));
}

void PublishDialog::take() {
    path_.take(files_);
    const std::optional<Publisher::Result> result = publisher_.take();
    if (!result) return;
    done_ = result->done;
    if (done_) wrote_ = wrote_text(out_, left_);
    text_ = result->stopped                  ? texts::files::kStopped
            : result->text.empty() && !done_ ? texts::files::kFailed
                                             : result->text;
    path_.complain({});
}

}  // namespace ewa::viewer
