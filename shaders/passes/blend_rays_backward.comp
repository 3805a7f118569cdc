#version 460
// SPDX-License-Identifier: Apache-2.0
// Gradient of blend_rays, front to back. With R = (what is blended behind a splat) . dL/dC,
// dL/d(ln depth) = depth ((1 - alpha) T c . dL/dC - R). R starts as C . dL/dC, and each splat subtracts its own share.
// One workgroup is one subgroup and owns a strip of one tile, push.strip. It reads the tile's sorted splats, how rays meet them, the image planes and
// dL/d(image). It adds to the gradient slots of the tile's instances, which are zero before. Lanes whose next splat is the
// same add it together.
#extension GL_GOOGLE_include_directive : require
#define BINDING_CAMERA 7
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
TEXELS(0, records);
layout(set = 0, binding = 1, scalar) readonly buffer Splats { uint splats[]; };
layout(set = 0, binding = 2, scalar) readonly buffer TileStarts { uint tile_starts[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Planes { float planes[]; };
layout(set = 0, binding = 4, scalar) readonly buffer ImageGradient { float image_gradient[]; };
layout(set = 0, binding = 5, scalar) buffer Slots { vec4 slots[]; };
TEXELS(6, rays);
layout(set = 0, binding = 8, scalar) buffer CountsBlock { Counts counts; };
layout(push_constant, scalar) uniform Push { RayPush ray_push; };
#define push ray_push.blend
#include "lib/tile.glsl"
#include "lib/rays.glsl"
const uint HELD = 16u;  // splats that a lane holds
#include "lib/ray_order.glsl"
#include "lib/ray_gradient.glsl"

float T, rest;
vec3 gradient;
Ray own_ray;

// Blends the nearest waiting splats of each lane, where they are nearer than all splats to come.
void blend_held(inout RayOrder o, float to_come) {
    for (uint turn = 0u; turn < HELD * SUBGROUP; ++turn) {
        const bool next = T > 0.0 && o.depths[0] < NEVER && o.depths[0] <= to_come;
        if (!in_time() || subgroupAll(!next)) break;
        // The nearest of the lanes' next splats: in the lanes' common order, each is added once.
        const float nearest = subgroup_min(next ? o.depths[0] : NEVER);
        const uint at = subgroup_min(next && o.depths[0] == nearest ? o.instances[0] : 0xffffffffu);
        const bool first = next && o.instances[0] == at;
        const RaySplat r = read_ray_splat(at);
        const Meeting m = meet(r, own_ray);
        bool blended = false;
        float g = 0.0, weight = 0.0;
        if (first) {
            const float alpha = o.alphas[0], before = T;
            weight = composite(alpha, T, blended);
            const float own = dot(r.color.rgb, gradient);
            rest -= weight * own;
            EXACT const float raw = 1.0 - exp(-m.depth);
            g = raw <= float(ALPHA_MAX) ? m.depth * ((1.0 - alpha) * before * own - rest) : 0.0;
        }
        add_to_slot(r, m, blended, g, 0.0, 0.0, weight * gradient);
        release(o, first);
    }
}

#include "lib/ray_walk.glsl"

void main() {
    const uint tile = gl_WorkGroupID.x * push.tile_step[0] + gl_WorkGroupID.y * push.tile_step[1];
    if (tile >= push.tiles[0] * push.tiles[1]) return;
    const uint strip = ray_push.strip;
    const uvec2 p = strip_pixel(tile, strip);
    const bool inside = p.x < push.image.size[0] && p.y < push.image.size[1];
    const uint at = min(p.y, push.image.size[1] - 1u) * push.image.stride + min(p.x, push.image.size[0] - 1u);
    own_ray = ray_through(vec2(p) + 0.5);
    T = inside && sees(own_ray) ? 1.0 : -1.0;
    gradient = gradient_of(at);
    rest = dot(gradient, color_of(at));
    walk_rays(tile, strip, own_ray);
    report_turns();
}
