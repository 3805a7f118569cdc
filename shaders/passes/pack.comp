#version 460
// SPDX-License-Identifier: Apache-2.0
// Packs the colour planes into 8-bit RGBA, one word a pixel in rows of `stride`, rounded and clamped as
// save_image does. One invocation owns one texel of each plane, which is 4 pixels of a row. It reads the planes
// and writes the packed words.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
TEXELS(0, planes);
layout(set = 0, binding = 1, scalar) writeonly buffer Packed { uint packed[]; };
layout(push_constant, scalar) uniform Push { PackPush push; };

// NaN becomes 0.
uvec4 to_byte(vec4 v) {
    precise const vec4 scaled = mix(vec4(0.0), min(v, vec4(1.0)), greaterThan(v, vec4(0.0))) * 255.0;
    return uvec4(scaled + 0.5);
}

void main() {
    const uint i = item_index(), texels = push.plane_floats / 4u;
    if (i >= texels) return;
    const uvec4 r = to_byte(fetch(planes, PLANE_R * texels + i));
    const uvec4 g = to_byte(fetch(planes, PLANE_G * texels + i));
    const uvec4 b = to_byte(fetch(planes, PLANE_B * texels + i));
    const uvec4 words = r | (g << 8) | (b << 16) | uvec4(0xff000000u);
    for (uint p = 0; p < 4; ++p) packed[4 * i + p] = words[p];
}
