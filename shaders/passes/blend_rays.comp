#version 460
// SPDX-License-Identifier: Apache-2.0
// Blends the splats of each ray front to back, in the order of their middles on the ray: C = sum c alpha T + T background with
// alpha = 1 - exp(-optical depth).
// One workgroup is one subgroup and owns a strip of a tile, workgroup.z. It reads the tile's range of the sorted splats, and
// how rays meet them. It writes the strip's pixels in the image planes. SPEC_MODE: BLEND_COLOR or BLEND_DEPTH.
#extension GL_GOOGLE_include_directive : require
#define BINDING_CAMERA 5
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
TEXELS(0, records);
layout(set = 0, binding = 1, scalar) readonly buffer Splats { uint splats[]; };
layout(set = 0, binding = 2, scalar) readonly buffer TileStarts { uint tile_starts[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Planes { float planes[]; };
TEXELS(4, rays);
layout(set = 0, binding = 6, scalar) buffer CountsBlock { Counts counts; };
layout(push_constant, scalar) uniform Push { RayPush ray_push; };
#define push ray_push.blend
#include "lib/tile.glsl"
#include "lib/rays.glsl"
const uint HELD = 16u;  // splats that a lane holds
#include "lib/ray_order.glsl"

float T = 1.0, depth_sum = 0.0;
vec3 color = vec3(0.0);

// Blends the nearest waiting splats of each lane, where they are nearer than all splats to come.
void blend_held(inout RayOrder o, float to_come) {
    for (uint turn = 0u; turn < HELD; ++turn) {
        const bool next = T > 0.0 && o.depths[0] < NEVER && o.depths[0] <= to_come;
        if (!in_time() || subgroupAll(!next)) break;
        const vec4 shown = fetch(records, RECORD_TEXELS * splats[next ? o.instances[0] : 0u] + 2u);
        if (next) {
            bool blended;
            const float weight = composite(o.alphas[0], T, blended);
            color += weight * shown.rgb;
            if (MODE == BLEND_DEPTH) depth_sum += weight * o.depths[0];
        }
        release(o, next);
    }
}

#include "lib/ray_walk.glsl"

void main() {
    const uint tile = gl_WorkGroupID.x * push.tile_step[0] + gl_WorkGroupID.y * push.tile_step[1];
    if (tile >= push.tiles[0] * push.tiles[1]) return;
    const uvec2 p = strip_pixel(tile, gl_WorkGroupID.z);
    const bool inside = p.x < push.image.size[0] && p.y < push.image.size[1];
    const Ray ray = ray_through(vec2(p) + 0.5);
    T = inside && sees(ray) ? 1.0 : -1.0;
    walk_rays(tile, gl_WorkGroupID.z, ray);
    report_turns();
    if (inside) {
        const uint at = p.y * push.image.stride + p.x;
        const float left = abs(T);
        planes[PLANE_R * push.image.plane_floats + at] = color.r + left * push.background[0];
        planes[PLANE_G * push.image.plane_floats + at] = color.g + left * push.background[1];
        planes[PLANE_B * push.image.plane_floats + at] = color.b + left * push.background[2];
        planes[PLANE_T * push.image.plane_floats + at] = left;
        if (MODE == BLEND_DEPTH) planes[PLANE_DEPTH * push.image.plane_floats + at] = depth_sum;
    }
}
