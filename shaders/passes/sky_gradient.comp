#version 460
// SPDX-License-Identifier: Apache-2.0
// Gradient of add_sky by the sky: each texel gets T dL/dC of the pixels that show it, times its weight there.
// One workgroup is one subgroup and owns a block of pixels. It reads the image planes, dL/d(image) and the camera, and adds to
// the view's slot. Sums are whole numbers, so their order does not matter. A subgroup adds what all its lanes have for one cell
// of the sky together.
// A pixel whose gradient is not finite is skipped and counted.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"
#define BINDING_CAMERA 2
#include "lib/sky.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) readonly buffer Planes { float planes[]; };
layout(set = 0, binding = 1, scalar) readonly buffer ImageGradient { float image_gradient[]; };
layout(set = 0, binding = 3, scalar) buffer Slots { uint slots[]; };  // of int, which uint adds as well
layout(set = 0, binding = 4, scalar) buffer CountsBlock { Counts counts; };
layout(push_constant, scalar) uniform Push { SkyGradientPush push; };

uint sum_of_lanes(uint x) {
    [[unroll]] for (uint s = 0u; s < DOUBLINGS; ++s) {
        if ((1u << s) < SUBGROUP) x += subgroupShuffleXor(x, 1u << s);
    }
    return x;
}

// T dL/dC in units, at most what a pixel may add.
vec3 pixel_gradient(uvec2 pixel) {
    const ImageLayout image = push.sky.image;
    const uvec4 at = uvec4(PLANE_R, PLANE_G, PLANE_B, PLANE_T) * image.plane_floats + pixel.y * image.stride + pixel.x;
    const vec3 gradient = planes[at.w] * vec3(image_gradient[at.r], image_gradient[at.g], image_gradient[at.b]);
    if (!is_finite(gradient)) {
        atomicAdd(counts.dropped_updates, 1u);
        return vec3(0.0);
    }
    const float most = float(SKY_SUM_MAX) / float(image.size[0] * image.size[1]);
    return clamp(float(SKY_UNITS) * gradient, vec3(-most), vec3(most));
}

void add(SkyCorners corners, uint values[12]) {
    [[unroll]] for (uint k = 0u; k < 12u; ++k)
        if (values[k] != 0u) atomicAdd(slots[push.slot + 3u * corners.texels[k / 3u] + k % 3u], values[k]);
}

// Adds what the lanes have for one cell, and begins again.
void add_together(SkyCorners corners, inout uint sums[12]) {
    [[unroll]] for (uint k = 0u; k < 12u; ++k) sums[k] = sum_of_lanes(sums[k]);
    if (LANE == 0u) add(corners, sums);
    [[unroll]] for (uint k = 0u; k < 12u; ++k) sums[k] = 0u;
}

void main() {
    const uvec2 size = uvec2(push.sky.image.size[0], push.sky.image.size[1]);
    const uvec2 blocks = (size + SKY_BLOCK - 1u) / SKY_BLOCK;
    const uint block = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (block >= blocks.x * blocks.y) return;
    const uvec2 first = SKY_BLOCK * uvec2(block % blocks.x, block / blocks.x);
    SkyCorners shared_corners = sky_corners(push.sky, first);
    uint sums[12];
    [[unroll]] for (uint k = 0u; k < 12u; ++k) sums[k] = 0u;
    for (uint begin = 0u; begin < SKY_BLOCK * SKY_BLOCK; begin += SUBGROUP) {
        const uvec2 pixel = first + uvec2((begin + LANE) % SKY_BLOCK, (begin + LANE) / SKY_BLOCK);
        const bool inside = pixel.x < size.x && pixel.y < size.y;
        const SkyCorners corners = sky_corners(push.sky, inside ? pixel : first);
        const vec3 gradient = inside ? pixel_gradient(pixel) : vec3(0.0);
        uint values[12];
        [[unroll]] for (uint k = 0u; k < 12u; ++k)
            values[k] = uint(int(round(corners.weights[k / 3u] * gradient[k % 3u])));
        // Lane 0 is inside where any lane is.
        const uint cell = subgroupShuffle(corners.cell, 0u);
        if (!subgroupAll(!inside || corners.cell == cell)) {
            add(corners, values);
            continue;
        }
        if (cell != shared_corners.cell) {
            add_together(shared_corners, sums);
            shared_corners = corners;
        }
        [[unroll]] for (uint k = 0u; k < 12u; ++k) sums[k] += values[k];
    }
    add_together(shared_corners, sums);
}
