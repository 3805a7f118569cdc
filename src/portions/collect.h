// SPDX-License-Identifier: Apache-2.0
// Functions that move bytes between ranks: join them on rank 0, whole or in pieces, divide them again, and exchange them.
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

/// Passes the bytes of all ranks to `take` on rank 0, rank by rank, in pieces of some MiB. Rank 0 never stores more than a piece of
/// another rank's bytes. begin: receives the number and CRC-32 (zlib's) of all bytes before `take`. Only rank 0 calls `begin` and
/// `take`. Collective.
void pass_on(Ranks& ranks, std::span<const std::byte> own,
             const std::function<void(uint64_t bytes, uint32_t checksum)>& begin,
             const std::function<void(std::span<const std::byte>)>& take);

/// Divides bytes that rank 0 reads into parts, in pieces of some MiB. sizes: of all parts, in bytes; each rank gets as many parts
/// as any other. read: fills a piece with the bytes from an offset; called on rank 0 only. take: receives this rank's parts.
/// Collective.
void hand_out(Ranks& ranks, const std::vector<uint64_t>& sizes,
              const std::function<void(uint64_t offset, std::span<std::byte>)>& read,
              const std::function<void(size_t part, std::vector<std::byte>)>& take);

/// Sends out[r] to rank r. Returns what each rank has sent to this one. Collective.
std::vector<std::vector<std::byte>> exchanged(Ranks& ranks, std::vector<std::vector<std::byte>> out);

/// Returns the bytes of rank 0 on every rank. own: the bytes on rank 0; ignored on other ranks. Collective.
std::vector<std::byte> from_rank_0(Ranks& ranks, std::span<const std::byte> own);

/// Bytes and times of this rank's exchanges with other ranks so far.
struct Traffic {
    uint64_t sent_bytes = 0;
    double exchange = 0, waiting = 0;  // ms
};

/// Wraps a Ranks and counts the traffic of its functions.
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
