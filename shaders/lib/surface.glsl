// SPDX-License-Identifier: Apache-2.0
// The surface that a splat stands for: where its density along each ray is highest. To first order that is a plane through
// the mean whose normal is Sigma^-1 times the direction of sight.
#ifndef EWA_LIB_SURFACE
#define EWA_LIB_SURFACE
#include "lib/stored_splat.glsl"

// The direction of sight at the mean, in camera axes, of any length.
vec3 sight_of(Projection p) {
    return LENSES != 0u && camera.lens == LENS_ORTHOGRAPHIC ? vec3(0.0, 0.0, 1.0) : point_of(p.view);
}

// The unit normal in world axes, towards the eye.
vec3 normal_of(Projection p) {
    const vec3 sight = normalize(sight_of(p));
    // Sigma^-1 times the square of the least scale: no factor is above 1.
    const vec3 ratio = min(p.scale.x, min(p.scale.y, p.scale.z)) / p.scale;
    vec3 n = vec3(0.0);
    [[unroll]] for (int k = 0; k < 3; ++k) {
        const vec3 axis = p.axes[k] / p.scale[k];
        n += axis * (dot(axis, sight) * ratio[k] * ratio[k]);
    }
    // A needle or disc that is seen exactly edge-on has no other normal than the direction of sight.
    const float size = max(abs(n.x), max(abs(n.y), abs(n.z)));
    n = size > 1e-30 ? normalize(n / size) : sight;
    return -(transpose(camera_rotation()) * n);
}

// How the depth of that plane changes by u and v of the record: the mean of the depth where the position in the image is
// given. The low-pass counts as an error of that position, so the depth stays within the splat.
vec2 depth_slopes(Projection p) {
    vec3 along = vec3(0.0, 0.0, 1.0);
    if (LENSES != 0u && (camera.lens == LENS_FISHEYE || camera.lens == LENS_EQUIRECTANGULAR))
        along = normalize(point_of(p.view));
    const vec3 depths = along * p.axes;
    const float x = dot(p.m0, depths), y = dot(p.m1, depths);
    return 2.0 * vec2(p.ux * (x - p.k * y), p.vy * y);
}
#endif
