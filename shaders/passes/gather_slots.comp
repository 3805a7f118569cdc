#version 460
// SPDX-License-Identifier: Apache-2.0
// Adds the gradient slots of each splat, and carries the sums to the arrays that its record was made of.
// One invocation owns splat i. It reads its slots in the order of its tiles and its record, and writes its entry of each
// gradient. SPEC_MODE: GATHER_* bits and SHAPE_WHITENERS.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
const bool ADD = (MODE & GATHER_ADD) != 0u, ABSOLUTE = (MODE & GATHER_ABSOLUTE) != 0u,
           FOURTH = (MODE & GATHER_FOURTH) != 0u, WHITENERS = (MODE & SHAPE_WHITENERS) != 0u;

TEXELS(0, records);
TEXELS(1, slots);
layout(set = 0, binding = 2, scalar) readonly buffer TileCounts { uint tile_counts[]; };
layout(set = 0, binding = 3, scalar) readonly buffer FirstInstances { uint first_instances[]; };
layout(set = 0, binding = 4, scalar) readonly buffer SortedIndices { uint sorted_indices[]; };
layout(set = 0, binding = 5, scalar) buffer Means { vec2 means[]; };
layout(set = 0, binding = 6, scalar) buffer Shapes { vec3 shapes[]; };
layout(set = 0, binding = 7, scalar) buffer Opacities { float opacities[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer Features { float features[]; };
layout(set = 0, binding = 9, scalar) buffer Absolute { vec2 absolute[]; };
layout(push_constant, scalar) uniform Push { GatherPush push; };
#include "lib/slots.glsl"

void main() {
    const uint i = item_index();
    if (i >= push.splats) return;
    const uint count = tile_counts[i];
    vec4 sum[SLOT_TEXELS];
    sum_slots(count > 0u ? first_instances[i] : 0u, count, ABSOLUTE || FOURTH, sum);
    const float g = sum[0].x, gu = sum[0].y, gv = sum[0].z, guu = sum[0].w, guv = sum[1].x, gvv = sum[1].y;
    const vec4 record1 = fetch(records, RECORD_TEXELS * i + 1u);
    const float ux = record1.x, k = record1.y, vy = record1.z;

    // d(power)/d(mean) = 2 L^T (u, v) with L = [ux, -k ux; 0, vy].
    vec2 mean = 2.0 * vec2(ux * gu, vy * gv - k * ux * gu);
    vec3 shape;
    if (WHITENERS) {
        // power = -(u^2 + v^2), u = ux (dx - k dy), v = vy dy, and dy = v / vy.
        shape = vec3(-2.0 * guu / ux, 2.0 * (ux / vy) * guv, -2.0 * gvv / vy);
    } else {
        // power = -(A dx^2 + 2 B dx dy + C dy^2) / 2 with dx = u / ux + k v / vy, dy = v / vy.
        const float t = k / vy;
        shape = -vec3(0.5 * ((guu / ux + 2.0 * t * guv) / ux + t * t * gvv), (guv / ux + t * gvv) / vy,
                      0.5 * gvv / (vy * vy));
    }
    // alpha is proportional to the opacity. A listed splat that draws nothing may have opacity 0.
    float opacity = record1.w > 0.0 ? g / record1.w : 0.0;
    vec2 sizes = 2.0 * vec2(ux * sum[2].y, sum[2].z);
    if (ADD) {
        mean += means[i];
        shape += shapes[i];
        opacity += opacities[i];
        if (ABSOLUTE) sizes += absolute[i];
    }
    means[i] = mean;
    shapes[i] = shape;
    opacities[i] = opacity;
    if (ABSOLUTE) absolute[i] = sizes;
    const vec4 feature = vec4(sum[1].zw, sum[2].x, sum[2].w);
    [[unroll]] for (uint c = 0; c < 4; ++c) {
        if (push.first_channel + c < push.channels) features[push.channels * i + push.first_channel + c] = feature[c];
    }
}
