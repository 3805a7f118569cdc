#version 460
// SPDX-License-Identifier: Apache-2.0
// Unpacks a training image's RGBA texels into planes, over the background where it is transparent.
// One invocation owns a texel of the planes, 4 pixels of a row. It reads their texels and writes the target planes. What lies right
// of the image within its stride is zero.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
COLOR_TEXELS(0, photo);
STORED_TEXELS(1, planes);
layout(push_constant, scalar) uniform Push { UnpackPush push; };

void main() {
    const uint item = item_index(), row_texels = push.image.stride / 4u;
    if (item >= row_texels * push.image.size[1]) return;
    const uint x = item % row_texels * 4u, at = push.first_pixel + item / row_texels * push.image.size[0] + x;
    const vec3 background = vec3(push.background[0], push.background[1], push.background[2]);
    vec4 red = vec4(0.0), green = vec4(0.0), blue = vec4(0.0);
    [[unroll]] for (uint c = 0; c < 4; ++c) {
        const bool inside = x + c < push.image.size[0];
        const vec4 texel = fetch_color(photo, inside ? at + c : at);
        const vec3 color = texel.rgb * texel.a + background * (1.0 - texel.a);
        red[c] = inside ? color.r : 0.0;
        green[c] = inside ? color.g : 0.0;
        blue[c] = inside ? color.b : 0.0;
    }
    const uint plane = push.image.plane_floats / 4u;
    planes[PLANE_R * plane + item] = as_texel(red);
    planes[PLANE_G * plane + item] = as_texel(green);
    planes[PLANE_B * plane + item] = as_texel(blue);
}
