// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/publish_dialog.h"

#include <imgui.h>

#include <algorithm>

#include "core/folders.h"
#include "core/process.h"
#include "core/text.h"
#include "viewer/editor/save_choices.h"

namespace ewa::viewer {
namespace {

namespace fs = std::filesystem;

struct PublishKind {
    SplatFormat format;
    const char *name, *hint;
};
constexpr PublishKind kPublishKinds[] = {
    {SplatFormat::page, "Web page (one HTML file)",
     "Opens in any browser, without a network. A server needs this one file."},
    {SplatFormat::sog, "SOG (small file)", "For SuperSplat, PlayCanvas, Spark and other viewers on the web."},
    {SplatFormat::sog_levels, "Streamed levels (large scenes)",
     "A folder for a web server. A viewer loads what it shows, coarse splats first."},
};
constexpr const char *kPublishTitle = "Publish", *kPublishIt = "Publish", *kPublishReplace = "Replace",
                     *kPublishCancel = "Cancel", *kPublishStop = "Stop", *kPublishClose = "Close",
                     *kPageTitle = "Title", *kWithViews = "With the views of the film",
                     *kLevelsLabel = "Levels (0: as many as the scene needs)",
                     *kOpenInBrowser = "Open in browser", *kShowFolder = "Show folder",
                     *kCopyPath = "Copy path", *kPublishTarget = "File", *kPublishStopped = "Stopped.",
                     *kPublishFailed = "ewa convert has failed.",
                     *kPublishBusy = "The last edit is still being done.";
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
    const std::string& name = editor_.scene(editor_.active()).name;
    const size_t count = std::min(name.size(), title_.size() - 1);
    std::copy_n(name.begin(), count, title_.begin());
    title_[count] = 0;
    choose(kind_);
}

void PublishDialog::choose(int kind) {
    kind_ = kind;
    const EditedScene& scene = editor_.scene(editor_.active());
    path_.set(proposed_file(scene.file, scene.name, row_of_kind(kind)));
}

bool PublishDialog::draw() {
    if (!begin_modal(kPublishTitle)) return true;
    if (running())
        draw_work();
    else if (done_)
        draw_done();
    else
        draw_form();
    bool stays = true;
    switch (draw_buttons()) {
        case Choice::confirm:
            if (done_)
                stays = false;
            else
                start();
            break;
        case Choice::cancel:
            if (running())
                publisher_.stop();
            else
                stays = false;
            break;
        case Choice::other:
        case Choice::none:
            break;
    }
    end_modal(stays);
    return stays;
}

Choice PublishDialog::draw_buttons() {
    if (running()) return draw_choices(nullptr, nullptr, kPublishStop);
    if (done_) return draw_choices(kPublishClose, nullptr, nullptr);
    return draw_choices(path_.replaces() ? kPublishReplace : kPublishIt, nullptr, kPublishCancel,
                        !path_.path().empty() && !editor_.busy());
}

void PublishDialog::draw_form() {
    for (int i = 0; i < int(std::size(kPublishKinds)); ++i)
        if (ImGui::RadioButton(kPublishKinds[i].name, kind_ == i)) choose(i);
    ImGui::TextDisabled("%s", kPublishKinds[kind_].hint);
    ImGui::Spacing();
    ImGui::TextUnformatted(kPublishTarget);
    path_.draw(files_);
    if (kPublishKinds[kind_].format == SplatFormat::page) {
        ImGui::SetNextItemWidth(modal_width() / 2);
        ImGui::InputText(kPageTitle, title_.data(), title_.size());
        if (!views_.empty()) ImGui::Checkbox(kWithViews, &with_views_);
    }
    if (kPublishKinds[kind_].format == SplatFormat::sog_levels) {
        ImGui::SetNextItemWidth(6 * ImGui::GetTextLineHeight());
        if (ImGui::InputInt(kLevelsLabel, &levels_)) levels_ = std::clamp(levels_, 0, kMostLevels);
    }
    if (editor_.busy()) modal_text(kPublishBusy);
    if (!text_.empty()) modal_box("error", text_, kPublishLines);
}

void PublishDialog::draw_work() {
    const Publisher::Progress progress = publisher_.progress();
    modal_text("Writing " + core::one_line(out_.string()));
    ImGui::ProgressBar(progress.share, ImVec2(modal_width(), 0.4f * ImGui::GetTextLineHeight()), "");
    modal_text(core::duration_text(progress.seconds));
    modal_box("work", progress.text, 2);
}

void PublishDialog::draw_done() {
    modal_box("done", text_, kPublishLines);
    if (kPublishKinds[kind_].format == SplatFormat::page) {
        if (ImGui::Button(kOpenInBrowser)) open(out_);
        ImGui::SameLine();
    }
    if (ImGui::Button(kShowFolder)) open(out_.parent_path());
    ImGui::SameLine();
    if (ImGui::Button(kCopyPath)) ImGui::SetClipboardText(out_.c_str());
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
    if (kPublishKinds[kind_].format == SplatFormat::page) order.title = title_.data();
    if (kPublishKinds[kind_].format == SplatFormat::page && with_views_) order.views = views_;
    if (kPublishKinds[kind_].format == SplatFormat::sog_levels) order.levels = levels_;
    const bool journaled = scene.journal && core::is_file(scene.journal->file());
    if (now.done > 0 && journaled) order.edits = scene.journal->file();
    if (scene.file.empty() || (now.done > 0 && !journaled)) {
        order.splats = now.splats;
        order.states = now.states;
    }
    out_ = out;
    publisher_.start(std::move(order));
}

bool PublishDialog::take() {
    if (!running()) return path_.take(files_);
    const std::optional<Publisher::Result> result = publisher_.take();
    if (!result) return true;  // the seconds change
    done_ = result->done;
    text_ = result->stopped                  ? kPublishStopped
            : result->text.empty() && !done_ ? kPublishFailed
                                             : result->text;
    path_.complain({});
    return true;
}

}  // namespace ewa::viewer
