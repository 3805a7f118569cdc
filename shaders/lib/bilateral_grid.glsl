// SPDX-License-Identifier: Apache-2.0
// A bilateral grid: an affine map of colours that depends on the place in the image and on the colour's grey. A pixel's map is
// interpolated linearly between the 8 cells around it. The first and last cells lie on the borders of the image and at grey 0
// and 1. A grid of one cell has one map for all pixels.
#ifndef EWA_LIB_BILATERAL_GRID
#define EWA_LIB_BILATERAL_GRID

layout(constant_id = SPEC_MODE) const uint MODE = 0;
const bool ONE_CELL = (MODE & GRID_ONE_CELL) != 0u;
const uint CELLS_X = ONE_CELL ? 1u : GRID_WIDTH, CELLS_Y = ONE_CELL ? 1u : GRID_HEIGHT, CELLS_Z = ONE_CELL ? 1u : GRID_DEPTH;
const uvec3 GRID_SIZE = uvec3(CELLS_X, CELLS_Y, CELLS_Z);
const uint GRID_TEXELS = 3u * CELLS_X * CELLS_Y * CELLS_Z;   // of a photo
const vec3 GREY = vec3(GREY_RED, GREY_GREEN, GREY_BLUE);

// First texel of a cell of a grid.
uint grid_texel(uvec3 cell) { return 3u * (cell.x + CELLS_X * (cell.y + CELLS_Y * cell.z)); }

vec2 grid_place(ImageLayout image, uvec2 pixel) {
    return (vec2(pixel) + 0.5) / vec2(image.size[0], image.size[1]) * vec2(CELLS_X - 1u, CELLS_Y - 1u);
}

float grid_level(vec3 color) { return clamp(dot(GREY, color), 0.0, 1.0) * float(CELLS_Z - 1u); }

// The affine map of a colour: three rows of (matrix row, offset).
vec3 mapped(vec4 rows[3], vec3 color) {
    const vec4 c = vec4(color, 1.0);
    return vec3(dot(rows[0], c), dot(rows[1], c), dot(rows[2], c));
}

// The map at a pixel, and its derivative by the level.
struct GridSlice {
    vec4 rows[3];
    vec4 by_level[3];
};
#endif
