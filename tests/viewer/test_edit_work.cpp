// SPDX-License-Identifier: Apache-2.0
// The work of the editor without its window: journals, saves, scenes that were separated, and what is published.
#include <sys/resource.h>

#include <atomic>
#include <csignal>
#include <memory>
#include <mutex>
#include <utility>

#include "cli/program.h"
#include "ewa/splat_files.h"
#include "support/soon.h"
#include "viewer/editor/edit_worker.h"
#include "viewer/editor/editor.h"
#include "viewer/opening.h"

namespace ewa::test {
namespace {

namespace fs = std::filesystem;

class EditWork : public testing::Test {
  protected:
    void SetUp() override {
        make_splats(scene_, 400);
        enter();
    }
    /// Ends the session, and begins another one on the file.
    void enter() {
        editor_.reset();
        editor_ = opened();
    }
    std::unique_ptr<viewer::Editor> opened() {
        auto editor = std::make_unique<viewer::Editor>(
            EWA_PROGRAM, [] {}, viewer::kUsualBudget);
        editor->enter("a.ply", scene_, std::make_shared<const Gaussians>(load_splats(scene_)), {}, true);
        settle(*editor);
        return editor;
    }
    void settle(viewer::Editor& editor) {
        EXPECT_TRUE(soon([&] {
            if (const auto news = editor.take(); !news.note.empty()) note_ = news.note;
            return !editor.busy() && !editor.saving();
        }));
    }
    void perform(const std::string& name, const std::string& value = "") {
        editor_->perform({name, {{name, value}}});
        settle(*editor_);
    }
    void delete_right() {
        perform("select", "x=0..");
        perform("delete");
    }
    void undo() {
        editor_->undo();
        settle(*editor_);
    }
    void redo() {
        editor_->redo();
        settle(*editor_);
    }
    size_t saved(bool all = false) {
        editor_->save(folder_ / "out.ply", all);
        settle(*editor_);
        return load_splats(folder_ / "out.ply").size();
    }
    size_t left() const { return editor_->snapshot().left; }
    edit::ReadJournal journal(size_t part = 1) const {
        return edit::read_journal(edit::journal_of(scene_, part));
    }
    bool noted(const std::string& text) const { return note_.find(text) != std::string::npos; }

    Folder folder_;
    const std::string scene_ = folder_ / "a.ply";
    std::string note_;
    std::unique_ptr<viewer::Editor> editor_;
};

TEST_F(EditWork, IsUnsavedWhereItDiffersFromTheLastSave) {
    perform("select", "x=0..");
    EXPECT_FALSE(editor_->unsaved());
    perform("delete");
    EXPECT_TRUE(editor_->unsaved());
    EXPECT_EQ(saved(), left());
    EXPECT_FALSE(editor_->unsaved());
    EXPECT_FALSE(journal().unsaved());
    perform("select", "all");
    EXPECT_FALSE(editor_->unsaved()) << "a selection is no work";
    undo();
    undo();
    EXPECT_TRUE(editor_->unsaved()) << "the file has other splats";
    redo();
    EXPECT_FALSE(editor_->unsaved());
    enter();
    EXPECT_TRUE(editor_->left_journals().empty()) << "all was saved";
}

/// Splats that a training has frozen are locked, by a step that is no edit of the user's.
TEST_F(EditWork, LocksWhatATrainingHasFrozen) {
    const auto splats = std::make_shared<const Gaussians>(load_splats(scene_));
    std::vector<bool> frozen(splats->size());
    for (size_t i = 0; i < frozen.size(); i += 4) frozen[i] = true;
    editor_->enter("a.ply", "", splats, {}, false, frozen);
    settle(*editor_);
    EXPECT_EQ(editor_->snapshot().locked, 100u);
    ASSERT_TRUE(editor_->snapshot().marks);
    EXPECT_EQ((*editor_->snapshot().marks)[4], kMarkLocked);
    EXPECT_EQ((*editor_->snapshot().marks)[5], 0);
    EXPECT_FALSE(editor_->unsaved());
    undo();
    EXPECT_EQ(editor_->snapshot().locked, 100u) << "it was undone";
    perform("select", "all");
    EXPECT_EQ(editor_->snapshot().selected, 300u);
    perform("delete");
    EXPECT_TRUE(editor_->unsaved());
    EXPECT_EQ(saved(), 100u) << "what is saved has other splats";
    perform("unlock");
    EXPECT_EQ(editor_->snapshot().locked, 0u);
}

/// The file of a training that runs has splats of an earlier step.
TEST_F(EditWork, SavesTheSplatsOfATrainingAndNotThoseOfItsFile) {
    Gaussians newer = load_splats(scene_);
    newer.resize(300);
    editor_->enter("a.ply", scene_, std::make_shared<const Gaussians>(newer), {}, false);
    settle(*editor_);
    EXPECT_EQ(saved(), 300u);
    EXPECT_FALSE(noted("has changed")) << note_;
    delete_right();
    EXPECT_EQ(saved(), left());
}

TEST_F(EditWork, IsUnsavedAfterASaveThatFails) {
    delete_right();
    write_file(folder_ / "folder", "");
    editor_->save(folder_ / "folder/out.ply", false);
    settle(*editor_);
    EXPECT_TRUE(editor_->unsaved());
    EXPECT_TRUE(journal().unsaved());
}

TEST_F(EditWork, GoesOnWithoutAJournalThatCannotBeWritten) {
    perform("select", "x=0..");
    const std::string journal_text = read_file(scene_ + ".edits");
    const auto old = std::signal(SIGXFSZ, SIG_IGN);
    rlimit limit{};
    ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &limit), 0);
    const rlimit full{.rlim_cur = journal_text.size() + 5, .rlim_max = limit.rlim_max};
    setrlimit(RLIMIT_FSIZE, &full);
    perform("delete");
    perform("select", "y=0..");
    setrlimit(RLIMIT_FSIZE, &limit);
    std::signal(SIGXFSZ, old);
    EXPECT_TRUE(noted("edits are no longer kept beside the file: ")) << note_;
    EXPECT_EQ(editor_->snapshot().done, 3u);
    EXPECT_GT(editor_->snapshot().selected, 0u);
    EXPECT_TRUE(editor_->unsaved());
    EXPECT_FALSE(editor_->scene(0).journaled);
    EXPECT_EQ(read_file(scene_ + ".edits"), journal_text);
    EXPECT_EQ(saved(), left());
    EXPECT_FALSE(editor_->unsaved());
    EXPECT_FALSE(fs::exists(scene_ + ".edits")) << "it misses edits that are saved";
}

