// SPDX-License-Identifier: Apache-2.0
#include "platform/windows/windows.h"

namespace ewa::platform {

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
