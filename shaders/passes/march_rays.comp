#version 460
// SPDX-License-Identifier: Apache-2.0
// Marches along rays through the volume of all splats: interval by interval, C += T (1 - exp(-depth)) (colour by the shares
// of the depth), T *= exp(-depth). lib/march.glsl describes the intervals.
// One workgroup is one subgroup and owns a strip of a tile, workgroup.z. It reads the tile's range of the sorted splats, and
// how rays meet them. It writes the strip's pixels in the image planes. SPEC_MODE: intervals evaluated together.
#extension GL_GOOGLE_include_directive : require
#define BINDING_CAMERA 5
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
TEXELS(0, records);
layout(set = 0, binding = 1, scalar) readonly buffer Splats { uint splats[]; };
layout(set = 0, binding = 2, scalar) readonly buffer TileStarts { uint tile_starts[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Planes { float planes[]; };
TEXELS(4, rays);
layout(set = 0, binding = 6, scalar) buffer CountsBlock { Counts counts; };
layout(push_constant, scalar) uniform Push { RayPush ray_push; };
#define push ray_push.blend
#include "lib/tile.glsl"
#define CHOSEN_ROOM ROW_MOST
const uint ROW_MOST = 1024u;  // splats of a strip that are listed
#include "lib/rays.glsl"
#include "lib/normal.glsl"
#include "lib/march.glsl"

void main() {
    const uint tile = gl_WorkGroupID.x * push.tile_step[0] + gl_WorkGroupID.y * push.tile_step[1];
    if (tile >= push.tiles[0] * push.tiles[1]) return;
    const uint strip = gl_WorkGroupID.z;
    const uvec2 p = strip_pixel(tile, strip);
    const bool inside = p.x < push.image.size[0] && p.y < push.image.size[1];
    const Ray ray = ray_through(vec2(p) + 0.5);
    const Placing placing = place_intervals(tile, strip, ray, ray_push.samples);

    float T = 1.0;
    vec3 color = vec3(0.0);
    for (uint begin = 0u; begin < ray_push.samples; begin += GROUP) {
        const bool open = inside && T > float(MARCH_STOP) && placing.last > 0.0;
        if (subgroupAll(!open)) break;
        float from, to;
        march_group(tile, strip, ray, placing, begin, ray_push.samples, open, from, to);
        [[unroll]] for (uint i = 0u; i < GROUP; ++i) {
            color += (T * mean_transmittance(depths[i])) * emissions[i];
            T *= exp(-depths[i]);
        }
    }
    report_turns();
    if (inside) {
        const uint at = p.y * push.image.stride + p.x;
        planes[PLANE_R * push.image.plane_floats + at] = color.r + T * push.background[0];
        planes[PLANE_G * push.image.plane_floats + at] = color.g + T * push.background[1];
        planes[PLANE_B * push.image.plane_floats + at] = color.b + T * push.background[2];
        planes[PLANE_T * push.image.plane_floats + at] = T;
    }
}
