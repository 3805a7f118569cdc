// SPDX-License-Identifier: Apache-2.0
// A stored splat as the rays of a camera meet it. lib/rays.glsl describes the values. The including pass defines
// BINDING_CAMERA. Needs stored_splat.glsl.
#ifndef EWA_LIB_RAY_SHAPE
#define EWA_LIB_RAY_SHAPE

struct RayShape {
    View view;
    mat3 directions;  // of the splat's axes in camera axes
    vec3 sharpness;   // the least scale over each scale
    float least_scale;
    mat3 frame;       // columns q1, q2, q3, by the splat's axes
    float ux, k, vy;  // px
    vec2 bend;        // g
    float rho;
    float depth;      // optical depth of the ray through the centre; of KERNEL_DENSITY: times |direction| = 1
};

// The squares of components of any size neither overflow nor underflow.
float robust_length(vec3 v) {
    const vec3 a = abs(v);
    const float largest = max(max(a.x, a.y), a.z);
    return largest > 0.0 ? largest * length(v / largest) : 0.0;
}

// The median of three values.
float middle_of(vec3 v) { return max(min(v.x, v.y), min(max(v.x, v.y), v.z)); }

// The root mean square of a splat's shadow over all directions, over the product of its two larger scales.
float relative_shadow(vec3 sharpness) {
    const float least = min(min(sharpness.x, sharpness.y), sharpness.z), middle = middle_of(sharpness);
    return sqrt((1.0 + least * least + middle * middle) / 3.0);
}

RayShape ray_shape(View view, Lens lens, vec4 unit_quaternion, vec3 stored_log_scale, float logit) {
    RayShape r;
    r.view = view;
    r.directions = lens.rotation * rotation_of(unit_quaternion);
    const vec3 log_scale = computable_log_scale(stored_log_scale);
    const float largest = max(max(log_scale.x, log_scale.y), log_scale.z);
    const float least = min(min(log_scale.x, log_scale.y), log_scale.z);
    const vec3 relative = exp(log_scale - largest);
    r.sharpness = exp(least - log_scale);
    r.least_scale = exp(least);

    const float z = view.z.x;
    const vec3 to_mean = vec3(view.x.x / z, view.y.x / z, 1.0);
    const mat3 rows = transpose(r.directions);  // column j: component j of each axis
    // M v of the ray through the mean, and how M v moves with the pixel's x; both times the least scale.
    const vec3 center = (to_mean * r.directions) * r.sharpness;
    const vec3 by_x = rows[0] * r.sharpness;
    const float distance = robust_length(center);
    const vec3 m0 = (rows[0] - to_mean.x * rows[2]) * relative, m1 = (rows[1] - to_mean.y * rows[2]) * relative;
    const float height = robust_length(m1);
    r.frame[2] = center / distance;
    r.frame[1] = m1 / height;
    r.frame[0] = cross(r.frame[1], r.frame[2]);

    // The minors of m0 and m1 are `center` times the middle one of the relative scales.
    const float middle = middle_of(relative);
    const vec2 px = lens.focal / z * exp(largest);
    r.ux = 0.7071067811865476 * (height / distance) / middle / px.x;
    r.k = (lens.focal.x / lens.focal.y) * (dot(m0, m1) / height / height);
    r.vy = 0.7071067811865476 / height / px.y;
    r.rho = 1.4142135623730951 * (r.least_scale / z) / distance;
    const vec3 by_y = rows[1] * r.sharpness;
    r.bend = vec2(dot(r.frame[2], by_x), dot(r.frame[2], by_y)) / distance / lens.focal;
    if (KERNEL == KERNEL_DENSITY) {
        r.depth = softplus(logit) * relative_shadow(r.sharpness) / distance;
    } else {
        r.depth = min(softplus(logit), -log(float(1.0 - ALPHA_MAX)));
    }
    return r;
}
#endif
