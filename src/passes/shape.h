// SPDX-License-Identifier: Apache-2.0
// How kernels are cut for a device. Every such choice is made here, from the device's properties alone.
#pragma once
#include <array>
#include <bit>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "gpu/device.h"

#include "gpu/pipeline.h"
#include "shared/constants.h"
#include "shared/layouts.h"

namespace ewa::passes {

struct Shape {
    uint32_t subgroup = 8;  // lanes
    uint32_t group = 128;   // invocations of an element-wise workgroup, a multiple of subgroup
    uint32_t tile_width = 8, tile_height = 8;  // px; one subgroup owns a tile
    uint32_t sort_lanes_max = 512;             // lanes that share a radix sort
    uint32_t sort_chunk = 256;                 // items a sorting lane should have at least
    uint32_t sort_group = 64;                  // invocations of a sorting workgroup
    uint32_t tile_interleave = 1;              // neighbouring workgroups take tiles this far apart
    uint32_t max_groups = 65535;
    uint32_t loop_limit = 65535;  // turns a loop may take in one invocation
    float cut_off =
        float(shared::ALPHA_MIN);  // contributions under this are skipped; another is for comparisons
};

inline Shape shape_for(const gpu::Limits& limits) {
    Shape shape;
    shape.subgroup = limits.subgroup_size;
    if (shape.subgroup == 0 || shape.subgroup > 64 || (shape.subgroup & (shape.subgroup - 1)) != 0)
        throw std::logic_error("a subgroup of " + std::to_string(shape.subgroup) + " lanes");
    // Lanes stand side by side in a tile row; a narrow subgroup gets a narrow, tall tile.
    shape.tile_width = shape.subgroup < 8 ? shape.subgroup : 8;
    shape.tile_height = 64 / shape.tile_width;
    shape.max_groups = limits.max_groups;
    if (limits.cpu) {
        // Threads take contiguous shares of a dispatch: neighbours far apart make the shares equally heavy.
        shape.tile_interleave = 16;
        // Small workgroups share few lanes out evenly; starting one costs next to nothing here.
        shape.sort_group = shape.subgroup;
    } else {
        shape.sort_lanes_max = 16384;
        shape.sort_chunk = 64;
    }
    return shape;
}

/// Workgroups of an element-wise kernel over `items`, laid out on x and y within the device's limit.
inline std::array<uint32_t, 3> element_groups(const Shape& shape, uint64_t items, uint32_t z = 1) {
    const uint64_t groups = items == 0 ? 1 : (items + shape.group - 1) / shape.group;
    const uint64_t rows = (groups + shape.max_groups - 1) / shape.max_groups;
    return {uint32_t((groups + rows - 1) / rows), uint32_t(rows), z};
}

/// One workgroup of a single subgroup for each of `blocks`.
inline std::array<uint32_t, 3> subgroup_groups(const Shape& shape, uint64_t blocks) {
    const uint64_t groups = blocks == 0 ? 1 : blocks;
    const uint64_t rows = (groups + shape.max_groups - 1) / shape.max_groups;
    return {uint32_t((groups + rows - 1) / rows), uint32_t(rows), 1};
}

/// One workgroup a tile. The tile of workgroup (x, y) is x * push.tile_step[0] + y * push.tile_step[1].
inline std::array<uint32_t, 3> tile_groups(const Shape& shape, const shared::BlendPush& push) {
    const uint32_t tiles = push.tiles[0] * push.tiles[1];
    const uint32_t rows =
        push.tile_step[1] == 1 ? shape.tile_interleave : (tiles + push.tile_step[1] - 1) / push.tile_step[1];
    const uint32_t columns = push.tile_step[1] == 1 ? (tiles + rows - 1) / rows : push.tile_step[1];
    return {columns, rows, 1};
}

/// Steps for tile_groups: interleaved, or in rows as wide as the device's limit on one dimension asks for.
inline std::array<uint32_t, 2> tile_steps(const Shape& shape, uint32_t tiles) {
    if (shape.tile_interleave > 1) return {shape.tile_interleave, 1};
    return {1, tiles < shape.max_groups ? tiles : shape.max_groups};
}

inline gpu::SpecConstant spec(uint32_t id, uint32_t value) {
    return {id, value};
}
inline gpu::SpecConstant spec_float(uint32_t id, float value) {
    return {id, std::bit_cast<uint32_t>(value)};
}

}  // namespace ewa::passes
