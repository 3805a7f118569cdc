// SPDX-License-Identifier: Apache-2.0
// The thread of the editor, which holds the histories of all scenes and does one task after another. Independent of the window.
#pragma once
#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "edit/journal.h"
#include "edit/shapes.h"
#include "viewer/editor/edit_snapshot.h"

namespace ewa::viewer {

class EditWorker {
  public:
    /// wake: called on the thread when take() has something new. budget: as Editor's.
    EditWorker(std::function<void()> wake, size_t budget);
    void set_budget(size_t budget);
    /// Drops the tasks that wait, and removes journals without edits.
    ~EditWorker();

    /// Where a scene keeps its journal: beside the file it was opened from. file: empty: nowhere.
    struct Place {
        std::filesystem::path file;
        size_t part = 1;  // more: the scene was separated from another one of the file
        edit::JournalHead head;
    };

    // Tasks. scene: EditedScene::id.
    /// Adds a scene and makes it the active one. frozen: splats that are locked by its first step, which cannot be undone and needs no
    /// save; empty: none.
    void add(uint64_t scene, std::shared_ptr<const Gaussians> splats, edit::Cameras cameras, Place place,
             std::vector<bool> frozen = {});
    /// The selection of `of` becomes a scene with the same history, and leaves `of`.
    void separate(uint64_t scene, uint64_t of, Place place);
    /// Performs the steps of a journal, and continues it. A scene that is not there yet has the first splats of `of`.
    void restore(uint64_t scene, uint64_t of, Place place, edit::ReadJournal journal);
    /// discard: its unsaved edits are lost, and with them its journal.
    void remove(uint64_t scene, bool discard);
    /// Removes all scenes. What was done before is not taken any more.
    void clear();
    /// Removes the journals of scenes with unsaved edits, before it returns.
    void discard();
    void activate(uint64_t scene);
    void show(uint64_t scene, bool shown);
    void perform(uint64_t scene, edit::Step step);
    void undo(uint64_t scene);
    void redo(uint64_t scene);
    /// These edits of state_of() are in a file that was saved.
    void saved(uint64_t scene, const std::vector<edit::Step>& steps);
    /// shapes: each of the splats that those before leave; empty: none.
    void preview(const std::vector<std::string>& shapes);
    void drag(const std::optional<glm::dmat4>& transform);  // a newer one replaces one that waits

    /// The steps in effect and the splats of a scene, once all tasks before are done.
    struct State {
        std::vector<edit::Step> steps;
        std::shared_ptr<const Gaussians> first;  // without edits
        size_t left = 0;                         // splats with edits
    };
    std::future<State> state_of(uint64_t scene);

    bool busy() const { return pending_ > 0; }  // there are tasks whose results were not taken

    /// What the list of scenes shows of one.
    struct SceneState {
        uint64_t id;
        bool unsaved;    // its lasting edits are others than at the last save
        bool journaled;  // its journal has all edits
    };

    const std::shared_ptr<Comparing>& comparing() const { return comparing_; }
    /// Ends the comparisons with photos of all tasks up to now. These tasks then change nothing.
    void cancel() { comparing_->cancelled = posted_.load(); }

    /// What has been done since the last take().
    struct Done {
        std::shared_ptr<const EditSnapshot> snapshot;  // null: as before
        std::optional<size_t> preview_count;
        std::vector<SceneState> scenes;
        std::vector<std::pair<uint64_t, bool>>
            moves;  // scenes that an undo has closed (false), or a redo opened
        std::string note;
        bool any = false;
    };
    Done take();

  private:
    struct Scene {
        std::shared_ptr<edit::History> history;
        edit::Cameras cameras;
        Place place;
        bool journaled = !place.file.empty();
        std::unique_ptr<edit::Journal> journal = {};  // null: there are no edits, or they are not kept
        bool goes_on = false;                         // its journal is that of an earlier session
        bool shown = true;
        size_t least = 0;                     // steps that undo leaves
        uint64_t from = 0;                    // the scene that it was separated from; 0: none
        size_t from_step = 0;                 // by this step of it
        bool closed = false;                  // that step was undone
        std::vector<edit::Words> saved = {};  // lasting edits of the last save
        bool unmarked = false;                // the journal does not know of that save
        std::vector<edit::Words> lasting() const { return edit::lasting_edits(history->in_effect()); }
        bool untouched() const { return lasting().empty() && saved.empty(); }
        bool unsaved() const { return !closed && lasting() != saved; }
    };
    using Task = std::function<void()>;
    void post(Task task);
    void work(const std::stop_token& stop);
    void change(uint64_t scene, const std::function<void(Scene&)>& edit);
    void record(Scene& scene, const std::function<void(edit::Journal&)>& write);
    void write_journal(Scene& scene);
    void follow(uint64_t of, size_t step, bool undone);
    void publish();
    void join();
    std::shared_ptr<const EditSnapshot> snapshot() const;
    std::shared_ptr<const std::vector<uint8_t>> marks() const;
    void find_preview();

    std::function<void()> wake_;
    std::atomic<size_t> budget_;

    // The thread alone uses these.
    std::map<uint64_t, Scene> scenes_;
    uint64_t active_ = 0;
    std::vector<std::string> preview_;  // shapes; empty: none
    std::vector<bool> previewed_;       // of the active scene's splats; empty: none
    std::optional<glm::dmat4> drag_;
    std::shared_ptr<const Gaussians> joined_;
    std::vector<std::pair<uint64_t, uint64_t>> joined_of_;  // scenes, with the versions of their values
    Draft draft_;  // of the joined splats, if they are more than the budget
    double milliseconds_ = 0;
    std::vector<std::pair<uint64_t, bool>> moves_;
    std::string note_;
    uint64_t period_ = 0;  // number of clear() so far

    std::shared_ptr<Comparing> comparing_ = std::make_shared<Comparing>();
    std::atomic<uint64_t> posted_ = 0;  // tasks so far
    std::atomic<int> pending_ = 0;
    std::mutex mutex_;
    int finished_ = 0;  // tasks since the last take()
    uint64_t next_period_ = 0;
    std::condition_variable_any waits_;
    std::deque<Task> tasks_;
    std::optional<std::optional<glm::dmat4>> next_drag_;
    Done done_;
    std::jthread thread_;
};

}  // namespace ewa::viewer
