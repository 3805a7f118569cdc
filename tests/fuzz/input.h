// SPDX-License-Identifier: Apache-2.0
// What the targets have in common: where an input lies, and what every reading of one has to keep to.
#pragma once
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <string>
#include <vector>

#include "memory.h"

/// Ends the program, with `text` in scope as what it is about.
#define EWA_REQUIRE(condition)                                                    \
    if (!(condition)) {                                                           \
        std::fprintf(stderr, "%s does not hold: %s\n", #condition, text.c_str()); \
        std::abort();                                                             \
    }

namespace ewa::fuzz {

/// A file in memory that the reader opens by name.
class MemoryFile {
  public:
    MemoryFile()
        : descriptor_(memfd_create("fuzz", 0)), path_("/proc/self/fd/" + std::to_string(descriptor_)) {}
    const std::string& hold(const uint8_t* data, size_t size) {
        if (ftruncate(descriptor_, static_cast<off_t>(size)) != 0) std::abort();
        if (pwrite(descriptor_, data, size, 0) != static_cast<ssize_t>(size)) std::abort();
        return path_;
    }

  private:
    int descriptor_;
    std::string path_;
};

/// A new folder, in memory where possible: every run writes a file. It goes when the program ends.
inline std::filesystem::path make_folder() {
    struct Folders {
        std::vector<std::filesystem::path> made;
        ~Folders() {
            for (const auto& folder : made) std::filesystem::remove_all(folder);
        }
    };
    static Folders folders;
    const std::filesystem::path shared = "/dev/shm";
    const auto root = std::filesystem::is_directory(shared) ? shared : std::filesystem::temp_directory_path();
    const std::string number = std::to_string(getpid()) + "-" + std::to_string(folders.made.size());
    folders.made.push_back(root / ("ewa-fuzz-" + number));
    std::filesystem::create_directories(folders.made.back());
    return folders.made.back();
}

/// Reads an input of so many bytes, within the memory of memory.h and so many seconds of the processor, so
/// that a busy machine is no finding; libFuzzer's own limit ends what never returns.
template <class Read>
void read_within(size_t bytes, double seconds, const Read& read) {
    watch_memory();
    const std::clock_t start = std::clock();
    const long long before = live;
    peak = before;
    read();
    require_modest(bytes, before);
    const std::string text = "time for " + std::to_string(bytes) + " bytes";
    EWA_REQUIRE(double(std::clock() - start) < seconds * CLOCKS_PER_SEC);
}

}  // namespace ewa::fuzz
