// SPDX-License-Identifier: Apache-2.0
// Zip archives in memory.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

namespace ewa::io {

/// Reads the entries of an archive. The whole file is in memory. Nothing is ever written to disk, so the names
/// of entries cannot lead anywhere.
class ArchiveReader {
  public:
    /// Throws InputError if the file is not a zip archive or its directory is damaged.
    explicit ArchiveReader(const std::filesystem::path& path);
    ~ArchiveReader();
    ArchiveReader(const ArchiveReader&) = delete;
    ArchiveReader& operator=(const ArchiveReader&) = delete;

    uint64_t bytes() const;  // of the archive

    /// The name of the first entry of the directory. Throws InputError without one.
    std::string first_entry() const;

    /// The content of the entry with this name. Throws InputError without such an entry, or if it unpacks to more
    /// than `most` bytes.
    std::string read(const std::string& entry, uint64_t most) const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Collects entries and gives the archive. Entries are stored, without the time, so that the same entries
/// give the same bytes.
class ArchiveWriter {
  public:
    ArchiveWriter();
    ~ArchiveWriter();
    ArchiveWriter(const ArchiveWriter&) = delete;
    ArchiveWriter& operator=(const ArchiveWriter&) = delete;

    /// The content begins at a multiple of `alignment` bytes of the archive, at most 64.
    void add(const std::string& entry, const std::string& bytes, size_t alignment = 1);
    std::string finish();  // call once, last

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace ewa::io
