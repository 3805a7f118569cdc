// SPDX-License-Identifier: Apache-2.0
// Sums over a tile's pixels, and the gradient slots that they go to. Needs tile.glsl. The including pass declares push,
// tile_starts, slots, and SUMS: the floats of a slot that it writes.
#ifndef EWA_LIB_TILE_SUMS
#define EWA_LIB_TILE_SUMS
const float NO_GRADIENT[12] = float[](0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
const bool WIDE_STORES = BROADCAST != BROADCAST_SHUFFLES;

// Sums BLOCK values over the subgroup at once. At each step a lane keeps half of its values and sends the other half, so
// that lane l ends with the sum of value l % BLOCK. Then lanes BLOCK apart are added.
float transposing_sum(float v[8]) {
    const uint lane = LANE;
    const bool b0 = (lane & 1u) != 0u, b1 = (lane & 2u) != 0u, b2 = (lane & 4u) != 0u;
    float four[4], two[2];
    if (BLOCK == 1u) return v[0];
    [[unroll]] for (uint i = 0; i < BLOCK / 2u; ++i)
        four[i] = (b0 ? v[2 * i + 1] : v[2 * i]) + subgroupShuffleXor(b0 ? v[2 * i] : v[2 * i + 1], 1u);
    if (BLOCK == 2u) return four[0];
    [[unroll]] for (uint i = 0; i < BLOCK / 4u; ++i)
        two[i] = (b1 ? four[2 * i + 1] : four[2 * i]) + subgroupShuffleXor(b1 ? four[2 * i] : four[2 * i + 1], 2u);
    if (BLOCK == 4u) return two[0];
    float sum = (b2 ? two[1] : two[0]) + subgroupShuffleXor(b2 ? two[0] : two[1], 4u);
    [[unroll]] for (uint s = 3u; s < DOUBLINGS; ++s) {
        if ((1u << s) < SUBGROUP) sum += subgroupShuffleXor(sum, 1u << s);
    }
    return sum;
}

// Whole texels take fewer memory transactions. On a CPU, each store costs, so unused floats are not written: those of a texel,
// or of half a texel.
void write_slot(uint index, float slot[12]) {
    [[unroll]] for (uint t = 0; t < SLOT_TEXELS; ++t) {
        const uint at = SLOT_TEXELS * index + t;
        const vec4 texel = vec4(slot[4 * t], slot[4 * t + 1], slot[4 * t + 2], slot[4 * t + 3]);
#ifdef EWA_TEXEL_BUFFERS
        if (4 * t < SUMS) slots[at].x = as_texel(texel).x;
        if (4 * t + 2 < SUMS) slots[at].y = as_texel(texel).y;
#else
        if (WIDE_STORES) {
            slots[at] = texel;
            continue;
        }
        [[unroll]] for (uint c = 0; c < 4; ++c) {
            if (4 * t + c < SUMS) slots[at][c] = texel[c];
        }
#endif
    }
}

// The sums of a quad's tiles over the splats that they have picked. They lie apart by place, for the banks of shared memory.
shared float shared_sums[QUADS != 0u ? QUAD_TILES * SUMS * BATCH : 1u];
uint sum_at(uint tile, uint sum, uint place) { return (tile * SUMS + sum) * BATCH + place; }

// The sums of the splat at this place of the batch over the tiles that have picked it, in the order of the tiles.
void add_tiles(Loaded batch, uint place, inout float slot[12]) {
    const uint picked = shared_words[place] >> PART_SHIFT & batch.open;
    [[unroll]] for (uint tile = 0; tile < QUAD_TILES; ++tile) {
        if ((picked >> tile & 1u) == 0u) continue;
        [[unroll]] for (uint i = 0; i < SUMS; ++i) slot[i] += shared_sums[sum_at(tile, i, place)];
    }
}

// The slots that the tile has not reached, from instance k to the end of its list, have gradient zero: they lie behind the
// last open pixel.
void write_other_slots(uint k, uint end, uint tile) {
    const uint place = own_place();
    // The last tile also clears the slots of instances with the sentinel tile. Every slot of the list is written, so that
    // none keeps values of an earlier frame.
    if (tile + 1u == push.tiles[0] * push.tiles[1]) {
        const uint all = tile_starts[tile + 2u];
        for (uint e = end; e < all; e += CREW) {
            if (e + place < all) write_slot(slot_of(e + place), NO_GRADIENT);
        }
    }
    for (; k < end; k += CREW) {
        if (k + place < end) write_slot(slot_of(k + place), NO_GRADIENT);
    }
}
#endif
