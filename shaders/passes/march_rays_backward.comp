#version 460
// SPDX-License-Identifier: Apache-2.0
// Gradient of march_rays, front to back, with the borders of the intervals held fixed. With f(x) = (1 - exp(-x)) / x, E_j the
// emitted colour of interval j, d_j its optical depth, T_j the transmittance before it, and R_j = (light from behind it) . dL/dC, splat i has
//   dL/d(d_ij) = (T_j f(d_j) c_i + T_j f'(d_j) E_j) . dL/dC - R_j
// One workgroup is one subgroup and owns a strip of one tile, push.strip. It reads the tile's sorted splats, how rays meet them, the image planes and
// dL/d(image). It adds to the gradient slots of the tile's instances, which are zero before.
// SPEC_MODE: the number of intervals evaluated together.
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
#define CHOSEN_ROOM ROW_MOST
const uint ROW_MOST = 1024u;  // splats of a strip that are listed
#include "lib/rays.glsl"
#include "lib/normal.glsl"
#include "lib/march.glsl"
#include "lib/ray_gradient.glsl"

// The derivative of mean_transmittance.
float mean_transmittance_slope(float x) {
    return x < 0.03 ? -0.5 + x * (0.33333333 - x * (0.125 - x * 0.033333333)) : (exp(-x) - mean_transmittance(x)) / x;
}

float by_depth[GROUP];   // dL/d(d_ij) without the splat's own colour
vec3 by_emitted[GROUP];  // and its slope by that

void add_group(uint tile, uint strip, Ray ray, bool open, float from, float to) {
    const float top = strip_top(tile, strip), bottom = top + float(ROW_STEP - 1u);
    const uint end = tile_starts[tile + 1u];
    FOR_EACH_SPLAT(from, to)
        const Passing p = pass_by(r, ray);
        float g = 0.0, s1 = 0.0, s2 = 0.0, last = 0.0, before = 0.0;
        vec3 color = vec3(0.0);
        [[unroll]] for (uint i = 0u; i <= GROUP; ++i) {
            const float at = clamp((borders[i] - p.m.middle) * p.sharpness, -40.0, 40.0), share = normal_cdf(at);
            if (i > 0u) {
                g += last * (share - before);
                color += (p.depth * (share - before)) * by_emitted[i - 1u];
            }
            const float own = i < GROUP ? p.depth * (by_depth[min(i, GROUP - 1u)] + dot(by_emitted[min(i, GROUP - 1u)], r.color.rgb)) : 0.0;
            const float moved = (last - own) * normal_density(at);
            s1 += moved;
            s2 += moved * at;
            last = own;
            before = share;
        }
        // Behind the splat's own camera, the ray goes against the direction in which that one sees it.
        if (LENSES != 0u && p.m.stretch < 0.0) s1 = -s1;
        add_to_slot(r, p.m, open && p.depth > 0.0, g, s1, s2, color);
    END_SPLATS
}

void main() {
    const uint tile = gl_WorkGroupID.x * push.tile_step[0] + gl_WorkGroupID.y * push.tile_step[1];
    if (tile >= push.tiles[0] * push.tiles[1]) return;
    const uint strip = ray_push.strip;
    const uvec2 p = strip_pixel(tile, strip);
    const bool inside = p.x < push.image.size[0] && p.y < push.image.size[1];
    const uint at = min(p.y, push.image.size[1] - 1u) * push.image.stride + min(p.x, push.image.size[0] - 1u);
    const Ray ray = ray_through(vec2(p) + 0.5);
    const Placing placing = place_intervals(tile, strip, ray, ray_push.samples);
    const vec3 gradient = gradient_of(at);
    float T = 1.0, rest = dot(gradient, color_of(at));
    for (uint begin = 0u; begin < ray_push.samples; begin += GROUP) {
        const bool open = inside && T > float(MARCH_STOP) && placing.last > 0.0;
        if (subgroupAll(!open)) break;
        float from, to;
        march_group(tile, strip, ray, placing, begin, ray_push.samples, open, from, to);
        [[unroll]] for (uint i = 0u; i < GROUP; ++i) {
            const float emitted = T * dot(gradient, emissions[i]);
            rest -= mean_transmittance(depths[i]) * emitted;
            by_emitted[i] = (T * mean_transmittance(depths[i])) * gradient;
            by_depth[i] = mean_transmittance_slope(depths[i]) * emitted - rest;
            T *= exp(-depths[i]);
        }
        add_group(tile, strip, ray, open, from, to);
    }
    report_turns();
}
