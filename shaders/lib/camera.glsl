// SPDX-License-Identifier: Apache-2.0
// The camera's uniform block, and points in camera coordinates. The including pass defines BINDING_CAMERA, or
// BINDING_CAMERAS: then camera_index says which camera of a buffer the functions use.
#ifndef EWA_LIB_CAMERA
#define EWA_LIB_CAMERA
#include "lib/view.glsl"

#ifdef BINDING_CAMERAS
layout(set = 0, binding = BINDING_CAMERAS, scalar) readonly buffer Cameras { CameraBlock cameras[]; };
uint camera_index = 0u;
#define camera cameras[camera_index]
#else
layout(set = 0, binding = BINDING_CAMERA, scalar) uniform CameraUniform { CameraBlock camera; };
#endif

// The world-to-camera rotation as a matrix that multiplies column vectors.
mat3 camera_rotation() {
    return mat3(camera.rotation_hi[0], camera.rotation_hi[3], camera.rotation_hi[6], camera.rotation_hi[1],
                camera.rotation_hi[4], camera.rotation_hi[7], camera.rotation_hi[2], camera.rotation_hi[5],
                camera.rotation_hi[8]);
}

Lens camera_lens() {
    return Lens(camera_rotation(), vec2(camera.focal_hi[0], camera.focal_hi[1]),
                vec2(camera.tan_min[0], camera.tan_min[1]), vec2(camera.tan_max[0], camera.tan_max[1]));
}

// Subtracts the camera's position first, in two floats: a scene far from the origin then loses no precision to float32.
View view_point(vec3 mean) {
    vec2 d[3];
    [[unroll]] for (int j = 0; j < 3; ++j) {
        d[j] = df_add(two_sum(mean[j], -camera.position_hi[j]), vec2(-camera.position_lo[j], 0.0));
    }
    vec2 p[3];
    [[unroll]] for (int i = 0; i < 3; ++i) {
        p[i] = vec2(0.0);
        [[unroll]] for (int j = 0; j < 3; ++j) {
            p[i] = df_add(p[i], df_mul(vec2(camera.rotation_hi[3 * i + j], camera.rotation_lo[3 * i + j]), d[j]));
        }
    }
    return View(vec3(d[0].x, d[1].x, d[2].x), p[0], p[1], p[2]);
}

// Pixel position along axis 0 (x) or 1 (y) of a point in the plane, in units of the focal length, as float pairs.
vec2 pixel_in_plane(vec2 q, int axis) {
    const vec2 focal = vec2(camera.focal_hi[axis], camera.focal_lo[axis]);
    const vec2 center = vec2(camera.center_hi[axis], camera.center_lo[axis]);
    return df_add(df_mul(q, focal), center);
}

// The same of a pinhole: focal * p / z + centre.
vec2 pixel_position(vec2 p, vec2 z, int axis) { return pixel_in_plane(df_div(p, z), axis); }
#endif