TEST_F(EditWork, RestoresWhatWasNotSaved) {
    delete_right();
    const size_t half = left();
    enter();
    auto lost = editor_->left_journals();
    ASSERT_EQ(lost.size(), 1u);
    editor_->restore(std::move(lost));
    settle(*editor_);
    EXPECT_EQ(left(), half);
    undo();
    EXPECT_EQ(left(), 400u);
    EXPECT_EQ(journal().steps.size(), 1u);
}

TEST_F(EditWork, RestoresEditsUpToOneThatFails) {
    editor_.reset();
    write_file(scene_ + ".edits", R"({"ewa_edits":1,"file":"a.ply","splats":400})"
                                  "\n"
                                  R"({"step":"a","edits":[["select","x=0.."]]})"
                                  "\n"
                                  R"({"step":"b","edits":[["lock"]]})"
                                  "\n"
                                  R"({"step":"c","edits":[["select","all"]]})"
                                  "\n"
                                  R"({"step":"d","edits":[["transform","scale=1e300"]]})"
                                  "\n"
                                  R"({"step":"e","edits":[["delete"]]})"
                                  "\n");
    enter();
    editor_->restore(editor_->left_journals());
    settle(*editor_);
    EXPECT_TRUE(noted("restored 3 of 5 edits: ")) << note_;
    undo();
    perform("select", "y=0..");
    EXPECT_EQ(journal().steps, editor_->snapshot().steps);
    EXPECT_TRUE(fs::exists(scene_ + ".edits.before"));
}

TEST_F(EditWork, OfAnotherVersionOfTheFileIsSetAside) {
    delete_right();
    make_splats(scene_, 400, 2);
    fs::last_write_time(scene_, fs::last_write_time(scene_) + std::chrono::seconds(2));
    const size_t half = left();
    EXPECT_EQ(saved(), half) << "the splats that are shown are saved";
    EXPECT_TRUE(noted("has changed on disk")) << note_;
    EXPECT_EQ(read_splats(folder_ / "out.ply").gaussians.sh_degree, 1);
    perform("select", "all");
    perform("lock");
    enter();
    EXPECT_TRUE(editor_->left_journals().empty());
    settle(*editor_);
    EXPECT_TRUE(noted("the file has changed since it was edited")) << note_;
    EXPECT_TRUE(fs::exists(scene_ + ".edits.before"));
    EXPECT_FALSE(fs::exists(scene_ + ".edits"));
}

TEST_F(EditWork, OfASecondWindowHasNoJournal) {
    delete_right();
    const std::string first = read_file(scene_ + ".edits");
    const auto second = opened();
    EXPECT_TRUE(second->left_journals().empty());
    settle(*second);
    EXPECT_TRUE(noted("another window edits this file")) << note_;
    second->perform({"Select", {{"select", "all"}}});
    settle(*second);
    EXPECT_TRUE(noted("edits are not kept beside the file: ")) << note_;
    EXPECT_EQ(second->snapshot().selected, 400u);
    EXPECT_EQ(read_file(scene_ + ".edits"), first);
    EXPECT_FALSE(fs::exists(scene_ + ".edits.before"));
}

