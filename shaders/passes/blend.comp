#version 460
// SPDX-License-Identifier: Apache-2.0
// Blends the splats of each tile front to back: C = sum c alpha T + T background.
// One workgroup is one subgroup and owns one tile; with SPEC_QUADS it is four, and owns a quad. It reads the range of the sorted
// splats and their records, and writes the pixels in the image planes. SPEC_MODE: BLEND_*.
#extension GL_GOOGLE_include_directive : require
#define BINDING_INDICES 4
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
const bool WITH_DEPTH = MODE == BLEND_DEPTH;
const bool WITH_COUNT = MODE == BLEND_COUNT;
const bool MEDIAN = MODE == BLEND_MEDIAN;

TEXELS(0, records);
layout(set = 0, binding = 1, scalar) readonly buffer Splats { uint splats[]; };
layout(set = 0, binding = 2, scalar) readonly buffer TileStarts { uint tile_starts[]; };
layout(push_constant, scalar) uniform Push { BlendPush push; };
#include "lib/tile.glsl"
#include "lib/tile_columns.glsl"
PLANES_OUT(3, planes);

// Draws the splat as a solid: the first hit closes the pixel. The light is at the camera, so the outline is darker.
void meet_ellipsoid(LaneSplat s, uint p, inout float T, inout vec3 color) {
    const float u = s.u + s.u_step * float(p), v = s.v + s.v_step * float(p);
    const float height = 1.0 - (u * u + v * v) * float(2.0 / (ELLIPSOID_REACH * ELLIPSOID_REACH));
    const float least = BY_DEPTH ? depth_of(float(ELLIPSOID_OPACITY)) : float(ELLIPSOID_OPACITY);
    const bool hit = T > 0.0 && height >= 0.0 && s.opacity >= least;
    const float shade = mix(float(ELLIPSOID_RIM), 1.0, sqrt(max(height, 0.0)));
    color = hit ? shade * s.color : color;
    T = hit ? 0.0 : T;
}

// The splat's depth at the lane's pixel p, where it takes T to the median.
void meet_median(LaneSplat s, uint p, float before, float after, inout float depth) {
    const float u = s.u + s.u_step * float(p), v = s.v + s.v_step * float(p);
    const float z = max(s.z + s.color.x * u + s.color.y * v, float(NEAR_PLANE));
    depth = before > float(MEDIAN_TRANSMITTANCE) && after <= float(MEDIAN_TRANSMITTANCE) ? z : depth;
}

void main() {
    const uint tile = gl_WorkGroupID.x * push.tile_step[0] + gl_WorkGroupID.y * push.tile_step[1];
    if (tile >= push.tiles[0] * push.tiles[1]) return;
    const uint px = first_pixel(tile).x, py = first_pixel(tile).y;
    const vec2 pixel = vec2(px, py) + 0.5;

    float T[PIXELS], depth[PIXELS], count[PIXELS];
    vec3 color[PIXELS];
    [[unroll]] for (uint p = 0; p < PIXELS; ++p) {
        // A pixel outside the image starts closed, so that it never keeps the tile's loop running.
        T[p] = px < push.image.size[0] && py + p * ROW_STEP < push.image.size[1] ? 1.0 : -1.0;
        color[p] = vec3(0.0);
        depth[p] = count[p] = 0.0;
    }
    const uint end = tile_starts[tile + 1u];
    uint k = tile_starts[tile];
    // The condition of the loop comes last: where it comes first, lavapipe runs the body once more behind the last turn.
    if (k < end) do {
        const Loaded batch = load_batch(k, end);
        UNROLL_BLOCKS for (uint first = 0; first < (IN_QUADS ? batch.turns : BATCH); first += BLOCK) {
            [[unroll]] for (uint j = 0; j < BLOCK; ++j) {
                const LaneSplat s = lane_splat(batch, first + j, pixel);
                if (MODE == BLEND_ELLIPSOIDS) {
                    [[unroll]] for (uint p = 0; p < PIXELS; ++p) meet_ellipsoid(s, p, T[p], color[p]);
                    continue;
                }
                float raw[PIXELS];
                column_alphas(s, raw);
                [[unroll]] for (uint p = 0; p < PIXELS; ++p) {
                    bool blended;
                    const float alpha = alpha_of(raw[p]);
                    const float before = T[p];
                    const float weight = composite(alpha, T[p], blended);
                    if (MEDIAN) {
                        meet_median(s, p, before, T[p], depth[p]);
                        continue;
                    }
                    color[p] += weight * s.color;
                    if (WITH_DEPTH) depth[p] += weight * s.z;
                    if (WITH_COUNT) count[p] += blended && alpha > 0.0 ? 1.0 : 0.0;
                }
            }
        }
        bool open = false;
        [[unroll]] for (uint p = 0; p < PIXELS; ++p) open = open || T[p] > 0.0;
        if (all_closed(open)) break;
        k += BATCH;
    } while (k < end);
    if (MEDIAN) {
        [[unroll]] for (uint p = 0; p < PIXELS; ++p) T[p] = abs(T[p]);
        STORE_COLUMN(planes, PLANE_T, T);
        STORE_COLUMN(planes, PLANE_MEDIAN, depth);
        return;
    }
    const vec3 background = vec3(push.background[0], push.background[1], push.background[2]);
    float red[PIXELS], green[PIXELS], blue[PIXELS], left[PIXELS];
    [[unroll]] for (uint p = 0; p < PIXELS; ++p) {
        left[p] = abs(T[p]);
        red[p] = color[p].r + left[p] * background.r;
        green[p] = color[p].g + left[p] * background.g;
        blue[p] = color[p].b + left[p] * background.b;
    }
    STORE_COLUMN(planes, PLANE_R, red);
    STORE_COLUMN(planes, PLANE_G, green);
    STORE_COLUMN(planes, PLANE_B, blue);
    STORE_COLUMN(planes, PLANE_T, left);
    if (WITH_DEPTH) { STORE_COLUMN(planes, PLANE_DEPTH, depth); }
    if (WITH_COUNT) { STORE_COLUMN(planes, PLANE_COUNT, count); }
}
