#version 460
// SPDX-License-Identifier: Apache-2.0
// Blends the splats that each ray meets as blend_rays does, in the order of the tile's list, that of the splats' means.
// One workgroup is one subgroup and owns a tile. It reads the tile's range of the sorted splats, and how rays meet them. It
// writes its pixels in the image planes. SPEC_MODE: BLEND_COLOR or BLEND_DEPTH.
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
layout(push_constant, scalar) uniform Push { BlendPush push; };
#include "lib/tile.glsl"
#include "lib/rays.glsl"
#include "lib/ray_list.glsl"

void main() {
    const uint tile = gl_WorkGroupID.x * push.tile_step[0] + gl_WorkGroupID.y * push.tile_step[1];
    if (tile >= push.tiles[0] * push.tiles[1]) return;
    Ray ray[PIXELS];
    float T[PIXELS], depth[PIXELS];
    vec3 color[PIXELS];
    bool inside[PIXELS];
    [[unroll]] for (uint p = 0u; p < PIXELS; ++p) {
        const uvec2 at = ray_pixel(tile, p);
        inside[p] = at.x < push.image.size[0] && at.y < push.image.size[1];
        ray[p] = ray_through(vec2(at) + 0.5);
        T[p] = inside[p] && sees(ray[p]) ? 1.0 : -1.0;
        depth[p] = 0.0;
        color[p] = vec3(0.0);
    }
    const uint end = tile_starts[tile + 1u];
    for (uint k = tile_starts[tile]; k < end; k += SUBGROUP) {
        bool open = false;
        [[unroll]] for (uint p = 0u; p < PIXELS; ++p) open = open || T[p] > 0.0;
        if (!in_time() || subgroupAll(!open)) break;
        load_ray_batch(k, end);
        [[dont_unroll]] for (uint j = 0u; j < SUBGROUP; ++j) {
            if (!in_time()) break;
            vec2 rows;
            const RaySplat r = ray_splat_of_batch(j, rows);
            [[unroll]] for (uint p = 0u; p < PIXELS; ++p) {
                if (!reaches_rows(tile, p, rows)) continue;
                const Meeting m = meet(r, ray[p]);
                const float alpha = T[p] > 0.0 ? alpha_of_meeting(m) : 0.0;
                if (alpha > 0.0) {
                    bool blended;
                    const float weight = composite(alpha, T[p], blended);
                    color[p] += weight * r.color.rgb;
                    if (MODE == BLEND_DEPTH) depth[p] += weight * m.middle;
                }
            }
        }
    }
    report_turns();
    [[unroll]] for (uint p = 0u; p < PIXELS; ++p) {
        if (!inside[p]) continue;
        const uvec2 pixel = ray_pixel(tile, p);
        const uint at = pixel.y * push.image.stride + pixel.x;
        const float left = abs(T[p]);
        planes[PLANE_R * push.image.plane_floats + at] = color[p].r + left * push.background[0];
        planes[PLANE_G * push.image.plane_floats + at] = color[p].g + left * push.background[1];
        planes[PLANE_B * push.image.plane_floats + at] = color[p].b + left * push.background[2];
        planes[PLANE_T * push.image.plane_floats + at] = left;
        if (MODE == BLEND_DEPTH) planes[PLANE_DEPTH * push.image.plane_floats + at] = depth[p];
    }
}
