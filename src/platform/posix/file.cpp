// SPDX-License-Identifier: Apache-2.0
#include "platform/file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <string>

#include "platform/file_facts.h"

namespace ewa::platform {
namespace {

namespace fs = std::filesystem;

constexpr off_t kLockPlace = off_t(1) << 62;

std::error_code reason() {
    return {errno, std::generic_category()};
}

FileId id_of(const struct stat& status) {
    return {uint64_t(status.st_dev), uint64_t(status.st_ino)};
}

int flags_of(Open how) {
    switch (how) {
        case Open::read:
            return O_RDONLY;
        case Open::edit:
            return O_RDWR | O_CREAT;
        case Open::create:
        case Open::create_owned:
            return O_RDWR | O_CREAT | O_EXCL;
        case Open::append:
            return O_WRONLY | O_CREAT | O_APPEND;
    }
    return O_RDONLY;
}

}  // namespace

const char* const kNullFile = "/dev/null";

File& File::operator=(File&& other) noexcept {
    close();
    handle_ = std::exchange(other.handle_, kClosed);
    return *this;
}

std::error_code File::open(const fs::path& path, Open how) {
    close();
    handle_ = ::open(path.c_str(), flags_of(how) | O_CLOEXEC, how == Open::create_owned ? 0600 : 0666);
    return handle_ < 0 ? reason() : std::error_code();
}

std::error_code File::close() {
    const auto open = int(std::exchange(handle_, kClosed));
    return open >= 0 && ::close(open) != 0 ? reason() : std::error_code();
}

std::error_code File::read(void* bytes, size_t size, size_t& got) {
    ssize_t count = 0;
    do count = ::read(int(handle_), bytes, size);
    while (count < 0 && errno == EINTR);
    got = size_t(std::max<ssize_t>(count, 0));
    return count < 0 ? reason() : std::error_code();
}

std::error_code File::write(const void* bytes, size_t size) {
    for (const char* next = static_cast<const char*>(bytes); size > 0;) {
        const ssize_t count = ::write(int(handle_), next, size);
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) return count < 0 ? reason() : std::make_error_code(std::errc::io_error);
        next += count;
        size -= size_t(count);
    }
    return {};
}

std::error_code File::size(uint64_t& bytes) const {
    struct stat status {};
    if (fstat(int(handle_), &status) != 0) return reason();
    bytes = uint64_t(status.st_size);
    return {};
}

std::error_code File::go_to(uint64_t offset) {
    return lseek(int(handle_), off_t(offset), SEEK_SET) < 0 ? reason() : std::error_code();
}

std::error_code File::skip(uint64_t bytes) {
    return lseek(int(handle_), off_t(bytes), SEEK_CUR) < 0 ? reason() : std::error_code();
}

std::error_code File::flush() {
    return fsync(int(handle_)) != 0 && errno != EINVAL && errno != EROFS ? reason() : std::error_code();
}

std::error_code File::permit_as(const fs::path& other) {
    struct stat status {};
    if (stat(other.c_str(), &status) != 0) return reason();
    return fchmod(int(handle_), status.st_mode & 07777) != 0 ? reason() : std::error_code();
}

Lock File::try_lock() {
    if (flock(int(handle_), LOCK_EX | LOCK_NB) == 0) return Lock::locked;
    return errno == EWOULDBLOCK ? Lock::taken : Lock::unknown;
}

bool is_locked(const fs::path& path) {
    // Opening a named pipe would wait for a writer.
    const File file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
    return file.is_open() && flock(int(file.handle()), LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
}

Lock lock_path(const fs::path& path, File& held) {
    // A byte behind every end. Network file systems would keep others from reading a file that is locked whole, or lock none that is
    // open for reading alone. Opening a named pipe would wait for a writer.
    struct flock place {};
    place.l_type = F_WRLCK;
    place.l_whence = SEEK_SET;
    place.l_start = kLockPlace;
    place.l_len = 1;
    Lock lock = Lock::locked;
    held = File(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
    if (!held.is_open()) {  // a folder, or a file that this user may not write
        held = File(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
        lock = held.is_open() ? held.try_lock() : Lock::unknown;
    } else if (fcntl(int(held.handle()), F_OFD_SETLK, &place) != 0) {
        lock = errno == EAGAIN || errno == EACCES ? Lock::taken : Lock::unknown;
    }
    struct stat status {};
    if (lock != Lock::locked || (fstat(int(held.handle()), &status) == 0 && file_id(path) == id_of(status)))
        return lock;
    held.close();
    return Lock::taken;
}

std::error_code replace(const fs::path& from, const fs::path& to) {
    return rename(from.c_str(), to.c_str()) != 0 ? reason() : std::error_code();
}

void flush_folder(const fs::path& folder) {
    const File directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (directory.is_open()) fsync(int(directory.handle()));
}

void remove_now(const fs::path::value_type* path) noexcept {
    unlink(path);
}

std::optional<FileId> file_id(const fs::path& path) {
    struct stat status {};
    if (stat(path.c_str(), &status) != 0) return std::nullopt;
    return id_of(status);
}

fs::file_time_type write_time(const fs::path& file, std::error_code& error) {
    return fs::last_write_time(file, error);
}

fs::path::string_type folded(const fs::path& path) {
    return path.native();
}

// Linux does not follow such links with fs.protected_symlinks, but that rule does not reach a path that the program resolves.
bool is_strangers_link(const fs::path& link) {
    struct stat of_link {
    }, folder{};
    const fs::path above = link.parent_path();
    if (lstat(link.c_str(), &of_link) != 0 || !S_ISLNK(of_link.st_mode)) return false;
    if (stat(above.empty() ? "." : above.c_str(), &folder) != 0) return false;
    const bool shared = (folder.st_mode & S_ISVTX) != 0 && (folder.st_mode & S_IWOTH) != 0;
    return shared && of_link.st_uid != geteuid() && of_link.st_uid != folder.st_uid;
}

std::error_code refuses_files(const fs::path& folder) {
    return access(folder.c_str(), W_OK | X_OK) != 0 ? reason() : std::error_code();
}

std::error_code link_folder(const fs::path& target, const fs::path& link, Elsewhere) {
    return symlink(target.c_str(), link.c_str()) != 0 ? reason() : std::error_code();
}

bool can_name_files(const fs::path&) {
    return true;
}

std::error_code make_temporary_folder(const char* prefix, fs::path& path) {
    std::string name = (fs::temp_directory_path() / prefix).string() + "XXXXXX";
    const bool made = mkdtemp(name.data()) != nullptr;
    path = name;
    return made ? std::error_code() : reason();
}

std::FILE* open_stream(const fs::path& path) {
    return std::fopen(path.c_str(), "rbe");
}

// fmemopen takes a pointer to non-const, and does not write through it in mode r.
std::FILE* stream_of(const void* bytes, size_t size) {
    return fmemopen(const_cast<void*>(bytes), size, "r");
}

bool is_full(const std::error_code& error) {
    return error.value() == ENOSPC || error.value() == EDQUOT || error.value() == EFBIG;
}

PassingFile::PassingFile() : file_(memfd_create("ewa", MFD_CLOEXEC)) {
    if (!file_.is_open()) error_ = reason();
    path_ = "/proc/self/fd/" + std::to_string(file_.handle());
}

}  // namespace ewa::platform
