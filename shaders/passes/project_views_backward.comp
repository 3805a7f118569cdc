#version 460
// SPDX-License-Identifier: Apache-2.0
// Gradient of project_views.
// One invocation owns splat i. It adds the gradients of its views in their order. With VIEWS_GRADIENTS each subgroup adds
// those of the view matrices over its splats, and reduce.comp adds the subgroups. SPEC_MODE: VIEWS_* bits
// and SHAPE_WHITENERS.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/plain_splat.glsl"
#include "lib/footprint_gradient.glsl"
#include "lib/lens_gradient.glsl"
#include "lib/subgroup.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
const bool VIEW_GRADIENTS = (MODE & VIEWS_GRADIENTS) != 0u, WHITENERS = (MODE & SHAPE_WHITENERS) != 0u;

layout(set = 0, binding = 4, scalar) readonly buffer Radii { ivec2 radii[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Means2d { vec2 means2d_gradient[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Depths { float depths_gradient[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Conics { vec3 conics_gradient[]; };
layout(set = 0, binding = 8, scalar) readonly buffer Compensations { float compensations_gradient[]; };
layout(set = 0, binding = 9, scalar) writeonly buffer MeansGradient { vec3 means_gradient[]; };
layout(set = 0, binding = 10, scalar) writeonly buffer ShapesGradient { float shapes_gradient[]; };
layout(set = 0, binding = 11, scalar) writeonly buffer ScalesGradient { vec3 scales_gradient[]; };
layout(set = 0, binding = 12, scalar) writeonly buffer ViewSums { float view_sums[]; };
layout(push_constant, scalar) uniform Push { ViewsPush push; };

struct Total {
    vec3 mean;
    vec3 log_scale, beside;  // as in FootprintGradient
    float covariance[6];
};

// The sums over pixels that have the same gradient by ux, k and vy: it is -2/ux gww.x, 2 ux/vy gww.y and -2/vy gww.z. For a
// conic A, B, C: A = 2 ux^2, B = -2 ux^2 k, C = 2 (ux^2 k^2 + vy^2).
Sums sums_of(vec3 shape_gradient, float compensation_gradient, Projection p) {
    const float by_a = shape_gradient.x, by_b = shape_gradient.y, by_c = shape_gradient.z;
    vec3 gww;
    if (WHITENERS) {
        gww = 0.5 * shape_gradient * vec3(-p.ux, p.vy / p.ux, -p.vy);
    } else {
        gww = vec3(-2.0 * p.ux * p.ux * (by_a - p.k * by_b + p.k * p.k * by_c), p.ux * p.vy * (2.0 * p.k * by_c - by_b),
                   -2.0 * p.vy * p.vy * by_c);
    }
    const float g = COMPENSATIONS && p.factor > float(COMPENSATION_MIN) ? compensation_gradient * p.factor : 0.0;
    return Sums(g, vec2(0.0), gww, vec3(0.0), vec2(0.0), 0.0);
}

// Adds w (a b^T + b a^T) / 2 to a symmetric matrix, whose entries off the diagonal count both of their places.
void add_product(inout float m[6], float w, vec3 a, vec3 b) {
    m[0] += w * a.x * b.x;
    m[1] += w * (a.x * b.y + a.y * b.x);
    m[2] += w * (a.x * b.z + a.z * b.x);
    m[3] += w * a.y * b.y;
    m[4] += w * (a.y * b.z + a.z * b.y);
    m[5] += w * a.z * b.z;
}

// dL/dSigma = T^T dL/dSigma2 T, with T = J W by rows t0, t1. With L as in footprint_gradient, dL/dSigma2 = 2 L^T gww L plus
// the compensation's share, which is that of footprint_gradient over M.
void add_covariance_gradient(inout float total[6], Sums s, Projection p, vec3 t0, vec3 t1) {
    const vec3 u = p.ux * (t0 - p.k * t1), v = p.vy * t1;
    add_product(total, 2.0 * s.gww.x, u, u);
    add_product(total, 4.0 * s.gww.y, u, v);
    add_product(total, 2.0 * s.gww.z, v, v);
    if (COMPENSATIONS && s.g != 0.0) {
        const vec3 m0 = p.unit * p.m0, m1 = p.unit * p.m1;
        const float aa = dot(m0, m0), cc = dot(m1, m1), low_pass = p.unit * p.unit * p.low_pass;
        const float share = -low_pass * (aa + cc + low_pass) / p.det0;
        const float weight = -0.5 * p.unit * p.unit * s.g / p.det;
        add_product(total, weight * (low_pass + share * cc), t0, t0);
        add_product(total, -2.0 * weight * share * p.b, t0, t1);
        add_product(total, weight * (low_pass + share * aa), t1, t1);
    }
}

// Adds the gradient of a splat in view v. Returns that of the view matrix.
void add_view(uint v, uint i, PlainSplat splat, inout Total total, out vec3 by_view, out mat3 by_rotation) {
    const uint at = v * push.splats + i;
    const ViewBlock view = views[v];
    view_index = v;
    const Projection p = project_in_view(splat, view, push.low_pass);
    const Sums s = sums_of(conics_gradient[at], COMPENSATIONS ? compensations_gradient[at] : 0.0, p);
    FootprintGradient f = footprint_gradient(s, p);
    f.mean = means2d_gradient[at];
    by_view = LENSES != 0u ? lens_point_gradient(f, p, 0.0) : view_point_gradient(f, p);
    by_view.z += depths_gradient[at];

    const mat3 rotation = rotation_of_view(view);
    total.mean += by_view * rotation;
    vec3 j0 = p.focal_over_z.x * vec3(1.0, 0.0, -p.tangent.x), j1 = p.focal_over_z.y * vec3(0.0, 1.0, -p.tangent.y);
    if (LENSES != 0u) {
        j0 = view.focal_hi[0] * p.image.jx;
        j1 = view.focal_hi[1] * p.image.jy;
    }
    if (COVARIANCES) {
        add_covariance_gradient(total.covariance, s, p, j0 * rotation, j1 * rotation);
    } else {
        total.log_scale += f.log_scale;
        total.beside += f.beside;
    }
    if (VIEW_GRADIENTS) {
        by_rotation = outerProduct(by_view, splat.mean);
        [[unroll]] for (int k = 0; k < 3; ++k)
            by_rotation += outerProduct(j0 * f.dm0[k] + j1 * f.dm1[k], splat.directions[k] * splat.scale[k]);
    }
}

void write_shape(uint i, PlainSplat splat, vec4 unit_quaternion, float norm, Total total) {
    if (COVARIANCES) {
        [[unroll]] for (uint j = 0; j < 6; ++j) shapes_gradient[6 * i + j] = total.covariance[j];
        return;
    }
    // s_i / s_j - s_j / s_i, without cancellation where the scales are nearly equal.
    // A compiler may divide by the product of two tiny scales, which is zero: a power of two lifts both.
    const vec3 largest = max(abs(splat.scale.yzx), abs(splat.scale.zxy));
    const vec3 lift = mix(vec3(1.0), vec3(1125899906842624.0), lessThan(largest, vec3(1e-6)));
    const vec3 a = lift * splat.scale.yzx, b = lift * splat.scale.zxy;
    const vec3 torque = total.beside / a / b * (a - b) * (a + b);
    const vec4 by_quaternion = torque_on_quaternion(unit_quaternion, torque) / norm;
    [[unroll]] for (uint j = 0; j < 4; ++j) shapes_gradient[4 * i + j] = by_quaternion[j];
    scales_gradient[i] = total.log_scale / splat.scale;
}

void main() {
    const uint i = item_index();
    const bool there = i < push.splats;
    vec4 unit_quaternion;
    float norm;
    const PlainSplat splat = read_splat(there ? i : 0u, unit_quaternion, norm);
    Total total = Total(vec3(0.0), vec3(0.0), vec3(0.0), float[6](0.0, 0.0, 0.0, 0.0, 0.0, 0.0));
    bool seen = false;
    const uint subgroups = gl_NumWorkGroups.x * gl_NumWorkGroups.y * (GROUP_SIZE / SUBGROUP);
    const uint own = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * (GROUP_SIZE / SUBGROUP) + SUBGROUP_INDEX;
    for (uint v = 0u; v < push.views; ++v) {
        const ivec2 radius = there ? radii[v * push.splats + i] : ivec2(0);
        vec3 by_view = vec3(0.0);
        mat3 by_rotation = mat3(0.0);
        if (radius.x > 0 && radius.y > 0) {
            seen = true;
            add_view(v, i, splat, total, by_view, by_rotation);
        }
        if (!VIEW_GRADIENTS) continue;
        // All lanes take part in the sums, with or without a splat.
        [[unroll]] for (uint j = 0; j < VIEW_GRADIENT_FLOATS; ++j) {
            const float sum = subgroup_sum(j < 9u ? by_rotation[j % 3u][j / 3u] : by_view[j % 3u]);
            if (LANE == 0u) view_sums[(VIEW_GRADIENT_FLOATS * v + j) * subgroups + own] = sum;
        }
    }
    if (!there) return;
    means_gradient[i] = total.mean;
    if (seen) {
        write_shape(i, splat, unit_quaternion, norm, total);
    } else {
        // The shape of an unseen splat may be anything, and zero times infinity is not zero.
        [[unroll]] for (uint j = 0; j < (COVARIANCES ? 6u : 4u); ++j) shapes_gradient[(COVARIANCES ? 6u : 4u) * i + j] = 0.0;
        if (!COVARIANCES) scales_gradient[i] = vec3(0.0);
    }
}
