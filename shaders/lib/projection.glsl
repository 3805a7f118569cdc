// SPDX-License-Identifier: Apache-2.0
// From a splat's parameters to its 2D Gaussian: Sigma2 = J W Sigma W^T J^T + LOW_PASS I (EWA; Zwicker et al. 2001,
// eq. 22 to 31). With M = J W R S, Sigma2 = M M^T + LOW_PASS I. The low-pass of KERNEL_ANTIALIAS is LOW_PASS_ANTIALIAS. All
// passes that project splats, or go back through the projection, share this code.
#ifndef EWA_LIB_PROJECTION
#define EWA_LIB_PROJECTION
#include "lib/density.glsl"
#include "lib/view.glsl"

// Where a lens shows a point, of cameras with SPEC_LENSES: lens.glsl fills it.
struct LensImage {
    vec2 x, y;              // in the plane, in units of the focal length; float pairs
    vec3 jx, jy;            // rows of J, in the plane: of a point that LENS_BROWN clamps
    vec3 exact_x, exact_y;  // the same of the point itself
    float depth;            // by which splats are ordered (world units)
    bool shown;
};

// When a rolling shutter sees a splat: readout.glsl fills it.
struct Readout {
    float time;   // of the splat's row
    vec3 motion;  // v: of the point in camera coordinates (world units a readout)
    vec3 row;     // r: d(share of the pixel)/d(point); 0 where the share is cut off
    float gain;   // k
};

layout(constant_id = SPEC_KERNEL) const uint KERNEL = KERNEL_PEAK;

float kernel_low_pass() { return KERNEL == KERNEL_ANTIALIAS ? float(LOW_PASS_ANTIALIAS) : float(LOW_PASS); }

struct Projection {
    View view;
    float low_pass;        // px^2
    mat3 axes;             // W R S: column k is principal axis k, scaled, in camera axes
    vec2 tangent;          // x/z, y/z, clamped for the Jacobian
    bvec2 tangent_clamped;
    vec2 focal_over_z;
    vec3 m0, m1;           // rows of M (px)
    bool footprint_in_range; // the footprint is within bounds; holds for splats in front of the camera only
    float unit;            // px to the units of a, b, c and det: 1, or less if squares would overflow
    float a, b, c, det;    // Sigma2 = [a b; b c]
    vec3 minors;           // m0 x m1
    float det0;            // det(M M^T), without the low-pass
    float ux, k, vy;       // as in the record (px)
    float factor;          // the kernel's factor
    vec3 scale;
    LensImage image;       // with SPEC_LENSES; then tangent, tangent_clamped and focal_over_z are not set
    Readout readout;       // with LENSES_ROLLING
};

// Chooses the unit in which no square of M overflows.
void set_unit(inout Projection p) {
    const vec3 wide = abs(p.m0) + abs(p.m1);
    const float footprint = wide.x + wide.y + wide.z;
    // A NaN fails this comparison.
    p.footprint_in_range = footprint <= float(FOOTPRINT_MAX);
    // A power of two, so that the product is exact.
    p.unit = footprint > 1073741824.0 ? 9.094947017729282e-13 : 1.0;
}

// From M and its minors to the whitener. The factor is that of KERNEL_PEAK or KERNEL_ANTIALIAS.
void set_covariance(inout Projection p, vec3 minors) {
    const vec3 m0 = p.unit * p.m0, m1 = p.unit * p.m1;
    const float aa = dot(m0, m0), cc = dot(m1, m1);
    const float low_pass = p.unit * p.unit * p.low_pass;
    p.a = aa + low_pass;
    p.b = dot(m0, m1);
    p.c = cc + low_pass;
    p.minors = minors;
    p.det0 = dot(p.minors, p.minors);
    p.det = p.det0 + low_pass * (aa + cc) + low_pass * low_pass;
    p.ux = p.unit * sqrt(0.5 * p.c / p.det);
    p.k = p.b / p.c;
    p.vy = p.unit * sqrt(0.5 / p.c);

    p.factor = 1.0;
    if (KERNEL == KERNEL_ANTIALIAS) p.factor = sqrt(max(0.0, p.det0 / p.det));
}

// directions: of the splat's axes in camera axes. cofactors: their cross products, direction k of k + 1 and k + 2; those
// of a rotation are the directions themselves.
Projection project_shape(View view, Lens lens, mat3 directions, mat3 cofactors, vec3 scale, float low_pass_px) {
    Projection p;
    p.view = view;
    p.low_pass = low_pass_px;
    p.scale = scale;
    const float z = p.view.z.x;
    [[unroll]] for (int k = 0; k < 3; ++k) p.axes[k] = directions[k] * scale[k];

    const vec2 tangent = vec2(p.view.x.x, p.view.y.x) / z;
    const vec2 low = lens.tan_min, high = lens.tan_max;
    p.tangent = clamp(tangent, low, high);
    p.tangent_clamped = bvec2(tangent.x < low.x || tangent.x > high.x, tangent.y < low.y || tangent.y > high.y);
    p.focal_over_z = lens.focal / z;
    p.m0 = p.focal_over_z.x * vec3(p.axes[0].x - p.tangent.x * p.axes[0].z, p.axes[1].x - p.tangent.x * p.axes[1].z,
                                   p.axes[2].x - p.tangent.x * p.axes[2].z);
    p.m1 = p.focal_over_z.y * vec3(p.axes[0].y - p.tangent.y * p.axes[0].z, p.axes[1].y - p.tangent.y * p.axes[1].z,
                                   p.axes[2].y - p.tangent.y * p.axes[2].z);

    set_unit(p);
    // det(M M^T) is the sum of the squared 2x2 minors of M (Cauchy-Binet). A minor is a product of two scales and of how
    // far the third axis points at the camera. No term cancels, however thin the splat and however wide the view.
    const vec3 x_scale = p.unit * p.focal_over_z.x * scale, y_scale = p.unit * p.focal_over_z.y * scale;
    set_covariance(p, (vec3(p.tangent, 1.0) * cofactors) * x_scale.yzx * y_scale.zxy);

    // A |J| / sqrt(det) with |J| = fx fy sqrt(1 + tx^2 + ty^2) / z^2, the determinant of the ray-space transform.
    if (KERNEL == KERNEL_DENSITY)
        p.factor = mean_shadow(scale, p.unit * p.focal_over_z) * sqrt((1.0 + dot(p.tangent, p.tangent)) / p.det);
    return p;
}
#endif
