// SPDX-License-Identifier: Apache-2.0
// Folders with the parts of a file that names them: the tiles of a tileset.json, the chunks of a lod-meta.json. Each writing has new
// folders, so that the rename of the naming file replaces everything at once, and several processes may write side by side.
// A folder holds the file kUnfinished until its naming file is in place. Only folders with this mark, and parts that a replaced
// file of ewa's names, are ever removed.
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/folders.h"
#include "io/splats/value_files.h"

namespace ewa::io {

inline constexpr const char* kUnfinished = ".ewa-unfinished";

struct PartKind {
    Paths (*named_by)(const std::filesystem::path& naming);  // parts that exist
    /// Whether ewa makes folders and files with such a name.
    bool (*is_folder)(std::string_view name);
    bool (*is_part)(const std::filesystem::path& file);
};

/// Whether the text is two numbers with _ between them.
bool is_pair_of_numbers(std::string_view text);

class PartFolders {
  public:
    PartFolders(const std::filesystem::path& naming, const PartKind& kind);
    /// Removes the new folders unless replace() was called.
    ~PartFolders();
    PartFolders(const PartFolders&) = delete;
    PartFolders& operator=(const PartFolders&) = delete;

    /// Makes a folder with the first name that does not exist: `usual`, then with -2, -3 and so on. Returns the name.
    std::string add(const std::string& usual);

    /// Writes the naming file. Then removes the parts of the replaced naming file, and folders that killed processes left. Keeps
    /// folders that a .json beside them names.
    void replace(std::string_view text);

  private:
    bool is_new(const std::string& name) const;
    void clear(const std::filesystem::path& folder) const;
    void remove_others(const Paths& before) const;

    std::filesystem::path naming_, above_;
    PartKind kind_;
    std::vector<std::string> names_;
    std::unique_ptr<core::FolderLock> lock_;  // of the first folder, whose name is in all marks
};

}  // namespace ewa::io
