// SPDX-License-Identifier: Apache-2.0
// Files that exist completely or not at all.
#pragma once
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

#include "ewa/error.h"
#include "platform/file.h"

namespace ewa::core {

/// A write failed because the disk, a quota or a limit of the file's size is full.
class FullDisk : public RunError {
  public:
    using RunError::RunError;
};

/// Throws FullDisk or RunError for a file that cannot be written. doing: the operation that failed. reason: the system's.
[[noreturn]] void fail_to_write(const std::filesystem::path& path, const char* doing,
                                const std::error_code& reason);

/// Writes a temporary file in the same directory, which commit() renames to the path. Until then, and after
/// any failure, the path keeps its content. The destructor removes the temporary file. Throws RunError that
/// names the path and the system's reason; a full disk shows at write, fsync or close. An existing target
/// keeps its permissions. A symbolic link is followed, but refused if it is another user's in a folder like /tmp. A target
/// that is not a regular file is refused.
class AtomicFile {
  public:
    /// usual: the umask or the existing file decides who may read. owner: only the owner may, and a symbolic
    /// link is replaced instead of followed.
    enum class Readers { usual, owner };

    explicit AtomicFile(const std::filesystem::path& path, Readers readers = Readers::usual);
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    void write(const void* bytes, size_t count);
    void write(std::string_view text) { write(text.data(), text.size()); }

    /// Makes commit() rename to `name`, in the same folder, instead of the path. Reserves this name by an empty file. False if
    /// a file of this name exists already. So only one of several processes gets the name.
    bool claim(const std::filesystem::path& name);

    /// Flushes everything to disk, then renames. Call once, last.
    void commit();

  private:
    void check(const std::error_code& error, const char* doing) const;

    std::filesystem::path target_, temporary_;
    platform::File file_;
    int listed_ = -1;  // for remove_unfinished_files()
    bool claimed_ = false;
};

/// An AtomicFile that is written value by value, in the machine's byte order.
class BinaryFile {
  public:
    explicit BinaryFile(const std::filesystem::path& path) : file_(path) {}
    template <class... Values>
    void add(const Values&... values) {
        (file_.write(&values, sizeof(values)), ...);
    }
    /// Writes the text and a zero byte.
    void add_text(const std::string& text) { file_.write(text.c_str(), text.size() + 1); }
    void commit() { file_.commit(); }

  private:
    AtomicFile file_;
};

/// Replaces the content of a file. On failure, throws RunError and the file keeps its content.
void write_text_file(const std::filesystem::path& path, std::string_view text,
                     AtomicFile::Readers readers = AtomicFile::Readers::usual);

/// Removes all current temporary files. It is for a signal handler that ends the program without destructors.
/// It uses neither locks nor memory allocation.
void remove_unfinished_files() noexcept;

/// Removes the temporary files that killed processes left in a folder. Their names have AtomicFile's form and
/// the number of a process that no longer exists, and no process has them locked. Failures are ignored.
void remove_abandoned_files(const std::filesystem::path& folder);

}  // namespace ewa::core
