// SPDX-License-Identifier: Apache-2.0
// How kernels are sized for a device: workgroups, tiles, lanes of a sort. Every such choice is made here,
// from the device's limits only.
#pragma once
#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "gpu/device.h"
#include "shared/constants.h"
#include "shared/layouts.h"

namespace ewa::passes {

using Groups = std::array<uint32_t, 3>;  // workgroups along x, y and z

struct KernelConfig {
    uint32_t subgroup = 8;         // lanes
    uint32_t element_group = 128;  // invocations of an element-wise workgroup, a multiple of subgroup
    uint32_t tile_width = 8, tile_height = 8;  // px; one subgroup owns a tile
    uint32_t sort_lanes_max = 512;             // lanes that share a radix sort
    uint32_t sort_chunk = 512;                 // least number of items of a sorting lane
    uint32_t sort_group = 64;                  // invocations of a sorting workgroup
    bool ranked_sort = false;                  // keys are ranked in shared memory; sort_lanes_max is not used
    bool live_counts = false;                  // with ranked_sort: the device counts the sort's workgroups
    uint32_t few_blocks =
        0;  // with ranked_sort: a sort of no more blocks of keys does without scans of their counters
    uint32_t scan_turns = 64;      // items that a lane scans
    uint32_t tile_interleave = 1;  // distance of neighbouring workgroups' tiles, or groups of splats
    uint32_t max_groups = 65535;   // workgroups along one dimension
    uint32_t loop_limit = 65535;   // iterations of a loop in one invocation
    uint32_t broadcast = shared::BROADCAST_SHUFFLES;  // of blending: SPEC_BROADCAST
    uint32_t frames_in_flight = 1;                    // training steps that are submitted and not finished
    bool replayed_steps = false;  // the commands of a training step are recorded once and submitted again
    bool texel_buffers = true;    // read-only buffers are texel buffers, or storage buffers
    // The next two are of frames with FrameRequest::splatting. Others have sorted slots and lists of tiles.
    uint32_t slots = shared::SLOTS_SORTED;  // SPEC_SLOTS
    uint32_t quads = 0;                     // SPEC_QUADS
    /// Most splats of a frame whose instances are put into lists of tiles, each of which is sorted in shared memory. 0: none. Then
    /// all splats are sorted by depth, and all instances by tile.
    uint32_t sorted_lists = 0;
    /// Modules that the build has made faster to compile. They change no byte. Tests compare them with whole ones.
    bool optimised_modules = true;
    /// Smaller alphas are skipped. Benchmarks change it to compare speed.
    float cut_off = float(shared::ALPHA_MIN);
};

constexpr uint32_t kRankedBytes = 32768;  // of shared memory, at most, in radix_scatter_ranked.comp

/// Whether the device can rank the keys of a sort in shared memory.
inline bool can_rank(const gpu::Limits& limits) {
    return limits.ballots && limits.shared_bytes >= kRankedBytes &&
           limits.max_invocations >= shared::RANKED_SUBGROUPS * limits.subgroup_size;
}

/// The largest batch of a quad that the device has room for. 0: none.
inline uint32_t most_quads(const gpu::Limits& limits) {
    const uint32_t crew = shared::QUAD_TILES * limits.subgroup_size;
    if (limits.max_invocations < crew) return 0;
    const uint32_t room = limits.shared_bytes / shared::QUAD_SPLAT_BYTES;
    return std::min(crew, room / limits.subgroup_size * limits.subgroup_size);
}

constexpr uint32_t kListGroup = 128;  // invocations that sort a list

/// For KernelConfig::sorted_lists: one list may have all splats of a frame. An invocation of sort_lists.comp then does 1.2 million
/// turns of loops on a GPU, which takes less than a second, and 50,367 on a CPU, whose driver ends loops after 65,535.
inline uint32_t most_sorted_lists(const gpu::Limits& limits) {
    return limits.cpu ? 1u << 16 : 1u << 20;
}

/// Throws std::logic_error unless the subgroup size is a power of two up to 64.
inline KernelConfig config_for(const gpu::Limits& limits) {
    KernelConfig config;
    config.subgroup = limits.subgroup_size;
    if (config.subgroup == 0 || config.subgroup > 64 || (config.subgroup & (config.subgroup - 1)) != 0)
        throw std::logic_error("a subgroup of " + std::to_string(config.subgroup) + " lanes");
    // Lanes are side by side in a tile row: a narrow subgroup gets a narrow, tall tile.
    config.tile_width = config.subgroup < 8 ? config.subgroup : 8;
    config.tile_height = 64 / config.tile_width;
    config.max_groups = limits.max_groups;
    config.texel_buffers = limits.texel_buffers;
    if (limits.cpu) {
        // Threads take contiguous parts of a dispatch. Neighbouring workgroups far apart balance these parts.
        config.tile_interleave = 16;
        // Small workgroups divide few lanes evenly between threads, and cost next to nothing to start.
        config.sort_group = config.subgroup;
        // Few lanes have few counters to clear and to add up. Each thread has four workgroups of lanes, for balance.
        config.sort_lanes_max = config.subgroup * std::clamp(4 * limits.threads, 8u, 64u);
    } else {
        config.sort_lanes_max = 16384;
        config.sort_chunk = 64;
        config.frames_in_flight = 2;
        config.replayed_steps = true;
        // A third fewer instances than with 64 pixels. A lane of 32 has registers for four pixels.
        if (config.subgroup == 32) config.tile_width = 16;
        config.scan_turns = 16;
        config.broadcast = limits.scalar_loads ? shared::BROADCAST_UNIFORM : shared::BROADCAST_SHARED;
        config.ranked_sort = config.live_counts = can_rank(limits);
        // A workgroup reads the counters of all blocks, which takes as long as the scans with 128 blocks.
        config.few_blocks = 128;
    }
    return config;
}

/// Workgroups on x and y, at least one, within the device's limit along x.
inline Groups grid_of(const KernelConfig& config, uint64_t groups, uint32_t z = 1) {
    if (groups == 0) groups = 1;
    const uint64_t rows = (groups + config.max_groups - 1) / config.max_groups;
    return {uint32_t((groups + rows - 1) / rows), uint32_t(rows), z};
}

/// Workgroups of an element-wise kernel over `items`, for each of z layers.
inline Groups element_groups(const KernelConfig& config, uint64_t items, uint32_t z = 1) {
    return grid_of(config, (items + config.element_group - 1) / config.element_group, z);
}

/// As element_groups, for kernels that take their items by dealt_index (shaders/lib/prelude.glsl).
inline Groups dealt_groups(const KernelConfig& config, uint64_t items, uint32_t z = 1) {
    const Groups plain = element_groups(config, items);
    const uint32_t rows = std::max(plain[1], config.tile_interleave);
    return {uint32_t((uint64_t(plain[0]) * plain[1] + rows - 1) / rows), rows, z};
}

/// One workgroup of a single subgroup for each block of `block` items.
inline Groups block_groups(const KernelConfig& config, uint64_t items, uint32_t block, uint32_t z = 1) {
    return grid_of(config, (items + block - 1) / block, z);
}

/// One workgroup a tile. The tile of workgroup (x, y) is x * push.tile_step[0] + y * push.tile_step[1].
inline Groups tile_groups(const KernelConfig& config, const shared::BlendPush& push) {
    const uint32_t tiles = push.tiles[0] * push.tiles[1];
    const uint32_t rows =
        push.tile_step[1] == 1 ? config.tile_interleave : (tiles + push.tile_step[1] - 1) / push.tile_step[1];
    const uint32_t columns = push.tile_step[1] == 1 ? (tiles + rows - 1) / rows : push.tile_step[1];
    return {columns, rows, 1};
}

/// Steps for tile_groups: interleaved, or in rows as long as the device's limit allows.
inline std::array<uint32_t, 2> tile_steps(const KernelConfig& config, uint32_t tiles) {
    if (config.tile_interleave > 1) return {config.tile_interleave, 1};
    return {1, tiles < config.max_groups ? tiles : config.max_groups};
}

/// Invocations of a workgroup that ranks keys in shared memory, and its keys.
inline uint32_t ranked_group(const KernelConfig& config) {
    return shared::RANKED_SUBGROUPS * config.subgroup;
}
inline uint32_t ranked_keys(const KernelConfig& config) {
    return shared::RANKED_LANE_KEYS / (config.subgroup > 32 ? 2 : 1) * ranked_group(config);
}

/// Pixels of the image that the push constants describe.
template <class Push>
uint64_t pixels(const Push& push) {
    if constexpr (std::is_same_v<Push, shared::ImageLayout>)
        return uint64_t(push.size[0]) * push.size[1];
    else
        return pixels(push.image);
}

/// Texels of an image plane, 4 pixels of a row each.
template <class Push>
uint64_t texels(const Push& push) {
    return uint64_t(push.image.stride / 4) * push.image.size[1];
}

/// Items of a loss pass down the columns. The image's stride is a multiple of 4.
inline uint64_t loss_column_items(const shared::LossPush& push) {
    const uint32_t height = push.image.size[1];
    return uint64_t(push.image.stride / 4) * ((height + shared::LOSS_ROWS - 1) / shared::LOSS_ROWS);
}
/// Items of a loss pass along the rows.
template <class Push>
uint64_t loss_row_items(const Push& push) {
    const uint32_t texels = push.image.stride / 4;
    return uint64_t((texels + shared::LOSS_TEXELS - 1) / shared::LOSS_TEXELS) * push.image.size[1];
}

}  // namespace ewa::passes
