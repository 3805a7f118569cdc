// SPDX-License-Identifier: Apache-2.0
// Where a lens shows a point, and J = d(pixel)/d(point), of cameras with SPEC_LENSES. Points are in camera coordinates, and planes
// in units of the focal length. check/reference/lens.h has the formulas. Needs projection.glsl, and a block `camera`.
#ifndef EWA_LIB_LENS
#define EWA_LIB_LENS

#include "lib/lens_slopes.glsl"

vec2 df_root(vec2 a) {
    const float r = sqrt(a.x);
    if (!(r > 0.0)) return vec2(0.0);
    return quick_two_sum(r, (df_add(a, -two_product(r, r)).x) / (2.0 * r));
}

// cos and sin of k pi / 16, as float pairs.
const vec4 TURNS[9] = vec4[9](
    vec4(1.0, 0.0, 0.0, 0.0),
    vec4(0.980785251, 2.97394731e-08, 0.195090324, -1.67047143e-09),
    vec4(0.923879504, 2.83074897e-08, 0.382683426, 6.22335072e-09),
    vec4(0.831469595, 1.68702634e-08, 0.555570245, -1.17695214e-08),
    vec4(0.707106769, 1.21016175e-08, 0.707106769, 1.21016175e-08),
    vec4(0.555570245, -1.17695214e-08, 0.831469595, 1.68702634e-08),
    vec4(0.382683426, 6.22335072e-09, 0.923879504, 2.83074897e-08),
    vec4(0.195090324, -1.67047143e-09, 0.980785251, 2.97394731e-08),
    vec4(0.0, 0.0, 1.0, -0.0));
const vec2 TURN = vec2(0.196349546, -5.46392354e-09);  // pi / 16

// atan2(y, x) as a float pair: a turn by a multiple of pi / 16 leaves an angle for which the series is short.
vec2 df_angle(vec2 y, vec2 x) {
    const bool below = y.x < 0.0, left = x.x < 0.0;
    const vec2 ay = below ? -y : y, ax = left ? -x : x;
    const int k = int(round(atan(ay.x, ax.x) / TURN.x));
    const vec4 turn = TURNS[clamp(k, 0, 8)];
    const vec2 c = turn.xy, s = turn.zw;
    const vec2 t = df_div(df_add(df_mul(ay, c), -df_mul(ax, s)), df_add(df_mul(ax, c), df_mul(ay, s)));
    const float q = t.x * t.x;
    const float rest = t.x * q * (-1.0 / 3.0 + q * (1.0 / 5.0 + q * (-1.0 / 7.0 + q / 9.0)));
    vec2 angle = df_add(df_mul(vec2(float(k), 0.0), TURN), df_add(t, vec2(rest, 0.0)));
    if (left) angle = df_add(df_mul(vec2(16.0, 0.0), TURN), -angle);
    return below ? -angle : angle;
}

vec2 lens_term(uint i) { return vec2(camera.lens_hi[i], camera.lens_lo[i]); }

// 1 + w (a + w (b + w c)).
vec2 df_radial(vec2 w, vec2 a, vec2 b, vec2 c) {
    return df_add(vec2(1.0, 0.0), df_mul(w, df_add(a, df_mul(w, df_add(b, df_mul(w, c))))));
}

// ---- LENS_BROWN ----

vec2 df_twice(vec2 a) { return 2.0 * a; }

void brown_point(vec2 a, vec2 b, out vec2 x, out vec2 y) {
    const vec2 aa = df_mul(a, a), bb = df_mul(b, b), ab = df_twice(df_mul(a, b)), w = df_add(aa, bb);
    const vec2 radial = df_div(df_radial(w, lens_term(LENS_K1), lens_term(LENS_K2), lens_term(LENS_K3)),
                               df_radial(w, lens_term(LENS_K4), lens_term(LENS_K5), lens_term(LENS_K6)));
    const vec2 p1 = lens_term(LENS_P1), p2 = lens_term(LENS_P2);
    const vec2 prism_x = df_mul(w, df_add(lens_term(LENS_S1), df_mul(w, lens_term(LENS_S2))));
    const vec2 prism_y = df_mul(w, df_add(lens_term(LENS_S3), df_mul(w, lens_term(LENS_S4))));
    x = df_add(df_add(df_mul(radial, a), df_mul(p1, ab)), df_add(df_mul(p2, df_add(w, df_twice(aa))), prism_x));
    y = df_add(df_add(df_mul(radial, b), df_mul(p2, ab)), df_add(df_mul(p1, df_add(w, df_twice(bb))), prism_y));
}

