// SPDX-License-Identifier: Apache-2.0
// The inverse of a lens: what a position in the image sees. src/scene/native_lens.h has the same as ray_of. Needs a block `camera`.
#ifndef EWA_LIB_LENS_RAY
#define EWA_LIB_LENS_RAY
#include "lib/lens_slopes.glsl"

vec2 brown_bend(vec2 t) {
    const float w = dot(t, t), p1 = camera.lens_hi[LENS_P1], p2 = camera.lens_hi[LENS_P2];
    const vec2 prism = w * vec2(camera.lens_hi[LENS_S1] + w * camera.lens_hi[LENS_S2], camera.lens_hi[LENS_S3] + w * camera.lens_hi[LENS_S4]);
    return brown_radial(w).x * t + 2.0 * t.x * t.y * vec2(p1, p2) + vec2(p2, p1) * (w + 2.0 * t * t) + prism;
}

// By Newton's method. Nothing where it does not end at q, or ends beyond where the lens is one to one.
vec3 brown_ray(vec2 q) {
    vec2 t = q;
    for (int k = 0; k < 20; ++k) {
        const vec2 step = inverse(brown_slope(t)) * (q - brown_bend(t));
        t += step;
        if (dot(step, step) < 1e-14 * (1.0 + dot(t, t))) break;
    }
    const vec2 left = q - brown_bend(t);
    // A NaN fails this comparison.
    return dot(left, left) < 1e-10 * (1.0 + dot(q, q)) && dot(t, t) <= camera.lens_limit ? vec3(t, 1.0) : vec3(0.0);
}

// By Newton's method, between an angle that is too small and one that is too large.
vec3 fisheye_ray(vec2 q) {
    const float k1 = camera.lens_hi[LENS_K1], k2 = camera.lens_hi[LENS_K2], k3 = camera.lens_hi[LENS_K3], k4 = camera.lens_hi[LENS_K4];
    const float r = length(q);
    float low = 0.0, high = camera.lens_limit, angle = min(r, high);
    for (int k = 0; k < 30; ++k) {
        const float w = angle * angle;
        const float error = angle * (1.0 + w * (k1 + w * (k2 + w * (k3 + w * k4)))) - r;
        const float slope = 1.0 + w * (3.0 * k1 + w * (5.0 * k2 + w * (7.0 * k3 + w * 9.0 * k4)));
        if (error < 0.0) low = angle; else high = angle;
        float next = angle - error / slope;
        if (!(next > low && next < high)) next = 0.5 * (low + high);
        if (abs(next - angle) < 1e-7 * (1.0 + angle)) break;
        angle = next;
    }
    // At the limit, and still too near to the axis: the lens does not reach r.
    if (angle > (1.0 - 1e-6) * camera.lens_limit) return vec3(0.0);
    return vec3(sin(angle) * (r > 0.0 ? q / r : vec2(0.0)), cos(angle));
}

// The direction that a position in the plane sees, in camera axes and of any length; zero where the lens shows nothing. q: in units
// of the focal length.
vec3 lens_ray(vec2 q) {
    if (camera.lens == LENS_FISHEYE) return fisheye_ray(q);
    if (camera.lens == LENS_EQUIRECTANGULAR) return vec3(sin(q.x) * cos(q.y), sin(q.y), cos(q.x) * cos(q.y));
    if (camera.lens == LENS_ORTHOGRAPHIC) return vec3(0.0, 0.0, 1.0);
    return brown_ray(q);
}

// The inverse, in floats: where the lens shows a point in camera coordinates, in units of the focal length.
vec2 lens_position(vec3 p, out bool shown) {
    shown = true;
    if (camera.lens == LENS_FISHEYE) {
        const float r = length(p.xy), angle = atan(r, p.z), w = angle * angle;
        const float k1 = camera.lens_hi[LENS_K1], k2 = camera.lens_hi[LENS_K2], k3 = camera.lens_hi[LENS_K3], k4 = camera.lens_hi[LENS_K4];
        shown = angle <= camera.lens_limit;
        return (r > 0.0 ? angle / r : 0.0) * (1.0 + w * (k1 + w * (k2 + w * (k3 + w * k4)))) * p.xy;
    }
    if (camera.lens == LENS_EQUIRECTANGULAR) return vec2(atan(p.x, p.z), atan(p.y, length(p.xz)));
    if (camera.lens == LENS_ORTHOGRAPHIC) return p.xy;
    const vec2 t = p.xy / p.z;
    shown = p.z > 0.0 && dot(t, t) <= camera.lens_limit;
    return brown_bend(t);
}
#endif
