// SPDX-License-Identifier: Apache-2.0
#include "core/atomic_file.h"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <iterator>
#include <string>

#include "core/text.h"
#include "ewa/error.h"
#include "platform/process.h"

namespace ewa::core {
namespace {

/// An existing temporary file, for signal handlers. Further files and longer names are not recorded.
struct Unfinished {
    enum State { free, being_named, named };
    std::atomic<int> state{free};
    std::filesystem::path::value_type path[1024] = {};
};
Unfinished unfinished[8];
static_assert(std::atomic<int>::is_always_lock_free);

int list_unfinished(const std::filesystem::path& path) {
    for (int i = 0; i < int(std::size(unfinished)); ++i) {
        int expected = Unfinished::free;
        if (path.native().size() >= std::size(unfinished[i].path)) break;
        if (!unfinished[i].state.compare_exchange_strong(expected, Unfinished::being_named)) continue;
        *std::ranges::copy(path.native(), unfinished[i].path).out = 0;
        unfinished[i].state = Unfinished::named;
        return i;
    }
    return -1;
}

}  // namespace

void remove_unfinished_files() noexcept {
    for (const Unfinished& one : unfinished)
        if (one.state == Unfinished::named) platform::remove_now(one.path);
}

void fail_to_write(const std::filesystem::path& path, const char* doing, const std::error_code& reason) {
    const std::string text = one_line(path.string()) + ": " + doing + ": " + reason.message();
    if (platform::is_full(reason)) throw FullDisk(text);
    throw RunError(text);
}

void AtomicFile::check(const std::error_code& error, const char* doing) const {
    if (error) fail_to_write(target_, doing, error);
}

AtomicFile::AtomicFile(const std::filesystem::path& path, Readers readers) : target_(path) {
    if (path.filename().empty() || path.filename() == "." || path.filename() == "..")
        throw RunError(one_line(path.string()) + ": cannot be written: it names a folder");
    if (!platform::can_name_files(path.filename()))
        throw RunError(one_line(path.string()) + ": cannot be written: not a regular file by this name");
    std::error_code ignored;
    if (readers == Readers::usual && platform::is_strangers_link(path))
        throw RunError(one_line(path.string()) +
                       ": cannot be written: it is another user's link in a folder that all may write");
    if (readers == Readers::usual && std::filesystem::is_symlink(path, ignored)) {
        const std::filesystem::path resolved = std::filesystem::weakly_canonical(path, ignored);
        if (!resolved.empty()) target_ = resolved;
    }
    const auto existing = std::filesystem::status(target_, ignored);
    const bool exists = readers == Readers::usual && std::filesystem::exists(existing);
    if (exists && !std::filesystem::is_regular_file(existing))
        throw RunError(one_line(path.string()) + ": cannot be written: it exists and is not a regular file");

    // The name does not contain the target's, which may have the maximum length already.
    static std::atomic<unsigned> counter{0};
    const auto how = readers == Readers::owner ? platform::Open::create_owned : platform::Open::create;
    std::error_code error;
    do {
        temporary_ = target_.parent_path() / (".ewa-" + std::to_string(platform::process_id()) + "-" +
                                              std::to_string(counter++) + ".tmp");
        error = file_.open(temporary_, how);
    } while (error == std::errc::file_exists);
    check(error, "cannot be written");
    file_.try_lock();  // for remove_abandoned_files(); a file system may have no locks
    listed_ = list_unfinished(temporary_);
    if (exists) file_.permit_as(target_);  // a file system without permissions is no error
}

AtomicFile::~AtomicFile() {
    file_.close();
    if (!temporary_.empty()) platform::remove_now(temporary_.c_str());
    if (claimed_) platform::remove_now(target_.c_str());
    if (listed_ >= 0) unfinished[listed_].state = Unfinished::free;
}

void AtomicFile::write(const void* bytes, size_t count) {
    check(file_.write(bytes, count), "cannot be written");
}

bool AtomicFile::claim(const std::filesystem::path& name) {
    platform::File file;
    const std::error_code error = file.open(name, platform::Open::create);
    if (error == std::errc::file_exists) return false;
    if (claimed_) platform::remove_now(target_.c_str());
    claimed_ = false;
    target_ = name;
    check(error, "cannot be written");
    claimed_ = true;
    return true;
}

void AtomicFile::commit() {
    // Network and quota file systems may report a full disk only here.
    check(file_.flush(), "cannot be written to disk");
    check(file_.close(), "cannot be written to disk");
    check(platform::replace(temporary_, target_), "cannot be put in place");
    temporary_.clear();
    claimed_ = false;
    // The folder holds the new name. The file itself is on disk already, so a failure is no error.
    platform::flush_folder(target_.has_parent_path() ? target_.parent_path() : ".");
}

void write_text_file(const std::filesystem::path& path, std::string_view text, AtomicFile::Readers readers) {
    AtomicFile file(path, readers);
    file.write(text);
    file.commit();
}

void remove_abandoned_files(const std::filesystem::path& folder) {
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
        const std::string name = entry.path().filename().string();
        int process = 0, used = 0;
        unsigned number = 0;
        if (std::sscanf(name.c_str(), ".ewa-%9d-%9u.tmp%n", &process, &number, &used) != 2 ||
            size_t(used) != name.size() || process <= 0)
            continue;
        // A process of another container has a number that says nothing here.
        if (!platform::is_running(process) && (entry.is_symlink(error) || !platform::is_locked(entry.path())))
            platform::remove_now(entry.path().c_str());
    }
}

}  // namespace ewa::core
