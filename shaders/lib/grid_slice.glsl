// SPDX-License-Identifier: Apache-2.0
// Reads the map of a pixel. The pass declares the buffer `grids`, and `push` with the image's layout and the photo.
#ifndef EWA_LIB_GRID_SLICE
#define EWA_LIB_GRID_SLICE
#include "lib/bilateral_grid.glsl"

GridSlice slice_at(uint i, vec3 color) {
    GridSlice slice;
    [[unroll]] for (uint row = 0u; row < 3u; ++row) slice.rows[row] = slice.by_level[row] = vec4(0.0);
    if (ONE_CELL) {
        [[unroll]] for (uint row = 0u; row < 3u; ++row) slice.rows[row] = grids[GRID_TEXELS * push.photo + row];
        return slice;
    }
    const uvec2 pixel = uvec2(i % push.image.size[0], i / push.image.size[0]);
    const vec3 place = vec3(grid_place(push.image, pixel), grid_level(color));
    const uvec3 first = min(uvec3(place), uvec3(GRID_WIDTH, GRID_HEIGHT, GRID_DEPTH) - 2u);
    const vec3 share = place - vec3(first);
    [[unroll]] for (uint corner = 0u; corner < 8u; ++corner) {
        const uvec3 step = uvec3(corner & 1u, corner >> 1u & 1u, corner >> 2u);
        const float area = (step.x == 1u ? share.x : 1.0 - share.x) * (step.y == 1u ? share.y : 1.0 - share.y);
        const float weight = area * (step.z == 1u ? share.z : 1.0 - share.z);
        const uint texel = GRID_TEXELS * push.photo + grid_texel(first + step);
        [[unroll]] for (uint row = 0u; row < 3u; ++row) {
            const vec4 cell = grids[texel + row];
            slice.rows[row] += weight * cell;
            slice.by_level[row] += (step.z == 1u ? area : -area) * cell;
        }
    }
    return slice;
}
#endif
