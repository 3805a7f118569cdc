// SPDX-License-Identifier: Apache-2.0
// One process at a time in a folder.
#pragma once
#include <filesystem>

namespace ewa::core {

/// Holds the folder until it is destroyed or the process ends, however it ends; nothing is left on disk.
/// Throws RunError where another process holds it. A file system that knows no locks locks nothing.
class FolderLock {
  public:
    explicit FolderLock(const std::filesystem::path& folder);
    ~FolderLock();
    FolderLock(const FolderLock&) = delete;
    FolderLock& operator=(const FolderLock&) = delete;

  private:
    int descriptor_ = -1;
};

}  // namespace ewa::core
