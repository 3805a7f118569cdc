// SPDX-License-Identifier: Apache-2.0
#include "platform/windows/windows.h"

#include <iterator>
#include <utility>

namespace ewa::platform {
namespace {

constexpr DWORD kQuotaExceeded = 1295;  // ERROR_DISK_QUOTA_EXCEEDED

class WindowsErrors : public std::error_category {
  public:
    const char* name() const noexcept override { return "windows"; }
    std::string message(int error) const override { return error_words(DWORD(error)); }
};

constexpr wchar_t kNotValid = 0xfffd;

}  // namespace

std::wstring wide(std::string_view text) {
    std::wstring result;
    if (text.empty()) return result;
    result.resize(size_t(MultiByteToWideChar(CP_UTF8, 0, text.data(), int(text.size()), nullptr, 0)));
    MultiByteToWideChar(CP_UTF8, 0, text.data(), int(text.size()), result.data(), int(result.size()));
    return result;
}

std::string narrow(std::wstring_view text) {
    std::string result;
    if (text.empty()) return result;
    const int length = int(text.size());
    result.resize(size_t(WideCharToMultiByte(CP_UTF8, 0, text.data(), length, nullptr, 0, nullptr, nullptr)));
    WideCharToMultiByte(CP_UTF8, 0, text.data(), length, result.data(), int(result.size()), nullptr, nullptr);
    return result;
}

std::error_code error_of(DWORD error) {
    static const WindowsErrors others;
    static constexpr std::pair<DWORD, std::errc> kKnown[] = {
        {ERROR_FILE_NOT_FOUND, std::errc::no_such_file_or_directory},
        {ERROR_PATH_NOT_FOUND, std::errc::no_such_file_or_directory},
        {ERROR_INVALID_NAME, std::errc::no_such_file_or_directory},
        {ERROR_BAD_NETPATH, std::errc::no_such_file_or_directory},
        {ERROR_ACCESS_DENIED, std::errc::permission_denied},
        {ERROR_SHARING_VIOLATION, std::errc::device_or_resource_busy},
        {ERROR_LOCK_VIOLATION, std::errc::device_or_resource_busy},
        {ERROR_WRITE_PROTECT, std::errc::read_only_file_system},
        {ERROR_FILE_EXISTS, std::errc::file_exists},
        {ERROR_ALREADY_EXISTS, std::errc::file_exists},
        {ERROR_DISK_FULL, std::errc::no_space_on_device},
        {ERROR_HANDLE_DISK_FULL, std::errc::no_space_on_device},
        {kQuotaExceeded, std::errc::no_space_on_device},
        {ERROR_FILE_TOO_LARGE, std::errc::file_too_large},
        {ERROR_NOT_ENOUGH_MEMORY, std::errc::not_enough_memory},
        {ERROR_OUTOFMEMORY, std::errc::not_enough_memory},
        {ERROR_TOO_MANY_OPEN_FILES, std::errc::too_many_files_open},
        {ERROR_FILENAME_EXCED_RANGE, std::errc::filename_too_long},
        {ERROR_DIRECTORY, std::errc::not_a_directory},
        {ERROR_BROKEN_PIPE, std::errc::broken_pipe},
        {ERROR_NO_DATA, std::errc::broken_pipe},
        {ERROR_NOT_SAME_DEVICE, std::errc::cross_device_link},
        {ERROR_DIR_NOT_EMPTY, std::errc::directory_not_empty}};
    for (const auto& [number, known] : kKnown)
        if (number == error) return std::make_error_code(known);
    return {int(error), others};
}

std::string error_words(DWORD error) {
    wchar_t words[512];
    const DWORD length = FormatMessageW(
        FORMAT_MESSAGE_FROM_SYSTEM | FORMAT_MESSAGE_IGNORE_INSERTS | FORMAT_MESSAGE_MAX_WIDTH_MASK, nullptr,
        error, 0, words, DWORD(std::size(words)), nullptr);
    std::string text = narrow({words, length});
    while (!text.empty() && (text.back() == ' ' || text.back() == '.')) text.pop_back();
    return text.empty() ? "error " + std::to_string(error) + " of Windows" : text;
}

}  // namespace ewa::platform

// The C++ library of MinGW makes paths of text by this function of C. The one of MinGW takes each byte for a character. This one
// reads UTF-8, as paths are written. Characters above U+FFFF are two units: the first one takes three bytes, the second one the
// last. MinGW has both functions in one object, so both are here.
extern "C" size_t mbrtowc(wchar_t* to, const char* from, size_t size, mbstate_t* state) {
    if (!from) return 0;
    if (size == 0) return size_t(-2);
    wchar_t units[2] = {};
    size_t bytes = 1;
    if (state && *state) {
        units[0] = wchar_t(*state);
        *state = 0;
    } else if (const auto first = static_cast<unsigned char>(*from); first < 0x80) {
        units[0] = first;
    } else {
        const int length = first < 0xe0 ? 2 : first < 0xf0 ? 3 : 4;
        const int count = size_t(length) > size
                              ? 0
                              : MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, from, length, units, 2);
        if (count == 0) units[0] = ewa::platform::kNotValid;
        if (count > 0) bytes = size_t(length);
        if (count == 2 && state) {
            *state = units[1];
            --bytes;
        }
    }
    if (to) *to = units[0];
    return units[0] ? bytes : 0;
}

extern "C" size_t mbrlen(const char* from, size_t size, mbstate_t* state) {
    return mbrtowc(nullptr, from, size, state);
}
