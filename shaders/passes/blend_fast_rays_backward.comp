#version 460
// SPDX-License-Identifier: Apache-2.0
// Gradient of blend_fast_rays, front to back, with the terms of blend_rays_backward.
// One workgroup is one subgroup and owns a tile. It reads the tile's sorted splats, how rays meet them, the image planes and
// dL/d(image). It adds to the gradient slots of the tile's instances, which are zero before.
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
layout(push_constant, scalar) uniform Push { BlendPush push; };
#include "lib/tile.glsl"
#include "lib/rays.glsl"
#include "lib/ray_list.glsl"
#include "lib/ray_gradient.glsl"

void main() {
    const uint tile = gl_WorkGroupID.x * push.tile_step[0] + gl_WorkGroupID.y * push.tile_step[1];
    if (tile >= push.tiles[0] * push.tiles[1]) return;
    Ray ray[PIXELS];
    float T[PIXELS], rest[PIXELS];
    vec3 gradient[PIXELS];
    [[unroll]] for (uint p = 0u; p < PIXELS; ++p) {
        const uvec2 pixel = ray_pixel(tile, p);
        const bool inside = pixel.x < push.image.size[0] && pixel.y < push.image.size[1];
        const uint at = min(pixel.y, push.image.size[1] - 1u) * push.image.stride + min(pixel.x, push.image.size[0] - 1u);
        ray[p] = ray_through(vec2(pixel) + 0.5);
        T[p] = inside && sees(ray[p]) ? 1.0 : -1.0;
        gradient[p] = gradient_of(at);
        rest[p] = dot(gradient[p], color_of(at));
    }
    const uint end = tile_starts[tile + 1u];
    for (uint k = tile_starts[tile]; k < end; k += SUBGROUP) {
        bool open = false;
        [[unroll]] for (uint p = 0u; p < PIXELS; ++p) open = open || T[p] > 0.0;
        if (!in_time() || subgroupAll(!open)) break;
        load_ray_batch(k, end);
        [[dont_unroll]] for (uint j = 0u; j < min(SUBGROUP, end - k); ++j) {
            if (!in_time()) break;
            vec2 rows;
            const RaySplat r = ray_splat_of_batch(j, rows);
            RayTerms sum = no_ray_terms();
            [[unroll]] for (uint p = 0u; p < PIXELS; ++p) {
                if (!reaches_rows(tile, p, rows)) continue;
                const Meeting m = meet(r, ray[p]);
                const float alpha = T[p] > 0.0 ? alpha_of_meeting(m) : 0.0;
                if (alpha > 0.0) {
                    bool blended;
                    const float before = T[p], weight = composite(alpha, T[p], blended), own = dot(r.color.rgb, gradient[p]);
                    rest[p] -= weight * own;
                    EXACT const float raw = 1.0 - exp(-m.depth);
                    const float g = raw <= float(ALPHA_MAX) ? m.depth * ((1.0 - alpha) * before * own - rest[p]) : 0.0;
                    add_ray_terms(sum, r, m, blended, g, 0.0, 0.0, weight * gradient[p]);
                }
            }
            const RayTerms all = summed(sum);
            if (LANE == 0u) add_terms_to_slot(r.at, all);
        }
    }
    report_turns();
}
