// SPDX-License-Identifier: Apache-2.0
// A camera's motion, MOTION_TEXELS: W = exp(w) W0, eye = eye0 + W0^T s, focal = exp(f) focal0.
// With the angle t = |w|, exp(w) v = v + a w x v + b w x (w x v), a = sin(t) / t, b = (1 - cos(t)) / t^2. The gradient by w
// needs c = (t - sin(t)) / t^3. All three are power series of t^2: sin and cos of Vulkan have an absolute error of 2^-11.
#ifndef EWA_LIB_MOTION
#define EWA_LIB_MOTION

struct Motion {
    vec3 turn;
    float log_focal;
    vec3 shift;
};

float series_a(float t2) { return 1.0 - t2 / 6.0 * (1.0 - t2 / 20.0 * (1.0 - t2 / 42.0 * (1.0 - t2 / 72.0))); }
float series_b(float t2) { return 0.5 * (1.0 - t2 / 12.0 * (1.0 - t2 / 30.0 * (1.0 - t2 / 56.0 * (1.0 - t2 / 90.0)))); }
float series_c(float t2) { return (1.0 - t2 / 20.0 * (1.0 - t2 / 42.0 * (1.0 - t2 / 72.0 * (1.0 - t2 / 110.0)))) / 6.0; }

// exp(w) v - v, without cancellation.
vec3 turned_by(vec3 w, vec3 v) {
    const float t2 = dot(w, w);
    const vec3 once = cross(w, v);
    return series_a(t2) * once + series_b(t2) * cross(w, once);
}

// dL/dw from dL/d(rotation that follows the motion).
vec3 turn_gradient(vec3 w, vec3 gradient) {
    const float t2 = dot(w, w);
    const vec3 once = cross(w, gradient);
    return gradient - series_b(t2) * once + series_c(t2) * cross(w, once);
}

// dL/ds from dL/d(shift along the axes of the moved camera).
vec3 shift_gradient(vec3 w, vec3 gradient) { return gradient + turned_by(-w, gradient); }
#endif
