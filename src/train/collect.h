// SPDX-License-Identifier: Apache-2.0
// Bytes that the ranks hold together: joined on rank 0, and divided again.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "ewa/ranks.h"

namespace ewa::train {

/// The bytes of all ranks one after another, on rank 0; empty on the others. Collective.
std::vector<std::byte> joined(Ranks& ranks, std::vector<std::byte> own);

/// This rank's part of bytes that rank 0 has. all: ignored on other ranks. sizes: of the part of each rank. Collective.
std::vector<std::byte> part_of(Ranks& ranks, std::span<const std::byte> all,
                               const std::vector<uint64_t>& sizes);

/// Bytes of rank 0, on every rank. own: ignored on other ranks. Collective.
std::vector<std::byte> told(Ranks& ranks, std::span<const std::byte> own);

}  // namespace ewa::train
