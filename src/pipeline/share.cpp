// SPDX-License-Identifier: Apache-2.0
#include "pipeline/share.h"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <string>
#include <utility>

#include "ewa/error.h"

namespace ewa::pipeline {
namespace {

constexpr size_t kTexel = 16;  // bytes

/// Where plane p of splat i is in a buffer with the layout of the parameters, in bytes.
size_t texel_at(uint32_t planes, uint32_t p, size_t i) {
    return parameter_index(planes, 4 * p, i) * sizeof(float);
}

/// A splat's texels one after another.
void pack_splat(const std::byte* array, uint32_t planes, size_t i, std::byte* to) {
    for (uint32_t p = 0; p < planes; ++p)
        std::memcpy(to + p * kTexel, array + texel_at(planes, p, i), kTexel);
}
void unpack_splat(const std::byte* from, uint32_t planes, size_t i, std::byte* array) {
    for (uint32_t p = 0; p < planes; ++p)
        std::memcpy(array + texel_at(planes, p, i), from + p * kTexel, kTexel);
}

/// Bytes for every rank and from every rank.
struct Parcels {
    std::vector<std::vector<std::byte>> out, in;
    explicit Parcels(size_t ranks) : out(ranks), in(ranks) {}
    void exchange(Ranks& ranks) {
        const std::vector<std::span<const std::byte>> sent(out.begin(), out.end());
        const std::vector<std::span<std::byte>> received(in.begin(), in.end());
        ranks.exchange(sent, received);
    }
};

struct Overlap {
    size_t begin, end;  // splats of all ranks
    size_t size() const { return end - begin; }
};
Overlap overlap(size_t first_a, size_t size_a, size_t first_b, size_t size_b) {
    const size_t begin = std::max(first_a, first_b), end = std::min(first_a + size_a, first_b + size_b);
    return {begin, std::max(begin, end)};
}

/// The splats of each rank, as they are and as they will be.
struct Division {
    std::vector<Range> before, after;
};

/// An array of the layout of the parameters, levelled.
gpu::Buffer levelled(gpu::Device& device, const Model& model, const gpu::Buffer& array,
                     const Division& division) {
    Ranks& ranks = *model.share.ranks;
    const size_t size = size_t(ranks.size()), own = size_t(ranks.rank());
    const uint32_t planes = model.planes();
    const size_t splat = planes * kTexel;
    Parcels parcels(size);
    const Range &had = division.before[own], &has = division.after[own];
    const auto bytes = array.download<std::byte>(parameter_bytes(had.splats, model.sh_degree));
    for (size_t rank = 0; rank < size; ++rank) {
        const Range &theirs = division.after[rank], &from = division.before[rank];
        const Overlap given = overlap(had.first, had.splats, theirs.first, theirs.splats);
        parcels.out[rank].resize(given.size() * splat);
        for (size_t i = given.begin; i < given.end; ++i)
            pack_splat(bytes.data(), planes, i - had.first, &parcels.out[rank][(i - given.begin) * splat]);
        parcels.in[rank].resize(overlap(has.first, has.splats, from.first, from.splats).size() * splat);
    }
    parcels.exchange(ranks);
    std::vector<std::byte> next(parameter_bytes(has.splats, model.sh_degree));
    size_t i = 0;
    for (const auto& part : parcels.in)
        for (size_t at = 0; at < part.size(); at += splat, ++i)
            unpack_splat(&part[at], planes, i, next.data());
    gpu::Buffer result =
        parameter_buffer(device, array.name().c_str(), array.texel(), has.splats, model.sh_degree);
    result.upload(std::span<const std::byte>(next));
    return result;
}

}  // namespace

Range range_of(uint32_t all, int rank, int ranks) {
    const uint64_t blocks = (uint64_t(all) + shared::PARAM_BLOCK - 1) / shared::PARAM_BLOCK;
    const auto begin = [&](int q) {
        return uint32_t(
            std::min<uint64_t>(all, blocks * uint64_t(q) / uint64_t(ranks) * shared::PARAM_BLOCK));
    };
    return {begin(rank), begin(rank + 1) - begin(rank)};
}

Gaussians slice_of(const Gaussians& all, size_t first, size_t count) {
    Gaussians part;
    part.sh_degree = all.sh_degree;
    part.origin = all.origin;
    part.density = all.density;
    part.resize(count);
    const auto copy = [&](const std::vector<float>& from, std::vector<float>& to) {
        const size_t values = from.size() / all.size();
        std::copy_n(from.begin() + std::ptrdiff_t(values * first), values * count, to.begin());
    };
    copy(all.means, part.means);
    copy(all.opacity_logits, part.opacity_logits);
    copy(all.quaternions, part.quaternions);
    copy(all.log_scales, part.log_scales);
    copy(all.sh, part.sh);
    return part;
}

void check_share(uint32_t all, int ranks) {
    if (ranks > 1 && (uint64_t(all) + shared::PARAM_BLOCK - 1) / shared::PARAM_BLOCK < uint64_t(ranks))
        throw RunError(std::to_string(all) + " splats are too few for " + std::to_string(ranks) +
                       " parts: each needs " + std::to_string(shared::PARAM_BLOCK));
}

uint64_t sum_over(Ranks& ranks, uint64_t own) {
    const std::vector<uint64_t> all = ranks.gather(std::span(&own, 1));
    return std::accumulate(all.begin(), all.end(), uint64_t(0));
}

void level(gpu::Device& device, Model& model) {
    Ranks& ranks = *model.share.ranks;
    const uint64_t own = model.splats;
    Division division;
    uint32_t all = 0;
    for (const uint64_t splats : ranks.gather(std::span(&own, 1))) {
        division.before.push_back({all, uint32_t(splats)});
        all += uint32_t(splats);
    }
    check_share(all, ranks.size());
    for (int rank = 0; rank < ranks.size(); ++rank)
        division.after.push_back(range_of(all, rank, ranks.size()));
    const Range mine = division.after[size_t(ranks.rank())];
    model.share.first = mine.first;
    model.share.all = all;
    if (ranks.size() == 1) return;
    for (gpu::Buffer* array : {&model.params, &model.moments1, &model.moments2})
        if (*array) *array = levelled(device, model, *array, division);
    model.splats = model.capacity = mine.splats;
}

namespace {

/// A source that another rank's target copies. Its texels follow.
struct SentSource {
    uint32_t draw = 0, index = 0, hits = 0, unused = 0;
};
static_assert(sizeof(SentSource) == kTexel);

/// Which rank has the target of a draw. The draws of a rank's dead splats follow those of the ranks before; then come those
/// of new splats.
struct Targets {
    std::vector<uint64_t> dead;  // splats of the ranks up to this one
    size_t rank_of(uint64_t draw) const {
        const auto found = std::upper_bound(dead.begin(), dead.end(), draw);
        return std::min(size_t(found - dead.begin()), dead.size() - 1);
    }
    uint64_t first(size_t rank) const { return rank == 0 ? 0 : dead[rank - 1]; }
};

}  // namespace

ForeignSources fetch_sources(gpu::Device& device, Model& model, gpu::Buffer sources, gpu::Buffer hits,
                             uint32_t dead, uint32_t added) {
    Ranks& ranks = *model.share.ranks;
    const size_t size = size_t(ranks.size()), own = size_t(ranks.rank());
    const uint32_t planes = model.planes();
    const size_t splat = sizeof(SentSource) + planes * kTexel;
    // Read before others take their turn: then no rank of this process keeps the device's memory meanwhile.
    const auto drawn = sources.download<uint32_t>(sources.bytes() / 4);
    auto all_hits = hits.download<uint32_t>(model.splats);
    sources = {};
    hits = {};
    const uint64_t own_dead = dead;
    Targets targets{ranks.gather(std::span(&own_dead, 1))};
    std::partial_sum(targets.dead.begin(), targets.dead.end(), targets.dead.begin());
    const uint64_t draws = targets.dead.back() + added;

    const auto params = model.params.download<std::byte>(parameter_bytes(model.splats, model.sh_degree));
    Parcels parcels(size);
    for (uint32_t d = 0; d < draws; ++d) {
        if (drawn[d] == shared::NOT_LISTED) continue;
        const size_t rank = targets.rank_of(d);
        std::vector<std::byte>& out = parcels.out[rank];
        const SentSource sent{d, drawn[d], all_hits[drawn[d]]};
        // What stays here needs no texels, but all have the same size.
        out.resize(out.size() + splat);
        std::memcpy(&out[out.size() - splat], &sent, sizeof(sent));
        if (rank != own) pack_splat(params.data(), planes, drawn[d], &out[out.size() - splat + sizeof(sent)]);
    }
    std::vector<uint64_t> bytes;
    for (const auto& out : parcels.out) bytes.push_back(out.size());
    const std::vector<uint64_t> all_bytes = ranks.gather(bytes);
    for (size_t rank = 0; rank < size; ++rank) parcels.in[rank].resize(all_bytes[rank * size + own]);
    parcels.exchange(ranks);

    size_t foreign = 0;
    for (size_t rank = 0; rank < size; ++rank)
        if (rank != own) foreign += parcels.in[rank].size() / splat;
    const uint32_t extended = uint32_t(model.splats + foreign);
    std::vector<std::byte> values(parameter_bytes(extended, model.sh_degree));
    std::copy(params.begin(), params.end(), values.begin());
    const uint64_t first_draw = targets.first(own);
    std::vector<uint32_t> places(dead + (own + 1 == size ? added : 0u));
    for (size_t rank = 0; rank < size; ++rank)
        for (size_t at = 0; at < parcels.in[rank].size(); at += splat) {
            SentSource sent;
            std::memcpy(&sent, &parcels.in[rank][at], sizeof(sent));
            uint32_t index = sent.index;
            if (rank != own) {
                index = uint32_t(all_hits.size());
                unpack_splat(&parcels.in[rank][at + sizeof(sent)], planes, index, values.data());
                all_hits.push_back(sent.hits);
            }
            places[size_t(sent.draw - first_draw)] = index;
        }
    model.params = parameter_buffer(device, "params", model.params.texel(), extended, model.sh_degree);
    model.params.upload(std::span<const std::byte>(values));
    ForeignSources result{gpu::Buffer(device, "sources", std::max<uint64_t>(4 * places.size(), 4)),
                          gpu::Buffer(device, "hits", 4 * all_hits.size())};
    if (!places.empty()) result.sources.upload(std::span<const uint32_t>(places));
    result.hits.upload(std::span<const uint32_t>(all_hits));
    return result;
}

}  // namespace ewa::pipeline
