// SPDX-License-Identifier: Apache-2.0
// Comparisons with photos on the thread of the editor.
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "ewa/error.h"
#include "viewer/editor/edit_worker.h"

namespace ewa::viewer {
namespace {

/// A chain of 12 splats that touch, then one alone.
std::shared_ptr<const Gaussians> chain_and_one() {
    Gaussians g;
    g.resize(13);
    for (size_t i = 0; i < g.size(); ++i) {
        g.means[3 * i] = i < 12 ? float(i) : 1000;
        g.quaternions[4 * i] = 1;
        g.opacity_logits[i] = 2;
    }
    return std::make_shared<const Gaussians>(std::move(g));
}

EditWorker::Done done_with(EditWorker& worker) {
    EditWorker::Done all;
    for (;;) {
        EditWorker::Done done = worker.take();
        if (!done.snapshot) done.snapshot = all.snapshot;
        if (done.note.empty()) done.note = all.note;
        all = std::move(done);
        if (!worker.busy()) return all;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
}

TEST(Comparing, IsOfWhatTheFloatersLeave) {
    edit::Cameras cameras = [] { return std::vector<Camera>(); };
    size_t asked = 0;
    cameras.contradicted = [&](const Gaussians& all, const std::vector<uint32_t>& left) {
        ++asked;
        EXPECT_EQ(left.size(), 12u);
        std::vector<bool> flags(all.size());
        flags[3] = flags[4] = flags[7] = true;
        return flags;
    };
    EditWorker worker([] {}, 1000);
    worker.add(1, chain_and_one(), cameras, {});
    worker.preview({"floaters", "contradicted"});
    EXPECT_EQ(done_with(worker).preview_count, 4u);
    worker.preview({});
    worker.perform(1, {"Clean", {{"remove", "floaters"}, {"remove", "contradicted"}}});
    const EditWorker::Done done = done_with(worker);
    EXPECT_EQ(done.note, "");
    EXPECT_EQ(done.preview_count, std::nullopt);
    ASSERT_EQ(done.snapshot->steps.size(), 1u);
    EXPECT_EQ(done.snapshot->steps[0].edits[1], (edit::Words{"remove", "splats=3-4,7"}));
    EXPECT_EQ(done.snapshot->left, 9u);
    EXPECT_EQ(asked, 2u);
}

TEST(Comparing, EndsWhenItIsCancelled) {
    EditWorker worker([] {}, 1000);
    edit::Cameras cameras = [] { return std::vector<Camera>(); };
    cameras.contradicted = [state = worker.comparing()](const Gaussians&,
                                                        const std::vector<uint32_t>&) -> std::vector<bool> {
        state->photo = 1;
        while (!state->stopped()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        throw InputError("");
    };
    worker.add(1, chain_and_one(), cameras, {});
    const auto begun = [&] {
        while (worker.comparing()->photo.exchange(0) == 0)
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
    };
    worker.preview({"contradicted"});
    begun();
    worker.cancel();
    worker.perform(1, {"Clean", {{"select", "contradicted"}, {"delete", ""}}});
    begun();
    worker.cancel();
    const EditWorker::Done done = done_with(worker);
    EXPECT_EQ(done.note, "");
    EXPECT_TRUE(worker.state_of(1).get().steps.empty());
    worker.preview({"contradicted"});  // the worker's end cancels it
    begun();
}

TEST(Comparing, SaysWhyThereIsNone) {
    EditWorker worker([] {}, 1000);
    worker.add(1, chain_and_one(), {}, {});
    worker.preview({"floaters", "contradicted"});
    const EditWorker::Done done = done_with(worker);
    EXPECT_NE(done.note.find("photos are known of the folder of a training run"), std::string::npos);
    EXPECT_EQ(done.preview_count, 1u);
}

}  // namespace
}  // namespace ewa::viewer
