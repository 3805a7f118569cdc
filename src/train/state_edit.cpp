// SPDX-License-Identifier: Apache-2.0
#include "train/state_edit.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "ewa/error.h"
#include "portions/portions.h"

namespace ewa::train {

using portions::kTexelBytes;

namespace {

/// A flag for each splat.
std::vector<bool> flags_of(const std::vector<uint32_t>& indices, uint32_t splats) {
    std::vector<bool> flags(splats);
    for (const uint32_t i : indices) {
        if (i >= splats)
            throw InputError("an edit names splat " + std::to_string(i) + " of " + std::to_string(splats));
        flags[i] = true;
    }
    return flags;
}

bool is_named(const TrainerArray& array, portions::Array name) {
    return array.name == portions::name_of(name);
}

bool is_moments(const TrainerArray& array) {
    return is_named(array, portions::moments1) || is_named(array, portions::moments2);
}

/// Fills all texels of a splat.
void fill_splat(std::vector<std::byte>& bytes, uint32_t planes, size_t i, std::byte value) {
    const std::vector<std::byte> texels(planes * kTexelBytes, value);
    portions::unpack_splat(texels.data(), planes, i, bytes.data());
}

/// Sets the moments of these splats. Returns how many change.
uint32_t set_frozen(std::vector<std::byte>& bytes, uint32_t planes, const std::vector<bool>& which,
                    bool frozen) {
    static_assert(shared::FROZEN_MOMENT == 0xffffffffu);
    uint32_t changed = 0;
    for (size_t i = 0; i < which.size(); ++i) {
        if (!which[i] || is_frozen(bytes, planes, i) == frozen) continue;
        fill_splat(bytes, planes, i, frozen ? std::byte{0xff} : std::byte{0});
        ++changed;
    }
    return changed;
}

/// Moves the texels of these splats, whose indices ascend, to the front. The rest of the last block is zero.
void keep_texels(std::vector<std::byte>& bytes, uint32_t planes, const std::vector<uint32_t>& kept) {
    const size_t splat = planes * kTexelBytes;
    std::vector<std::byte> texels(splat);
    for (size_t to = 0; to < kept.size(); ++to) {
        portions::pack_splat(bytes.data(), planes, kept[to], texels.data());
        portions::unpack_splat(texels.data(), planes, to, bytes.data());
    }
    const size_t blocks = (kept.size() + shared::PARAM_BLOCK - 1) / shared::PARAM_BLOCK;
    bytes.resize(blocks * shared::PARAM_BLOCK * splat);
    for (size_t i = kept.size(); i < blocks * shared::PARAM_BLOCK; ++i)
        fill_splat(bytes, planes, i, std::byte{0});
}

void keep_statistics(std::vector<std::byte>& bytes, const std::vector<uint32_t>& kept) {
    constexpr size_t kEach = 8;
    for (size_t to = 0; to < kept.size(); ++to)
        std::memmove(bytes.data() + to * kEach, bytes.data() + kept[to] * kEach, kEach);
    bytes.resize(kept.size() * kEach);
}

}  // namespace

bool is_frozen(std::span<const std::byte> moments, uint32_t planes, size_t i) {
    uint32_t word;
    std::memcpy(&word, &moments[pipeline::parameter_index(planes, 0, i) * sizeof(word)], sizeof(word));
    return word == shared::FROZEN_MOMENT;
}

uint32_t count_frozen(std::span<const std::byte> moments, uint32_t planes) {
    uint32_t count = 0;
    for (size_t i = 0; i < moments.size() / (planes * kTexelBytes); ++i)
        count += is_frozen(moments, planes, i);
    return count;
}

EditCounts apply_edit(const SplatEdit& edit, TrainerState& state) {
    uint32_t& splats = state.report.splats;
    const uint32_t planes = pipeline::parameter_planes(state.sh_degree);
    const std::vector<bool> removed = flags_of(edit.remove, splats);
    std::vector<bool> frozen = flags_of(edit.freeze, splats), freed = flags_of(edit.unfreeze, splats);
    std::vector<uint32_t> kept;
    for (uint32_t i = 0; i < splats; ++i) {
        if (!removed[i]) kept.push_back(i);
        frozen[i] = frozen[i] && !removed[i];
        freed[i] = freed[i] && !removed[i] && !frozen[i];
    }
    if (kept.empty())
        throw InputError("the edit would remove all " + std::to_string(splats) +
                         " splats, and a training needs one");
    EditCounts counts{.removed = splats - uint32_t(kept.size())};
    for (TrainerArray& array : state.arrays) {
        if (is_moments(array)) {
            counts.unfrozen = set_frozen(array.bytes, planes, freed, false);
            counts.frozen = set_frozen(array.bytes, planes, frozen, true);
        }
        if (counts.removed == 0) continue;
        if (is_moments(array) || is_named(array, portions::params))
            keep_texels(array.bytes, planes, kept);
        else if (is_named(array, portions::statistics))
            keep_statistics(array.bytes, kept);
    }
    splats = uint32_t(kept.size());
    return counts;
}

}  // namespace ewa::train