vec2 brown_tangent(vec2 t) { return clamp(t, vec2(camera.tan_min[0], camera.tan_min[1]), vec2(camera.tan_max[0], camera.tan_max[1])); }

void brown_rows(vec2 t, float inverse_z, out vec3 x, out vec3 y) {
    const mat2 slope = brown_slope(t);
    x = inverse_z * vec3(slope[0].x, slope[1].x, -dot(vec2(slope[0].x, slope[1].x), t));
    y = inverse_z * vec3(slope[0].y, slope[1].y, -dot(vec2(slope[0].y, slope[1].y), t));
}

// ---- LENS_FISHEYE: x = A(r, z) x with A = d / r ----

// A, its derivative B = dA/dr / r and that one's, C = dB/dr / r; then dA/dz, d2A/dz2 and dB/dz.
struct Fisheye {
    float a, b, c, az, azz, bz;
};

Fisheye fisheye_slopes(vec3 p) {
    const float k1 = camera.lens_hi[LENS_K1], k2 = camera.lens_hi[LENS_K2], k3 = camera.lens_hi[LENS_K3], k4 = camera.lens_hi[LENS_K4];
    const float r2 = dot(p.xy, p.xy), r = sqrt(r2), z = p.z, rho2 = r2 + z * z;
    const float angle = atan(r, z), w = angle * angle;
    const float slope = 1.0 + w * (3.0 * k1 + w * (5.0 * k2 + w * (7.0 * k3 + w * 9.0 * k4)));
    const float curvature = angle * (6.0 * k1 + w * (20.0 * k2 + w * (42.0 * k3 + w * 72.0 * k4)));
    Fisheye f;
    f.az = -slope / rho2;
    const float rho4 = rho2 * rho2;
    f.azz = (curvature * r + 2.0 * z * slope) / rho4;
    if (z > 0.0 && r2 < 0.02 * z * z) {
        // Near the axis the terms cancel: d / tan as a series in tan^2.
        const float q = r2 / (z * z), i = 1.0 / z, i3 = i * i * i;
        const float g1 = k1 - 1.0 / 3.0, g2 = 0.2 - k1 + k2, g3 = -1.0 / 7.0 + 14.0 / 15.0 * k1 - 5.0 / 3.0 * k2 + k3;
        const float g4 = 1.0 / 9.0 - 0.8656084656 * k1 + 19.0 / 9.0 * k2 - 7.0 / 3.0 * k3 + k4;
        f.a = i * (1.0 + q * (g1 + q * (g2 + q * (g3 + q * g4))));
        f.b = 2.0 * i3 * (g1 + q * (2.0 * g2 + q * (3.0 * g3 + q * 4.0 * g4)));
        f.c = 4.0 * i3 * i * i * (2.0 * g2 + q * (6.0 * g3 + q * 12.0 * g4));
        // B = b(q) / z^3: dB/dz = -(3 b + 2 q b') / z^4.
        f.bz = -i * (3.0 * f.b + r2 * f.c);
        return f;
    }
    const float turned = angle * (1.0 + w * (k1 + w * (k2 + w * (k3 + w * k4))));
    f.a = turned / r;
    f.b = (slope * z / rho2 - f.a) / r2;
    f.c = (curvature * z * z / (r * rho4) - 2.0 * z * slope / rho4 - 3.0 * f.b) / r2;
    f.bz = -curvature * z / (r * rho4) + 2.0 * slope / rho4;
    return f;
}

