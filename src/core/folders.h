// SPDX-License-Identifier: Apache-2.0
// Folders: tests for files and folders, creation, a lock between processes, and temporary folders.
#pragma once
#include <filesystem>
#include <string>

#include "platform/file.h"

namespace ewa::core {

/// Whether the path is a regular file (is_file), or a folder (is_folder). False on any error.
bool is_file(const std::filesystem::path& path);
bool is_folder(const std::filesystem::path& path);

/// Whether a desktop or a server has made the file, or a folder above it. Their names begin with a dot, or are __MACOSX, @eaDir,
/// Thumbs.db or desktop.ini. name: the file's path relative to the user's folder.
bool is_of_desktop(const std::filesystem::path& name);

/// The path relative to the folder, with / between its parts on every system: as names inside files are written.
std::filesystem::path inside(const std::filesystem::path& path, const std::filesystem::path& folder);

/// Creates the folder and its parents. An empty path names no folder. Throws RunError if the folder cannot be
/// created, or if the path names something else.
void make_folder(const std::filesystem::path& folder);

/// A word that begins with ~/, or --option=~/, with the user's home folder in place of ~: shells expand neither a quoted ~
/// nor one behind =. Other words, and all where the user has no home folder, stay as they are.
std::string with_home(const std::string& word);

/// Locks a folder until the object or the process ends. Nothing is left on disk. Throws RunError if another
/// process holds the lock. On a file system without locks, this does nothing.
class FolderLock {
  public:
    explicit FolderLock(const std::filesystem::path& folder);

  private:
    platform::File held_;
};

/// Locks the existing file of this name until the object or the process ends, for who replaces it. Waits while another process has
/// the lock, at most a minute. Nothing is left on disk. Where there is no such file, or the file system has no locks, this does
/// nothing.
class FileLock {
  public:
    explicit FileLock(const std::filesystem::path& file);
    /// Whether another process had the lock for the whole minute.
    bool is_others() const { return is_others_; }

  private:
    platform::File held_;
    bool is_others_ = false;
};

/// A new folder in the system's folder for temporary files. The destructor removes it with its contents.
class TemporaryFolder {
  public:
    /// The folder's name begins with `prefix`. Throws RunError.
    explicit TemporaryFolder(const std::string& prefix);
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
};

}  // namespace ewa::core