TEST_F(EditWork, SeparatesAndTakesItBack) {
    perform("select", "x=0..");
    editor_->separate();
    settle(*editor_);
    ASSERT_EQ(editor_->scenes(), 2u);
    EXPECT_EQ(editor_->scene(1).part, 2u);
    EXPECT_TRUE(editor_->scene(1).unsaved);
    const size_t rest = left();
    EXPECT_EQ(journal(2).separated, 2u);
    EXPECT_EQ(journal(2).separated_at, 2u);
    editor_->activate(1);
    settle(*editor_);
    EXPECT_EQ(left(), 400 - rest);
    undo();
    EXPECT_EQ(left(), 400 - rest) << "undo stops where the scene begins";

    editor_->activate(0);
    undo();
    EXPECT_EQ(editor_->scenes(), 1u);
    EXPECT_EQ(left(), 400u);
    EXPECT_FALSE(fs::exists(edit::journal_of(scene_, 2)));
    redo();
    ASSERT_EQ(editor_->scenes(), 2u);
    EXPECT_EQ(left(), rest);
    EXPECT_EQ(journal(2).separated, 2u);

    editor_->activate(1);
    perform("select", "all");
    perform("lock");
    editor_->activate(0);
    undo();
    EXPECT_EQ(editor_->scenes(), 2u);
    EXPECT_TRUE(noted("has edits of its own")) << note_;
}

TEST_F(EditWork, RestoresWhatWasSeparated) {
    perform("select", "x=0..");
    editor_->separate();
    settle(*editor_);
    const size_t rest = left();
    enter();
    auto lost = editor_->left_journals();
    ASSERT_EQ(lost.size(), 2u);
    editor_->restore(std::move(lost));
    settle(*editor_);
    ASSERT_EQ(editor_->scenes(), 2u);
    EXPECT_EQ(left(), rest);
    editor_->activate(1);
    settle(*editor_);
    EXPECT_EQ(left(), 400 - rest);
    EXPECT_EQ(saved(), 400 - rest);
    editor_->activate(0);
    undo();
    EXPECT_EQ(editor_->scenes(), 1u);
    EXPECT_EQ(left(), 400u);
}

TEST_F(EditWork, JoinsScenesOfWhichOneIsEmpty) {
    perform("select", "x=0..");
    editor_->separate();
    settle(*editor_);
    const size_t rest = left();
    EXPECT_EQ(saved(true), 400u);
    editor_->activate(1);
    perform("select", "all");
    perform("delete");
    EXPECT_EQ(saved(true), rest) << note_;
    EXPECT_FALSE(editor_->unsaved());
}

TEST_F(EditWork, EditsAnotherFileBesideTheFirst) {
    const std::string other = folder_ / "b.ply";
    make_splats(other, 50, 2);
    editor_->add("b.ply", other, std::make_shared<const Gaussians>(load_splats(other)));
    settle(*editor_);
    EXPECT_EQ(left(), 50u);
    EXPECT_EQ(editor_->snapshot().drawn->size(), 450u);
    delete_right();
    EXPECT_TRUE(fs::exists(other + ".edits"));
    EXPECT_FALSE(fs::exists(scene_ + ".edits"));
    const size_t rest = left();
    EXPECT_LT(rest, 50u);
    EXPECT_EQ(saved(), rest);
    EXPECT_EQ(saved(true), 400 + rest);
}

TEST(EditWorker, PublishesManyUndosOnce) {
    std::atomic<bool> held = false;
    std::mutex mutex;
    viewer::EditWorker* waking = nullptr;
    size_t published = 0;
    std::shared_ptr<const viewer::EditSnapshot> last;
    const auto take = [&] {
        soon([&] { return !held; });
        const std::lock_guard lock(mutex);
        if (const auto done = waking->take(); done.snapshot) {
            ++published;
            last = done.snapshot;
        }
    };
    viewer::EditWorker worker(take, viewer::kUsualBudget);
    waking = &worker;
    const auto settle = [&] {
        EXPECT_TRUE(soon([&] { return !worker.busy(); }));
        const std::lock_guard lock(mutex);
        return std::exchange(published, 0);
    };
    auto splats = std::make_shared<Gaussians>();
    splats->resize(10);
    worker.add(1, splats, {}, {});
    constexpr int kSteps = 1000;
    for (int i = 0; i < kSteps; ++i) worker.perform(1, {"Select", {{"select", i % 2 ? "none" : "all"}}});
    settle();
    ASSERT_EQ(last->done, size_t(kSteps));
    held = true;
    for (int i = 0; i < kSteps; ++i) worker.undo(1);
    held = false;
    EXPECT_LT(settle(), 20u);
    EXPECT_EQ(last->done, 0u);
    // A scene that opens replaces the old one at once.
    held = true;
    worker.perform(1, {"Select", {{"select", "all"}}});
    worker.clear();
    worker.add(2, splats, {}, {});
    held = false;
    EXPECT_EQ(settle(), 1u);
    EXPECT_EQ(last->selected, 0u);
}

}  // namespace
}  // namespace ewa::test