void fisheye_point(View v, out vec2 x, out vec2 y) {
    const vec2 r = df_root(df_add(df_mul(v.x, v.x), df_mul(v.y, v.y)));
    const vec2 angle = df_angle(r, v.z), w = df_mul(angle, angle);
    const vec2 bend = df_add(vec2(1.0, 0.0), df_mul(w, df_add(lens_term(LENS_K1), df_mul(w, df_add(lens_term(LENS_K2), df_mul(w,
                      df_add(lens_term(LENS_K3), df_mul(w, lens_term(LENS_K4)))))))));
    // On the axis the angle is that of the tangent.
    const vec2 factor = r.x > 1e-18 * abs(v.z.x) ? df_div(df_mul(angle, bend), r) : df_div(vec2(1.0, 0.0), v.z);
    x = df_mul(factor, v.x);
    y = df_mul(factor, v.y);
}

// ---- All lenses ----

vec3 point_of(View v) { return vec3(v.x.x, v.y.x, v.z.x); }

LensImage lens_image(View v) {
    LensImage image;
    const vec3 p = point_of(v);
    const float rho2 = dot(p, p);
    image.depth = p.z;
    image.shown = true;
    if (camera.lens == LENS_FISHEYE) {
        fisheye_point(v, image.x, image.y);
        const Fisheye f = fisheye_slopes(p);
        image.jx = vec3(f.a + f.b * p.x * p.x, f.b * p.x * p.y, f.az * p.x);
        image.jy = vec3(f.b * p.x * p.y, f.a + f.b * p.y * p.y, f.az * p.y);
        image.depth = sqrt(rho2);
        image.shown = atan(length(p.xy), p.z) <= camera.lens_limit;
    } else if (camera.lens == LENS_EQUIRECTANGULAR) {
        const vec2 q_pair = df_root(df_add(df_mul(v.x, v.x), df_mul(v.z, v.z)));
        const float q2 = dot(p.xz, p.xz), q = sqrt(q2);
        image.x = df_angle(v.x, v.z);
        image.y = df_angle(v.y, q_pair);
        image.jx = vec3(p.z, 0.0, -p.x) / q2;
        image.jy = vec3(-p.x * p.y / q, q, -p.y * p.z / q) / rho2;
        image.depth = sqrt(rho2);
        image.shown = q > 0.0;
    } else if (camera.lens == LENS_ORTHOGRAPHIC) {
        image.x = v.x;
        image.y = v.y;
        image.jx = vec3(1.0, 0.0, 0.0);
        image.jy = vec3(0.0, 1.0, 0.0);
    } else {
        const vec2 a = df_div(v.x, v.z), b = df_div(v.y, v.z), t = vec2(a.x, b.x);
        brown_point(a, b, image.x, image.y);
        brown_rows(brown_tangent(t), 1.0 / p.z, image.jx, image.jy);
        brown_rows(t, 1.0 / p.z, image.exact_x, image.exact_y);
        image.shown = dot(t, t) <= camera.lens_limit;
        return image;
    }
    image.exact_x = image.jx;
    image.exact_y = image.jy;
    return image;
}

// As project_shape, with the lens's J.
Projection project_through_lens(View view, LensImage image, mat3 directions, mat3 cofactors, vec3 scale, float low_pass_px) {
    Projection p;
    p.view = view;
    p.low_pass = low_pass_px;
    p.scale = scale;
    p.image = image;
    [[unroll]] for (int k = 0; k < 3; ++k) p.axes[k] = directions[k] * scale[k];
    const vec3 x = camera.focal_hi[0] * p.image.jx, y = camera.focal_hi[1] * p.image.jy;
    p.m0 = x * p.axes;
    p.m1 = y * p.axes;
    set_unit(p);
    const vec3 both = cross(x, y);
    const vec3 sizes = p.unit * scale;
    set_covariance(p, (both * cofactors) * sizes.yzx * sizes.zxy);
    if (KERNEL == KERNEL_DENSITY) {
        const float root = sqrt(length(both));
        p.factor = mean_shadow(scale, vec2(p.unit * root)) / sqrt(p.det);
    }
    return p;
}
#endif
