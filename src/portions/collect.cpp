// SPDX-License-Identifier: Apache-2.0
#include "portions/collect.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <numeric>
#include <utility>

namespace ewa::portions {
namespace {

/// A part for each rank.
using OutParts = std::vector<std::span<const std::byte>>;
using InParts = std::vector<std::span<std::byte>>;

constexpr size_t kPassedPiece = size_t(4) << 20;  // bytes

uint32_t checksum_of(std::span<const std::byte> bytes) {
    if (bytes.empty()) return 0;  // zlib restarts the sum for a null pointer
    return uint32_t(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point begin) {
    return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

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

void pass_on(Ranks& ranks, std::span<const std::byte> own,
             const std::function<void(uint64_t, uint32_t)>& begin,
             const std::function<void(std::span<const std::byte>)>& take) {
    const std::array<uint64_t, 2> card{own.size(), checksum_of(own)};
    const std::vector<uint64_t> cards = ranks.gather(card);
    uint64_t bytes = cards[0], checksum = cards[1];
    for (size_t i = 2; i < cards.size(); i += 2) {
        bytes += cards[i];
        checksum = crc32_combine(uLong(checksum), uLong(cards[i + 1]), z_off_t(cards[i]));
    }
    const bool first = ranks.rank() == 0;
    if (first) begin(bytes, uint32_t(checksum));
    if (first) take(own);
    std::vector<std::byte> buffer;
    for (size_t rank = 1; rank < size_t(ranks.size()); ++rank)
        for (uint64_t at = 0, size = cards[2 * rank]; at < size; at += kPassedPiece) {
            const size_t piece = std::min(kPassedPiece, size_t(size - at));
            OutParts out(size_t(ranks.size()));
            InParts in(size_t(ranks.size()));
            if (size_t(ranks.rank()) == rank) out[0] = own.subspan(at, piece);
            if (first) buffer.resize(piece);
            if (first) in[rank] = buffer;
            ranks.exchange(out, in);
            if (first) take(buffer);
        }
}

void hand_out(Ranks& ranks, const std::vector<uint64_t>& sizes,
              const std::function<void(uint64_t, std::span<std::byte>)>& read,
              const std::function<void(size_t, std::vector<std::byte>)>& take) {
    const size_t each = sizes.size() / size_t(ranks.size()), own = size_t(ranks.rank());
    uint64_t offset = 0;
    for (size_t part = 0; part < sizes.size(); offset += sizes[part++]) {
        const size_t to = part / each;
        std::vector<std::byte> taken(to == own ? sizes[part] : 0), buffer;
        if (to == 0 && own == 0) read(offset, taken);
        for (uint64_t at = 0; to > 0 && at < sizes[part]; at += kPassedPiece) {
            const size_t piece = std::min(kPassedPiece, size_t(sizes[part] - at));
            OutParts out(size_t(ranks.size()));
            InParts in(size_t(ranks.size()));
            if (own == 0) buffer.resize(piece);
            if (own == 0) read(offset + at, buffer);
            if (own == 0) out[to] = buffer;
            if (to == own) in[0] = std::span(taken).subspan(at, piece);
            ranks.exchange(out, in);
        }
        if (to == own) take(part, std::move(taken));
    }
}

std::vector<std::vector<std::byte>> exchanged(Ranks& ranks, std::vector<std::vector<std::byte>> out) {
    const size_t size = out.size(), own = size_t(ranks.rank());
    std::vector<std::vector<std::byte>> in(size);
    in[own] = std::exchange(out[own], {});  // stays here
    if (size == 1) return in;
    std::vector<uint64_t> sizes;
    for (const auto& part : out) sizes.push_back(part.size());
    const std::vector<uint64_t> all = ranks.gather(sizes);
    for (size_t rank = 0; rank < size; ++rank)
        if (rank != own) in[rank].resize(all[rank * size + own]);
    OutParts sent(out.begin(), out.end());
    InParts received(in.begin(), in.end());
    received[own] = {};
    ranks.exchange(sent, received);
    return in;
}

std::vector<std::byte> from_rank_0(Ranks& ranks, std::span<const std::byte> own) {
    const uint64_t size = own.size();
    std::vector<std::byte> received(ranks.gather(std::span(&size, 1)).front());
    OutParts out(size_t(ranks.size()));
    InParts in(size_t(ranks.size()));
    if (ranks.rank() == 0) std::fill(out.begin(), out.end(), own);
    in[0] = received;
    ranks.exchange(out, in);
    return received;
}

std::vector<uint64_t> CountedRanks::gather(std::span<const uint64_t> own) {
    const auto begin = Clock::now();
    std::vector<uint64_t> all = ranks_.gather(own);
    traffic_.waiting += milliseconds_since(begin);
    return all;
}

void CountedRanks::exchange(std::span<const std::span<std::byte>> out,
                            std::span<const std::span<std::byte>> in) {
    const auto begin = Clock::now();
    ranks_.exchange(OutParts(out.begin(), out.end()), in);
    traffic_.exchange += milliseconds_since(begin);
    for (size_t rank = 0; rank < out.size(); ++rank)
        if (rank != size_t(ranks_.rank())) traffic_.sent_bytes += out[rank].size();
}

}  // namespace ewa::portions
