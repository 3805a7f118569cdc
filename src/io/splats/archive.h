// SPDX-License-Identifier: Apache-2.0
// Writes zip archives in memory; zip_files.h reads them.
#pragma once
#include <cstdint>
#include <memory>
#include <string>

namespace ewa::io {

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
