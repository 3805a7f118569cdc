// SPDX-License-Identifier: Apache-2.0
// A stored splat as the rays of a camera meet it. lib/rays.glsl describes the values. The including pass defines
// BINDING_CAMERA. Needs stored_splat.glsl.
#ifndef EWA_LIB_RAY_SHAPE
#define EWA_LIB_RAY_SHAPE

// The pinhole in whose image rays meet a splat. Under SPEC_LENSES each splat has its own: it looks at the mean, and its focal length
// is 1, so that rays of every direction have a position in its image.
struct RayCamera {
    mat3 rotation;  // from the world
    vec2 focal;     // px, or 1
    vec3 to_mean;   // z = 1
    float z;        // of the mean
    float depth;    // by which the lens orders splats: z of the camera, or the distance
    vec3 deeper;    // d(depth)/d(mean)
};

struct RayShape {
    RayCamera eye;
    mat3 directions;  // of the splat's axes in the axes of `eye`
    vec3 log_scale;   // of what rays meet: with KERNEL_ANTIALIAS wider than the splat
    vec3 sharpness;   // the least scale over each scale
    float least_scale;
    mat3 frame;       // columns q1, q2, q3, by the splat's axes
    float ux, k, vy;  // px, or tangents under SPEC_LENSES
    vec2 bend;        // g
    float rho;
    float depth;      // optical depth of the ray through the centre; of KERNEL_DENSITY: times |direction| = 1
    float peak;       // with KERNEL_ANTIALIAS: c opacity
};

// The axes of a splat's own camera, as rows: a stable frame around the unit direction m (Duff et al. 2017, "Building an Orthonormal
// Basis, Revisited"). lens_meeting in rays.glsl evaluates the same.
float frame_factor(vec3 m) { return -1.0 / ((m.z >= 0.0 ? 1.0 : -1.0) + m.z); }
mat3 frame_rows(vec3 m) {
    const float s = m.z >= 0.0 ? 1.0 : -1.0, a = frame_factor(m);
    return mat3(vec3(1.0 + s * m.x * m.x * a, s * m.x * m.y * a, -s * m.x), vec3(m.x * m.y * a, s + m.y * m.y * a, -m.y), m);
}

RayCamera ray_camera(View view) {
    const Lens lens = camera_lens();
    const vec3 p = vec3(view.x.x, view.y.x, view.z.x);
    const vec3 ahead = vec3(0.0, 0.0, 1.0);
    if (LENSES == 0u) return RayCamera(lens.rotation, lens.focal, vec3(p.xy / p.z, 1.0), p.z, p.z, ahead);
    const float distance = length(p);
    const mat3 to_frame = transpose(frame_rows(p / distance));
    const bool by_z = camera.lens == LENS_BROWN;
    return RayCamera(to_frame * lens.rotation, vec2(1.0), ahead, distance, by_z ? p.z : distance, by_z ? to_frame[2] : ahead);
}

// How much KERNEL_ANTIALIAS widens a splat. check/reference/rays.h has the formulas.
struct Widening {
    vec3 log_scale;     // ln s'
    vec3 narrower;      // (s / s')^2
    vec3 share;         // (w / s')^2, so that both add up to 1
    vec3 along;         // p over eye.z
    vec3 own;           // 1 / (s_k^2 Q), with that p
    float rest;         // Q' / Q = sum (p_k / s'_k)^2 / Q
    float log_share;    // ln c
};

// The squares of components of any size neither overflow nor underflow.
float robust_length(vec3 v) {
    const vec3 a = abs(v);
    const float largest = max(max(a.x, a.y), a.z);
    return largest > 0.0 ? largest * length(v / largest) : 0.0;
}

float least_of(vec3 v) { return min(min(v.x, v.y), v.z); }
// The median of three values.
float middle_of(vec3 v) { return max(min(v.x, v.y), min(max(v.x, v.y), v.z)); }

// The root mean square of a splat's shadow over all directions, over the product of its two larger scales.
float relative_shadow(vec3 sharpness) {
    const float least = min(min(sharpness.x, sharpness.y), sharpness.z), middle = middle_of(sharpness);
    return sqrt((1.0 + least * least + middle * middle) / 3.0);
}

Widening widening_of(RayCamera eye, mat3 directions, vec3 log_scale) {
    Widening w;
    const float log_width = log(eye.depth) + 0.5 * log(float(LOW_PASS_ANTIALIAS) / (camera.focal_hi[0] * camera.focal_hi[1]));
    const vec3 more = 2.0 * (log_width - log_scale);
    // ln s - ln s'
    const vec3 less = -0.5 * (max(more, vec3(0.0)) + log(1.0 + exp(-abs(more))));
    w.log_scale = log_scale - less;
    w.narrower = 1.0 / (1.0 + exp(more));
    w.share = 1.0 / (1.0 + exp(-more));
    w.along = eye.to_mean * directions;
    // In units of the least scale.
    const vec3 sharp = exp(least_of(log_scale) - log_scale), wide = exp(least_of(w.log_scale) - w.log_scale);
    const float length_sharp = robust_length(w.along * sharp), length_wide = robust_length(w.along * wide);
    w.own = (sharp / length_sharp) * (sharp / length_sharp);
    w.rest = dot(w.along * w.along * w.own, w.narrower);
    // The least scale of the three cancels against the units.
    w.log_share = less.x + less.y + less.z - least_of(less) + log(length_sharp / length_wide);
    return w;
}

RayShape ray_shape(View view, vec4 unit_quaternion, vec3 stored_log_scale, float logit) {
    RayShape r;
    r.eye = ray_camera(view);
    r.directions = r.eye.rotation * rotation_of(unit_quaternion);
    r.log_scale = computable_log_scale(stored_log_scale);
    r.peak = 0.0;
    if (KERNEL == KERNEL_ANTIALIAS) {
        const Widening w = widening_of(r.eye, r.directions, r.log_scale);
        r.log_scale = w.log_scale;
        r.peak = min(sigmoid(logit), float(ALPHA_MAX)) * exp(w.log_share);
    }
    const vec3 log_scale = r.log_scale;
    const float largest = max(max(log_scale.x, log_scale.y), log_scale.z);
    const float least = least_of(log_scale);
    const vec3 relative = exp(log_scale - largest);
    r.sharpness = exp(least - log_scale);
    r.least_scale = exp(least);

    const float z = r.eye.z;
    const vec3 to_mean = r.eye.to_mean;
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
    const vec2 px = r.eye.focal / z * exp(largest);
    r.ux = 0.7071067811865476 * (height / distance) / middle / px.x;
    r.k = (r.eye.focal.x / r.eye.focal.y) * (dot(m0, m1) / height / height);
    r.vy = 0.7071067811865476 / height / px.y;
    r.rho = 1.4142135623730951 * (r.least_scale / z) / distance;
    const vec3 by_y = rows[1] * r.sharpness;
    r.bend = vec2(dot(r.frame[2], by_x), dot(r.frame[2], by_y)) / distance / r.eye.focal;
    if (KERNEL == KERNEL_DENSITY) {
        r.depth = softplus(logit) * relative_shadow(r.sharpness) / distance;
    } else if (KERNEL == KERNEL_ANTIALIAS) {
        // -ln(1 - peak), exact for a small peak too.
        const float rest = 1.0 - r.peak;
        r.depth = rest == 1.0 ? r.peak : -log(rest) * (r.peak / (1.0 - rest));
    } else {
        r.depth = min(softplus(logit), -log(float(1.0 - ALPHA_MAX)));
    }
    return r;
}
#endif
