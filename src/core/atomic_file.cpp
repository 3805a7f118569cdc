// SPDX-License-Identifier: Apache-2.0
#include "core/atomic_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <string>
#include <utility>

#include "core/text.h"
#include "ewa/error.h"

namespace ewa::core {
namespace {

/// An existing temporary file, for signal handlers. Further files and longer names are not recorded.
struct Unfinished {
    enum State { free, being_named, named };
    std::atomic<int> state{free};
    char path[1024] = {};
};
Unfinished unfinished[8];
static_assert(std::atomic<int>::is_always_lock_free);

int list_unfinished(const std::filesystem::path& path) {
    for (int i = 0; i < int(std::size(unfinished)); ++i) {
        int expected = Unfinished::free;
        if (path.native().size() >= sizeof(unfinished[i].path)) break;
        if (!unfinished[i].state.compare_exchange_strong(expected, Unfinished::being_named)) continue;
        std::strcpy(unfinished[i].path, path.c_str());
        unfinished[i].state = Unfinished::named;
        return i;
    }
    return -1;
}

/// Whether the link is a stranger's, in a folder like /tmp, where all may create files. Linux does not follow such links
/// with fs.protected_symlinks, but that rule does not reach a path that the program resolves.
bool is_strangers_link(const std::filesystem::path& link) {
    struct stat of_link {
    }, folder{};
    const std::filesystem::path above = link.parent_path();
    if (lstat(link.c_str(), &of_link) != 0 || !S_ISLNK(of_link.st_mode)) return false;
    if (stat(above.empty() ? "." : above.c_str(), &folder) != 0) return false;
    const bool shared = (folder.st_mode & S_ISVTX) != 0 && (folder.st_mode & S_IWOTH) != 0;
    return shared && of_link.st_uid != geteuid() && of_link.st_uid != folder.st_uid;
}

}  // namespace

void remove_unfinished_files() noexcept {
    for (const Unfinished& one : unfinished)
        if (one.state == Unfinished::named) unlink(one.path);
}

void fail_to_write(const std::filesystem::path& path, const char* doing, int reason) {
    const std::string text = one_line(path.string()) + ": " + doing + ": " + std::strerror(reason);
    if (reason == ENOSPC || reason == EDQUOT || reason == EFBIG) throw FullDisk(text);
    throw RunError(text);
}

void AtomicFile::fail(const char* doing) const {
    fail_to_write(target_, doing, errno);
}

AtomicFile::AtomicFile(const std::filesystem::path& path, Readers readers) : target_(path) {
    if (path.filename().empty() || path.filename() == "." || path.filename() == "..")
        throw RunError(one_line(path.string()) + ": cannot be written: it names a folder");
    std::error_code ignored;
    if (readers == Readers::usual && is_strangers_link(path))
        throw RunError(one_line(path.string()) +
                       ": cannot be written: it is another user's link in a folder that all may write");
    if (readers == Readers::usual && std::filesystem::is_symlink(path, ignored)) {
        const std::filesystem::path resolved = std::filesystem::weakly_canonical(path, ignored);
        if (!resolved.empty()) target_ = resolved;
    }
    struct stat existing {};
    const bool exists = readers == Readers::usual && stat(target_.c_str(), &existing) == 0;
    if (exists && !S_ISREG(existing.st_mode))
        throw RunError(one_line(path.string()) + ": cannot be written: it exists and is not a regular file");

    // The name does not contain the target's, which may have the maximum length already.
    static std::atomic<unsigned> counter{0};
    do {
        temporary_ = target_.parent_path() /
                     (".ewa-" + std::to_string(getpid()) + "-" + std::to_string(counter++) + ".tmp");
        descriptor_ = open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC,
                           readers == Readers::owner ? 0600 : 0666);
    } while (descriptor_ < 0 && errno == EEXIST);
    if (descriptor_ < 0) fail("cannot be written");
    flock(descriptor_, LOCK_EX | LOCK_NB);  // for remove_abandoned_files(); a file system may have no locks
    listed_ = list_unfinished(temporary_);
    // A file system without permissions is no error.
    if (exists && fchmod(descriptor_, existing.st_mode & 07777) != 0) errno = 0;
}

AtomicFile::~AtomicFile() {
    if (descriptor_ >= 0) close(descriptor_);
    if (!temporary_.empty()) unlink(temporary_.c_str());
    if (claimed_) unlink(target_.c_str());
    if (listed_ >= 0) unfinished[listed_].state = Unfinished::free;
}

void AtomicFile::write(const void* bytes, size_t count) {
    const char* next = static_cast<const char*>(bytes);
    while (count > 0) {
        const ssize_t written = ::write(descriptor_, next, count);
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) fail("cannot be written");
        next += written;
        count -= static_cast<size_t>(written);
    }
}

bool AtomicFile::claim(const std::filesystem::path& name) {
    const int file = open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file < 0 && errno == EEXIST) return false;
    if (claimed_) unlink(target_.c_str());
    claimed_ = false;
    target_ = name;
    if (file < 0) fail("cannot be written");
    close(file);
    claimed_ = true;
    return true;
}

void AtomicFile::commit() {
    // Network and quota file systems may report a full disk only here.
    if (fsync(descriptor_) != 0 && errno != EINVAL && errno != EROFS) fail("cannot be written to disk");
    if (close(std::exchange(descriptor_, -1)) != 0) fail("cannot be written to disk");
    if (rename(temporary_.c_str(), target_.c_str()) != 0) fail("cannot be put in place");
    temporary_.clear();
    claimed_ = false;
    // The directory holds the new name. The file itself is on disk already, so a failure is no error.
    const std::filesystem::path parent = target_.has_parent_path() ? target_.parent_path() : ".";
    const int directory = open(parent.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (directory >= 0) {
        fsync(directory);
        close(directory);
    }
}

void write_text_file(const std::filesystem::path& path, std::string_view text, AtomicFile::Readers readers) {
    AtomicFile file(path, readers);
    file.write(text);
    file.commit();
}

namespace {

/// Whether nobody holds the lock of AtomicFile. A process of another container has a number that says nothing here.
bool is_unlocked(const std::filesystem::path& file) {
    const int descriptor = open(file.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (descriptor < 0) return true;
    const bool unlocked = flock(descriptor, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
    close(descriptor);
    return unlocked;
}

}  // namespace

void remove_abandoned_files(const std::filesystem::path& folder) {
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
        const std::string name = entry.path().filename().string();
        int process = 0, used = 0;
        unsigned number = 0;
        if (std::sscanf(name.c_str(), ".ewa-%9d-%9u.tmp%n", &process, &number, &used) != 2 ||
            size_t(used) != name.size() || process <= 0)
            continue;
        if (kill(process, 0) != 0 && errno == ESRCH && is_unlocked(entry.path()))
            unlink(entry.path().c_str());
    }
}

}  // namespace ewa::core
