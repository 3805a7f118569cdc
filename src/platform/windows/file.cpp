// SPDX-License-Identifier: Apache-2.0
#include "platform/file.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cwctype>
#include <new>
#include <ratio>
#include <string>
#include <vector>

#include "platform/file_facts.h"
#include "platform/windows/windows.h"

namespace ewa::platform {
namespace {

namespace fs = std::filesystem;

constexpr DWORD kShared = FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE;
constexpr DWORD kMostAtOnce = 1u << 30;  // bytes of one read or write
constexpr DWORD kLockPlace =
    0x40000000;               // in units of 4 GB, beyond every file: locks there keep nobody from reading
constexpr int kTries = 40;    // while a reader, such as a virus scanner, keeps a file from being replaced
constexpr DWORD kPause = 25;  // ms

/// A path that may have more than 260 characters: absolute, with the prefix that turns the limit off.
std::wstring long_path(const fs::path& path) {
    constexpr size_t kShort = 240;
    if (path.native().size() < kShort || path.native().starts_with(L"\\\\?\\")) return path.native();
    std::error_code unknown;
    const fs::path whole = fs::absolute(path, unknown).lexically_normal().make_preferred();
    if (unknown) return path.native();
    return whole.native().starts_with(L"\\\\") ? L"\\\\?\\UNC" + whole.native().substr(1)
                                               : L"\\\\?\\" + whole.native();
}

HANDLE open_handle(const fs::path& path, DWORD access, DWORD creation, DWORD flags = 0) {
    return CreateFileW(long_path(path).c_str(), access, kShared, nullptr, creation, flags, nullptr);
}

OVERLAPPED lock_place() {
    OVERLAPPED place{};
    place.OffsetHigh = kLockPlace;
    return place;
}

bool lock_now(HANDLE file, DWORD flags) {
    OVERLAPPED place = lock_place();
    return LockFileEx(file, flags | LOCKFILE_FAIL_IMMEDIATELY, 0, 1, 0, &place) != 0;
}

bool is_held() {
    return GetLastError() == ERROR_LOCK_VIOLATION || GetLastError() == ERROR_IO_PENDING;
}

std::optional<FileId> id_of(HANDLE file) {
    BY_HANDLE_FILE_INFORMATION of{};
    if (!GetFileInformationByHandle(file, &of)) return std::nullopt;
    return FileId{of.dwVolumeSerialNumber, uint64_t(of.nFileIndexHigh) << 32 | of.nFileIndexLow};
}

/// A name that no other call of any process has, for a file or folder that is made for a while.
std::wstring passing_name(std::wstring_view prefix) {
    static std::atomic<unsigned> counter{0};
    LARGE_INTEGER now{};
    QueryPerformanceCounter(&now);
    return std::wstring(prefix) + std::to_wstring(GetCurrentProcessId()) + L"-" + std::to_wstring(counter++) +
           L"-" + std::to_wstring(now.QuadPart & 0xffffff);
}

/// Whether Windows takes this part of a path for something else.
bool is_special(const fs::path& part) {
    const std::wstring& text = part.native();
    if (text == L"." || text == L"..") return false;
    std::wstring stem = text.substr(0, text.find(L'.'));
    while (stem.ends_with(L' ')) stem.pop_back();
    for (wchar_t& c : stem) c = wchar_t(std::towupper(c));
    const bool numbered = stem.size() == 4 && stem[3] >= L'0' && stem[3] <= L'9' &&
                          (stem.starts_with(L"COM") || stem.starts_with(L"LPT"));
    return numbered || stem == L"NUL" || stem == L"CON" || stem == L"PRN" || stem == L"AUX" ||
           text.ends_with(L'.') || text.ends_with(L' ') ||
           text.find_first_of(L"<>:\"|?*") != std::wstring::npos ||
           std::ranges::any_of(text, [](wchar_t c) { return c < 0x20; });
}

/// Renames over a file that others have open, as Windows 10 can on its own file systems.
bool replace_open(const std::wstring& from, const std::wstring& to) {
    struct Renaming {  // FILE_RENAME_INFO with flags, which older headers lack
        DWORD flags;
        HANDLE folder;
        DWORD bytes;
        wchar_t name[1];
    };
    constexpr auto kRenameInfoEx = FILE_INFO_BY_HANDLE_CLASS(22);
    constexpr DWORD kReplace = 1, kPosix = 2;
    const File file(value_of(open_handle(from, DELETE | SYNCHRONIZE, OPEN_EXISTING)));
    if (!file.is_open()) return false;
    std::vector<std::byte> memory(sizeof(Renaming) + to.size() * sizeof(wchar_t));
    auto* renaming =
        new (memory.data()) Renaming{kReplace | kPosix, nullptr, DWORD(to.size() * sizeof(wchar_t)), {}};
    std::copy_n(to.c_str(), to.size() + 1, renaming->name);
    return SetFileInformationByHandle(handle_of(file.handle()), kRenameInfoEx, renaming,
                                      DWORD(memory.size())) != 0;
}

/// Makes `link` the same file as `file`, or its copy.
std::error_code show(const fs::path& file, const fs::path& link, Elsewhere elsewhere) {
    if (CreateHardLinkW(long_path(link).c_str(), long_path(file).c_str(), nullptr)) return {};
    std::error_code error = last_error();
    if (elsewhere == Elsewhere::copied) fs::copy_file(file, link, error);
    return error;
}

}  // namespace

const char* const kNullFile = "NUL";

File& File::operator=(File&& other) noexcept {
    close();
    handle_ = std::exchange(other.handle_, kClosed);
    return *this;
}

std::error_code File::open(const fs::path& path, Open how) {
    close();
    DWORD access = GENERIC_READ | GENERIC_WRITE, creation = OPEN_ALWAYS;
    if (how == Open::read) access = GENERIC_READ, creation = OPEN_EXISTING;
    if (how == Open::append) access = FILE_APPEND_DATA | SYNCHRONIZE;
    if (how == Open::create || how == Open::create_owned) creation = CREATE_NEW;
    handle_ = value_of(open_handle(path, access, creation, FILE_ATTRIBUTE_NORMAL));
    return error_unless(handle_ != kClosed);
}

std::error_code File::close() {
    const std::intptr_t open = std::exchange(handle_, kClosed);
    return error_unless(open == kClosed || CloseHandle(handle_of(open)));
}

std::error_code File::read(void* bytes, size_t size, size_t& got) {
    DWORD count = 0;
    const bool done =
        ReadFile(handle_of(handle_), bytes, DWORD(std::min<size_t>(size, kMostAtOnce)), &count, nullptr) != 0;
    got = count;
    // The end of a pipe.
    return done || GetLastError() == ERROR_BROKEN_PIPE ? std::error_code() : last_error();
}

std::error_code File::write(const void* bytes, size_t size) {
    for (const char* next = static_cast<const char*>(bytes); size > 0;) {
        DWORD count = 0;
        if (!WriteFile(handle_of(handle_), next, DWORD(std::min<size_t>(size, kMostAtOnce)), &count, nullptr))
            return last_error();
        if (count == 0) return std::make_error_code(std::errc::io_error);
        next += count;
        size -= count;
    }
    return {};
}

std::error_code File::size(uint64_t& bytes) const {
    LARGE_INTEGER size{};
    const std::error_code error = error_unless(GetFileSizeEx(handle_of(handle_), &size));
    bytes = uint64_t(size.QuadPart);
    return error;
}

std::error_code File::go_to(uint64_t offset) {
    LARGE_INTEGER place{};
    place.QuadPart = LONGLONG(offset);
    return error_unless(SetFilePointerEx(handle_of(handle_), place, nullptr, FILE_BEGIN));
}

std::error_code File::skip(uint64_t bytes) {
    LARGE_INTEGER place{};
    place.QuadPart = LONGLONG(bytes);
    return error_unless(SetFilePointerEx(handle_of(handle_), place, nullptr, FILE_CURRENT));
}

std::error_code File::flush() {
    return error_unless(FlushFileBuffers(handle_of(handle_)) || GetLastError() == ERROR_INVALID_FUNCTION);
}

std::error_code File::permit_as(const fs::path&) {
    return {};
}

Lock File::try_lock() {
    if (lock_now(handle_of(handle_), LOCKFILE_EXCLUSIVE_LOCK)) return Lock::locked;
    return is_held() ? Lock::taken : Lock::unknown;
}

bool is_locked(const fs::path& path) {
    const File file(value_of(open_handle(path, GENERIC_READ, OPEN_EXISTING)));
    return file.is_open() && !lock_now(handle_of(file.handle()), 0) && is_held();
}

// A mutex with the number of the file or folder: Windows locks no folders, and an open file keeps others from renaming its folder,
// and from replacing it on some disks.
Lock lock_path(const fs::path& path, File& held) {
    const std::optional<FileId> id = file_id(path);
    if (!id) return Lock::unknown;
    const std::wstring name =
        L"Global\\ewa-folder-" + std::to_wstring(id->device) + L"-" + std::to_wstring(id->number);
    HANDLE mutex = CreateMutexW(nullptr, FALSE, name.c_str());
    if (!mutex) return GetLastError() == ERROR_ACCESS_DENIED ? Lock::taken : Lock::unknown;
    const bool exists = GetLastError() == ERROR_ALREADY_EXISTS;
    held = File(value_of(mutex));
    const bool taken = exists || file_id(path) != id;
    if (taken) held.close();
    return taken ? Lock::taken : Lock::locked;
}

std::error_code replace(const fs::path& from, const fs::path& to) {
    const std::wstring before = long_path(from), after = long_path(to);
    std::error_code error;
    for (int i = 0; i < kTries; ++i) {
        if (replace_open(before, fs::absolute(after).make_preferred().native())) return {};
        error = error_unless(
            MoveFileExW(before.c_str(), after.c_str(), MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH));
        if (error != std::errc::permission_denied && error != std::errc::device_or_resource_busy) break;
        Sleep(kPause);
    }
    return error;
}

// NTFS keeps the names in its journal.
void flush_folder(const fs::path&) {}

void remove_now(const fs::path::value_type* path) noexcept {
    DeleteFileW(path);
}

std::optional<FileId> file_id(const fs::path& path) {
    // Folders open with this flag alone.
    const File file(value_of(open_handle(path, 0, OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS)));
    return file.is_open() ? id_of(handle_of(file.handle())) : std::nullopt;
}

fs::file_time_type write_time(const fs::path& file, std::error_code& error) {
    using Ticks = std::chrono::duration<int64_t, std::ratio<1, 10'000'000>>;
    constexpr Ticks kTo1970 = std::chrono::seconds(11'644'473'600);  // from 1601
    WIN32_FILE_ATTRIBUTE_DATA of{};
    error = error_unless(GetFileAttributesExW(long_path(file).c_str(), GetFileExInfoStandard, &of));
    if (error) return fs::file_time_type::min();
    const Ticks ticks(int64_t(of.ftLastWriteTime.dwHighDateTime) << 32 | of.ftLastWriteTime.dwLowDateTime);
    return std::chrono::file_clock::from_sys(
        std::chrono::sys_time<std::chrono::nanoseconds>(ticks - kTo1970));
}

fs::path::string_type folded(const fs::path& path) {
    std::wstring slashes = path.native();
    std::ranges::replace(slashes, L'/', L'\\');
    std::wstring text(slashes.size(), L'\0');
    const int length = int(text.size());
    if (length > 0)
        LCMapStringEx(LOCALE_NAME_INVARIANT, LCMAP_UPPERCASE, slashes.data(), length, text.data(), length,
                      nullptr, nullptr, 0);
    return text;
}

bool is_strangers_link(const fs::path&) {
    return false;
}

std::error_code refuses_files(const fs::path& folder) {
    const File file(value_of(open_handle(folder / passing_name(L".ewa-try-"), GENERIC_WRITE | DELETE,
                                         CREATE_NEW, FILE_ATTRIBUTE_HIDDEN | FILE_FLAG_DELETE_ON_CLOSE)));
    return error_unless(file.is_open());
}

std::error_code link_folder(const fs::path& target, const fs::path& link, Elsewhere elsewhere) {
    if (target.empty()) return std::make_error_code(std::errc::no_such_file_or_directory);
    const fs::path source = target.is_absolute() ? target : link.parent_path() / target;
    std::error_code error;
    const fs::path own = fs::weakly_canonical(link.parent_path(), error);  // may be in the target
    if (!fs::create_directory(link, error))
        return error ? error : std::make_error_code(std::errc::file_exists);
    for (fs::recursive_directory_iterator entry(source, error), end; !error && entry != end;) {
        const fs::path made = link / entry->path().lexically_relative(source);
        if (!entry->is_directory(error)) {
            if (!error) error = show(entry->path(), made, elsewhere);
        } else if (fs::weakly_canonical(entry->path(), error) == own) {
            entry.disable_recursion_pending();
        } else {
            fs::create_directory(made, error);
        }
        if (!error) entry.increment(error);
    }
    std::error_code ignored;
    if (error) fs::remove_all(link, ignored);
    return error;
}

bool can_name_files(const fs::path& name) {
    return std::ranges::none_of(name, is_special);
}

std::error_code make_temporary_folder(const char* prefix, fs::path& path) {
    path = fs::temp_directory_path() / passing_name(wide(prefix));
    return error_unless(CreateDirectoryW(long_path(path).c_str(), nullptr));
}

std::FILE* open_stream(const fs::path& path) {
    return _wfopen(long_path(path).c_str(), L"rbN");
}

// Windows has no streams over memory. T: it keeps a file in memory while there is enough of it; D: it goes with the stream.
std::FILE* stream_of(const void* bytes, size_t size) {
    std::FILE* stream = _wfopen((fs::temp_directory_path() / passing_name(L"ewa-stream-")).c_str(), L"w+bTD");
    if (stream && std::fwrite(bytes, 1, size, stream) != size) {
        std::fclose(stream);
        return nullptr;
    }
    if (stream) std::rewind(stream);
    return stream;
}

bool is_full(const std::error_code& error) {
    return error == std::errc::no_space_on_device || error == std::errc::file_too_large;
}

// Windows keeps a temporary file in memory while there is enough of it.
PassingFile::PassingFile() : path_(fs::temp_directory_path() / passing_name(L"ewa-passing-")) {
    file_ = File(value_of(open_handle(path_, GENERIC_READ | GENERIC_WRITE | DELETE, CREATE_NEW,
                                      FILE_ATTRIBUTE_TEMPORARY | FILE_FLAG_DELETE_ON_CLOSE)));
    error_ = error_unless(file_.is_open());
}

}  // namespace ewa::platform
