// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <memory>
#include <vector>

#include "core/atomic_file.h"
#include "platform/file.h"
#include "support/file_limit.h"
#include "support/temp_folder.h"

namespace {

namespace fs = std::filesystem;
using namespace ewa;
using core::AtomicFile;
using test::expect_error;
using test::file_bytes;
using test::files_in;
using test::TempFolder;

TEST(AtomicFile, ReplacesOnlyAtCommit) {
    TempFolder folder;
    const auto path = folder.write("a.txt", "old");
    {
        AtomicFile file(path);
        file.write("new text");
        EXPECT_EQ(file_bytes(path), "old");
        file.commit();
        EXPECT_EQ(file_bytes(path), "new text");
    }
    EXPECT_EQ(file_bytes(path), "new text");
    EXPECT_EQ(files_in(folder.path()), 1u);
}

TEST(AtomicFile, LeavesNothingWithoutCommit) {
    TempFolder folder;
    { AtomicFile(folder / "a.txt").write("text"); }
    EXPECT_EQ(files_in(folder.path()), 0u);
}

TEST(AtomicFile, NamesPathAndReason) {
    TempFolder folder;
    expect_error<RunError>([&] { AtomicFile file(folder / "none" / "a.txt"); },
                           {"none/a.txt", "No such file or directory"});
    std::filesystem::create_directory(folder / "folder");
    expect_error<RunError>([&] { AtomicFile file(folder / "folder"); }, {"folder", "not a regular file"});
    expect_error<RunError>([&] { AtomicFile file(folder / ""); }, {"names a folder"});
    expect_error<RunError>([&] { AtomicFile file(platform::kNullFile); },
                           {platform::kNullFile, "not a regular file"});
}

// A limit on the size of files stands for the full disk: write returns an error in the same place.
TEST(AtomicFile, FailedWriteKeepsTheOldFile) {
    TempFolder folder;
    const auto path = folder.write("a.txt", "old");
    if (!test::FileLimit::exists()) GTEST_SKIP() << "no limit on the size of files";
    {
        const test::FileLimit small(1000);
        expect_error<RunError>([&] { core::write_text_file(path, std::string(5000, 'x')); },
                               {"a.txt", "File too large"});
    }
    EXPECT_EQ(file_bytes(path), "old");
    EXPECT_EQ(files_in(folder.path()), 1u);
}

TEST(AtomicFile, KeepsPermissionsAndFollowsLinks) {
    TempFolder folder;
    const auto path = folder.write("a.txt", "old");
    fs::permissions(path, fs::perms(0640));
    std::filesystem::create_symlink("a.txt", folder / "link");
    core::write_text_file(folder / "link", "new");
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
    EXPECT_EQ(file_bytes(path), "new");
    EXPECT_EQ(fs::status(path).permissions(), fs::perms(0640));
}

TEST(AtomicFile, ForTheOwnerAlone) {
    TempFolder folder;
    const auto path = folder.write("a.txt", "old"), others = folder.write("b.txt", "theirs");
    std::filesystem::create_symlink("b.txt", folder / "link");
    for (const auto& written : {path, folder / "link"}) {
        core::write_text_file(written, "secret", AtomicFile::Readers::owner);
        EXPECT_EQ(file_bytes(written), "secret");
        const fs::file_status status = fs::symlink_status(written);
        EXPECT_EQ(status.type(), fs::file_type::regular);
        EXPECT_EQ(status.permissions(), fs::perms(0600));
    }
    EXPECT_EQ(file_bytes(others), "theirs");
}

// More at a time than the list holds, over and over: each that is listed goes, no other file does.
TEST(AtomicFile, ASignalsHandlerRemovesWhatIsUnfinished) {
    TempFolder folder;
    for (int round = 0; round < 3; ++round) {
        core::write_text_file(folder / "whole.txt", "whole");
        {
            AtomicFile one(folder / "one.txt"), two(folder / "two.txt");
            one.write("text");
            EXPECT_EQ(files_in(folder.path()), 3u);
            core::remove_unfinished_files();
            EXPECT_EQ(files_in(folder.path()), 1u);
            std::vector<std::unique_ptr<AtomicFile>> many;
            for (int i = 0; i < 20; ++i)
                many.push_back(std::make_unique<AtomicFile>(folder / std::to_string(i)));
            core::remove_unfinished_files();
        }
        EXPECT_EQ(files_in(folder.path()), 1u);
    }
    EXPECT_EQ(file_bytes(folder / "whole.txt"), "whole");
}

TEST(AtomicFile, TakesTheLongestName) {
    TempFolder folder;
    const std::string name(255, 'n');
    core::write_text_file(folder / name, "text");
    EXPECT_EQ(file_bytes(folder / name), "text");
}

}  // namespace
