#version 460
// SPDX-License-Identifier: Apache-2.0
// Blends the nearest NEAREST spheres of each pixel front to back: C = sum c alpha T + T background, alpha = 1 - q. It ends
// after the sphere that takes T to TRANSMITTANCE_STOP.
// One workgroup is one subgroup and owns one tile. It reads the tile's range of the sorted splats and their records,
// and writes the tile's pixels in the image planes. SPEC_MODE: BLEND_COLOR, BLEND_DEPTH or BLEND_COUNT.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
const bool WITH_DEPTH = MODE == BLEND_DEPTH;
const bool WITH_COUNT = MODE == BLEND_COUNT;

TEXELS(0, records);
layout(set = 0, binding = 1, scalar) readonly buffer Splats { uint splats[]; };
layout(set = 0, binding = 2, scalar) readonly buffer TileStarts { uint tile_starts[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Planes { float planes[]; };
layout(push_constant, scalar) uniform Push { BlendPush push; };
#include "lib/tile.glsl"
#include "lib/sphere_blending.glsl"

void main() {
    const uint tile = gl_WorkGroupID.x * push.tile_step[0] + gl_WorkGroupID.y * push.tile_step[1];
    if (tile >= push.tiles[0] * push.tiles[1]) return;
    const uint px = first_pixel(tile).x, py = first_pixel(tile).y;
    const vec2 pixel = vec2(px, py) + 0.5;

    float T[PIXELS], depth[PIXELS], count[PIXELS];
    uint left[PIXELS];
    vec3 color[PIXELS];
    [[unroll]] for (uint p = 0; p < PIXELS; ++p) {
        // A pixel outside the image takes none, so that it never keeps the tile's loop running.
        left[p] = px < push.image.size[0] && py + p * ROW_STEP < push.image.size[1] ? NEAREST : 0u;
        T[p] = 1.0;
        color[p] = vec3(0.0);
        depth[p] = count[p] = 0.0;
    }
    const uint end = tile_starts[tile + 1u];
    for (uint k = tile_starts[tile]; k < end; k += SUBGROUP) {
        const Loaded batch = load_batch(k, end);
        UNROLL_BLOCKS for (uint first = 0; first < SUBGROUP; first += BLOCK) {
            [[unroll]] for (uint j = 0; j < BLOCK; ++j) {
                const LaneSplat s = lane_splat(batch, first + j, pixel);
                [[unroll]] for (uint p = 0; p < PIXELS; ++p) {
                    const Meeting m = meet_sphere(s, p, left[p], T[p]);
                    color[p] += m.weight * s.color;
                    if (WITH_DEPTH) depth[p] += m.weight * s.z;
                    if (WITH_COUNT) count[p] += m.alpha > 0.0 ? 1.0 : 0.0;
                }
            }
        }
        bool open = false;
        [[unroll]] for (uint p = 0; p < PIXELS; ++p) open = open || left[p] > 0u;
        if (subgroupAll(!open)) break;
    }
    const vec3 background = vec3(push.background[0], push.background[1], push.background[2]);
    [[unroll]] for (uint p = 0; p < PIXELS; ++p) {
        const uint y = py + p * ROW_STEP;
        if (px < push.image.size[0] && y < push.image.size[1]) {
            const uint at = y * push.image.stride + px;
            planes[PLANE_R * push.image.plane_floats + at] = color[p].r + T[p] * background.r;
            planes[PLANE_G * push.image.plane_floats + at] = color[p].g + T[p] * background.g;
            planes[PLANE_B * push.image.plane_floats + at] = color[p].b + T[p] * background.b;
            planes[PLANE_T * push.image.plane_floats + at] = T[p];
            if (WITH_DEPTH) planes[PLANE_DEPTH * push.image.plane_floats + at] = depth[p];
            if (WITH_COUNT) planes[PLANE_COUNT * push.image.plane_floats + at] = count[p];
        }
    }
}
