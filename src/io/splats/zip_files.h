// SPDX-License-Identifier: Apache-2.0
// Zip archives of whole folders: photos, a dataset, or splats. They come from strangers, so all entries are checked before one is
// written.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace ewa::io {

/// Whether the file's first bytes are those of a zip archive. False on any error.
bool is_zip(const std::filesystem::path& path);

/// The files of an archive, which is read from disk piece by piece.
class ZipFiles {
  public:
    struct Entry {
        std::filesystem::path name;  // normalised, relative, inside the folder
        uint64_t bytes = 0;          // unpacked
        uint64_t index = 0;          // among all entries
    };

    /// Throws InputError if the file is no zip archive or is damaged, and for an entry that is not a plain file or leads
    /// elsewhere or more than 64 folders deep. Also if the archive is encrypted, holds more than 100,000 entries, or would
    /// unpack to 200 times its size and 16 MiB more.
    explicit ZipFiles(const std::filesystem::path& path);
    ~ZipFiles();
    ZipFiles(const ZipFiles&) = delete;
    ZipFiles& operator=(const ZipFiles&) = delete;

    /// Without folders, and without the files that desktops add.
    const std::vector<Entry>& entries() const;
    uint64_t bytes() const;  // of all entries, unpacked

    /// Gives the content of an entry in pieces. Throws InputError if it is damaged.
    void read(const Entry& entry, const std::function<void(std::string_view)>& piece) const;

    /// The whole content of an entry. Throws as read does.
    std::string text(const Entry& entry) const;

    /// The first bytes of an entry, at most this many. Throws as read does.
    std::string head(const Entry& entry, size_t bytes) const;

    /// Writes all entries, or those that are wanted, into a new folder. progress(entries done) is called after each; false
    /// ends it, and the result is false. Throws InputError, RunError (disk).
    bool unpack(const std::filesystem::path& folder, const std::function<bool(int)>& progress,
                const std::function<bool(const Entry&)>& wanted = {}) const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// The text of an error with the archive and the entry in place of the folder where they were unpacked.
std::string named_in_archive(std::string text, const std::filesystem::path& unpacked,
                             const std::filesystem::path& archive);

/// Reads all entries and keeps nothing. Throws as they do.
uint64_t check_zip(const std::filesystem::path& path);

}  // namespace ewa::io
