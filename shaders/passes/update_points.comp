#version 460
// SPDX-License-Identifier: Apache-2.0
// Gradient of the projection of spheres, fused with Adam as in update.comp, whose buffers and rules it shares.
// One invocation owns splat i. The three scales of a splat have the same gradient and the same step. The rotation and the
// opacity have no gradient and do not move. SPEC_MODE: UPDATE_* bits, without UPDATE_REGULARISED.
#extension GL_GOOGLE_include_directive : require
#define BINDING_CAMERA 1
#include "lib/prelude.glsl"
#include "lib/params.glsl"
#include "lib/sphere.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_SH_DEGREE) const uint SH_DEGREE = 3;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
const bool GRADIENT_ONLY = (MODE & UPDATE_GRADIENT_ONLY) != 0u, STATISTICS = (MODE & UPDATE_STATISTICS) != 0u,
           ABSOLUTE = (MODE & UPDATE_ABSOLUTE) != 0u, PACKED_MOMENTS = (MODE & UPDATE_PACKED_MOMENTS) != 0u;

TEXELS(0, params);
TEXELS(2, records);
TEXELS(3, slots);
WORD_TEXELS(4, moments1);
WORD_TEXELS(5, moments2);
layout(set = 0, binding = 6, scalar) readonly buffer TileCounts { uint tile_counts[]; };
layout(set = 0, binding = 7, scalar) readonly buffer FirstInstances { uint first_instances[]; };
layout(set = 0, binding = 8, scalar) buffer CountsBlock { Counts counts; };
STORED_TEXELS(9, params_out);
STORED_WORD_TEXELS(10, moments1_out);
STORED_WORD_TEXELS(11, moments2_out);
layout(set = 0, binding = 12, scalar) buffer Statistics { vec2 statistics[]; };
layout(set = 0, binding = 13, scalar) readonly buffer SortedIndices { uint sorted_indices[]; };
layout(set = 0, binding = 14, scalar) uniform Values { UpdateBlock push; };
#include "lib/slots.glsl"
#include "lib/adam.glsl"

// With q = u^2 + v^2, u = (x - mean.x) / radius.x: dL/d(alpha) = g has dL/d(mean) = 2 g w / radius and
// dL/d(ln radius) = 2 g w^2 in each axis.
void main() {
    const uint i = item_index();
    if (i >= push.splats || counts.instances > push.instance_capacity) return;
    const uint count = tile_counts[i];
    const bool visible = count > 0u;
    const vec4 p0 = fetch(params, index_of(0, i)), p1 = fetch(params, index_of(1, i)),
               p2 = fetch(params, index_of(2, i));
    vec4 sum[SLOT_TEXELS];
    sum_slots(visible ? first_instances[i] : 0u, count, ABSOLUTE, sum);
    const vec2 gw = sum[0].yz, gww = vec2(sum[0].w, sum[1].y);
    const SphereProjection p = project_sphere(p0.xyz, p1, p2.xyz);
    // The mean of an invisible splat may be anything. Zero times a direction that is not finite is not zero.
    const vec3 direction = visible ? normalize(p.view.offset) : vec3(0.0);
    // max(0, .) passes no gradient where the colour is zero.
    const vec3 shown = fetch(records, RECORD_TEXELS * i + 2u).rgb;
    const vec3 color_gradient =
        visible ? vec3(sum[1].zw, sum[2].x) * vec3(greaterThan(shown, vec3(0.0))) : vec3(0.0);
    vec3 direction_gradient;
    const float red_gradient = move_sh(i, color_gradient, direction, direction_gradient);

    const vec2 mean_px = 2.0 * p.inverse_radius * gw;
    const float log_scale = 2.0 * dot(p.share, gww);
    const float inverse_z = 1.0 / p.view.z.x;
    const vec2 tangent = vec2(p.view.x.x, p.view.y.x) * inverse_z;
    vec3 view_gradient = vec3(p.focal_over_z * mean_px, 0.0);
    view_gradient.z = -dot(tangent, view_gradient.xy) - inverse_z * log_scale;
    const vec3 direction_part =
        (direction_gradient - direction * dot(direction, direction_gradient)) / length(p.view.offset);
    const vec3 mean_gradient = transpose(camera_rotation()) * view_gradient + direction_part;
    const float depth = visible ? p.view.z.x : 3.4e38;

    // Scales that are equal stay equal: their moments are rounded alike.
    const uvec4 random = moment_random(i, 2u, push.step, push.seed).xxxw;
    move_rounded(2, i, p2, visible ? vec4(vec3(log_scale / 3.0), red_gradient) : vec4(0.0),
                 vec4(vec3(push.scale_rate), push.sh0_rate), depth, random);
    if (GRADIENT_ONLY) move(1, i, p1, vec4(0.0), vec4(0.0), depth);
    move(0, i, p0, visible ? vec4(mean_gradient, 0.0) : vec4(0.0), vec4(vec3(push.mean_rate), 0.0), depth);
    count_updates();
    if (STATISTICS && visible) {
        const vec2 size = ABSOLUTE ? 2.0 * p.inverse_radius * sum[2].yz : mean_px;
        const float norm = length(size * vec2(push.half_size[0], push.half_size[1]));
        if (is_finite(norm)) statistics[i] += vec2(norm, 1.0);
    }
}
