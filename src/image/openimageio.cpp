// SPDX-License-Identifier: Apache-2.0
#include "image/openimageio.h"

#include <dlfcn.h>
#include <link.h>
#include <sys/auxv.h>

#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "core/text.h"
#include "ewa/error.h"
#include "image/limits.h"

namespace ewa::image {
namespace {

namespace fs = std::filesystem;

/// Where the module is, seen from the folder of the program or of libewa: in a build tree, installed
/// (EWA_MODULES_FROM_PROGRAMS), beside an installed libewa; for the tests and the fuzz targets of a build
/// tree. Nowhere else, whatever LD_LIBRARY_PATH and the folder one happens to be in are.
constexpr const char* kPlaces[] = {"modules", EWA_MODULES_FROM_PROGRAMS, "ewa", "../modules",
                                   "../../modules"};

[[noreturn]] void cannot_load(const std::string& reason) {
    throw RunError(core::one_line(std::string(kOpenImageIOFile) +
                                  ", by which pictures are read and written, cannot be loaded: " + reason +
                                  "; install ewa again, with the libraries that it needs"));
}

/// The program's; how it was called where there is no /proc, as in a bare chroot.
fs::path program_file() {
    std::error_code no_proc;
    const fs::path file = fs::canonical("/proc/self/exe", no_proc);
    return no_proc ? fs::canonical(std::bit_cast<const char*>(getauxval(AT_EXECFN))) : file;
}

/// Of the program or the shared library that this function is part of, symbolic links resolved.
fs::path own_file() try {
    Dl_info unused;
    void* found = nullptr;
    if (dladdr1(reinterpret_cast<const void*>(&own_file), &unused, &found, RTLD_DL_LINKMAP) == 0)
        return program_file();
    const char* name = static_cast<const link_map*>(found)->l_name;
    return *name ? fs::canonical(name) : program_file();  // the program itself has no name there
} catch (const fs::filesystem_error& error) {
    cannot_load("where ewa itself is cannot be told: " + error.code().message());
}

fs::path module_file() {
    const fs::path own = own_file();
    for (const char* place : kPlaces) {
        const fs::path file = own.parent_path() / place / kOpenImageIOFile;
        std::error_code absent;
        if (fs::exists(file, absent)) return file;
    }
    cannot_load("it is neither in " +
                (own.parent_path() / EWA_MODULES_FROM_PROGRAMS).lexically_normal().string() +
                " nor in the folders ewa and modules beside " + own.string());
}

/// Of a file that has lost its end dlopen maps pages that are not there, and the process ends by SIGBUS. What
/// is no library at all, or one of another processor, dlopen finds out by itself.
void refuse_cut_short(const fs::path& file) {
    std::error_code unknown;
    const uint64_t size = fs::file_size(file, unknown);
    std::ifstream in(file, std::ios::binary);
    ElfW(Ehdr) header{};
    const unsigned char native = sizeof(void*) == 8 ? ELFCLASS64 : ELFCLASS32;
    if (unknown || !in.read(reinterpret_cast<char*>(&header), sizeof(header))) return;
    if (std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0 || header.e_ident[EI_CLASS] != native) return;
    if (!in.seekg(std::streamoff(header.e_phoff))) return;
    for (int i = 0; i < header.e_phnum; ++i) {
        ElfW(Phdr) segment{};
        const bool is_there = bool(in.read(reinterpret_cast<char*>(&segment), sizeof(segment)));
        if (!is_there || (segment.p_type == PT_LOAD &&
                          (segment.p_offset > size || segment.p_filesz > size - segment.p_offset)))
            cannot_load(file.string() + " has lost its end");
    }
}

/// Never unloaded: threads and destructors of the libraries behind it run until the process ends.
OpenImageIO& load() {
    const fs::path file = module_file();
    refuse_cut_short(file);
    void* library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!library) cannot_load(dlerror());
    const auto* module = static_cast<const OpenImageIOModule*>(dlsym(library, kOpenImageIOEntry));
    if (!module) cannot_load(dlerror());
    if (module->version != std::string_view(EWA_VERSION))
        cannot_load(std::string("it is of ewa ") + module->version + ", and this is " EWA_VERSION);
    OpenImageIO& instance = *module->instance();
    if (!instance.limit(kMaxDecodedBytes, kMaxChannels))
        cannot_load("its OpenImageIO has no limits of pictures' sizes; 2.4 is the first that has");
    return instance;
}

}  // namespace

OpenImageIO& openimageio() {
    static OpenImageIO& loaded = load();
    return loaded;
}

}  // namespace ewa::image
