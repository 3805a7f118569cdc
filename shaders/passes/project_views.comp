#version 460
// SPDX-License-Identifier: Apache-2.0
// Projects splats in several views, as gsplat 1.6 does.
// One invocation owns splat i in view workgroup.z. A splat that is not visible gets zeros. SPEC_MODE: VIEWS_* bits
// and SHAPE_WHITENERS.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/plain_splat.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
const bool OPACITIES = (MODE & VIEWS_OPACITIES) != 0u, WHITENERS = (MODE & SHAPE_WHITENERS) != 0u;

layout(set = 0, binding = 4, scalar) readonly buffer Opacities { float opacities[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer Radii { ivec2 radii[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer Means2d { vec2 means2d[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer Depths { float depths[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer Conics { vec3 conics[]; };
layout(set = 0, binding = 9, scalar) writeonly buffer Compensations { float compensations[]; };
layout(push_constant, scalar) uniform Push { ViewsPush push; };

// Half sizes of the box around a splat (px); zero where it is not visible.
vec2 radii_of(Projection p, vec2 mean, float opacity) {
    const vec3 position = abs(vec3(p.view.x.x, p.view.y.x, p.view.z.x));
    // A NaN fails these comparisons.
    const bool in_range = position.x <= float(VIEW_MAX) && position.y <= float(VIEW_MAX) && position.z <= float(VIEW_MAX) &&
                          p.view.z.x > push.near && (LENSES == 0u || p.image.shown) && p.view.z.x < push.far && p.footprint_in_range && p.det > 0.0 &&
                          is_finite(vec3(mean, p.ux)) && is_finite(p.vy) && p.ux > 0.0 && p.vy > 0.0;
    float sigmas = float(RADIUS_SIGMAS);
    bool shown = true;
    if (OPACITIES) {
        const float peak = opacity * p.factor;
        shown = peak >= float(ALPHA_MIN);
        sigmas = min(sigmas, sqrt(2.0 * log(peak / float(ALPHA_MIN))));
    }
    const vec2 radius = min(ceil(sigmas * sqrt(vec2(p.a, p.c)) / p.unit), vec2(RADIUS_MAX));
    const vec2 size = vec2(push.size[0], push.size[1]);
    const bool on_image = all(greaterThan(mean + radius, vec2(0.0))) && all(lessThan(mean - radius, size)) &&
                          any(greaterThan(radius, vec2(push.radius_clip)));
    return in_range && shown && on_image ? radius : vec2(0.0);
}

void main() {
    const uint i = item_index(), at = gl_WorkGroupID.z * push.splats + i;
    if (i >= push.splats) return;
    const ViewBlock view = views[gl_WorkGroupID.z];
    vec4 unit_quaternion;
    float norm;
    view_index = gl_WorkGroupID.z;
    const Projection p = project_in_view(read_splat(i, unit_quaternion, norm), view, push.low_pass);
    const vec2 fx = vec2(view.focal_hi[0], 0.0), fy = vec2(view.focal_hi[1], 0.0), cx = vec2(view.center[0], 0.0), cy = vec2(view.center[1], 0.0);
    const vec2 mean = LENSES != 0u ? vec2(df_add(df_mul(p.image.x, fx), cx).x, df_add(df_mul(p.image.y, fy), cy).x)
                                   : vec2(pixel_of(p.view.x, p.view.z, fx, cx).x, pixel_of(p.view.y, p.view.z, fy, cy).x);
    const vec2 radius = radii_of(p, mean, OPACITIES ? opacities[i] : 1.0);
    const bool visible = radius.x > 0.0 && radius.y > 0.0;
    radii[at] = visible ? ivec2(radius) : ivec2(0);
    means2d[at] = visible ? mean : vec2(0.0);
    depths[at] = visible ? p.view.z.x : 0.0;
    const vec3 shape = WHITENERS ? vec3(p.ux, p.k, p.vy) : vec3(p.c, -p.b, p.a) / p.det * (p.unit * p.unit);
    conics[at] = visible ? shape : vec3(0.0);
    if (COMPENSATIONS) compensations[at] = visible ? p.factor : 0.0;
}
