// SPDX-License-Identifier: Apache-2.0
// How J of a lens changes with the point: the gradient of what depends on J. Needs lens.glsl.
#ifndef EWA_LIB_LENS_GRADIENT
#define EWA_LIB_LENS_GRADIENT

// Second derivatives of x and of y: (aa, ab, bb).
void brown_curvature(vec2 t, out vec3 x, out vec3 y) {
    const float w = dot(t, t), p1 = camera.lens_hi[LENS_P1], p2 = camera.lens_hi[LENS_P2];
    const float s1 = camera.lens_hi[LENS_S1], s2 = camera.lens_hi[LENS_S2], s3 = camera.lens_hi[LENS_S3], s4 = camera.lens_hi[LENS_S4];
    const vec3 c = brown_radial(w);
    const float aab = 2.0 * c.y * t.y + 4.0 * c.z * t.x * t.x * t.y, abb = 2.0 * c.y * t.x + 4.0 * c.z * t.x * t.y * t.y;
    const vec3 prism = vec3(w + 2.0 * t.x * t.x, 2.0 * t.x * t.y, w + 2.0 * t.y * t.y);
    x = vec3(6.0 * c.y * t.x + 4.0 * c.z * t.x * t.x * t.x + 6.0 * p2, aab + 2.0 * p1, abb + 2.0 * p2) +
        2.0 * s1 * vec3(1.0, 0.0, 1.0) + 4.0 * s2 * prism;
    y = vec3(aab + 2.0 * p1, abb + 2.0 * p2, 6.0 * c.y * t.y + 4.0 * c.z * t.y * t.y * t.y + 6.0 * p1) +
        2.0 * s3 * vec3(1.0, 0.0, 1.0) + 4.0 * s4 * prism;
}

// dL/d(point) through J, given dL/d(rows of J): v0 and v1, in the plane. clamped: of LENS_BROWN's J, else of the point itself.
vec3 lens_bend_gradient(vec3 p, vec3 v0, vec3 v1, bool clamped) {
    if (camera.lens == LENS_ORTHOGRAPHIC) return vec3(0.0);
    if (camera.lens == LENS_FISHEYE) {
        const Fisheye f = fisheye_slopes(p);
        const float xx = p.x * p.x, xy = p.x * p.y, yy = p.y * p.y;
        // Second derivatives of x and of y: rows of symmetric matrices.
        const mat3 x = mat3(3.0 * f.b * p.x + f.c * xx * p.x, f.b * p.y + f.c * xx * p.y, f.az + f.bz * xx,
                            f.b * p.y + f.c * xx * p.y, f.b * p.x + f.c * yy * p.x, f.bz * xy,
                            f.az + f.bz * xx, f.bz * xy, f.azz * p.x);
        const mat3 y = mat3(f.b * p.y + f.c * xx * p.y, f.b * p.x + f.c * yy * p.x, f.bz * xy,
                            f.b * p.x + f.c * yy * p.x, 3.0 * f.b * p.y + f.c * yy * p.y, f.az + f.bz * yy,
                            f.bz * xy, f.az + f.bz * yy, f.azz * p.y);
        return x * v0 + y * v1;
    }
    if (camera.lens == LENS_EQUIRECTANGULAR) {
        const float q2 = dot(p.xz, p.xz), q = sqrt(q2), rho2 = dot(p, p), rho4 = rho2 * rho2, q4 = q2 * q2;
        const float xz = (p.x * p.x - p.z * p.z) / q4, xx = -2.0 * p.x * p.z / q4;
        vec3 gradient = vec3(xx * v0.x + xz * v0.z, 0.0, xz * v0.x - xx * v0.z);
        const float f = 1.0 / (q * rho2), steep = 1.0 / (q2 * q * rho2) + 2.0 / (q * rho4);
        const float by_y = (p.y * p.y - q2) / (q * rho4);
        const mat3 y = mat3(p.y * (p.x * p.x * steep - f), p.x * by_y, p.x * p.y * p.z * steep,
                            p.x * by_y, -2.0 * q * p.y / rho4, p.z * by_y,
                            p.x * p.y * p.z * steep, p.z * by_y, p.y * (p.z * p.z * steep - f));
        return gradient + y * v1;
    }
    const float i = 1.0 / p.z;
    const vec2 given = p.xy * i, t = clamped ? brown_tangent(given) : given;
    vec3 jx, jy, cx, cy;
    brown_rows(t, i, jx, jy);
    brown_curvature(t, cx, cy);
    const mat2 slope = brown_slope(t);
    // dL/d(slope of x), dL/d(slope of y).
    const vec2 sx = i * (v0.xy - v0.z * t), sy = i * (v1.xy - v1.z * t);
    vec2 by_t = vec2(dot(sx, cx.xy) + dot(sy, cy.xy), dot(sx, cx.yz) + dot(sy, cy.yz));
    by_t -= i * (v0.z * vec2(slope[0].x, slope[1].x) + v1.z * vec2(slope[0].y, slope[1].y));
    by_t = mix(vec2(0.0), by_t, equal(given, t));
    return i * vec3(by_t, -dot(by_t, t)) - vec3(0.0, 0.0, i * (dot(v0, jx) + dot(v1, jy)));
}

// dL/d(point) through the pixel.
vec3 exact_gradient(FootprintGradient f, Projection p) {
    return camera.focal_hi[0] * f.mean.x * p.image.exact_x + camera.focal_hi[1] * f.mean.y * p.image.exact_y;
}

// dL/d(rows of J), in the plane.
void lens_row_gradients(FootprintGradient f, Projection p, float by_log, out vec3 v0, out vec3 v1) {
    v0 = camera.focal_hi[0] * (p.axes * f.dm0);
    v1 = camera.focal_hi[1] * (p.axes * f.dm1);
    if (KERNEL == KERNEL_DENSITY) {
        const vec3 n = cross(p.image.jx, p.image.jy);
        const float scale = by_log / dot(n, n);
        v0 += scale * cross(p.image.jy, n);
        v1 += scale * cross(n, p.image.jx);
    }
}

// dL/d(mean in camera coordinates), through its pixel and through M, whose rows are focal times rows of J times the axes. With
// KERNEL_DENSITY also through |J|, the length of the rows' cross product. by_log: dL/d ln(|J|).
vec3 lens_point_gradient(FootprintGradient f, Projection p, float by_log) {
    vec3 v0, v1;
    lens_row_gradients(f, p, by_log, v0, v1);
    return exact_gradient(f, p) + lens_bend_gradient(point_of(p.view), v0, v1, true);
}

// As focal_gradient, of a lens whose bounds stay.
float lens_focal_gradient(FootprintGradient f, Projection p) {
    const vec2 focal = vec2(camera.focal_hi[0], camera.focal_hi[1]);
    return dot(f.mean, focal * vec2(p.image.x.x, p.image.y.x)) + f.log_scale.x + f.log_scale.y + f.log_scale.z;
}
#endif
