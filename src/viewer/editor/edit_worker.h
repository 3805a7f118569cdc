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
#include "viewer/draft.h"
#include "viewer/editor/edit_snapshot.h"

namespace ewa::viewer {

class EditWorker {
  public:
    /// wake: called on the thread when take() has something new. budget: as Editor's.
    EditWorker(std::function<void()> wake, size_t budget);
    /// Drops the tasks that wait, and removes journals without edits.
    ~EditWorker();

    // Tasks. scene: EditedScene::id.
    void add(uint64_t scene, std::shared_ptr<const Gaussians> splats, edit::Cameras cameras);
    /// Adds a scene with the history of another one, whose splats are those that `of` has selected.
    void add_selection(uint64_t scene, uint64_t of);
    void remove(uint64_t scene);
    void activate(uint64_t scene);
    void show(uint64_t scene, bool shown);
    /// journal: gets a line for what is done; null: none.
    void perform(uint64_t scene, std::vector<edit::Step> steps, std::shared_ptr<edit::Journal> journal);
    void undo(uint64_t scene, std::shared_ptr<edit::Journal> journal);
    void redo(uint64_t scene, std::shared_ptr<edit::Journal> journal);
    void preview(const std::string& selection);
    void drag(const std::optional<glm::dmat4>& transform);  // a newer one replaces one that waits

    /// The edits in effect and the splats of a scene, once all tasks before are done.
    struct State {
        std::vector<edit::Words> edits;
        std::shared_ptr<const Gaussians> first;  // without edits
    };
    std::future<State> state_of(uint64_t scene);

    bool busy() const { return pending_ > 0; }

    /// What has been done since the last take().
    struct Done {
        std::shared_ptr<const EditSnapshot> snapshot;  // null: as before; so the next two
        std::shared_ptr<const Gaussians> splats;
        Draft draft;
        std::shared_ptr<const std::vector<uint8_t>> marks;
        std::optional<size_t> preview_count;
        std::vector<edit::Step> steps;
        std::vector<uint64_t> changed;  // scenes with edits that were done, undone or redone
        std::string note;
        bool any = false;
    };
    Done take();

  private:
    struct Scene {
        std::shared_ptr<edit::History> history;
        std::shared_ptr<edit::Journal> journal;
        edit::Cameras cameras;
        bool shown = true;
    };
    using Task = std::function<void()>;
    void post(Task task);
    void work(const std::stop_token& stop);
    void change(uint64_t scene, const std::shared_ptr<edit::Journal>& journal,
                const std::function<void(Scene&)>& edit);
    void publish();
    void join();
    std::shared_ptr<const EditSnapshot> snapshot() const;
    std::shared_ptr<const std::vector<uint8_t>> marks() const;
    void find_preview();

    std::function<void()> wake_;
    size_t budget_;

    // The thread alone uses these.
    std::map<uint64_t, Scene> scenes_;
    uint64_t active_ = 0;
    std::string preview_;          // a selection; empty: none
    std::vector<bool> previewed_;  // of the active scene's splats; empty: none
    std::optional<glm::dmat4> drag_;
    std::shared_ptr<const Gaussians> joined_;
    std::vector<std::pair<uint64_t, uint64_t>> joined_of_;  // scenes, with the versions of their values
    Draft draft_;  // of the joined splats, if they are more than the budget
    double milliseconds_ = 0;
    std::vector<edit::Step> steps_;
    std::vector<uint64_t> changed_;

    std::atomic<int> pending_ = 0;
    std::mutex mutex_;
    std::condition_variable_any waits_;
    std::deque<Task> tasks_;
    std::optional<std::optional<glm::dmat4>> next_drag_;
    Done done_;
    std::jthread thread_;
};

}  // namespace ewa::viewer
