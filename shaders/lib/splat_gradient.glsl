// SPDX-License-Identifier: Apache-2.0
// One view's gradient by a splat's mean, logit, quaternion and scales. Needs stored_splat.glsl and footprint_gradient.glsl.
#ifndef EWA_LIB_SPLAT_GRADIENT
#define EWA_LIB_SPLAT_GRADIENT
#include "lib/lens_gradient.glsl"
#include "lib/readout_gradient.glsl"

struct SplatGradient {
    vec3 mean;
    float logit;
    vec4 quaternion;
    vec3 log_scale;
    vec3 view;     // dL/d(mean in camera coordinates), without the part that passes through the colour
    vec3 torque;   // dL/d(rotation about the splat's own axes, radians)
    vec3 motion;   // dL/d(motion during the readout, of the point in camera coordinates)
};

// 1 - opacity has no digits left where the opacity is close to 1.
float transparency_of(float logit) { return sigmoid(-logit); }

// With KERNEL_DENSITY an optical depth above DEPTH_MAX is cut off, and has no gradient.
void cut_off_gradient(StoredProjection stored, inout Sums s) {
    if (KERNEL == KERNEL_DENSITY && stored.peak * stored.footprint.factor > float(DEPTH_MAX)) s.g = 0.0;
}

// g: Sums.g. direction: of the splat from the camera, of unit length. direction_gradient: the colour's, by the direction.
SplatGradient splat_gradient(FootprintGradient f, StoredProjection stored, StoredSplat splat, float g, vec3 direction,
                             vec3 direction_gradient) {
    const Projection p = stored.footprint;
    SplatGradient result;
    const vec3 by_offset = along_gradient(p, direction, direction_gradient);
    result.motion = vec3(0.0);
    result.view = ROLLING        ? readout_point_gradient(f, p, g, by_offset, result.motion)
                  : LENSES != 0u ? lens_point_gradient(f, p, g)
                                 : view_point_gradient(f, p);
    const mat3 to_world = transpose(seen_rotation(p));
    result.torque = f.beside * scale_ratios(splat.log_scale);
    result.quaternion = torque_on_quaternion(stored.unit_quaternion, result.torque) / stored.quaternion_norm;
    result.mean = to_world * result.view + by_offset;
    result.logit = g * (KERNEL == KERNEL_DENSITY ? log_softplus_slope(splat.logit) : transparency_of(splat.logit));
    result.log_scale = f.log_scale;
    return result;
}

// by_depth: dL/d(depth of the mean), of the depth plane.
void add_depth_gradient(inout SplatGradient g, float by_depth) {
    const vec3 by_view = vec3(0.0, 0.0, by_depth);
    g.view += by_view;
    g.mean += transpose(camera_rotation()) * by_view;
}
#endif
