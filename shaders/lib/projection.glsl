// SPDX-License-Identifier: Apache-2.0
// From a splat's parameters to its 2D Gaussian: Sigma2 = J W Sigma W^T J^T + LOW_PASS I (EWA; Zwicker et al. 2001,
// eq. 22 to 31). With M = J W R S, Sigma2 = M M^T + LOW_PASS I. The forward and the backward pass share this code.
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
    bool in_range;         // quaternion and mean are within bounds
    bool footprint_in_range; // the footprint is within bounds; holds for splats in front of the camera only
    float unit;            // px to the units of a, b, c and det: 1, or less if squares would overflow
    float a, b, c, det;    // Sigma2 = [a b; b c]
    vec3 minors;           // m0 x m1
    float det0;            // det(M M^T), without the low-pass
    float ux, k, vy;       // as in the record (px)
    float peak;            // opacity before the kernel's factor
    float factor;          // the kernel's factor
};

float sigmoid(float x) { return 1.0 / (1.0 + exp(-x)); }

// A scale below exp(LOG_SCALE_MIN) looks the same as exp(LOG_SCALE_MIN), and ratios of such scales stay finite.
vec3 computable_log_scale(vec3 log_scale) { return max(log_scale, vec3(float(LOG_SCALE_MIN))); }

Projection project_splat(SplatShape splat) {
    Projection p;
    p.view = view_point(splat.mean);
    const float z = p.view.z.x;
    p.unit_quaternion = normalize_quaternion(splat.quaternion, p.quaternion_norm);
    p.rotation = rotation_of(p.unit_quaternion);
    const vec3 scale = exp(computable_log_scale(splat.log_scale));
    const mat3 directions = camera_rotation() * p.rotation;
    [[unroll]] for (int k = 0; k < 3; ++k) p.axes[k] = directions[k] * scale[k];

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

    const vec3 far = abs(p.view.offset), wide = abs(p.m0) + abs(p.m1);
    const float footprint = wide.x + wide.y + wide.z;
    // A NaN fails these comparisons.
    p.in_range = far.x <= float(VIEW_MAX) && far.y <= float(VIEW_MAX) && far.z <= float(VIEW_MAX) &&
                 p.quaternion_norm >= float(QUATERNION_MIN);
    p.footprint_in_range = footprint <= float(FOOTPRINT_MAX);
    // A power of two, so that the product is exact.
    p.unit = footprint > 1073741824.0 ? 9.094947017729282e-13 : 1.0;
    const vec3 m0 = p.unit * p.m0, m1 = p.unit * p.m1;
    const float aa = dot(m0, m0), cc = dot(m1, m1);
    const float low_pass = p.unit * p.unit * float(LOW_PASS);
    p.a = aa + low_pass;
    p.b = dot(m0, m1);
    p.c = cc + low_pass;
    // det(M M^T) is the sum of the squared 2x2 minors of M (Cauchy-Binet). A minor is a product of two scales and of how
    // far the third axis points at the camera. No term cancels, however thin the splat and however wide the view.
    const vec3 x_scale = p.unit * p.focal_over_z.x * scale, y_scale = p.unit * p.focal_over_z.y * scale;
    p.minors = (vec3(p.tangent, 1.0) * directions) * x_scale.yzx * y_scale.zxy;
    p.det0 = dot(p.minors, p.minors);
    p.det = p.det0 + low_pass * (aa + cc) + low_pass * low_pass;
    p.ux = p.unit * sqrt(0.5 * p.c / p.det);
    p.k = p.b / p.c;
    p.vy = p.unit * sqrt(0.5 / p.c);

    p.peak = sigmoid(splat.logit);
    p.factor = 1.0;
    if (KERNEL == KERNEL_ANTIALIAS) p.factor = sqrt(max(0.0, p.det0 / p.det));
    if (KERNEL == KERNEL_UNIT_MASS) p.factor = 0.15915494309189535 * p.unit * p.unit / sqrt(p.det);
    return p;
}
#endif
