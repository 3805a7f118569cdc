// SPDX-License-Identifier: Apache-2.0
// Journals of edits: what is read back, saves, versions of the file, locks, and files that cannot be written.
#include <gtest/gtest.h>

#include <chrono>
#include <memory>

#include "edit/journal.h"
#include "ewa/error.h"
#include "support/file_limit.h"
#include "support/temp_folder.h"

namespace {

using namespace ewa;
using namespace ewa::edit;
using test::expect_error;

Step doing(std::vector<Words> edits) {
    return {"Step", std::move(edits)};
}

Step choosing(const std::string& shape) {
    return doing({{"select", shape}});
}

TEST(Journal, IsReadBackUpToWhatACrashCutOff) {
    const test::TempFolder folder;
    const auto file = folder / "a.ply.edits";
    EXPECT_EQ(journal_of(folder / "a.ply"), file);
    const JournalHead head{"a.ply", 300};
    const Step first = choosing("x=0.."), second = doing({{"delete", ""}}), third = choosing("all");
    {
        Journal journal(file, head, false);
        journal.did(first);
        journal.did(second);
        journal.undid();
        journal.did(third);
        journal.undid();
        journal.redid();
    }
    const ReadJournal read = read_journal(file);
    EXPECT_EQ(read.head, head);
    EXPECT_EQ(read.steps, (std::vector<Step>{first, third}));
    folder.write("a.ply.edits", test::file_bytes(file) + "{\"step\":\"De");
    EXPECT_EQ(read_journal(file).steps.size(), 2u);
    {
        Journal journal(file, head, true);
        journal.did(second);
    }
    EXPECT_EQ(read_journal(file).steps, (std::vector<Step>{first, third, second}));
    EXPECT_EQ(edits_of_journal(file).size(), 3u);
}

TEST(Journal, KnowsWhatIsSaved) {
    const test::TempFolder folder;
    const auto file = folder / "a.ply.edits";
    const Step all = choosing("all"), none = choosing("none"), remove = doing({{"delete", ""}});
    const auto unsaved = [&] { return read_journal(file).unsaved(); };
    Journal journal(file, {"a.ply", 3}, false);
    journal.did(all);
    EXPECT_FALSE(unsaved()) << "a selection is no work";
    journal.did(remove);
    EXPECT_TRUE(unsaved());
    journal.saved();
    EXPECT_FALSE(unsaved());
    journal.did(none);
    EXPECT_FALSE(unsaved());
    journal.did(remove);
    EXPECT_TRUE(unsaved());
    for (int i = 0; i < 2; ++i) journal.undid();
    EXPECT_FALSE(unsaved()) << "undone to what was saved";
    journal.undid();
    EXPECT_TRUE(unsaved()) << "undone after the save";
    journal.undid();
    journal.did(none);
    journal.did(remove);
    EXPECT_TRUE(unsaved()) << "another selection was deleted";
    EXPECT_EQ(edits_of_journal(file).size(), 2u);
}

TEST(Journal, OfASeparatedSceneKeepsWhereItBegan) {
    const test::TempFolder folder;
    const auto file = journal_of(folder / "a.ply", 2);
    EXPECT_EQ(file, folder / "a.ply.2.edits");
    {
        Journal journal(file, {"a.ply", 3}, false);
        journal.did(choosing("all"));
        journal.separated(5);
        journal.did(doing({{"delete", ""}}));
        journal.undid();
    }
    EXPECT_EQ(read_journal(file).separated, 1u);
    EXPECT_EQ(read_journal(file).separated_at, 5u);
    folder.write("a.ply.2.edits", test::file_bytes(file) + "{\"undo\":1}\n");
    expect_error<InputError>([&] { read_journal(file); }, {"line 6: there is nothing to undo"});
}

TEST(Journal, OfAnotherVersionOfTheFileIsKnown) {
    const test::TempFolder folder;
    const auto file = folder.write("a.ply", "splats");
    const auto journal = journal_of(file);
    const JournalHead head = head_of(file, 3);
    EXPECT_EQ(head.bytes, 6u);
    Journal(journal, head, false).did(choosing("all"));
    EXPECT_EQ(read_journal(journal).head, head);
    EXPECT_TRUE(same_version(head, head_of(file, 3)));
    EXPECT_FALSE(same_version(head, head_of(file, 4)));
    EXPECT_TRUE(same_version({"b.ply", 3}, head)) << "a head without a version";
    folder.write("a.ply", "others");
    std::filesystem::last_write_time(file,
                                     std::filesystem::last_write_time(file) + std::chrono::nanoseconds(4000));
    EXPECT_FALSE(same_version(head, head_of(file, 3)));
    EXPECT_TRUE(journal_remarks(journal, 3).empty());
    EXPECT_EQ(journal_remarks(journal, 4).size(), 1u);
}

TEST(Journal, IsOfOneWindowAtATime) {
    const test::TempFolder folder;
    const auto file = folder / "a.ply.edits";
    EXPECT_FALSE(in_use(file));
    auto journal = std::make_unique<Journal>(file, JournalHead{"a.ply", 3}, false);
    journal->did(choosing("all"));
    EXPECT_TRUE(in_use(file));
    for (const bool go_on : {false, true})
        expect_error<RunError>([&] { Journal(file, {"a.ply", 3}, go_on); }, {"another window"});
    EXPECT_EQ(read_journal(file).steps.size(), 1u);
    journal.reset();
    EXPECT_FALSE(in_use(file));
    Journal(file, {"a.ply", 3}, false).did(choosing("none"));
    EXPECT_EQ(read_journal(file.string() + ".before").steps, std::vector<Step>{choosing("all")});
}

TEST(Journal, OfANameThatIsNoUtf8IsWritten) {
    const test::TempFolder folder;
    const auto file = folder / "a.edits";
    Journal(file, {"\xff.ply", 3}, false).did(choosing("all"));
    EXPECT_EQ(read_journal(file).steps.size(), 1u);
}

TEST(Journal, ThatCannotBeWrittenKeepsItsWholeLines) {
    const test::TempFolder folder;
    const auto file = folder / "a.edits";
    if (!test::FileLimit::exists()) GTEST_SKIP() << "no limit on the size of files";
    Journal journal(file, {"a.ply", 3}, false);
    journal.did(choosing("all"));
    const std::string whole = test::file_bytes(file);
    {
        const test::FileLimit full(whole.size() + 9);
        EXPECT_THROW(journal.did(choosing("none")), RunError);
    }
    journal.did(choosing("invert"));
    EXPECT_EQ(test::file_bytes(file), whole) << "no line follows one that is missing";
    journal.saved();
    EXPECT_FALSE(std::filesystem::exists(file)) << "its last edits are missing, and saved";
}

TEST(Journal, NamesTheLineThatIsDamaged) {
    const test::TempFolder folder;
    const std::string head = "{\"ewa_edits\":1,\"file\":\"a\",\"splats\":3}\n";
    const auto error_of = [&](const std::string& text) {
        const auto file = folder.write("j.edits", text);
        expect_error<InputError>([&] { edits_of_journal(file); }, {"j.edits"});
    };
    error_of("");
    error_of("{\"ewa_edits\":2,\"file\":\"a\",\"splats\":3}\n");
    error_of(head + "{\"undo\":1}\n");
    error_of(head + "{\"step\":\"x\",\"edits\":[[]]}\n");
    error_of(head + "{\"step\":\"x\",\"edits\":[[\"select\",1]]}\n");
    error_of(head + "{\"step\":\"x\",\"edits\":[[\"glow\"]]}\n");
    error_of(head + "nonsense\n");
    const auto line_three = [&](const std::string& text) {
        const auto file = folder.write("j.edits", head + "{\"saved\":1}\n" + text);
        expect_error<InputError>([&] { read_journal(file); }, {"j.edits: line 3: "});
    };
    line_three("{\"step\":\"x\",\"edits\":[[\"delete\",\"junk\"]]}\n");
    line_three("{\"step\":\"x\",\"edits\":[[\"select\",\"junk\"]]}\n");
    EXPECT_TRUE(edits_of_journal(folder.write("j.edits", head + "\n \n")).empty());
    EXPECT_FALSE(read_journal(folder / "j.edits").cut_off);
    folder.write("j.edits", head + "{\"step\":\"x\",\"edits\":[[\"delete\"]]}");
    EXPECT_TRUE(read_journal(folder / "j.edits").cut_off);
}

}  // namespace
