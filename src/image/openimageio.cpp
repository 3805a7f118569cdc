// SPDX-License-Identifier: Apache-2.0

#include <dlfcn.h>
#include <link.h>
#include <sys/auxv.h>

#include <bit>
#include <filesystem>
#include <string_view>

#include "core/system_limits.h"
#include "ewa/error.h"
#include "image/image_files.h"

namespace ewa::image {
namespace {

namespace fs = std::filesystem;

/// Where the module is, from the folder of the program or libewa: installed, for programs and for libewa; in
/// a build tree, for programs and tests. LD_LIBRARY_PATH and the working folder do not count.
constexpr const char* kModuleFolders[] = {EWA_MODULES_FROM_PROGRAMS, "ewa", "modules", "../modules"};

[[noreturn]] void cannot_load(const std::string& reason) {
    throw RunError(
        std::string(kModuleFile) +
        ", which reads and writes all image formats but PNG and JPEG, cannot be loaded: " + reason +
        "; install ewa's module and OpenImageIO (Debian: libopenimageio-dev), or convert the image "
        "to PNG");
}

/// The shared library that has this function, or else the program. Without symbolic links.
fs::path own_file() {
    Dl_info unused;
    void* found = nullptr;
    dladdr1(reinterpret_cast<const void*>(&own_file), &unused, &found, RTLD_DL_LINKMAP);
    const char* name = found ? static_cast<const link_map*>(found)->l_name : "";  // empty for the program
    std::error_code unknown;
    // Not /proc/self/exe, which a bare chroot does not have.
    return fs::canonical(*name ? name : std::bit_cast<const char*>(getauxval(AT_EXECFN)), unknown);
}

fs::path module_file() {
    const fs::path own = own_file(), folder = own.parent_path();
    for (const char* place : kModuleFolders) {
        const fs::path file = folder / place / kModuleFile;
        std::error_code absent;
        if (fs::exists(file, absent)) return file;
    }
    cannot_load("it is neither in " + (folder / EWA_MODULES_FROM_PROGRAMS).lexically_normal().string() +
                " nor in the folders ewa and modules beside " + own.string());
}

// Some of OpenImageIO's libraries start threads when they are loaded. Where they cannot, the process hangs or
// ends. With its threads it takes 300 MB of address space on two processors.
constexpr uint64_t kAddressSpace = 400u << 20;
constexpr int kThreads = 8;

/// Throws unless the module can be loaded with what the system still gives.
void check_room() {
    if (core::has_room(kAddressSpace, kThreads)) return;
    throw RunError(std::string(kModuleFile) + " needs " + std::to_string(kAddressSpace >> 20) +
                   " MiB of address space and " + std::to_string(kThreads) +
                   " threads, more than the system gives; " + core::address_limit_text() +
                   "a higher limit (ulimit -a) helps, or an image in PNG");
}

/// Never unloaded: threads and destructors of OpenImageIO's libraries run until the process ends.
const OpenImageIO& load() {
    const fs::path file = module_file();
    check_room();
    void* library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!library) cannot_load(dlerror());
    const auto* module = static_cast<const OpenImageIO*>(dlsym(library, kModuleEntry));
    if (!module) cannot_load(std::string("it belongs to another build of ewa: ") + dlerror());
    if (module->version != std::string_view(EWA_VERSION))
        cannot_load(std::string("it belongs to ewa ") + module->version + ", and this is " EWA_VERSION);
    if (!module->limit(kMaxDecodedBytes, kMaxChannels))
        cannot_load("its OpenImageIO is older than 2.4 and cannot limit the size of images");
    return *module;
}

}  // namespace

const OpenImageIO& openimageio() {
    static const OpenImageIO& loaded = load();
    return loaded;
}

}  // namespace ewa::image
