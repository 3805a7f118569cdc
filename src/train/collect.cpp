// SPDX-License-Identifier: Apache-2.0
#include "train/collect.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace ewa::train {
namespace {

/// A part for each rank.
using OutParts = std::vector<std::span<const std::byte>>;
using InParts = std::vector<std::span<std::byte>>;

}  // namespace

std::vector<std::byte> joined(Ranks& ranks, std::vector<std::byte> own) {
    if (ranks.size() == 1) return own;
    const uint64_t size = own.size();
    const std::vector<uint64_t> sizes = ranks.gather(std::span(&size, 1));
    std::vector<std::byte> all;
    OutParts out(sizes.size());
    InParts in(sizes.size());
    out[0] = own;
    if (ranks.rank() == 0) {
        all.resize(std::accumulate(sizes.begin(), sizes.end(), uint64_t(0)));
        uint64_t at = 0;
        for (size_t rank = 0; rank < sizes.size(); at += sizes[rank++])
            in[rank] = std::span(all).subspan(at, sizes[rank]);
    }
    ranks.exchange(out, in);
    return all;
}

std::vector<std::byte> part_of(Ranks& ranks, std::span<const std::byte> all,
                               const std::vector<uint64_t>& sizes) {
    std::vector<std::byte> own(sizes[size_t(ranks.rank())]);
    OutParts out(sizes.size());
    InParts in(sizes.size());
    uint64_t at = 0;
    if (ranks.rank() == 0)
        for (size_t rank = 0; rank < sizes.size(); at += sizes[rank++])
            out[rank] = all.subspan(at, sizes[rank]);
    in[0] = own;
    ranks.exchange(out, in);
    return own;
}

std::vector<std::byte> told(Ranks& ranks, std::span<const std::byte> own) {
    const uint64_t size = own.size();
    std::vector<std::byte> heard(ranks.gather(std::span(&size, 1)).front());
    OutParts out(size_t(ranks.size()));
    InParts in(size_t(ranks.size()));
    if (ranks.rank() == 0) std::fill(out.begin(), out.end(), own);
    in[0] = heard;
    ranks.exchange(out, in);
    return heard;
}

}  // namespace ewa::train
