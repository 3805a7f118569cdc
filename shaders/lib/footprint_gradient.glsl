// SPDX-License-Identifier: Apache-2.0
// Gradient from the sums of a splat's tiles to its M and scales. Needs projection.glsl.
#ifndef EWA_LIB_FOOTPRINT_GRADIENT
#define EWA_LIB_FOOTPRINT_GRADIENT

// Sums over the slots of a splat; see SLOT_FLOATS.
struct Sums {
    float g;
    vec2 gw;       // sum g u, sum g v
    vec3 gww;      // sum g u^2, g u v, g v^2
    vec3 color;
    vec2 absolute;
    float depth;   // dL/d(depth of the mean), with UPDATE_DEPTH
};

struct FootprintGradient {
    vec2 mean;         // dL/d(mean in px)
    vec2 absolute;     // sum over pixels of |dL/d(mean in px)|
    vec3 dm0, dm1;     // dL/d(rows of M)
    vec3 log_scale;    // dL/d(logarithms of the scales)
    vec3 beside;       // yz, zx and xy of P
    vec2 tangent;      // dL/d(tangents) with constant M: of KERNEL_DENSITY only
};

// From the whitened sums to the 2D Gaussian and its M. With power = -(u^2 + v^2) and (u, v) = L d, L = [ux, -k ux; 0, vy]:
// d(power)/d(mean) = 2 L^T (u, v), d(power)/dM = 4 L^T (u, v)(u, v)^T L M. L M is computed first: for a long needle, L^T L
// and M have terms that are thousands of times their product.
//
// P = M^T dL/dM is symmetric, as the square of that product. Its diagonal is the gradient by the logarithms of the scales.
// An off-diagonal entry times s_i / s_j - s_j / s_i is the torque about the third axis: dL/d(rotation about it, radians).
FootprintGradient footprint_gradient(Sums s, Projection p) {
    const float skew = -p.k * p.ux;
    FootprintGradient f;
    f.mean = 2.0 * vec2(p.ux * s.gw.x, skew * s.gw.x + p.vy * s.gw.y);
    f.absolute = 2.0 * vec2(p.ux * s.absolute.x, s.absolute.y);

    const vec3 m0 = p.unit * p.m0, m1 = p.unit * p.m1, n = p.minors;
    const float low_pass = p.unit * p.unit * p.low_pass, ux = p.ux / p.unit, vy = p.vy / p.unit;
    // c m0 - b m1 = low_pass m0 + m1 x (m0 x m1), where no term cancels.
    const vec3 lu = (ux / p.c) * (low_pass * m0 + cross(m1, n)), lv = vy * m1;
    const vec3 hu = s.gww.x * lu + s.gww.y * lv, hv = s.gww.y * lu + s.gww.z * lv;
    f.dm0 = 4.0 * p.ux * hu;
    f.dm1 = 4.0 * (skew * hu + p.vy * hv);
    f.log_scale = 4.0 * (lu * hu + lv * hv);
    f.beside = 4.0 * (lu.yzx * hu.zxy + lv.yzx * hv.zxy);   // P of yz, zx, xy
    if (KERNEL == KERNEL_DENSITY || (KERNEL == KERNEL_ANTIALIAS && p.det0 > 0.0)) {
        // ln(factor) = -ln(1 + q) / 2 with q = (det - det0) / det0, or -ln(det) / 2: in either
        // d(ln factor) = -(low_pass d(trace) + share d(det0)) / (2 det), d(det0) = 2 (m1 x n . dm0 + n x m0 . dm1).
        const float share =
            KERNEL == KERNEL_ANTIALIAS ? -(low_pass * (dot(m0, m0) + dot(m1, m1)) + low_pass * low_pass) / p.det0 : 1.0;
        const float scale = -s.g / p.det;
        f.dm0 += (p.unit * scale) * (low_pass * m0 + share * cross(m1, n));
        f.dm1 += (p.unit * scale) * (low_pass * m1 + share * cross(n, m0));
        const vec3 squares = n * n;
        f.log_scale += scale * (low_pass * (m0 * m0 + m1 * m1) +
                                share * vec3(squares.y + squares.z, squares.z + squares.x, squares.x + squares.y));
        f.beside += scale * (low_pass * (m0.yzx * m0.zxy + m1.yzx * m1.zxy) - share * n.yzx * n.zxy);
    }
    if (KERNEL == KERNEL_DENSITY) {
        // d(ln(A |J|)): by the scales, and by the tangents of |J|. |J| falls with the square of the depth, as A grows with
        // the square of the scales: view_point_gradient has that part.
        f.log_scale += s.g * mean_shadow_slope(p.scale);
        f.tangent = (s.g / (1.0 + dot(p.tangent, p.tangent))) * p.tangent;
    }
    return f;
}

// dL/d(mean in camera coordinates), through its pixel and through M. M's rows are focal/z (row x or y of the axes -
// tangent * row z).
vec3 view_point_gradient(FootprintGradient f, Projection p) {
    const float inverse_z = 1.0 / p.view.z.x;
    const vec3 row_z = vec3(p.axes[0].z, p.axes[1].z, p.axes[2].z);
    vec3 view_gradient = vec3(p.focal_over_z * f.mean, 0.0);
    const vec2 tangent = vec2(p.view.x.x, p.view.y.x) * inverse_z;
    view_gradient.z = -dot(tangent, view_gradient.xy) -
                      inverse_z * (f.log_scale.x + f.log_scale.y + f.log_scale.z);
    vec2 tangent_gradient =
        -p.focal_over_z * vec2(p.tangent_clamped.x ? 0.0 : dot(f.dm0, row_z), p.tangent_clamped.y ? 0.0 : dot(f.dm1, row_z));
    if (KERNEL == KERNEL_DENSITY) tangent_gradient += mix(f.tangent, vec2(0.0), p.tangent_clamped);
    return view_gradient + vec3(tangent_gradient, -dot(tangent_gradient, tangent)) * inverse_z;
}

// dL/d(logarithm of both focal lengths). The pixel's distance from the principal point and M are proportional to them, and
// so are the reciprocals of the tangents' bounds. |J| grows with their product, as A grows with the square of the scales.
float focal_gradient(FootprintGradient f, Projection p) {
    const vec3 row_z = vec3(p.axes[0].z, p.axes[1].z, p.axes[2].z);
    vec2 by_bound = p.focal_over_z * p.tangent * vec2(dot(f.dm0, row_z), dot(f.dm1, row_z));
    if (KERNEL == KERNEL_DENSITY) by_bound -= p.tangent * f.tangent;
    return dot(f.mean, p.focal_over_z * vec2(p.view.x.x, p.view.y.x)) + f.log_scale.x + f.log_scale.y + f.log_scale.z +
           (p.tangent_clamped.x ? by_bound.x : 0.0) + (p.tangent_clamped.y ? by_bound.y : 0.0);
}
#endif
