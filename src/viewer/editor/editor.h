// SPDX-License-Identifier: Apache-2.0
// The editor of the window: scenes with their histories, and the edits that tools and panels ask for. Edits run on a thread of their
// own, one after another, so that the window answers while a large scene is edited.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "edit/history.h"
#include "edit/journal.h"
#include "edit/shapes.h"
#include "viewer/editor/edit_settings.h"
#include "viewer/editor/edit_worker.h"
#include "viewer/latest.h"

namespace ewa::viewer {

/// A scene in the list of scenes.
struct EditedScene {
    std::string name;
    std::filesystem::path file;  // that was opened; empty: none
    size_t part = 1;             // more: it was separated from another scene of the file
    edit::JournalHead head;      // of the file, as it was when it was opened
    bool journaled = false;      // all edits are in the journal; it is there once there are edits
    bool newer = false;          // the splats are those of a training, and newer than the file's
    uint64_t id = 0;
    bool shown = true;
    bool unsaved = false;

    std::filesystem::path journal() const { return edit::journal_of(file, part); }
    /// Whether the file still has the splats that were opened.
    bool as_opened() const;
};

class Editor {
  public:
    /// program: the file of `ewa`, which writes what is saved. wake: called on a thread of the editor when take() has something new.
    /// budget: most splats of a draft, which is drawn while the view changes.
    Editor(std::filesystem::path program, std::function<void()> wake, size_t budget);
    void set_budget(size_t budget);

    // Scenes.
    /// Replaces all scenes by this one. journaled: it is a file of its own, and gets a journal. frozen: as EditWorker::add.
    void enter(const std::string& name, const std::filesystem::path& file,
               std::shared_ptr<const Gaussians> splats, edit::Cameras cameras, bool journaled,
               std::vector<bool> frozen = {});
    /// Adds a scene of another file, which becomes the active one. file: empty: the splats are in none.
    void add(const std::string& name, const std::filesystem::path& file,
             std::shared_ptr<const Gaussians> splats) {
        insert(name, file, std::move(splats), {}, !file.empty(), {});
    }
    bool wants_scene = false;  // the user asks for a file to add
    void clear();              // there is nothing to edit
    size_t scenes() const { return scenes_.size(); }
    const EditedScene& scene(size_t i) const { return *scenes_[i]; }
    size_t active() const { return active_; }
    void activate(size_t scene);
    /// The active scene is always shown: if it is hidden, another one becomes active. The only one that is shown stays.
    void show(size_t scene, bool shown);
    void close(size_t scene);
    /// The selection becomes a scene of its own: this history and --select invert --delete. Undo takes it back.
    void separate();

    // Edits of the active scene, in the background and in order. An error is News::note.
    /// A selection without a title gets that of selection_title().
    void perform(edit::Step step);
    /// --select with the modifiers of the settings. shape: as the functions of edit/shapes.h write it.
    void select(const std::string& shape, edit::Operation operation);
    void undo();
    void redo();
    /// Shows in red what the removal of shapes would take, each of the splats that those before leave. Nothing changes. None: ends
    /// that, and comparisons with photos.
    void preview(const std::vector<std::string>& shapes);
    /// The comparison with photos in progress.
    const std::shared_ptr<Comparing>& comparing() const { return worker_.comparing(); }
    std::optional<size_t> preview_count() const { return preview_count_; }

    /// While a gizmo is dragged: the transform of the selection that is drawn. Empty: none. The edit itself is perform().
    void drag(const std::optional<glm::dmat4>& transform) { worker_.drag(transform); }

    bool busy() const { return worker_.busy(); }  // edits are being done, or take() has not taken them yet
    /// Takes what has been done. Call it once per turn of the window's loop, before anything reads snapshot().
    struct News {
        bool any = false, snapshot = false;  // snapshot: it may be another one
        std::string note;                    // a message for the user; empty: none
    };
    News take();
    void say(std::string note) { note_ = std::move(note); }  // News::note of the next take()
    /// The state of the active scene.
    const EditSnapshot& snapshot() const { return *snapshot_; }

    // Files.
    /// `ewa convert` replays the edits on the file and writes the result, on a thread of its own. If the file has changed since it
    /// was opened, the splats that were opened take its place. all: joins all scenes that are shown.
    void save(const std::filesystem::path& file, bool all);
    bool saving() const { return saving_.running(); }
    bool unsaved() const;                  // any scene has edits that were not saved
    void discard() { worker_.discard(); }  // removes the journals of unsaved edits
    /// The journals that an earlier session has left of the active scene's file and its parts. Empty if all of its edits were
    /// saved. An error is News::note. Call it while the editor is not busy.
    struct Left {
        size_t part;
        edit::ReadJournal journal;
    };
    std::vector<Left> left_journals();
    /// Performs the edits in the active scene, and in a scene for each part.
    void restore(std::vector<Left> left);
    /// The ewa convert line of the active scene's edits.
    std::string command() const;

    EditSettings settings;

  private:
    struct Saved {
        std::string note;
        std::vector<std::pair<uint64_t, std::vector<edit::Step>>> scenes;  // that are saved, with their edits
    };
    EditedScene& now() { return *scenes_[active_]; }
    void insert(const std::string& name, const std::filesystem::path& file,
                std::shared_ptr<const Gaussians> splats, edit::Cameras cameras, bool journaled,
                std::vector<bool> frozen);
    EditedScene& add_part(size_t part);
    void move(uint64_t id, bool opens);

    std::filesystem::path program_;
    std::vector<std::unique_ptr<EditedScene>> scenes_;
    std::vector<std::unique_ptr<EditedScene>> closed_;  // by undo
    size_t active_ = 0;
    std::shared_ptr<const EditSnapshot> snapshot_ = std::make_shared<EditSnapshot>();
    std::optional<size_t> preview_count_;
    std::function<void()> wake_;
    std::string note_;
    uint64_t ids_ = 0;  // that were given to scenes
    EditWorker worker_;
    Task<Saved> saving_;  // its thread ends before the rest
};

}  // namespace ewa::viewer
