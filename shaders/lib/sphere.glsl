// SPDX-License-Identifier: Apache-2.0
// Projection of a splat that is drawn as a sphere (docs/numerics.md, "Points"). The including pass defines BINDING_CAMERA.
// The sphere has the geometric mean of the scales, and the radius of ELLIPSOID_REACH of them. On the image it covers an ellipse
// along the axes, with the low-pass: q = ((x - mean.x) / radius.x)^2 + ((y - mean.y) / radius.y)^2 < 1.
#ifndef EWA_LIB_SPHERE
#define EWA_LIB_SPHERE
#include "lib/camera.glsl"
#include "lib/quaternion.glsl"

struct SphereProjection {
    View view;
    vec2 focal_over_z;
    vec2 inverse_radius;      // 1/px
    vec2 share;               // d(ln radius in px) / d(ln scale): 1 without the low-pass
    bool in_range;            // mean and quaternion are within bounds
    bool footprint_in_range;  // holds for spheres in front of the camera only
};

SphereProjection project_sphere(vec3 mean, vec4 quaternion, vec3 log_scale) {
    SphereProjection p;
    p.view = view_point(mean);
    p.focal_over_z = camera_lens().focal / p.view.z.x;
    const float log_mean = (log_scale.x + log_scale.y + log_scale.z) * (1.0 / 3.0);
    const vec2 deviation = p.focal_over_z * exp(max(log_mean, float(LOG_SCALE_MIN)));
    // A NaN fails the comparisons.
    p.footprint_in_range = deviation.x + deviation.y <= float(FOOTPRINT_MAX);
    const vec2 squares = deviation * deviation, variance = squares + float(LOW_PASS);
    p.share = squares / variance;
    p.inverse_radius = 1.0 / (float(ELLIPSOID_REACH) * sqrt(variance));
    // A sphere has no rotation, but the same splats are skipped in every drawing.
    float norm;
    normalize_quaternion(quaternion, norm);
    const vec3 far = abs(p.view.offset);
    p.in_range = far.x <= float(VIEW_MAX) && far.y <= float(VIEW_MAX) && far.z <= float(VIEW_MAX) &&
                 norm >= float(QUATERNION_MIN);
    return p;
}
#endif
