// SPDX-License-Identifier: Apache-2.0
#include "core/system_limits.h"

#include <sys/mman.h>
#include <sys/resource.h>

#include <algorithm>
#include <latch>
#include <system_error>
#include <thread>
#include <vector>

namespace ewa::core {

std::string address_limit_text() {
    rlimit limit{};
    if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return "";
    return "this process may use only " + std::to_string(limit.rlim_cur >> 20) +
           " MiB of address space (ulimit -v); ";
}

uint64_t memory_limit() {
    uint64_t least = UINT64_MAX;
    for (const auto resource : {RLIMIT_AS, RLIMIT_DATA}) {
        rlimit limit{};
        if (getrlimit(resource, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
            least = std::min(least, uint64_t(limit.rlim_cur));
    }
    return least;
}

bool has_room(uint64_t bytes, int threads) {
    void* mapped = mmap(nullptr, bytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (mapped == MAP_FAILED) return false;
    bool started = true;
    std::latch end(1);
    {
        std::vector<std::jthread> all;
        try {
            for (int i = 0; i < threads; ++i) all.emplace_back([&end] { end.wait(); });
        } catch (const std::system_error&) {
            started = false;
        }
        end.count_down();
    }
    munmap(mapped, bytes);
    return started;
}

}  // namespace ewa::core
