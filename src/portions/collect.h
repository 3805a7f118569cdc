// SPDX-License-Identifier: Apache-2.0
// Bytes that the ranks hold together: joined on rank 0, whole or in pieces, divided again, and exchanged.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "ewa/ranks.h"

namespace ewa::portions {

/// The bytes of all ranks one after another, on rank 0; empty on the others. Collective.
std::vector<std::byte> joined(Ranks& ranks, std::vector<std::byte> own);

/// Hands the bytes of all ranks on, one after another, in pieces of some MiB; on rank 0, which holds no more than a piece of
/// another's. begin: gets their number and CRC-32 (zlib's) first. Both functions are called on rank 0 alone. Collective.
void pass_on(Ranks& ranks, std::span<const std::byte> own,
             const std::function<void(uint64_t bytes, uint32_t checksum)>& begin,
             const std::function<void(std::span<const std::byte>)>& take);

/// Divides bytes that rank 0 reads into parts, in pieces of some MiB. sizes: of all parts; each rank gets as many. read: fills a
/// piece from an offset on; called on rank 0 alone. take: gets this rank's parts. Collective.
void hand_out(Ranks& ranks, const std::vector<uint64_t>& sizes,
              const std::function<void(uint64_t offset, std::span<std::byte>)>& read,
              const std::function<void(size_t part, std::vector<std::byte>)>& take);

/// Sends out[r] to rank r. Returns what each rank has sent to this one. Collective.
std::vector<std::vector<std::byte>> exchanged(Ranks& ranks, std::vector<std::vector<std::byte>> out);

/// Bytes of rank 0, on every rank. own: ignored on other ranks. Collective.
std::vector<std::byte> from_rank_0(Ranks& ranks, std::span<const std::byte> own);

/// What this rank has exchanged with others so far.
struct Traffic {
    uint64_t sent_bytes = 0;
    double exchange = 0, waiting = 0;  // ms
};

/// Functions of ranks that count what they do.
class CountedRanks {
  public:
    explicit CountedRanks(Ranks& ranks) : ranks_(ranks) {}
    std::vector<uint64_t> gather(std::span<const uint64_t> own);
    void exchange(std::span<const std::span<std::byte>> out, std::span<const std::span<std::byte>> in);
    const Traffic& traffic() const { return traffic_; }

  private:
    Ranks& ranks_;
    Traffic traffic_;
};

}  // namespace ewa::portions
