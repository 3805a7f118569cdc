// SPDX-License-Identifier: Apache-2.0
// How fast ranks exchange data, measured.
#pragma once
#include <cstdint>
#include <vector>

#include "ewa/ranks.h"

namespace ewa::ranks {

/// An exchange in which each rank sends and receives `bytes`, in equal parts to and from each other rank.
struct Transfer {
    uint64_t bytes = 0;
    double milliseconds = 0;  // until the last rank is done: the median of several
};

struct Network {
    int ranks = 1;
    double gather_ms = 0;             // of one number from each rank: the median of many
    std::vector<Transfer> transfers;  // smallest first
};

/// Every rank of the group calls it, with the same sizes. All get the same figures.
Network measure_network(Ranks& ranks, const std::vector<uint64_t>& sizes);

}  // namespace ewa::ranks
