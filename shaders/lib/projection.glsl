// SPDX-License-Identifier: Apache-2.0
// From a splat's parameters to its 2D Gaussian: Sigma2 = J W Sigma W^T J^T + LOW_PASS I (EWA; Zwicker et al. 2001,
// eq. 22 to 31), with M = J W R S, so that Sigma2 = M M^T + LOW_PASS I. Shared by the forward and the backward pass.
// Needs camera.glsl and quaternion.glsl.
#ifndef EWA_LIB_PROJECTION
#define EWA_LIB_PROJECTION
#include "lib/camera.glsl"
#include "lib/quaternion.glsl"

layout(constant_id = SPEC_KERNEL) const uint KERNEL = KERNEL_PEAK;

struct SplatShape {
    vec3 mean;
    float logit;
    vec4 quaternion;
    vec3 log_scale;
};

struct Projection {
    View view;
    vec4 unit_quaternion;
    float quaternion_norm;
    mat3 rotation;         // of the splat
    mat3 axes;             // W R S: column k is principal axis k, scaled, in camera axes
    vec2 tangent;          // x/z, y/z, clamped for the Jacobian
    bvec2 tangent_clamped;
    vec2 focal_over_z;
    vec3 m0, m1;           // rows of M (px)
    float a, b, c, det;    // Sigma2 = [a b; b c] (px^2)
    float det0;            // det(M M^T), without the low-pass
    float peak;            // opacity before the kernel's factor
    float factor;          // the kernel's factor
};

float sigmoid(float x) { return 1.0 / (1.0 + exp(-x)); }

// det(M M^T) as the sum of the squared 2x2 minors (Cauchy-Binet): nothing cancels, however thin the splat.
float gram_determinant(vec3 m0, vec3 m1) {
    const vec3 minors = cross(m0, m1);
    return dot(minors, minors);
}

Projection project_splat(SplatShape splat) {
    Projection p;
    p.view = view_point(splat.mean);
    const float z = p.view.z.x;
    p.unit_quaternion = normalize_quaternion(splat.quaternion, p.quaternion_norm);
    p.rotation = rotation_of(p.unit_quaternion);
    const vec3 scale = exp(splat.log_scale);
    p.axes = camera_rotation() * p.rotation;
    [[unroll]] for (int k = 0; k < 3; ++k) p.axes[k] *= scale[k];

    const vec2 tangent = vec2(p.view.x.x, p.view.y.x) / z;
    const vec2 low = vec2(camera.tan_min[0], camera.tan_min[1]);
    const vec2 high = vec2(camera.tan_max[0], camera.tan_max[1]);
    p.tangent = clamp(tangent, low, high);
    p.tangent_clamped = bvec2(tangent.x < low.x || tangent.x > high.x, tangent.y < low.y || tangent.y > high.y);
    p.focal_over_z = vec2(camera.focal_hi[0], camera.focal_hi[1]) / z;
    p.m0 = p.focal_over_z.x * vec3(p.axes[0].x - p.tangent.x * p.axes[0].z, p.axes[1].x - p.tangent.x * p.axes[1].z,
                                   p.axes[2].x - p.tangent.x * p.axes[2].z);
    p.m1 = p.focal_over_z.y * vec3(p.axes[0].y - p.tangent.y * p.axes[0].z, p.axes[1].y - p.tangent.y * p.axes[1].z,
                                   p.axes[2].y - p.tangent.y * p.axes[2].z);

    const float aa = dot(p.m0, p.m0), cc = dot(p.m1, p.m1);
    const float low_pass = float(LOW_PASS);
    p.a = aa + low_pass;
    p.b = dot(p.m0, p.m1);
    p.c = cc + low_pass;
    p.det0 = gram_determinant(p.m0, p.m1);
    p.det = p.det0 + low_pass * (aa + cc) + low_pass * low_pass;

    p.peak = sigmoid(splat.logit);
    p.factor = 1.0;
    if (KERNEL == KERNEL_ANTIALIAS) p.factor = sqrt(max(0.0, p.det0 / p.det));
    if (KERNEL == KERNEL_UNIT_MASS) p.factor = 0.15915494309189535 / sqrt(p.det);
    return p;
}
#endif
