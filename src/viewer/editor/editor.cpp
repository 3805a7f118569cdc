// SPDX-License-Identifier: Apache-2.0
#include "viewer/editor/editor.h"

#include <algorithm>
#include <utility>

#include "core/folders.h"
#include "core/text.h"
#include "ewa/error.h"
#include "ewa/splat_files.h"
#include "viewer/editor/edit_words.h"
#include "viewer/editor/edit_worker.h"
#include "viewer/editor/publish.h"

namespace ewa::viewer {
namespace {

namespace fs = std::filesystem;

/// A scene to save, once its edits are known.
struct Part {
    uint64_t id;
    fs::path file;  // empty: the splats are in no file
    std::future<EditWorker::State> state;
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
std::vector<std::string> conversion(const Part& part, const EditWorker::State& state, const fs::path& folder,
                                    const fs::path& out) {
    fs::path file = part.file;
    if (file.empty()) {
        file = folder / (std::to_string(part.id) + ".first.ply");
        save_splats(file, *state.first, SaveOptions());
    }
    std::vector<std::string> words{"convert", file.string(), out.string(), "--quiet"};
    if (state.edits.empty()) return words;
    const fs::path journal = folder / (std::to_string(part.id) + ".edits");
    edit::Journal(journal, {file.filename().string(), state.first->size()}, false)
        .did({"Saved", state.edits});
    words.insert(words.end(), {"--edits", journal.string()});
    return words;
}

void save_parts(const fs::path& program, std::vector<Part>& parts, const fs::path& out) {
    const core::TemporaryFolder folder("ewa-save");
    std::vector<std::string> join{"convert"};
    for (Part& part : parts) {
        const EditWorker::State state = part.state.get();
        if (!state.first) throw RunError("the scene is closed");
        if (parts.size() == 1) return run_ewa_program(program, conversion(part, state, folder.path(), out));
        const fs::path one = folder.path() / (std::to_string(part.id) + ".ply");
        run_ewa_program(program, conversion(part, state, folder.path(), one));
        join.push_back(one.string());
    }
    join.insert(join.end(), {out.string(), "--quiet"});
    run_ewa_program(program, join);
}

}  // namespace

Editor::Editor(fs::path program, std::function<void()> wake, size_t budget)
    : program_(std::move(program)),
      wake_(std::move(wake)),
      worker_(std::make_unique<EditWorker>(wake_, budget)) {}

Editor::~Editor() = default;

void Editor::insert(std::unique_ptr<EditedScene> scene, std::shared_ptr<const Gaussians> splats,
                    edit::Cameras cameras) {
    scene->id = ++ids_;
    worker_->add(scene->id, std::move(splats), std::move(cameras));
    scenes_.push_back(std::move(scene));
    activate(scenes_.size() - 1);
}

void Editor::clear() {
    for (const auto& scene : scenes_) worker_->remove(scene->id);
    scenes_.clear();
    active_ = 0;
    settings.tool = Tool::view;
}

void Editor::enter(const std::string& name, const fs::path& file, std::shared_ptr<const Gaussians> splats,
                   edit::Cameras cameras, bool journaled) {
    clear();
    auto scene = std::make_unique<EditedScene>();
    scene->name = name;
    scene->file = file;
    scene->journaled = journaled;
    insert(std::move(scene), std::move(splats), std::move(cameras));
}

void Editor::add(const std::string& name, const fs::path& file, std::shared_ptr<const Gaussians> splats) {
    auto scene = std::make_unique<EditedScene>();
    scene->name = name;
    scene->file = file;
    scene->journaled = true;
    insert(std::move(scene), std::move(splats), {});
}

void Editor::activate(size_t scene) {
    if (scene >= scenes_.size()) return;
    active_ = scene;
    worker_->activate(scenes_[scene]->id);
}

void Editor::show(size_t scene, bool shown) {
    if (scene >= scenes_.size()) return;
    scenes_[scene]->shown = shown;
    worker_->show(scenes_[scene]->id, shown);
}

void Editor::close(size_t scene) {
    if (scene >= scenes_.size() || scenes_.size() == 1) return;
    worker_->remove(scenes_[scene]->id);
    scenes_.erase(scenes_.begin() + std::ptrdiff_t(scene));
    activate(active_ > scene || active_ == scenes_.size() ? active_ - 1 : active_);
}

void Editor::separate() {
    if (scenes_.empty() || snapshot_->selected == 0) return;
    EditedScene& from = now();
    auto scene = std::make_unique<EditedScene>();
    scene->id = ++ids_;
    scene->name = from.name + " " + std::to_string(scenes_.size() + 1);
    scene->file = from.file;
    scene->unsaved = true;
    worker_->add_selection(scene->id, from.id);
    perform({"Separate", {{"delete", ""}}});
    scenes_.push_back(std::move(scene));
}

/// The journal of a scene's file, from its first edit on. A folder that cannot be written is said once.
void Editor::open_journal(EditedScene& scene, bool go_on) {
    if (!scene.journaled || scene.journal) return;
    const fs::path file = edit::journal_of(scene.file);
    std::error_code none;
    if (!go_on && core::is_file(file))
        fs::rename(file, file.string() + ".before", none);  // of an earlier session
    try {
        scene.journal = std::make_shared<edit::Journal>(
            file,
            edit::JournalHead{scene.file.filename().string(),
                              snapshot_->states ? snapshot_->states->size() : 0},
            go_on);
    } catch (const std::exception& error) {
        scene.journaled = false;
        note_ = std::string("edits are not kept in a journal: ") + error.what();
    }
}

void Editor::perform(edit::Step step) {
    if (scenes_.empty()) return;
    if (step.title.empty()) step.title = selection_title(step.edits.front().value);
    open_journal(now(), false);
    worker_->perform(now().id, {std::move(step)}, now().journal);
}

void Editor::select(const std::string& shape) {
    constexpr const char* kPrefixes[] = {"", "add:", "remove:", "and:"};
    std::string text = kPrefixes[size_t(settings.operation)] + shape;
    const bool in_view = shape.starts_with("polygon=") || shape.starts_with("brush=");
    if (in_view && settings.front) text += ";front";
    if (in_view && settings.extent) text += ";extent";
    perform({"", {{"select", std::move(text)}}});
}

void Editor::undo() {
    if (!scenes_.empty()) worker_->undo(now().id, now().journal);
}

void Editor::redo() {
    if (!scenes_.empty()) worker_->redo(now().id, now().journal);
}

void Editor::preview(const std::string& selection) {
    worker_->preview(selection);
}

void Editor::drag(const std::optional<glm::dmat4>& transform) {
    worker_->drag(transform);
}

bool Editor::busy() const {
    return worker_->busy();
}

Editor::News Editor::take() {
    EditWorker::Done done = worker_->take();
    News news{.any = done.any, .marks = false, .note = std::exchange(note_, {}), .done = done.steps};
    if (!done.note.empty()) news.note = done.note;
    preview_count_ = done.preview_count;
    if (done.snapshot) {
        snapshot_ = done.snapshot;
        news.marks = true;
        drawn_ = done.splats;
        draft_ = done.draft;
        marks_ = done.marks;
    }
    for (const auto& scene : scenes_)
        if (std::ranges::find(done.changed, scene->id) != done.changed.end()) scene->unsaved = true;
    if (saving_.ready()) {
        const Saved saved = saving_.take();
        news.any = true;
        news.note = saved.note;
        for (const auto& scene : scenes_)
            if (std::ranges::find(saved.failed, scene->id) != saved.failed.end()) scene->unsaved = true;
    }
    return news;
}

void Editor::save(const fs::path& file, bool all) {
    if (scenes_.empty() || saving_.running()) return;
    std::vector<Part> parts;
    for (size_t i = 0; i < scenes_.size(); ++i) {
        EditedScene& scene = *scenes_[i];
        if (all ? !scene.shown : i != active_) continue;
        parts.push_back({scene.id, scene.file, worker_->state_of(scene.id)});
        scene.unsaved = false;  // edits from now on set it again
    }
    saving_.start(wake_, [this, file, parts = std::move(parts)]() mutable {
        try {
            save_parts(program_, parts, file);
            return Saved{"wrote " + fs::absolute(file).string(), {}};
        } catch (const std::exception& error) {
            Saved saved{error.what(), {}};
            for (const Part& part : parts) saved.failed.push_back(part.id);
            return saved;
        }
    });
}

bool Editor::unsaved() const {
    return std::ranges::any_of(scenes_, [](const auto& scene) { return scene->unsaved; });
}

std::optional<edit::ReadJournal> Editor::left_journal(const fs::path& file, size_t splats) {
    const fs::path path = edit::journal_of(file);
    if (!core::is_file(path)) return std::nullopt;
    edit::ReadJournal journal = edit::read_journal(path);
    if (journal.head.splats != splats || journal.steps.empty()) return std::nullopt;
    return journal;
}

void Editor::restore(const edit::ReadJournal& journal) {
    if (scenes_.empty()) return;
    worker_->perform(now().id, journal.steps, nullptr);
    open_journal(now(), true);
}

std::string Editor::command() const {
    if (scenes_.empty()) return "";
    std::vector<edit::Words> words;
    for (size_t i = 0; i < snapshot_->done; ++i)
        words.insert(words.end(), snapshot_->steps[i].edits.begin(), snapshot_->steps[i].edits.end());
    const fs::path& file = scenes_[active_]->file;
    return edit::command_line(words, file.empty() ? "splats.ply" : file.string(), "edited.ply");
}

}  // namespace ewa::viewer
