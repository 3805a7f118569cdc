#version 460
// SPDX-License-Identifier: Apache-2.0
// Gradient of grid_slice by the cells. One workgroup is one subgroup. It owns GRID_LEVELS cells above one another and one part
// of the rows of pixels that use them. It reads the render and dL/d(image), and writes what its pixels add to the gradient of
// its cells. The first part adds the gradient of the total variation, which one cell has not.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/image.glsl"
#include "lib/subgroup.glsl"
#include "lib/bilateral_grid.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) readonly buffer Image { float image[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Grids { vec4 grids[]; };
layout(set = 0, binding = 2, scalar) readonly buffer ImageGradient { float image_gradient[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Sums { vec4 sums[]; };
layout(push_constant, scalar) uniform Push { GridPush push; };

const uint LEVELS = ONE_CELL ? 1u : GRID_LEVELS;

// The pixels along an axis that use cell k: those less than 1 from it. A neighbour more at each end has no weight.
uvec2 pixels_of(uint k, uint cells, uint size) {
    if (ONE_CELL) return uvec2(0u, size);
    const float span = float(size) / float(cells - 1u);
    const float begin = (float(k) - 1.0) * span - 1.0, end = (float(k) + 1.0) * span + 1.0;
    return uvec2(max(begin, 0.0), min(ceil(end), float(size)));
}

vec4 variation_gradient(uvec3 cell, uint row) {
    if (ONE_CELL) return vec4(0.0);
    const uint photo = GRID_TEXELS * push.photo;
    const vec4 own = grids[photo + grid_texel(cell) + row];
    vec4 sum = vec4(0.0);
    [[unroll]] for (uint axis = 0u; axis < 3u; ++axis) {
        uvec3 step = uvec3(0u);
        step[axis] = 1u;
        vec4 apart = vec4(0.0);
        if (cell[axis] > 0u) apart += own - grids[photo + grid_texel(cell - step) + row];
        if (cell[axis] + 1u < GRID_SIZE[axis]) apart += own - grids[photo + grid_texel(cell + step) + row];
        sum += apart * (2.0 * float(GRID_SIZE[axis]) / (float(GRID_FLOATS) * float(GRID_SIZE[axis] - 1u)));
    }
    return float(GRID_VARIATION_WEIGHT) * sum;
}

void main() {
    const uint column = gl_WorkGroupID.x, part = gl_WorkGroupID.y, first_level = GRID_LEVELS * gl_WorkGroupID.z;
    const uvec2 cell = uvec2(column % CELLS_X, column / CELLS_X);
    const uvec2 along_x = pixels_of(cell.x, CELLS_X, push.image.size[0]);
    const uvec2 along_y = pixels_of(cell.y, CELLS_Y, push.image.size[1]);
    const uint width = along_x.y - along_x.x, rows = along_y.y - along_y.x;
    const uint begin = rows * part / push.parts * width, end = rows * (part + 1u) / push.parts * width;
    vec4 sum[3u * GRID_LEVELS];
    [[unroll]] for (uint k = 0u; k < 3u * LEVELS; ++k) sum[k] = vec4(0.0);
    for (uint i = begin + LANE; i < end; i += SUBGROUP) {
        const uvec2 pixel = uvec2(along_x.x + i % width, along_y.x + i / width);
        const vec2 apart = max(1.0 - abs(grid_place(push.image, pixel) - vec2(cell)), 0.0);
        const uint at = pixel.y * push.image.stride + pixel.x;
        const uvec3 planes = uvec3(PLANE_R, PLANE_G, PLANE_B) * push.image.plane_floats + at;
        const vec3 color = vec3(image[planes.r], image[planes.g], image[planes.b]);
        const vec3 gradient =
            apart.x * apart.y *
            vec3(image_gradient[planes.r], image_gradient[planes.g], image_gradient[planes.b]);
        const float level = grid_level(color) - float(first_level);
        [[unroll]] for (uint k = 0u; k < LEVELS; ++k) {
            const vec4 weighted = max(1.0 - abs(level - float(k)), 0.0) * vec4(color, 1.0);
            [[unroll]] for (uint c = 0u; c < 3u; ++c) sum[3u * k + c] += gradient[c] * weighted;
        }
    }
    [[unroll]] for (uint k = 0u; k < 3u * LEVELS; ++k) {
        const uvec3 own = uvec3(cell, first_level + k / 3u);
        const vec4 total =
            vec4(subgroup_sum(sum[k].x), subgroup_sum(sum[k].y), subgroup_sum(sum[k].z), subgroup_sum(sum[k].w));
        const vec4 variation = part == 0u ? variation_gradient(own, k % 3u) : vec4(0.0);
        if (LANE == 0u) sums[GRID_TEXELS * part + grid_texel(own) + k % 3u] = total + variation;
    }
}
