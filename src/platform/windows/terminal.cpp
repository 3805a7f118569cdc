// SPDX-License-Identifier: Apache-2.0
#include "platform/terminal.h"

#include <fcntl.h>
#include <io.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "platform/windows/windows.h"

// shellapi.h needs more of windows.h than this folder includes.
extern "C" __declspec(dllimport) wchar_t** __stdcall CommandLineToArgvW(const wchar_t* line, int* count);

namespace ewa::platform {
namespace {

HANDLE handle_of_stream(Stream stream) {
    return GetStdHandle(stream == Stream::output ? STD_OUTPUT_HANDLE : STD_ERROR_HANDLE);
}

void keep_bytes(std::FILE* stream, const char* mode) {
    // A program that Windows starts without a console has none of the streams.
    if (_fileno(stream) < 0 && !std::freopen("NUL", mode, stream)) return;
    _setmode(_fileno(stream), _O_BINARY);
}

/// The words of the command line and a null pointer, which live until the process ends. Empty if Windows does not say.
std::vector<char*> utf8_words() {
    static std::vector<std::string> line;
    int count = 0;
    wchar_t** words = CommandLineToArgvW(GetCommandLineW(), &count);
    if (!words) return {};
    for (int i = 0; i < count; ++i) line.push_back(narrow(words[i]));
    LocalFree(words);
    std::vector<char*> pointers;
    for (std::string& word : line) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    return pointers;
}

}  // namespace

void begin_program(int& argc, char**& argv) {
    static std::vector<char*> words = utf8_words();
    if (!words.empty()) {
        argc = int(words.size()) - 1;
        argv = words.data();
    }
    _fmode = _O_BINARY;  // of files that are opened from now on
    keep_bytes(stdin, "rb");
    keep_bytes(stdout, "wb");
    keep_bytes(stderr, "wb");
    std::setvbuf(stderr, nullptr, _IONBF, 0);
    SetConsoleOutputCP(CP_UTF8);
    SetConsoleCP(CP_UTF8);
    for (const Stream stream : {Stream::output, Stream::errors}) {
        DWORD mode = 0;
        const HANDLE console = handle_of_stream(stream);
        if (GetConsoleMode(console, &mode))
            SetConsoleMode(console, mode | ENABLE_VIRTUAL_TERMINAL_PROCESSING);
    }
}

bool is_terminal(Stream stream) {
    DWORD mode = 0;
    return GetConsoleMode(handle_of_stream(stream), &mode) != 0;
}

bool redraws() {
    DWORD mode = 0;
    return GetConsoleMode(handle_of_stream(Stream::output), &mode) != 0 &&
           (mode & ENABLE_VIRTUAL_TERMINAL_PROCESSING) != 0;
}

bool shows_unicode() {
    return GetConsoleOutputCP() == CP_UTF8;
}

size_t terminal_columns() {
    CONSOLE_SCREEN_BUFFER_INFO screen{};
    if (!GetConsoleScreenBufferInfo(handle_of_stream(Stream::output), &screen)) return 0;
    return size_t(screen.srWindow.Right - screen.srWindow.Left + 1);
}

}  // namespace ewa::platform
