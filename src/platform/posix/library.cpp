// SPDX-License-Identifier: Apache-2.0
#include "platform/library.h"

#include <dlfcn.h>
#include <link.h>
#include <sys/auxv.h>

#include <bit>

namespace ewa::platform {

const char* const kLibrarySuffix = ".so";
const char* const kVulkanLoader = "libvulkan.so.1";

Library::Library(const std::filesystem::path& file) : handle_(dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL)) {
    if (!handle_) error_ = dlerror();
}

void* Library::find(const char* name) {
    void* found = handle_ ? dlsym(handle_, name) : nullptr;
    if (handle_ && !found) error_ = dlerror();
    return found;
}

std::filesystem::path own_program(std::error_code& error) {
    return std::filesystem::canonical(std::bit_cast<const char*>(getauxval(AT_EXECFN)), error);
}

std::filesystem::path own_file(std::error_code& error) {
    Dl_info unused;
    void* found = nullptr;
    dladdr1(reinterpret_cast<const void*>(&own_file), &unused, &found, RTLD_DL_LINKMAP);
    const char* name = found ? static_cast<const link_map*>(found)->l_name : "";  // empty for the program
    return *name ? std::filesystem::canonical(name, error) : own_program(error);
}

}  // namespace ewa::platform
