// SPDX-License-Identifier: Apache-2.0
// Projection of a splat as the operators get it: with linear scales or a covariance, in a view whose matrix need not be a
// rotation. Bindings 0 to 3 and SPEC_MODE are those of the operators of projection.
#ifndef EWA_LIB_PLAIN_SPLAT
#define EWA_LIB_PLAIN_SPLAT
#include "lib/projection.glsl"
#include "lib/quaternion.glsl"

layout(constant_id = SPEC_MODE) const uint MODE = 0;
const bool COVARIANCES = (MODE & VIEWS_COVARIANCES) != 0u, COMPENSATIONS = KERNEL == KERNEL_ANTIALIAS;

layout(set = 0, binding = 0, scalar) readonly buffer Views { ViewBlock views[]; };
uint view_index = 0u;  // whose lens lens.glsl reads
#define camera views[view_index]
#include "lib/lens.glsl"
layout(set = 0, binding = 1, scalar) readonly buffer Means { vec3 means[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Shapes { float shapes[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Scales { vec3 scales[]; };

// Columns of an F with F F^T = Sigma are directions[k] * scale[k], in world axes.
struct PlainSplat {
    vec3 mean;
    mat3 directions;
    mat3 cofactors;  // column k: direction k + 1 x direction k + 2
    vec3 scale;
};

// The cross products of a matrix's columns: column k + 1 x column k + 2.
mat3 cofactors_of(mat3 m) { return mat3(cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])); }

// A NaN stays one.
vec3 computable_scale(vec3 scale) {
    const vec3 least = mix(vec3(SCALE_MIN), vec3(-SCALE_MIN), lessThan(scale, vec3(0.0)));
    return mix(scale, least, lessThan(abs(scale), vec3(SCALE_MIN)));
}

PlainSplat splat_of_quaternion(vec3 mean, vec4 unit_quaternion, vec3 scale) {
    const mat3 rotation = rotation_of(unit_quaternion);
    return PlainSplat(mean, rotation, rotation, computable_scale(scale));
}

// a b - c d in two floats: the products of floats are exact, so that little is lost where they cancel.
vec2 difference_of_products(float a, float b, float c, float d) {
    return df_add(two_product(a, b), -two_product(c, d));
}

// Cholesky's factor, of a covariance xx xy xz yy yz zz that may be singular. Its pivots are ratios of minors (Sylvester), in
// float pairs: the covariance of a needle has minors far smaller than its products.
PlainSplat splat_of_covariance(vec3 mean, float raw[6]) {
    const float largest = max(max(raw[0], raw[3]), raw[5]);
    int exponent;
    frexp(max(largest, 1e-37), exponent);
    exponent -= exponent & 1;  // even: the root of the power of two is one
    float s[6];
    [[unroll]] for (int j = 0; j < 6; ++j) s[j] = ldexp(raw[j], -exponent);
    const vec2 minor2 = difference_of_products(s[0], s[3], s[1], s[1]);
    const vec2 beside = difference_of_products(s[0], s[4], s[1], s[2]);
    const vec2 minor3 = difference_of_products(s[0], s[5], s[2], s[2]);
    const vec2 last = df_add(df_mul(minor2, minor3), -df_mul(beside, beside));
    mat3 f = mat3(0.0);
    if (s[0] > 0.0) {
        f[0] = vec3(s[0], s[1], s[2]) / sqrt(s[0]);
        if (minor2.x > 0.0) {
            f[1] = vec3(0.0, minor2.x, beside.x) / sqrt(s[0]) / sqrt(minor2.x);
            f[2].z = sqrt(max(last.x, 0.0) / s[0] / minor2.x);
        } else {
            f[2].z = sqrt(max(minor3.x, 0.0) / s[0]);
        }
    } else if (s[3] > 0.0) {
        f[1] = vec3(0.0, s[3], s[4]) / sqrt(s[3]);
        f[2].z = sqrt(max(difference_of_products(s[3], s[5], s[4], s[4]).x, 0.0) / s[3]);
    } else {
        f[2].z = sqrt(max(s[5], 0.0));
    }
    const float root = ldexp(1.0, exponent / 2);
    return PlainSplat(mean, f, cofactors_of(f), vec3(root));
}

// unit_quaternion, norm: set for splats with quaternions.
PlainSplat read_splat(uint i, out vec4 unit_quaternion, out float norm) {
    unit_quaternion = vec4(1.0, 0.0, 0.0, 0.0);
    norm = 1.0;
    if (COVARIANCES) {
        float covariance[6];
        [[unroll]] for (uint j = 0; j < 6; ++j) covariance[j] = shapes[6 * i + j];
        return splat_of_covariance(means[i], covariance);
    }
    const vec4 quaternion = vec4(shapes[4 * i], shapes[4 * i + 1], shapes[4 * i + 2], shapes[4 * i + 3]);
    unit_quaternion = normalize_quaternion(quaternion, norm);
    return splat_of_quaternion(means[i], unit_quaternion, scales[i]);
}

mat3 rotation_of_view(ViewBlock view) {
    return mat3(view.rotation[0], view.rotation[3], view.rotation[6], view.rotation[1], view.rotation[4],
                view.rotation[7], view.rotation[2], view.rotation[5], view.rotation[8]);
}

// rotation * mean + translation in float pairs: the products of floats are exact.
View view_of_mean(ViewBlock view, vec3 mean) {
    vec2 p[3];
    [[unroll]] for (int i = 0; i < 3; ++i) {
        p[i] = vec2(view.translation[i], 0.0);
        [[unroll]] for (int j = 0; j < 3; ++j) p[i] = df_add(p[i], two_product(view.rotation[3 * i + j], mean[j]));
    }
    return View(vec3(0.0), p[0], p[1], p[2]);
}

// view: views[view_index].
Projection project_in_view(PlainSplat splat, ViewBlock view, float low_pass) {
    const Lens lens = Lens(rotation_of_view(view), vec2(view.focal_hi[0], view.focal_hi[1]),
                           vec2(view.tan_min[0], view.tan_min[1]), vec2(view.tan_max[0], view.tan_max[1]));
    const View at = view_of_mean(view, splat.mean);
    const mat3 directions = lens.rotation * splat.directions, cofactors = cofactors_of(lens.rotation) * splat.cofactors;
    if (LENSES != 0u) return project_through_lens(at, lens_image(at), directions, cofactors, splat.scale, low_pass);
    return project_shape(at, lens, directions, cofactors, splat.scale, low_pass);
}
#endif
