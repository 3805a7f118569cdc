// SPDX-License-Identifier: Apache-2.0
#include "portions/portions.h"

#include <algorithm>
#include <cstring>
#include <ranges>
#include <string>
#include <utility>

#include "ewa/error.h"
#include "portions/collect.h"
#include "scene/splat_arrays.h"

namespace ewa::portions {

using namespace pipeline;

Range range_of(uint32_t all, int portion, int portions) {
    const uint64_t blocks = (uint64_t(all) + shared::PARAM_BLOCK - 1) / shared::PARAM_BLOCK;
    const auto begin = [&](int q) {
        return uint32_t(
            std::min<uint64_t>(all, blocks * uint64_t(q) / uint64_t(portions) * shared::PARAM_BLOCK));
    };
    return {begin(portion), begin(portion + 1) - begin(portion)};
}

void check_portions(uint32_t all, int portions) {
    if (portions > 1 && (uint64_t(all) + shared::PARAM_BLOCK - 1) / shared::PARAM_BLOCK < uint64_t(portions))
        throw RunError(std::to_string(all) + " splats are too few for " + std::to_string(portions) +
                       " parts: each needs " + std::to_string(shared::PARAM_BLOCK));
}

Portions::Portions(gpu::Device& device, std::shared_ptr<Ranks> group, const Gaussians& start,
                   const Setup& setup)
    : ranks_(std::move(group)),
      count_(setup.count),
      sh_degree_(start.sh_degree),
      origin_(start.origin),
      holder_(make_holder(device, setup)) {
    clear(uint32_t(start.size()));
    for (int i = 0; i < count(); ++i) {
        Model& model = holder_->use(i, Need::state);
        const bool whole = model.splats == start.size();
        const auto upload = [&](const Gaussians& part) {
            return upload_model(device, part, setup.moments, setup.statistics);
        };
        const auto rows = std::views::iota(model.first, model.first + model.splats);
        Model made = whole ? upload(start) : upload(scene::rows_of(start, rows));
        made.first = model.first;
        made.all = model.all;
        model = std::move(made);
    }
}

uint32_t Portions::largest() const {
    uint32_t most = 0;
    for (int i = 0; i < count(); ++i) most = std::max(most, holder_->model(i).splats);
    return most;
}

void Portions::clear(uint32_t splats) {
    check_portions(splats, all());
    splats_ = splats;
    for (int i = 0; i < count(); ++i) {
        const Range range = range_of(splats, first() + i, all());
        Model like;
        like.splats = like.capacity = range.splats;
        like.first = range.first;
        like.all = splats;
        like.sh_degree = sh_degree_;
        like.origin = origin_;
        holder_->clear(i, std::move(like));
    }
}

Gaussians Portions::gaussians() {
    if (alone()) {
        const Model& model = holder_->use(0, Need::params);
        return download_model(model, model.params);
    }
    const auto bytes = joined(*ranks_, holder_->download(params));
    if (ranks_->rank() != 0) return {};
    return gaussians_of(holder_->model(0),
                        {reinterpret_cast<const float*>(bytes.data()), bytes.size() / sizeof(float)},
                        splats_);
}

namespace {

/// Where plane p of splat i is in a buffer with the layout of the parameters, in bytes.
size_t texel_at(uint32_t planes, uint32_t p, size_t i) {
    return parameter_index(planes, 4 * p, i) * sizeof(float);
}

/// The splats of a range that another range has too: from begin to end.
std::pair<size_t, size_t> overlap(const Range& a, const Range& b) {
    const size_t begin = std::max(a.first, b.first);
    return {begin, std::max(begin, std::min<size_t>(a.first + a.splats, b.first + b.splats))};
}

}  // namespace

void pack_splat(const std::byte* array, uint32_t planes, size_t i, std::byte* to) {
    for (uint32_t p = 0; p < planes; ++p)
        std::memcpy(to + p * kTexelBytes, array + texel_at(planes, p, i), kTexelBytes);
}

void unpack_splat(const std::byte* from, uint32_t planes, size_t i, std::byte* array) {
    for (uint32_t p = 0; p < planes; ++p)
        std::memcpy(array + texel_at(planes, p, i), from + p * kTexelBytes, kTexelBytes);
}

void Portions::level() {
    std::vector<uint64_t> own;
    for (int i = 0; i < count(); ++i) own.push_back(holder_->model(i).splats);
    std::vector<Range> before, after;
    uint32_t sum = 0;
    for (const uint64_t splats : ranks_->gather(own)) {
        before.push_back({sum, uint32_t(splats)});
        sum += uint32_t(splats);
    }
    check_portions(sum, all());
    splats_ = sum;
    for (int p = 0; p < all(); ++p) after.push_back(range_of(sum, p, all()));
    for (int i = 0; i < count(); ++i) holder_->remove(i, statistics);
    const std::span<const Array> kept = holder_->kept();
    for (const Array array : kept)
        if (array != statistics && all() > 1) level(array, before, after);
    for (int i = 0; i < count(); ++i) {
        Model& model = holder_->model(i);
        model.first = after[size_t(first() + i)].first;
        model.splats = model.capacity = after[size_t(first() + i)].splats;
        model.all = sum;
        if (std::ranges::find(kept, statistics) != kept.end())
            holder_->give(i, statistics, std::vector<std::byte>(std::max<uint64_t>(8ull * model.splats, 8)));
    }
}

/// Splats travel packed, each with its texels one after another, so that a rank's range is one sequence of bytes.
void Portions::level(Array array, const std::vector<Range>& before, const std::vector<Range>& after) {
    const uint32_t planes = parameter_planes(sh_degree_);
    const size_t splat = planes * kTexelBytes;
    std::vector<std::vector<std::byte>> out(size_t(ranks_->size()));
    for (int i = 0; i < count(); ++i) {
        const Range& had = before[size_t(first() + i)];
        const std::vector<std::byte> bytes = holder_->download(i, array);
        holder_->remove(i, array);
        for (int p = 0; p < all(); ++p) {
            std::vector<std::byte>& to = out[size_t(rank_of(p))];
            const auto [begin, end] = overlap(had, after[size_t(p)]);
            size_t at = to.size();
            to.resize(at + (end - begin) * splat);
            for (size_t s = begin; s < end; ++s, at += splat)
                pack_splat(bytes.data(), planes, s - had.first, &to[at]);
        }
    }
    const std::vector<std::vector<std::byte>> in = exchanged(*ranks_, std::move(out));
    size_t rank = 0, at = 0;
    for (int i = 0; i < count(); ++i) {
        const Range& has = after[size_t(first() + i)];
        std::vector<std::byte> bytes(parameter_bytes(has.splats, sh_degree_));
        for (size_t s = 0; s < has.splats; ++s, at += splat) {
            while (at == in[rank].size()) at = 0, ++rank;
            unpack_splat(&in[rank][at], planes, s, bytes.data());
        }
        holder_->give(i, array, std::move(bytes));
    }
}

}  // namespace ewa::portions
