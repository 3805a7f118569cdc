#version 460
// SPDX-License-Identifier: Apache-2.0
// Unpacks a training image's RGBA texels into planes, over the background where it is transparent.
// One invocation owns one pixel. It reads the pixel's texel and writes the target planes.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/image.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
COLOR_TEXELS(0, photo);
layout(set = 0, binding = 1, scalar) writeonly buffer Planes { float planes[]; };
layout(push_constant, scalar) uniform Push { UnpackPush push; };

void main() {
    const uint i = item_index();
    if (i >= push.image.size[0] * push.image.size[1]) return;
    const vec4 texel = fetch_color(photo, push.first_pixel + i);
    const vec3 background = vec3(push.background[0], push.background[1], push.background[2]);
    const vec3 color = texel.rgb * texel.a + background * (1.0 - texel.a);
    const uint at = pixel_offset(push.image, i);
    planes[PLANE_R * push.image.plane_floats + at] = color.r;
    planes[PLANE_G * push.image.plane_floats + at] = color.g;
    planes[PLANE_B * push.image.plane_floats + at] = color.b;
}
