#version 460
// SPDX-License-Identifier: Apache-2.0
// Applies a training image's PPISP to the render, before the loss compares the two.
// One workgroup is one subgroup and owns PPISP_BLOCK pixels. It reads the render's planes and the values of the photo and
// its camera, and writes the planes as the photo shows them.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/image.glsl"
#include "lib/subgroup.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) readonly buffer Image { float image[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Values { float values[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Exposed { float exposed[]; };
layout(push_constant, scalar) uniform Push { PpispPush push; };
#include "lib/ppisp_values.glsl"

void main() {
    const uint block = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    const uint pixels = push.image.size[0] * push.image.size[1];
    const uint begin = block * PPISP_BLOCK, end = min(begin + PPISP_BLOCK, pixels);
    const Ppisp ppisp = pushed_ppisp();
    for (uint i = begin + LANE; i < end; i += SUBGROUP) {
        const uint at = pixel_offset(push.image, i);
        const uvec3 planes = uvec3(PLANE_R, PLANE_G, PLANE_B) * push.image.plane_floats + at;
        const vec3 color = vec3(image[planes.r], image[planes.g], image[planes.b]);
        const vec3 shown = ppisp_color(ppisp, color, ppisp_place(push.image, i));
        [[unroll]] for (uint c = 0; c < 3; ++c) exposed[planes[c]] = shown[c];
    }
}
