// SPDX-License-Identifier: Apache-2.0
// Files by the system's own calls: with locks, flushed to disk, and without text conversion. Errors are the system's.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

namespace ewa::platform {

enum class Open {
    read,
    edit,          // for reading and writing; created where it does not exist
    create,        // for writing, or reading and writing; it must not exist
    create_owned,  // as create; only this user may read it. Windows: the folder decides who may
    append         // every write goes to the end; created where it does not exist
};

enum class Lock {
    locked,
    taken,
    unknown
};  // taken: by another open file. unknown: a file system has no locks

/// An open file, or one end of a pipe. Programs that this process starts do not get it, but by Streams. Other processes may read,
/// rename and remove the file meanwhile.
class File {
  public:
    File() = default;
    explicit File(std::intptr_t handle) : handle_(handle) {}
    ~File() { close(); }
    File(File&& other) noexcept : handle_(std::exchange(other.handle_, kClosed)) {}
    File& operator=(File&& other) noexcept;

    /// Closes what was open.
    std::error_code open(const std::filesystem::path& path, Open how);
    bool is_open() const { return handle_ != kClosed; }
    /// Network and quota file systems may report a full disk only here.
    std::error_code close();

    /// got: how many bytes came, at most `size`; 0 at the end of the file, or of the pipe.
    std::error_code read(void* bytes, size_t size, size_t& got);
    /// Writes all.
    std::error_code write(const void* bytes, size_t size);
    std::error_code size(uint64_t& bytes) const;
    std::error_code go_to(uint64_t offset);
    std::error_code skip(uint64_t bytes);
    /// Flushes the content to the disk. No error where a file system cannot.
    std::error_code flush();
    /// Gives the file the permissions of another one. Windows: those stay that the folder gave.
    std::error_code permit_as(const std::filesystem::path& other);
    /// Locks the file until it is closed, if nobody has it locked. Reading it needs no lock.
    Lock try_lock();

    std::intptr_t handle() const { return handle_; }

  private:
    static constexpr std::intptr_t kClosed = -1;
    std::intptr_t handle_ = kClosed;
};

/// Whether another open file locks this one.
bool is_locked(const std::filesystem::path& path);

/// Locks the file or folder of this name until `held` is closed. Others may read, rename and replace it; who has replaced it
/// meanwhile makes this `taken`. Nothing is left on disk. Windows: processes of other machines do not see the lock.
Lock lock_path(const std::filesystem::path& path, File& held);

/// Renames a file. A file of the new name is replaced in one step. Windows: where others have it open, on NTFS alone, elsewhere an
/// error.
std::error_code replace(const std::filesystem::path& from, const std::filesystem::path& to);

/// Flushes the names in a folder to the disk, where the system can. Failures are ignored.
void flush_folder(const std::filesystem::path& folder);

/// Removes a file. It uses neither locks nor memory allocation, so signal handlers may call it.
void remove_now(const std::filesystem::path::value_type* path) noexcept;

/// What is the same for two paths of one file or folder, hard links too, and differs for all others.
struct FileId {
    uint64_t device = 0, number = 0;
    auto operator<=>(const FileId&) const = default;
};
std::optional<FileId> file_id(const std::filesystem::path& path);

/// Whether the link is a stranger's, in a folder like /tmp, where all may create files. Windows: never, since only
/// administrators create links there.
bool is_strangers_link(const std::filesystem::path& link);

/// The reason why no file can be created in the folder, or none.
std::error_code refuses_files(const std::filesystem::path& folder);

/// Makes `link` show the folder `target`, whose path is relative to the folder of the link, or absolute. Windows: its files appear
/// as hard links, since links to folders need rights there; elsewhere: what becomes of a target on another disk.
enum class Elsewhere { refused, copied };
std::error_code link_folder(const std::filesystem::path& target, const std::filesystem::path& link,
                            Elsewhere elsewhere = Elsewhere::refused);

/// Whether the system can have files of this name, and takes it for nothing else. Windows: names such as NUL are devices, a colon
/// begins a stream, and dots and blanks at the end are lost.
bool can_name_files(const std::filesystem::path& name);

/// A new folder, for this user alone, in the system's folder for temporary files. Its name begins with `prefix`. path: where it is,
/// or would have been.
std::error_code make_temporary_folder(const char* prefix, std::filesystem::path& path);

/// A stream of C that reads the file, or bytes that live as long. Its bytes are as they are. Null, and errno, if it cannot.
std::FILE* open_stream(const std::filesystem::path& path);
std::FILE* stream_of(const void* bytes, size_t size);

/// Whether the error means a full disk, a quota, or the limit of a file's size.
bool is_full(const std::error_code& error);

/// What discards everything that is written to it: /dev/null or NUL.
extern const char* const kNullFile;

/// A file that a File reads by its path while the object lives. Linux: in memory, without a name in any folder.
class PassingFile {
  public:
    PassingFile();
    std::error_code error() const { return error_; }  // of the constructor
    File& file() { return file_; }
    const std::filesystem::path& path() const { return path_; }

  private:
    File file_;
    std::filesystem::path path_;
    std::error_code error_;
};

}  // namespace ewa::platform
