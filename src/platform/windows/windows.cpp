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
