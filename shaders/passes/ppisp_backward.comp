#version 460
// SPDX-License-Identifier: Apache-2.0
// Gradient of ppisp. One workgroup is one subgroup and owns PPISP_BLOCK pixels. It reads the render and the values of the
// photo and its camera, updates dL/d(image) in place, and writes its block's partial sums: PPISP_SUM_FLOATS.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/image.glsl"
#include "lib/subgroup.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) readonly buffer Image { float image[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Values { float values[]; };
layout(set = 0, binding = 2, scalar) buffer ImageGradient { float image_gradient[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Sums { float sums[]; };
layout(push_constant, scalar) uniform Push { PpispPush push; };
#include "lib/ppisp_values.glsl"

void write_sum(uint at, float value) {
    const float total = subgroup_sum(value);
    if (LANE == 0u) sums[at] = total;
}

void main() {
    const uint block = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    const uint pixels = push.image.size[0] * push.image.size[1];
    const uint begin = block * PPISP_BLOCK, end = min(begin + PPISP_BLOCK, pixels);
    if (begin >= pixels) return;
    const Ppisp ppisp = pushed_ppisp();
    PpispSums own;
    own.exposure = 0.0;
    own.colors = mat3(0.0);
    [[unroll]] for (uint c = 0u; c < 3u; ++c) {
        own.center[c] = vec2(0.0);
        own.falloff[c] = vec3(0.0);
        own.response[c] = vec4(0.0);
    }
    for (uint i = begin + LANE; i < end; i += SUBGROUP) {
        const uint at = pixel_offset(push.image, i);
        const uvec3 planes = uvec3(PLANE_R, PLANE_G, PLANE_B) * push.image.plane_floats + at;
        const vec3 color = vec3(image[planes.r], image[planes.g], image[planes.b]);
        const vec3 gradient = vec3(image_gradient[planes.r], image_gradient[planes.g], image_gradient[planes.b]);
        const vec3 back = ppisp_backward(ppisp, color, ppisp_place(push.image, i), gradient, own);
        [[unroll]] for (uint c = 0; c < 3; ++c) image_gradient[planes[c]] = back[c];
    }
    const uint first = PPISP_SUM_FLOATS * block;
    write_sum(first, own.exposure);
    [[unroll]] for (uint k = 0u; k < 9u; ++k) write_sum(first + 1u + k, own.colors[k / 3u][k % 3u]);
    [[unroll]] for (uint c = 0u; c < 3u; ++c) {
        const uint at = first + 10u + PPISP_CHANNEL_FLOATS * c;
        [[unroll]] for (uint k = 0u; k < 2u; ++k) write_sum(at + k, own.center[c][k]);
        [[unroll]] for (uint k = 0u; k < 3u; ++k) write_sum(at + 2u + k, own.falloff[c][k]);
        [[unroll]] for (uint k = 0u; k < 4u; ++k) write_sum(at + 5u + k, own.response[c][k]);
    }
}
