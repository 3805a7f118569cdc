// SPDX-License-Identifier: Apache-2.0
// Projection of a splat as the model stores it: with a logit for the opacity, and logarithms of the scales. The including
// pass defines BINDING_CAMERA.
#ifndef EWA_LIB_STORED_SPLAT
#define EWA_LIB_STORED_SPLAT
#include "lib/camera.glsl"
#include "lib/projection.glsl"
#include "lib/lens.glsl"
#include "lib/readout.glsl"
#include "lib/quaternion.glsl"

struct StoredSplat {
    vec3 mean;
    float logit;
    vec4 quaternion;
    vec3 log_scale;
};

struct StoredProjection {
    Projection footprint;
    vec4 unit_quaternion;
    float quaternion_norm;
    bool in_range;          // quaternion and mean are within bounds
    float peak;             // opacity, or with KERNEL_DENSITY optical depth, before the kernel's factor
};

float sigmoid(float x) { return 1.0 / (1.0 + exp(-x)); }

// A scale below exp(LOG_SCALE_MIN) looks the same as exp(LOG_SCALE_MIN), and ratios of such scales stay finite.
vec3 computable_log_scale(vec3 log_scale) { return max(log_scale, vec3(float(LOG_SCALE_MIN))); }

// exp(x) - exp(-x), accurate near zero too (a splat that is nearly round).
vec3 twice_sinh(vec3 x) {
    const vec3 q = x * x, e = exp(clamp(x, -80.0, 80.0));
    const vec3 series = 2.0 * x * (1.0 + q / 6.0 * (1.0 + q / 20.0 * (1.0 + q / 42.0)));
    return mix(e - 1.0 / e, series, lessThan(abs(x), vec3(0.5)));
}

// s_i / s_j - s_j / s_i of axes yz, zx and xy.
vec3 scale_ratios(vec3 log_scale) {
    const vec3 l = computable_log_scale(log_scale);
    return twice_sinh(l.yzx - l.zxy);
}

// The largest logarithm of a scale that a step leaves. Within the angles of a fisheye or 360 degrees, every splat has an image. A
// pinhole at the same place has none of a splat that reaches behind it.
float widest_log_scale(Projection p) {
    const bool wide = LENSES != 0u && (camera.lens == LENS_FISHEYE || camera.lens == LENS_EQUIRECTANGULAR);
    return wide ? log(float(WIDEST_SHARE) * p.image.depth) : 3.4e38;
}

// By which splats are ordered, in world units; they are in front of the camera where it is above NEAR_PLANE.
float depth_of_splat(Projection p) { return LENSES != 0u ? p.image.depth : p.view.z.x; }

// The camera's rotation when it sees the splat.
mat3 seen_rotation(Projection p) {
    return ROLLING ? readout_rotation(p.readout.time) * camera_rotation() : camera_rotation();
}

// The direction in which the camera sees the splat.
vec3 seen_along(Projection p) {
    if (LENSES != 0u && camera.lens == LENS_ORTHOGRAPHIC)
        return vec3(camera.rotation_hi[6], camera.rotation_hi[7], camera.rotation_hi[8]);
    return normalize(p.view.offset);
}

// A gradient by that direction, as one by the mean. Parallel rays have one direction.
vec3 along_gradient(Projection p, vec3 direction, vec3 gradient) {
    if (LENSES != 0u && camera.lens == LENS_ORTHOGRAPHIC) return vec3(0.0);
    return (gradient - direction * dot(direction, gradient)) / length(p.view.offset);
}

StoredProjection project_splat(StoredSplat splat) {
    StoredProjection p;
    const View view = view_point(splat.mean);
    p.unit_quaternion = normalize_quaternion(splat.quaternion, p.quaternion_norm);
    const Lens lens = camera_lens();
    const mat3 directions = lens.rotation * rotation_of(p.unit_quaternion);
    const vec3 scale = exp(computable_log_scale(splat.log_scale));
    if (ROLLING) {
        LensImage image;
        View seen = view;
        const Readout readout = read_out(seen, image);
        const mat3 turned = readout_rotation(readout.time) * directions;
        p.footprint = project_through_lens(seen, image, turned, turned, scale, kernel_low_pass());
        p.footprint.readout = readout;
    } else if (LENSES != 0u)
        p.footprint = project_through_lens(view, lens_image(view), directions, directions, scale, kernel_low_pass());
    else
        p.footprint = project_shape(view, lens, directions, directions, scale, kernel_low_pass());
    const vec3 far = abs(view.offset);
    // A NaN fails these comparisons.
    p.in_range = far.x <= float(VIEW_MAX) && far.y <= float(VIEW_MAX) && far.z <= float(VIEW_MAX) &&
                 p.quaternion_norm >= float(QUATERNION_MIN);
    p.peak = KERNEL == KERNEL_DENSITY ? softplus(splat.logit) : sigmoid(splat.logit);
    return p;
}
#endif
