// SPDX-License-Identifier: Apache-2.0
// The ranks that share a machine, and the cores of each.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "ewa/ranks.h"

namespace ewa::ranks {

/// The cores that a process may use.
struct Allowed {
    uint64_t machine = 0;              // a number of its own for each machine
    std::vector<uint64_t> cores = {};  // a bit for each core of the machine
};

struct Place {
    int local_rank = 0, local_size = 1;  // among the ranks of this machine
    int cores = 1;                       // for this rank's threads, at least 1
};

/// Divides each core by the ranks that may use it: where the launcher gave each rank cores of its own, these count.
Place place_of(std::span<const Allowed> all, int rank);

/// Every rank of the group calls it.
Place find_place(Ranks& ranks);

/// Lets lavapipe, which makes a thread for each core that it sees, use no more cores than these. Call it before the first
/// Vulkan function. The user's LP_NUM_THREADS goes before it.
void limit_lavapipe(int cores);

}  // namespace ewa::ranks
