// SPDX-License-Identifier: Apache-2.0
// Files that are there whole or not at all.
#pragma once
#include <cstddef>
#include <filesystem>
#include <string_view>

namespace ewa::core {

/// Writes beside the path, in the same directory, and takes the path's place when commit() is called: until
/// then, and whenever something fails, the path keeps what it held. The temporary is removed by the
/// destructor. Throws RunError that names the path and the system's reason (a full disk is found at write,
/// fsync or close). An existing target keeps its permissions; a symbolic link is followed; a target that is
/// no regular file is refused.
class AtomicFile {
  public:
    /// Who may read a file: whoever the user's umask or the file that was there lets, or the owner alone;
    /// what is for the owner alone takes a symbolic link's place instead of following it.
    enum class Readers { usual, owner };

    explicit AtomicFile(const std::filesystem::path& path, Readers readers = Readers::usual);
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    void write(const void* bytes, size_t count);
    void write(std::string_view text) { write(text.data(), text.size()); }

    /// Everything on disk, then the rename. Call once, last.
    void commit();

  private:
    [[noreturn]] void fail(const char* doing) const;

    std::filesystem::path target_, temporary_;
    int descriptor_ = -1;
    int listed_ = -1;  // for remove_unfinished_files()
};

/// The file becomes `text`, or stays as it was and RunError is thrown.
void write_text_file(const std::filesystem::path& path, std::string_view text,
                     AtomicFile::Readers readers = AtomicFile::Readers::usual);

/// Removes what is written beside its place at this moment: for the handler of a signal that ends the
/// program, in which no destructor runs. Takes no lock and no memory.
void remove_unfinished_files() noexcept;

/// Removes from a folder what processes that were killed while they wrote have left there (names as
/// AtomicFile gives them, of a process that is no more). What cannot be removed stays.
void remove_abandoned_files(const std::filesystem::path& folder);

}  // namespace ewa::core
