// SPDX-License-Identifier: Apache-2.0
// Bytes that the ranks hold together: joined on rank 0, whole or in pieces, and divided again.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "ewa/ranks.h"

namespace ewa::train {

/// The bytes of all ranks one after another, on rank 0; empty on the others. Collective.
std::vector<std::byte> joined(Ranks& ranks, std::vector<std::byte> own);

/// Hands the bytes of all ranks on, one after another, in pieces of some MiB; on rank 0, which holds no more than a piece of
/// another's. begin: gets their number and CRC-32 (zlib's) first. Both functions are called on rank 0 alone. Collective.
void pass_on(Ranks& ranks, std::span<const std::byte> own,
             const std::function<void(uint64_t bytes, uint32_t checksum)>& begin,
             const std::function<void(std::span<const std::byte>)>& take);

/// This rank's part of bytes that rank 0 reads, in pieces of some MiB. read: fills a piece from an offset on; called on rank 0
/// alone. sizes: of the part of each rank. Collective.
std::vector<std::byte> part_of(Ranks& ranks, const std::vector<uint64_t>& sizes,
                               const std::function<void(uint64_t offset, std::span<std::byte>)>& read);

/// Bytes of rank 0, on every rank. own: ignored on other ranks. Collective.
std::vector<std::byte> told(Ranks& ranks, std::span<const std::byte> own);

}  // namespace ewa::train
