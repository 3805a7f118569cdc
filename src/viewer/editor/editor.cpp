// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/editor.h"

#include <algorithm>
#include <utility>

#include "core/folders.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/splat_files.h"
#include "viewer/editor/edit_words.h"
#include "viewer/editor/publish.h"
#include "viewer/editor/texts.h"

namespace ewa::viewer {
namespace {

namespace fs = std::filesystem;

/// A scene to save, once its edits are known.
struct Part {
    EditedScene scene;
    std::future<EditWorker::State> future;
    EditWorker::State state = {};
    bool as_opened = true;
};

/// Runs `ewa`. Throws RunError with what it said.
void run_ewa_program(const fs::path& program, std::vector<std::string> arguments) {
    std::string said;
    const core::Ended ended = run_ewa(program, std::move(arguments), [&](std::string_view text) {
        said += text;
        return true;
    });
    if (ended != core::Ended::done)
        throw RunError(core::one_line(said.empty() ? "ewa convert failed" : said));
}

/// The arguments of ewa convert for one scene. folder: for temporary files.
std::vector<std::string> conversion(const Part& part, const fs::path& folder, const fs::path& out) {
    fs::path file = part.scene.file;
    const std::string name = std::to_string(part.scene.id);
    if (file.empty() || !part.as_opened) {
        file = folder / (name + ".first.ply");
        save_splats(file, *part.state.first, SaveOptions());
    }
    std::vector<std::string> words{"convert", file.string(), out.string(), "--quiet"};
    if (part.state.steps.empty()) return words;
    const fs::path journal = folder / (name + ".edits");
    edit::Journal writer(journal, {file.filename().string(), part.state.first->size()}, false);
    for (const edit::Step& step : part.state.steps) writer.did(step);
    words.insert(words.end(), {"--edits", journal.string()});
    return words;
}

/// Writes the scenes, joined. Returns what the user should know.
std::string save_parts(const fs::path& program, std::vector<Part>& parts, const fs::path& out) {
    std::string note = "wrote " + core::one_line(fs::absolute(out).string());
    std::vector<const Part*> filled;
    for (Part& part : parts) {
        part.state = part.future.get();
        if (!part.state.first) throw RunError("the scene is closed");
        part.as_opened = part.scene.as_opened();
        if (!part.as_opened && !part.scene.newer)
            note += "; " + core::one_line(part.scene.file.filename().string()) +
                    " has changed on disk, and these are the splats that were opened";
        if (part.state.left > 0 || parts.size() == 1) filled.push_back(&part);
    }
    if (filled.empty()) throw RunError("all scenes are empty");
    const core::TemporaryFolder folder("ewa-save");
    if (filled.size() == 1) {
        run_ewa_program(program, conversion(*filled.front(), folder.path(), out));
        return note;
    }
    std::vector<std::string> join{"convert"};
    for (const Part* part : filled) {
        join.push_back((folder.path() / (std::to_string(part->scene.id) + ".ply")).string());
        run_ewa_program(program, conversion(*part, folder.path(), join.back()));
    }
    join.insert(join.end(), {out.string(), "--quiet"});
    run_ewa_program(program, join);
    return note;
}

EditWorker::Place place_of(const EditedScene& scene) {
    return {scene.journaled ? scene.file : fs::path(), scene.part, scene.head};
}

}  // namespace

Editor::Editor(fs::path program, std::function<void()> wake, size_t budget)
    : program_(std::move(program)), wake_(std::move(wake)), worker_(wake_, budget) {}

void Editor::set_budget(size_t budget) {
    worker_.set_budget(budget);
}

bool EditedScene::as_opened() const {
    return !newer && edit::same_version(head, edit::head_of(file, head.splats));
}

void Editor::insert(const std::string& name, const fs::path& file, std::shared_ptr<const Gaussians> splats,
                    edit::Cameras cameras, bool journaled, std::vector<bool> frozen) {
    auto scene = std::make_unique<EditedScene>();
    scene->name = name;
    scene->file = file;
    scene->journaled = journaled;
    scene->id = ++ids_;
    scene->head = edit::head_of(file, splats->size());
    worker_.add(scene->id, std::move(splats), std::move(cameras), place_of(*scene), std::move(frozen));
    scenes_.push_back(std::move(scene));
    active_ = scenes_.size() - 1;
}

void Editor::clear() {
    worker_.clear();
    scenes_.clear();
    closed_.clear();
    active_ = 0;
    settings.tool = Tool::view;
}

void Editor::enter(const std::string& name, const fs::path& file, std::shared_ptr<const Gaussians> splats,
                   edit::Cameras cameras, bool journaled, std::vector<bool> frozen) {
    clear();
    insert(name, file, std::move(splats), std::move(cameras), journaled, std::move(frozen));
    scenes_.back()->newer = !journaled && !file.empty();
}

void Editor::activate(size_t scene) {
    if (scene >= scenes_.size()) return;
    active_ = scene;
    worker_.activate(scenes_[scene]->id);
    if (!scenes_[scene]->shown) show(scene, true);
}

void Editor::show(size_t scene, bool shown) {
    if (scene >= scenes_.size()) return;
    if (!shown && scene == active_) {
        const auto other = std::ranges::find_if(
            scenes_, [&](const auto& each) { return each->shown && each != scenes_[scene]; });
        if (other == scenes_.end()) return;
        activate(size_t(other - scenes_.begin()));
    }
    scenes_[scene]->shown = shown;
    worker_.show(scenes_[scene]->id, shown);
}

void Editor::close(size_t scene) {
    if (scene >= scenes_.size() || scenes_.size() == 1) return;
    worker_.remove(scenes_[scene]->id, true);
    scenes_.erase(scenes_.begin() + std::ptrdiff_t(scene));
    activate(active_ > scene || active_ == scenes_.size() ? active_ - 1 : active_);
}

/// Moves a scene from the list, or back.
void Editor::move(uint64_t id, bool opens) {
    auto &from = opens ? closed_ : scenes_, &to = opens ? scenes_ : closed_;
    const auto found = std::ranges::find(from, id, [](const auto& scene) { return scene->id; });
    if (found == from.end()) return;
    const auto active = active_ < scenes_.size() ? scenes_[active_]->id : 0;
    to.push_back(std::move(*found));
    from.erase(found);
    const auto again = std::ranges::find(scenes_, active, [](const auto& scene) { return scene->id; });
    activate(again == scenes_.end() ? 0 : size_t(again - scenes_.begin()));
}

/// Another scene of the active one's file.
EditedScene& Editor::add_part(size_t part) {
    auto scene = std::make_unique<EditedScene>(now());
    scene->id = ++ids_;
    scene->part = part;
    scene->name += " " + std::to_string(part);
    scene->shown = true;
    scene->journaled &= part <= edit::kMostParts;
    return *scenes_.emplace_back(std::move(scene));
}

void Editor::separate() {
    if (scenes_.empty() || snapshot_->selected == 0) return;
    const EditedScene& from = now();
    size_t part = 1;
    for (const auto* list : {&scenes_, &closed_})
        for (const auto& scene : *list)
            if (scene->file == from.file) part = std::max(part, scene->part);
    const EditedScene& added = add_part(part + 1);
    worker_.separate(added.id, from.id, place_of(added));
}

void Editor::perform(edit::Step step) {
    if (scenes_.empty()) return;
    if (settings.live && !std::ranges::all_of(step.edits, edit::changes_states, &edit::Words::name)) {
        note_ = texts::kLiveRefuses;
        return;
    }
    if (step.title.empty()) step.title = selection_title(step.edits.front().value);
    worker_.perform(now().id, std::move(step));
}

void Editor::select(const std::string& shape, edit::Operation operation) {
    std::string text = std::string(edit::kOperationWords[size_t(operation)]) + shape;
    const bool in_view = shape.starts_with("polygon=") || shape.starts_with("brush=");
    if (in_view && settings.front) text += ";front";
    if (in_view && settings.extent) text += ";extent";
    perform({"", {{"select", std::move(text)}}});
}

void Editor::undo() {
    if (settings.live && snapshot_->done <= settings.sent)
        note_ = snapshot_->done > 0 ? texts::kLiveUndo : "";
    else if (!scenes_.empty())
        worker_.undo(now().id);
}

void Editor::redo() {
    if (!scenes_.empty()) worker_.redo(now().id);
}

void Editor::preview(const std::vector<std::string>& shapes) {
    if (shapes.empty()) worker_.cancel();
    worker_.preview(shapes);
}

Editor::News Editor::take() {
    EditWorker::Done done = worker_.take();
    News news{.any = done.any, .snapshot = done.snapshot != nullptr, .note = std::exchange(note_, {})};
    if (!done.note.empty()) news.note = done.note;
    preview_count_ = done.preview_count;
    if (done.snapshot) snapshot_ = done.snapshot;
    for (const auto& [id, opens] : done.moves) move(id, opens);
    for (const EditWorker::SceneState& state : done.scenes)
        for (const auto& scene : scenes_)
            if (scene->id == state.id) {
                scene->unsaved = state.unsaved;
                scene->journaled = state.journaled;
            }
    if (saving_.ready()) {
        const Saved saved = saving_.take();
        news.any = true;
        news.note = saved.note;
        for (const auto& [id, steps] : saved.scenes) worker_.saved(id, steps);
    }
    return news;
}

void Editor::save(const fs::path& file, bool all) {
    if (scenes_.empty() || saving_.running()) return;
    std::vector<Part> parts;
    for (size_t i = 0; i < scenes_.size(); ++i)
        if (all ? scenes_[i]->shown : i == active_)
            parts.push_back({*scenes_[i], worker_.state_of(scenes_[i]->id)});
    saving_.start(wake_, [this, file, parts = std::move(parts)]() mutable {
        try {
            Saved saved{save_parts(program_, parts, file), {}};
            for (Part& part : parts) saved.scenes.emplace_back(part.scene.id, std::move(part.state.steps));
            return saved;
        } catch (const std::exception& error) {
            return Saved{error.what(), {}};
        }
    });
}

bool Editor::unsaved() const {
    return std::ranges::any_of(scenes_, [](const auto& scene) { return scene->unsaved; });
}

std::vector<Editor::Left> Editor::left_journals() {
    std::vector<Left> left;
    if (scenes_.empty() || !now().journaled) return left;
    bool unsaved = false;
    for (size_t part = 1; part <= edit::kMostParts; ++part) {
        const fs::path file = edit::journal_of(now().file, part);
        if (!core::is_file(file)) continue;
        const std::string name = core::one_line(file.filename().string());
        if (edit::in_use(file)) {
            note_ = "another window edits this file; edits here are not kept beside it";
            return {};
        }
        try {
            edit::ReadJournal journal = edit::read_journal(file);
            if (part > 1 && !journal.unsaved()) continue;
            if (!edit::same_version(journal.head, now().head)) {
                if (!journal.unsaved()) continue;
                edit::set_aside(file);
                note_ = "the file has changed since it was edited; its edits are in " + name + ".before";
                continue;
            }
            unsaved = unsaved || journal.unsaved();
            left.push_back({part, std::move(journal)});
        } catch (const std::exception& error) {
            note_ = error.what();
        }
    }
    if (!unsaved) left.clear();
    return left;
}

void Editor::restore(std::vector<Left> left) {
    if (scenes_.empty()) return;
    for (Left& each : left) {
        const EditedScene& scene = each.part == 1 ? now() : add_part(each.part);
        worker_.restore(scene.id, now().id, place_of(scene), std::move(each.journal));
    }
}

std::string Editor::command() const {
    if (scenes_.empty()) return "";
    const auto words = edit::edits_of({snapshot_->steps.data(), snapshot_->done});
    const fs::path& file = scenes_[active_]->file;
    return edit::command_line(edit::needed_edits(words), file.empty() ? "splats.ply" : file.string(),
                              "edited.ply");
}

}  // namespace ewa::viewer
