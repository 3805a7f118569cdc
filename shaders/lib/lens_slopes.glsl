// SPDX-License-Identifier: Apache-2.0
// LENS_BROWN as a map of tangents t = (x/z, y/z), and its derivatives, in floats. Needs a block `camera`.
#ifndef EWA_LIB_LENS_SLOPES
#define EWA_LIB_LENS_SLOPES

#ifdef EWA_PINHOLE
const uint LENSES = LENSES_PINHOLE;
#else
layout(constant_id = SPEC_LENSES) const uint LENSES = 0u;
#endif

// The radial factor and its first and second derivative by w.
vec3 brown_radial(float w) {
    const float k1 = camera.lens_hi[LENS_K1], k2 = camera.lens_hi[LENS_K2], k3 = camera.lens_hi[LENS_K3];
    const float k4 = camera.lens_hi[LENS_K4], k5 = camera.lens_hi[LENS_K5], k6 = camera.lens_hi[LENS_K6];
    const float n = 1.0 + w * (k1 + w * (k2 + w * k3)), n1 = k1 + w * (2.0 * k2 + w * 3.0 * k3), n2 = 2.0 * k2 + w * 6.0 * k3;
    const float d = 1.0 + w * (k4 + w * (k5 + w * k6)), d1 = k4 + w * (2.0 * k5 + w * 3.0 * k6), d2 = 2.0 * k5 + w * 6.0 * k6;
    const float c = n / d, c1 = (n1 - c * d1) / d;
    return vec3(c, c1, (n2 - 2.0 * c1 * d1 - c * d2) / d);
}

// d(x, y)/d(a, b): columns by a and by b.
mat2 brown_slope(vec2 t) {
    const float w = dot(t, t), p1 = camera.lens_hi[LENS_P1], p2 = camera.lens_hi[LENS_P2];
    const float s1 = camera.lens_hi[LENS_S1], s2 = camera.lens_hi[LENS_S2], s3 = camera.lens_hi[LENS_S3], s4 = camera.lens_hi[LENS_S4];
    const vec3 c = brown_radial(w);
    const float beside = 2.0 * (c.y * t.x * t.y + p1 * t.x + p2 * t.y);
    return mat2(c.x + 2.0 * c.y * t.x * t.x + 2.0 * p1 * t.y + 6.0 * p2 * t.x + 2.0 * t.x * (s1 + 2.0 * s2 * w),
                beside + 2.0 * t.x * (s3 + 2.0 * s4 * w), beside + 2.0 * t.y * (s1 + 2.0 * s2 * w),
                c.x + 2.0 * c.y * t.y * t.y + 6.0 * p1 * t.y + 2.0 * p2 * t.x + 2.0 * t.y * (s3 + 2.0 * s4 * w));
}
#endif
