// SPDX-License-Identifier: Apache-2.0
// A bilateral grid: an affine map of colours that depends on the place in the image and on the colour's grey. A pixel's map is
// interpolated linearly between the 8 cells around it. The first and last cells lie on the borders of the image and at grey 0
// and 1.
#ifndef EWA_LIB_BILATERAL_GRID
#define EWA_LIB_BILATERAL_GRID

const uvec3 GRID_SIZE = uvec3(GRID_WIDTH, GRID_HEIGHT, GRID_DEPTH);
const vec3 GREY = vec3(GREY_RED, GREY_GREEN, GREY_BLUE);

// First texel of a cell of a grid.
uint grid_texel(uvec3 cell) { return 3u * (cell.x + GRID_WIDTH * (cell.y + GRID_HEIGHT * cell.z)); }

vec2 grid_place(ImageLayout image, uvec2 pixel) {
    return (vec2(pixel) + 0.5) / vec2(image.size[0], image.size[1]) * vec2(GRID_WIDTH - 1u, GRID_HEIGHT - 1u);
}

float grid_level(vec3 color) { return clamp(dot(GREY, color), 0.0, 1.0) * float(GRID_DEPTH - 1u); }

// The map at a pixel, and its derivative by the level.
struct GridSlice {
    vec4 rows[3];
    vec4 by_level[3];
};
#endif
