// SPDX-License-Identifier: Apache-2.0
// Windows' own header, without its macros for common words, and what the sources of this folder share.
#pragma once
#ifndef UNICODE
#define UNICODE
#endif
#define WIN32_LEAN_AND_MEAN
#ifndef NOMINMAX
#define NOMINMAX
#endif
#include <windows.h>
#include <winsock2.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <system_error>

namespace ewa::platform {

inline HANDLE handle_of(std::intptr_t value) {
    return reinterpret_cast<HANDLE>(value);
}

inline std::intptr_t value_of(HANDLE handle) {
    return reinterpret_cast<std::intptr_t>(handle);
}

/// The system's error, in the words that POSIX has for it where it has some, so that it compares with std::errc.
std::error_code error_of(DWORD error);
inline std::error_code last_error() {
    return error_of(GetLastError());
}
inline std::error_code error_unless(bool success) {
    return success ? std::error_code() : last_error();
}

/// A text in UTF-8 as Windows' functions take it, and back. What is not valid becomes U+FFFD.
std::wstring wide(std::string_view text);
std::string narrow(std::wstring_view text);

/// The system's words for an error, in one line.
std::string error_words(DWORD error);

}  // namespace ewa::platform
