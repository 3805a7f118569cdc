#version 460
// SPDX-License-Identifier: Apache-2.0
// Gradient of the projection in several views, fused with Adam.
// One invocation owns splat i. It adds the sums of each view's bands, carries them back through the projection, adds the
// gradients in the order of the views, and writes parameters and moments. The gradient is the mean over all views. As in
// update.comp, a splat that no view lists has gradient zero, a step that is too long is shortened and counted, and an update
// that is not finite is dropped and counted. SPEC_MODE: UPDATE_* bits.
#extension GL_GOOGLE_include_directive : require
#define BINDING_CAMERAS 1
#define ADAM_OF_PUSH
#include "lib/prelude.glsl"
#include "lib/params.glsl"
#include "lib/stored_splat.glsl"
#include "lib/footprint_gradient.glsl"
#include "lib/splat_gradient.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_SH_DEGREE) const uint SH_DEGREE = 3;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
const bool GRADIENT_ONLY = false, BANDS = (MODE & UPDATE_BANDS) != 0u,
           BY_DEPTH_PLANE = (MODE & UPDATE_DEPTH) != 0u;

TEXELS(0, params);
layout(set = 0, binding = 2, scalar) readonly buffer ListIndices { uint list_indices[]; };
layout(set = 0, binding = 3, scalar) readonly buffer SumsIn { float sums[]; };
WORD_TEXELS(4, moments1);
WORD_TEXELS(5, moments2);
layout(set = 0, binding = 6, scalar) buffer CountsBlock { Counts counts; };
STORED_TEXELS(7, params_out);
STORED_WORD_TEXELS(8, moments1_out);
STORED_WORD_TEXELS(9, moments2_out);
layout(set = 0, binding = 10, scalar) buffer Statistics { vec2 statistics[]; };
layout(push_constant, scalar) uniform Push { UpdateViewsPush push; };
#include "lib/splat_update.glsl"

const uint FLOATS = BY_DEPTH_PLANE ? SUM_FLOATS_DEPTH : ABSOLUTE ? SUM_FLOATS_ABSOLUTE : SUM_FLOATS;

Sums sums_at(uint index) {
    const uint at = FLOATS * index;  // no local array of floats: glslang may give it the layout of a buffer's
    return Sums(sums[at], vec2(sums[at + 1u], sums[at + 2u]), vec3(sums[at + 3u], sums[at + 4u], sums[at + 5u]),
                vec3(sums[at + 6u], sums[at + 7u], sums[at + 8u]),
                FLOATS > SUM_FLOATS ? vec2(sums[at + 9u], sums[at + 10u]) : vec2(0.0), BY_DEPTH_PLANE ? sums[at + 11u] : 0.0);
}

Sums added(Sums a, Sums b) {
    return Sums(a.g + b.g, a.gw + b.gw, a.gww + b.gww, a.color + b.color, a.absolute + b.absolute,
                a.depth + b.depth);
}

// The sums of splat i over the bands of a view, in their order. Whether a band lists the splat.
bool sums_of(uint view, uint i, out Sums sums) {
    bool listed = false;
    const uint bands = BANDS ? push.bands : 1u;
    for (uint band = 0u; band < bands; ++band) {
        const uint index = list_indices[(view * bands + band) * push.splats + i];
        if (index == NOT_LISTED) continue;
        if (listed)
            sums = added(sums, sums_at(index));
        else
            sums = sums_at(index);
        listed = true;
    }
    return listed;
}

// Zero plus a value is not that value if it is -0: the first view's gradient is not added.
vec4 added(bool first, vec4 sum, vec4 value) { return first ? push.share * value : sum + push.share * value; }

void main() {
    const uint i = item_index();
    if (i >= push.splats) return;
    const vec4 p0 = fetch(params, index_of(0, i)), p1 = fetch(params, index_of(1, i)), p2 = fetch(params, index_of(2, i));
    const StoredSplat splat = StoredSplat(p0.xyz, p0.w, p1, p2.xyz);
    vec4 by_mean = vec4(0.0), by_quaternion = vec4(0.0), by_scale = vec4(0.0), by_sh[16];
    [[unroll]] for (uint plane = FIRST_SH_PLANE; plane < PLANES; ++plane) by_sh[plane] = vec4(0.0);
    float depth = 3.4e38, widest = 3.4e38;
    vec2 seen = vec2(0.0);
    for (uint view = 0u; view < push.views; ++view) {
        Sums s;
        if (!sums_of(view, i, s)) continue;
        const bool first = depth == 3.4e38;
        camera_index = view;
        const StoredProjection stored = project_splat(splat);
        const Projection p = stored.footprint;
        cut_off_gradient(stored, s);
        const vec3 direction = seen_along(p);
        const ShBasis basis = sh_basis_of(direction);
        vec3 direction_gradient = vec3(0.0);
        [[unroll]] for (uint plane = FIRST_SH_PLANE; plane < PLANES; ++plane) {
            const vec4 value = fetch(params, index_of(plane, i));
            by_sh[plane] = added(first, by_sh[plane], sh_gradient(plane, value, s.color, basis, direction_gradient));
        }
        const FootprintGradient f = footprint_gradient(s, p);
        SplatGradient g = splat_gradient(f, stored, splat, s.g, direction, direction_gradient);
        if (BY_DEPTH_PLANE) add_depth_gradient(g, s.depth);
        by_mean = added(first, by_mean, vec4(g.mean, g.logit));
        by_quaternion = added(first, by_quaternion, g.quaternion);
        by_scale = added(first, by_scale, vec4(g.log_scale, basis.value[0] * s.color.r));
        depth = min(depth, depth_of_splat(p));
        widest = min(widest, widest_log_scale(p));
        seen += statistics_of(f, 0.5 * vec2(camera.size[0], camera.size[1]));
    }

    [[unroll]] for (uint plane = FIRST_SH_PLANE; plane < PLANES; ++plane) {
        move(plane, i, fetch(params, index_of(plane, i)), by_sh[plane], sh_rates(plane), 0.0);
    }
    move_splat(i, p0, p1, p2, by_mean, by_quaternion, by_scale, sigmoid(p0.w), depth, widest);
    if (STATISTICS && seen.y > 0.0) statistics[i] += seen;
    count_updates();
}
