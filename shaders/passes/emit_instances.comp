#version 460
// SPDX-License-Identifier: Apache-2.0
// Writes the (splat, tile) instances in depth order.
// One invocation owns the splat at one depth rank, and of its tile rows the strip given by workgroup.z. The strip
// bounds the loop: a splat may cover more tiles than some drivers allow iterations.
// It reads the splat's record, tile count and prefix sum, and writes the keys and splats of its instances. A splat's
// instances are contiguous, in rows from top to bottom. With SPEC_QUADS they are of quads in place of tiles.
// SPEC_MODE: EMIT_FIRST_INSTANCES also writes where each splat's instances begin. With EMIT_LISTS a splat's index is its rank, and
// `lists` counts the instances of each tile.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/footprint.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
TEXELS(0, records);
layout(set = 0, binding = 1, scalar) readonly buffer Order { uint order[]; };
layout(set = 0, binding = 2, scalar) readonly buffer TileCounts { uint tile_counts[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Prefix { uint prefix[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Totals { uint totals[]; };
layout(set = 0, binding = 5, scalar) readonly buffer CountsBlock { Counts counts; };
layout(set = 0, binding = 6, scalar) writeonly buffer Keys { uint keys[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer Splats { uint splats[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer FirstInstances { uint first_instances[]; };
layout(set = 0, binding = 9, scalar) buffer Lists { uint lists[]; };
layout(push_constant, scalar) uniform Push { EmitPush push; };

void write(uint at, uint tile, uint splat) {
    keys[at] = tile;
    splats[at] = splat;
    if ((MODE & EMIT_LISTS) != 0u) atomicAdd(lists[tile], 1u);
}

void main() {
    const uint rank = dealt_index();
    if (rank >= push.splats || counts.instances > push.capacity) return;
    const uint splat = (MODE & EMIT_LISTS) != 0u ? rank : order[rank];
    const uint count = tile_counts[splat];
    if (count == 0u) return;
    const uvec2 size = uvec2(push.size[0], push.size[1]);
    const Footprint f = footprint_of(fetch(records, RECORD_TEXELS * splat),
                                     fetch(records, RECORD_TEXELS * splat + 1u), size);
    const uint strip = gl_WorkGroupID.z;
    const uint begin = max(f.row_begin, strip * push.strip_rows), end = min(f.row_end, (strip + 1u) * push.strip_rows);
    const uint first = totals[rank / push.scan_block] + prefix[rank];
    if (strip == 0u && (MODE & EMIT_FIRST_INSTANCES) != 0u) first_instances[splat] = first;
    // A splat that project's footprint counted may have an empty one here: its range is padded too.
    if (begin >= end && !(f.row_begin == f.row_end && strip == 0u)) return;

    uint at = first + count_tiles(f, f.row_begin, begin, size);
    for (uint row = begin; row < end; ++row) {
        const ListRow listed = list_row(f, row, size);
        // The count bounds the writes: project's footprint may be rounded differently from this one, and no instance
        // may land past the splat's own range.
        for (uint column = listed.columns.x; column < listed.columns.y; ++column) {
            if (at < first + count)
                write(at, row * push.tiles[0] + (WRAP != 0u ? column % push.tiles[0] : column),
                      QUADS != 0u ? splat | reached_tiles(listed, column, size) << PART_SHIFT : splat);
            ++at;
        }
    }
    // Pad the rest of the reserved range with the sentinel tile.
    for (; end == f.row_end && at < first + count; ++at) write(at, push.tiles[0] * push.tiles[1], splat);
}
