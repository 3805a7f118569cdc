// SPDX-License-Identifier: Apache-2.0
#include "portions/portions.h"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "ewa/error.h"
#include "portions/collect.h"

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

gpu::Buffer& Portions::Portion::buffer(size_t array) {
    const std::array<gpu::Buffer*, arrays> all{&model.params, &model.moments1, &model.moments2,
                                               &model.statistics, &list_indices};
    return *all[array];
}

Portions::Portions(gpu::Device& device, std::shared_ptr<Ranks> group, const Gaussians& start,
                   const Setup& setup)
    : device_(device),
      ranks_(std::move(group)),
      own_(size_t(setup.count)),
      kept_{params, Array::moments1},
      sh_degree_(start.sh_degree),
      origin_(start.origin) {
    if (setup.moments > 1) kept_.push_back(Array::moments2);
    if (setup.statistics) kept_.push_back(statistics);
    clear(uint32_t(start.size()));
    if (streamed()) device.limit_memory(setup.limit, [this] { return evict(); });
    for (int i = 0; i < count(); ++i) {
        in_use_ = i;
        Model& model = own_[size_t(i)].model;
        const bool whole = model.splats == start.size();
        const auto upload = [&](const Gaussians& part) {
            return upload_model(device, part, setup.moments, setup.statistics);
        };
        Model made = whole ? upload(start) : upload(slice_of(start, model.first, model.splats));
        made.first = model.first;
        made.all = model.all;
        model = std::move(made);
    }
}

Portions::~Portions() {
    // What remains on the device, such as an evaluation, keeps the limit.
    if (streamed()) device_.make_room_with({});
}

uint32_t Portions::own_splats() const {
    const auto add = [](uint32_t sum, const Portion& portion) { return sum + portion.model.splats; };
    return std::accumulate(own_.begin(), own_.end(), 0u, add);
}

uint32_t Portions::largest() const {
    uint32_t most = 0;
    for (const Portion& portion : own_) most = std::max(most, portion.model.splats);
    return most;
}

void Portions::copy_to_host(Portion& portion, size_t array) {
    Kept& kept = portion.kept[array];
    const gpu::Buffer& buffer = portion.buffer(array);
    if (!buffer || kept.same_as == buffer.serial()) return;
    kept.name = buffer.name();
    kept.texel = buffer.texel();
    kept.bytes.resize(buffer.bytes());
    stream(kept.bytes.size(), [&] { buffer.download(std::span<std::byte>(kept.bytes)); });
    kept.same_as = buffer.serial();
}

/// How many portions are used before this array is needed again. The visit after this one goes the other way, and visits
/// that need parameters alone take turns with those that need the state.
int Portions::visits_until(int portion, size_t array) const {
    const int last = count() - 1;
    const int at = in_use_ < 0 ? -1 : forwards_ ? in_use_ : last - in_use_;
    const int place = forwards_ ? portion : last - portion;
    const bool state = array != params;
    if (place > at && !(state && need_ != Need::state)) return place - at;
    const int next_visit = (last - at) + (last - place) + 1;
    return state && need_ == Need::state ? next_visit + count() : next_visit;
}

/// Frees the array of another portion that is not needed for longest. False if there is none.
bool Portions::evict() {
    if (std::exchange(evicting_, true)) return false;  // the copy to the host asks for room itself
    int most = -1;
    std::pair<size_t, size_t> found;
    for (size_t p = 0; p < own_.size(); ++p)
        for (size_t array = 0; int(p) != in_use_ && array < arrays; ++array)
            if (own_[p].buffer(array) && visits_until(int(p), array) > most) {
                most = visits_until(int(p), array);
                found = {p, array};
            }
    if (most >= 0) {
        Portion& portion = own_[found.first];
        copy_to_host(portion, found.second);
        portion.buffer(found.second) = gpu::Buffer();
    }
    evicting_ = false;
    return most >= 0;
}

Model& Portions::use(int index, Need need) {
    in_use_ = index;
    Portion& portion = own_[size_t(index)];
    for (size_t array = 0; array < arrays; ++array) {
        Kept& kept = portion.kept[array];
        gpu::Buffer& buffer = portion.buffer(array);
        const bool wanted =
            need == Need::state || array == params || (need == Need::statistics && array == statistics);
        if (!wanted || buffer || kept.bytes.empty()) continue;
        gpu::Buffer brought(device_, kept.name, kept.bytes.size(), kept.texel);
        stream(kept.bytes.size(), [&] { brought.upload(std::span<const std::byte>(kept.bytes)); });
        buffer = std::move(brought);
        kept.same_as = buffer.serial();
        if (!streamed()) kept = {};
    }
    return portion.model;
}

void Portions::changed() {
    for (Kept& kept : own_[size_t(in_use_)].kept) kept.same_as = 0;
}

gpu::Buffer Portions::take_list_indices() {
    Portion& portion = own_[size_t(in_use_)];
    portion.kept[Array::list_indices] = {};
    return std::move(portion.list_indices);
}

void Portions::keep_list_indices(gpu::Buffer listed) {
    own_[size_t(in_use_)].list_indices = std::move(listed);
}

void Portions::visit(Need need, const std::function<void(int, Model&)>& visit) {
    need_ = need;
    for (int i = 0; i < count(); ++i) {
        const int portion = forwards_ ? i : count() - 1 - i;
        visit(portion, use(portion, need));
    }
    in_use_ = -1;
    forwards_ = !forwards_;
}

