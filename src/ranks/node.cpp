// SPDX-License-Identifier: Apache-2.0
#include "ranks/node.h"

#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <string>

namespace ewa::ranks {
namespace {

constexpr size_t kWords = 128;  // 8192 cores, the most that Linux is built for

bool may_use(const Allowed& one, size_t core) {
    return core / 64 < one.cores.size() && (one.cores[core / 64] >> (core % 64) & 1) != 0;
}

/// Containers on one machine have names of their own, but share its boot.
uint64_t this_machine() {
    std::string text;
    std::ifstream("/proc/sys/kernel/random/boot_id") >> text;
    if (text.empty()) {
        char name[256] = "";
        gethostname(name, sizeof name - 1);
        text = name;
    }
    return std::hash<std::string>{}(text);
}

Allowed this_process() {
    Allowed own{this_machine(), std::vector<uint64_t>(kWords)};
    if (sched_getaffinity(0, sizeof(uint64_t) * kWords, reinterpret_cast<cpu_set_t*>(own.cores.data())) != 0)
        own.cores[0] = 1;
    return own;
}

}  // namespace

Place place_of(std::span<const Allowed> all, int rank) {
    const Allowed& own = all[size_t(rank)];
    Place place{0, 0, 1};
    double share = 0;
    for (size_t r = 0; r < all.size(); ++r) {
        if (all[r].machine != own.machine) continue;
        place.local_rank += int(r) < rank ? 1 : 0;
        ++place.local_size;
    }
    for (size_t core = 0; core < own.cores.size() * 64; ++core)
        if (may_use(own, core))
            share += 1.0 / double(std::ranges::count_if(all, [&](const Allowed& other) {
                         return other.machine == own.machine && may_use(other, core);
                     }));
    place.cores = std::max(1, int(std::floor(share + 1e-6)));  // 3 times a third is a whole
    return place;
}

Place find_place(Ranks& ranks) {
    const Allowed own = this_process();
    std::vector<uint64_t> sent = {own.machine};
    sent.insert(sent.end(), own.cores.begin(), own.cores.end());
    const std::vector<uint64_t> received = ranks.gather(sent);
    std::vector<Allowed> all;
    for (auto at = received.begin(); at != received.end(); at += std::ptrdiff_t(sent.size()))
        all.push_back({*at, {at + 1, at + std::ptrdiff_t(sent.size())}});
    return place_of(all, ranks.rank());
}

void limit_lavapipe(int cores) {
    setenv("LP_NUM_THREADS", std::to_string(cores).c_str(), 0);
}

}  // namespace ewa::ranks
