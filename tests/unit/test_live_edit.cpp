// SPDX-License-Identifier: Apache-2.0
// The edits that a client sends to a training.
#include "cli/live_edit.h"

#include <gtest/gtest.h>

#include <future>
#include <thread>

#include "ewa/error.h"
#include "live/edit_queue.h"
#include "support/temp_folder.h"

namespace ewa::test {
namespace {

/// Splats at 0, 1, 2, 3, 4 along x.
Gaussians splats_in_a_row() {
    Gaussians splats;
    splats.resize(5);
    for (size_t i = 0; i < 5; ++i) {
        splats.means[3 * i] = float(i);
        splats.quaternions[4 * i] = 1;
    }
    return splats;
}

TEST(LiveEdit, RemovesWhatItsFiltersRemove) {
    const auto removed = [](const std::string& edits) {
        const SplatEdit edit = cli::live_edit(splats_in_a_row(), {}, "{\"edits\": " + edits + "}");
        EXPECT_TRUE(edit.freeze.empty() && edit.unfreeze.empty());
        return edit.remove;
    };
    EXPECT_EQ(removed(R"([["where", "sphere=0,0,0,1.5"]])"), (std::vector<uint32_t>{2, 3, 4}));
    EXPECT_EQ(removed(R"([["where", "x=1.."], ["where", "x=..3"]])"), (std::vector<uint32_t>{0, 4}));
    EXPECT_EQ(removed(R"([["remove-invalid", ""]])"), std::vector<uint32_t>{});
}

TEST(LiveEdit, DeletesAndLocksSelections) {
    const auto edit = [](const std::string& edits, const std::vector<bool>& frozen = {}) {
        return cli::live_edit(splats_in_a_row(), frozen, "{\"edits\": " + edits + "}");
    };
    const SplatEdit deleted = edit(R"([["select", "x=2.."], ["select", "remove:x=4.."], ["delete"]])");
    EXPECT_EQ(deleted.remove, (std::vector<uint32_t>{2, 3}));
    EXPECT_EQ(edit(R"([["remove", "x=4.."]])").remove, std::vector<uint32_t>{4});
    const SplatEdit locked = edit(R"([["select", "x=..1"], ["lock"], ["select", "invert"], ["delete", ""]])");
    EXPECT_EQ(locked.freeze, (std::vector<uint32_t>{0, 1}));
    EXPECT_EQ(locked.remove, (std::vector<uint32_t>{2, 3, 4}));
    const std::vector<bool> all(5, true);
    EXPECT_EQ(edit(R"([["unlock"], ["select", "x=..0"], ["lock"]])", all).unfreeze,
              (std::vector<uint32_t>{1, 2, 3, 4}));
}

/// An edit begins with the splats that earlier ones have frozen.
TEST(LiveEdit, LeavesFrozenSplats) {
    const auto edit = [](const std::string& edits) {
        return cli::live_edit(splats_in_a_row(), {false, true, false, true, false},
                              "{\"edits\": " + edits + "}");
    };
    const SplatEdit deleted = edit(R"([["select", "x=1.."], ["delete"]])");
    EXPECT_EQ(deleted.remove, (std::vector<uint32_t>{2, 4}));
    EXPECT_TRUE(deleted.freeze.empty() && deleted.unfreeze.empty());
    const SplatEdit more = edit(R"([["select", "x=..1"], ["lock"]])");
    EXPECT_EQ(more.freeze, std::vector<uint32_t>{0}) << "the others are frozen, or not selected";
    const SplatEdit freed = edit(R"([["unlock"], ["select", "x=3.."], ["delete"]])");
    EXPECT_EQ(freed.unfreeze, std::vector<uint32_t>{1}) << "no other was frozen";
    EXPECT_EQ(freed.remove, (std::vector<uint32_t>{3, 4}));
    EXPECT_EQ(edit(R"([["where", "x=..2"]])").remove, (std::vector<uint32_t>{3, 4})) << "filters take all";
}

TEST(LiveEdit, RefusesOtherTexts) {
    for (const auto& [body, part] : std::vector<std::pair<std::string, std::string>>{
             {"", "the edit"},
             {"{}", "edits"},
             {R"({"edits": []})", "edits"},
             {R"({"edits": [["where"]]})", "--where"},
             {R"({"edits": [["adjust", "opacity=0.5"]]})", "--adjust"},
             {R"({"edits": [["where", 3]]})", "edits"},
             {R"({"edits": [["dance", ""]]})", "--dance"},
             {R"({"edits": [["where", "x"]]})", "--where"},
             {R"({"edits": [["where", "views=2.."]]})", "views"},
             {R"({"edits": [["decimate", "50%"]]})", "--decimate"},
             {R"({"edits": [["transform", "move=1,0,0"]]})", "--transform"}})
        expect_error<InputError>([&] { cli::live_edit(splats_in_a_row(), {}, body); }, {part});
}

TEST(EditQueue, AnswersWhateverAnEditThrows) {
    live::EditQueue queue;
    const auto refusal = [&](const auto& perform) {
        auto answer = std::async([&] { return queue.ask("body", std::chrono::minutes(1)); });
        try {
            while (!queue.perform(perform)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        } catch (...) {
            queue.stop();  // ends the wait
            EXPECT_TRUE(answer.get()) << "nothing was answered";
            throw;
        }
        const auto outcome = answer.get();
        return outcome ? outcome->refusal : "nothing was answered";
    };
    EXPECT_EQ(refusal([](const std::string&) -> live::EditReply { throw InputError("not\nthis"); }),
              "not this");
    EXPECT_EQ(refusal([](const std::string&) -> live::EditReply { throw std::length_error("too long"); }),
              "the edit failed: too long");
    EXPECT_EQ(queue.performed(), 0u);
    EXPECT_EQ(refusal([](const std::string&) { return live::EditReply(); }), "");
    EXPECT_EQ(queue.performed(), 1u);
    EXPECT_THROW(refusal([](const std::string&) -> live::EditReply { throw RunError("no device"); }),
                 RunError);
}

}  // namespace
}  // namespace ewa::test
