// SPDX-License-Identifier: Apache-2.0
// The pixels of a lane's column of a tile, out of image planes that are fetched as texels of 4 pixels. Zero outside the image.
// Needs tile.glsl. The including pass declares push.
#ifndef EWA_LIB_TILE_COLUMNS
#define EWA_LIB_TILE_COLUMNS
// With 8 lanes, each lane fetches the two texels of a row, and the subgroup turns rows into columns. Texels are fast to fetch on
// CPU drivers, where a load of single floats is a loop over the lanes.
#ifdef EWA_TEXEL_BUFFERS
const bool BY_ROWS = SUBGROUP == 8u && TILE_WIDTH == 8u && TILE_HEIGHT == 8u;
#else
const bool BY_ROWS = false;
#endif

// values[c] is column c of the lane's row. Afterwards, values[r] is row r of the lane's column.
void transpose_tile(inout float values[PIXELS]) {
    [[unroll]] for (uint s = 0u; s < 3u; ++s) {
        const uint step = 1u << s;
        const bool upper = (LANE & step) != 0u;
        [[unroll]] for (uint i = 0u; i < PIXELS; ++i) {
            if ((i & step) != 0u || (i | step) >= PIXELS) continue;
            const float low = values[i], high = values[i | step];
            const float other = subgroupShuffleXor(upper ? low : high, step);
            values[i] = upper ? other : low;
            values[i | step] = upper ? high : other;
        }
    }
}

// Fills COLUMN, an array of PIXELS floats, from plane PLANE of SOURCE. px, py: the lane's first pixel.
#define COLUMN_OF(SOURCE, PLANE, COLUMN) \
    if (BY_ROWS) { \
        const uint row = py + LANE, first = px - LANE; \
        const uint at = (PLANE) * push.image.plane_floats + min(row, push.image.size[1] - 1u) * push.image.stride; \
        [[unroll]] for (uint half_row = 0u; half_row < 2u; ++half_row) { \
            const uint x = first + 4u * half_row; \
            const vec4 texel = fetch(SOURCE, (at + min(x, push.image.stride - 4u)) / 4u); \
            [[unroll]] for (uint c = 0u; c < 4u; ++c) \
                COLUMN[(4u * half_row + c) % PIXELS] = row < push.image.size[1] && x + c < push.image.size[0] ? texel[c] : 0.0; \
        } \
        transpose_tile(COLUMN); \
    } else { \
        [[unroll]] for (uint p = 0u; p < PIXELS; ++p) { \
            const uint y = py + p * ROW_STEP; \
            const uint at = (PLANE) * push.image.plane_floats + min(y, push.image.size[1] - 1u) * push.image.stride + \
                            min(px, push.image.size[0] - 1u); \
            COLUMN[p] = px < push.image.size[0] && y < push.image.size[1] ? fetch(SOURCE, at / 4u)[at % 4u] : 0.0; \
        } \
    }

// Writes COLUMN, an array of PIXELS floats, to plane PLANE of TARGET, which PLANES_OUT has declared.
#ifdef EWA_TEXEL_BUFFERS
// Two neighbouring lanes exchange every second pixel, so that each stores pairs of pixels in a row. What lies right of the image
// within its stride is zero, and stays zero.
#define PLANES_OUT(BINDING, NAME) \
    layout(set = 0, binding = BINDING, scalar) writeonly buffer Out##BINDING { uint64_t NAME[]; }
#define STORE_COLUMN(TARGET, PLANE, COLUMN) \
    [[unroll]] for (uint p = 0u; p < PIXELS; p += 2u) { \
        const bool odd = (LANE & 1u) != 0u; \
        const float own = odd ? COLUMN[p + 1u] : COLUMN[p], other = subgroupShuffleXor(odd ? COLUMN[p] : COLUMN[p + 1u], 1u); \
        const uint x = px & ~1u, y = py + (odd ? p + 1u : p) * ROW_STEP; \
        const vec2 pair = odd ? vec2(other, px < push.image.size[0] ? own : 0.0) : vec2(own, x + 1u < push.image.size[0] ? other : 0.0); \
        if (x < push.image.size[0] && y < push.image.size[1]) \
            TARGET[((PLANE) * push.image.plane_floats + y * push.image.stride + x) / 2u] = packUint2x32(floatBitsToUint(pair)); \
    }
#else
#define PLANES_OUT(BINDING, NAME) layout(set = 0, binding = BINDING, scalar) writeonly buffer Out##BINDING { float NAME[]; }
#define STORE_COLUMN(TARGET, PLANE, COLUMN) \
    [[unroll]] for (uint p = 0u; p < PIXELS; ++p) { \
        const uint y = py + p * ROW_STEP; \
        if (px < push.image.size[0] && y < push.image.size[1]) \
            TARGET[(PLANE) * push.image.plane_floats + y * push.image.stride + px] = COLUMN[p]; \
    }
#endif
#endif
