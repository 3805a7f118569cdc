// SPDX-License-Identifier: Apache-2.0
#include "ranks/node.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "platform/system.h"

namespace ewa::ranks {
namespace {

constexpr size_t kWords = 128;  // 8192 cores, the most that Linux is built for

bool may_use(const Allowed& one, size_t core) {
    return core / 64 < one.cores.size() && (one.cores[core / 64] >> (core % 64) & 1) != 0;
}

Allowed this_process() {
    return {std::hash<std::string>{}(platform::machine_name()), platform::usable_cores(kWords)};
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
    platform::set_if_absent("LP_NUM_THREADS", std::to_string(cores));
}

}  // namespace ewa::ranks
