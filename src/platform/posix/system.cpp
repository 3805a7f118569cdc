// SPDX-License-Identifier: Apache-2.0
#include "platform/system.h"

#include <sched.h>
#include <sys/mman.h>
#include <sys/random.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <initializer_list>
#include <iterator>

namespace ewa::platform {
namespace {

uint64_t least_limit(std::initializer_list<__rlimit_resource_t> resources) {
    uint64_t least = UINT64_MAX;
    for (const auto resource : resources) {
        rlimit limit{};
        if (getrlimit(resource, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
            least = std::min(least, uint64_t(limit.rlim_cur));
    }
    return least;
}

}  // namespace

uint64_t address_limit() {
    return least_limit({RLIMIT_AS});
}

uint64_t memory_limit() {
    return least_limit({RLIMIT_AS, RLIMIT_DATA});
}

Reservation::Reservation(uint64_t bytes) : bytes_(bytes) {
    void* mapped = mmap(nullptr, bytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (mapped != MAP_FAILED) place_ = mapped;
}

Reservation::~Reservation() {
    if (place_) munmap(place_, bytes_);
}

uint64_t installed_memory() {
    return uint64_t(sysconf(_SC_PHYS_PAGES)) * uint64_t(sysconf(_SC_PAGESIZE));
}

std::optional<uint64_t> free_memory() {
    std::ifstream file("/proc/meminfo");
    for (std::string name, unit; file >> name;) {
        uint64_t kilobytes = 0;
        file >> kilobytes;
        std::getline(file, unit);
        if (name == "MemAvailable:") return kilobytes * 1024;
    }
    return std::nullopt;
}

uint64_t peak_memory() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return uint64_t(usage.ru_maxrss) * 1024;  // Linux counts in KiB
}

std::string machine_name() {
    std::string text;
    std::ifstream("/proc/sys/kernel/random/boot_id") >> text;
    if (text.empty()) {
        char name[256] = "";
        gethostname(name, sizeof name - 1);
        text = name;
    }
    return text;
}

std::string system_release() {
    std::string text;
    for (const char* place : {"/etc/os-release", "/usr/lib/os-release"}) {
        std::ifstream file(place);
        if (text.empty()) text.assign(std::istreambuf_iterator<char>(file), {});
    }
    return text;
}

std::vector<uint64_t> usable_cores(size_t words) {
    std::vector<uint64_t> cores(words);
    if (sched_getaffinity(0, sizeof(uint64_t) * words, reinterpret_cast<cpu_set_t*>(cores.data())) != 0)
        cores[0] = 1;
    return cores;
}

bool random_bytes(void* bytes, size_t size) {
    return getrandom(bytes, size, 0) == ssize_t(size);
}

std::string variable(const char* name) {
    const char* value = std::getenv(name);
    return value ? value : "";
}

void set_variable(const char* name, const std::string& value) {
    setenv(name, value.c_str(), 1);
}

void set_if_absent(const char* name, const std::string& value) {
    setenv(name, value.c_str(), 0);
}

}  // namespace ewa::platform
