// SPDX-License-Identifier: Apache-2.0
#include "platform/library.h"

#include "platform/windows/windows.h"

namespace ewa::platform {
namespace {

constexpr size_t kMostModulePath = 32768;  // what Windows allows

std::filesystem::path file_of_module(HMODULE module, std::error_code& error) {
    error.clear();
    std::wstring path(kMostModulePath, L'\0');
    const DWORD length = GetModuleFileNameW(module, path.data(), DWORD(path.size()));
    if (length == 0) error = last_error();
    path.resize(length);
    return path;
}

}  // namespace

const char* const kLibrarySuffix = ".dll";
const char* const kVulkanLoader = "vulkan-1.dll";

Library::Library(const std::filesystem::path& file) {
    // The libraries that a plugin needs are beside it, or beside the program.
    const DWORD beside = file.is_absolute() ? LOAD_LIBRARY_SEARCH_DLL_LOAD_DIR : 0;
    const std::filesystem::path name = file.is_absolute() ? file.lexically_normal().make_preferred() : file;
    handle_ = LoadLibraryExW(name.c_str(), nullptr, beside | LOAD_LIBRARY_SEARCH_DEFAULT_DIRS);
    if (!handle_) error_ = error_words(GetLastError());
}

void* Library::find(const char* name) {
    if (!handle_) return nullptr;
    void* found = reinterpret_cast<void*>(GetProcAddress(static_cast<HMODULE>(handle_), name));
    if (!found) error_ = std::string(name) + ": " + error_words(GetLastError());
    return found;
}

std::filesystem::path own_program(std::error_code& error) {
    return file_of_module(nullptr, error);
}

std::filesystem::path own_file(std::error_code& error) {
    HMODULE module = nullptr;
    GetModuleHandleExW(GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT,
                       reinterpret_cast<LPCWSTR>(&own_file), &module);
    return file_of_module(module, error);
}

}  // namespace ewa::platform
