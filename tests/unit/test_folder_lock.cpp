// SPDX-License-Identifier: Apache-2.0
// One holder of a folder at a time; whoever ends lets go.
#include "core/folders.h"

#include <optional>

#include "support/temp_folder.h"

namespace {

using namespace ewa;
using test::expect_error;

TEST(FolderLock, OneAtATime) {
    const test::TempFolder folder, other;
    std::optional<core::FolderLock> first(folder.path());
    expect_error<RunError>([&] { core::FolderLock second(folder.path()); },
                           {folder.path().string(), "another process uses this folder"});
    const core::FolderLock elsewhere(other.path());
    first.reset();
    const core::FolderLock third(folder.path());
    EXPECT_EQ(test::files_in(folder.path()), 0u);
}

TEST(FolderLock, WhatCannotBeLockedLocksNothing) {
    const test::TempFolder folder;
    const core::FolderLock absent(folder / "absent");
}

}  // namespace
