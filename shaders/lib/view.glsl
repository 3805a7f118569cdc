// SPDX-License-Identifier: Apache-2.0
// A point in camera coordinates, and the pixel that it projects to.
#ifndef EWA_LIB_VIEW
#define EWA_LIB_VIEW
#include "lib/double_float.glsl"

struct View {
    vec3 offset;     // mean - camera position, world axes
    vec2 x, y, z;    // camera coordinates as float pairs
};

// What the linearisation reads of a camera.
struct Lens {
    mat3 rotation;              // world to camera
    vec2 focal;                 // px
    vec2 tan_min, tan_max;      // bounds of x/z and y/z
};

// focal * p / z + center, as a float pair (px).
vec2 pixel_of(vec2 p, vec2 z, vec2 focal, vec2 center) {
    return df_add(df_mul(df_div(p, z), focal), center);
}
#endif