const char* Portions::name_of(Array array) {
    constexpr std::array kNames{"params", "moments1", "moments2", "statistics"};
    return kNames[array];
}

uint64_t Portions::bytes_of(Array array, uint32_t splats) const {
    return array == statistics ? 8ull * splats : parameter_bytes(splats, sh_degree_);
}

uint64_t Portions::state_bytes(uint32_t splats) const {
    uint64_t sum = 0;
    for (const Array array : kept_) sum += bytes_of(array, splats);
    return sum;
}

std::vector<std::byte> Portions::bytes_of(Portion& portion, Array array) {
    const uint64_t size = bytes_of(array, portion.model.splats);
    if (!streamed()) return portion.buffer(array).download<std::byte>(size);
    copy_to_host(portion, array);
    const std::vector<std::byte>& bytes = portion.kept[array].bytes;
    if (size > bytes.size()) throw std::logic_error("a portion lacks an array");
    return {bytes.begin(), bytes.begin() + std::ptrdiff_t(size)};
}

std::vector<std::byte> Portions::bytes(Array array) {
    if (!streamed()) return bytes_of(own_.front(), array);
    std::vector<std::byte> all;
    for (Portion& portion : own_) {
        const std::vector<std::byte> bytes = bytes_of(portion, array);
        all.insert(all.end(), bytes.begin(), bytes.end());
    }
    return all;
}

void Portions::pass_on(Array array, const std::function<void(uint64_t, uint32_t)>& begin,
                       const std::function<void(std::span<const std::byte>)>& take) {
    portions::pass_on(*ranks_, bytes(array), begin, take);
}

void Portions::hand_out(Array array, const std::function<void(uint64_t, std::span<std::byte>)>& read) {
    std::vector<uint64_t> sizes;
    for (int p = 0; p < all(); ++p) sizes.push_back(bytes_of(array, range_of(splats_, p, all()).splats));
    portions::hand_out(*ranks_, sizes, read, [&](size_t part, std::vector<std::byte> bytes) {
        give(int(part) - first(), array, std::move(bytes));
    });
}

Gaussians Portions::gaussians() {
    if (alone()) {
        const pipeline::Model& model = use(0, Need::params);
        return pipeline::download_model(model, model.params);
    }
    const auto bytes = joined(*ranks_, this->bytes(params));
    if (ranks_->rank() != 0) return {};
    return pipeline::gaussians_of(
        own_.front().model, {reinterpret_cast<const float*>(bytes.data()), bytes.size() / sizeof(float)},
        splats_);
}

std::vector<std::byte> Portions::sent(std::span<const std::byte> own) const {
    return from_rank_0(*ranks_, own);
}

void Portions::clear(uint32_t splats) {
    check_portions(splats, all());
    splats_ = splats;
    for (int i = 0; i < count(); ++i) {
        const Range range = range_of(splats, first() + i, all());
        Portion& portion = own_[size_t(i)];
        portion = {};
        portion.model.splats = portion.model.capacity = range.splats;
        portion.model.first = range.first;
        portion.model.all = splats;
        portion.model.sh_degree = sh_degree_;
        portion.model.origin = origin_;
    }
}

void Portions::give(int portion, Array array, std::vector<std::byte> bytes) {
    const gpu::Texel texel = array == params       ? gpu::Texel::rgba32f
                             : array == statistics ? gpu::Texel::none
                                                   : gpu::Texel::rgba32ui;
    own_[size_t(portion)].kept[array] = {name_of(array), texel, std::move(bytes), 0};
    if (!streamed()) use(portion, Need::state);
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
    for (const Portion& portion : own_) own.push_back(portion.model.splats);
    std::vector<Range> before, after;
    uint32_t sum = 0;
    for (const uint64_t splats : ranks_->gather(own)) {
        before.push_back({sum, uint32_t(splats)});
        sum += uint32_t(splats);
    }
    check_portions(sum, all());
    splats_ = sum;
    for (int p = 0; p < all(); ++p) after.push_back(range_of(sum, p, all()));
    for (Portion& portion : own_) {
        portion.model.statistics = gpu::Buffer();
        portion.kept[statistics] = {};
    }
    for (const Array array : kept_)
        if (array != statistics && all() > 1) level(array, before, after);
    for (int i = 0; i < count(); ++i) {
        Model& model = own_[size_t(i)].model;
        model.first = after[size_t(first() + i)].first;
        model.splats = model.capacity = after[size_t(first() + i)].splats;
        model.all = sum;
        if (std::ranges::find(kept_, statistics) != kept_.end())
            give(i, statistics, std::vector<std::byte>(std::max<uint64_t>(8ull * model.splats, 8)));
    }
}

/// Splats travel packed, each with its texels one after another, so that a rank's range is one sequence of bytes.
void Portions::level(Array array, const std::vector<Range>& before, const std::vector<Range>& after) {
    const uint32_t planes = parameter_planes(sh_degree_);
    const size_t splat = planes * kTexelBytes;
    std::vector<std::vector<std::byte>> out(size_t(ranks_->size()));
    for (int i = 0; i < count(); ++i) {
        Portion& portion = own_[size_t(i)];
        const Range& had = before[size_t(first() + i)];
        const std::vector<std::byte> bytes = bytes_of(portion, array);
        portion.buffer(array) = gpu::Buffer();
        portion.kept[array] = {};
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
        give(i, array, std::move(bytes));
    }
}

}  // namespace ewa::portions
