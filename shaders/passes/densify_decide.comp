#version 460
// SPDX-License-Identifier: Apache-2.0
// Decides how many splats each splat becomes: 0, 1 or 2.
// One invocation owns splat i. It reads parameters and statistics, and writes outputs[i].
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/params.glsl"
#include "lib/densify.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
TEXELS(0, params);
layout(set = 0, binding = 1, scalar) readonly buffer Statistics { vec2 statistics[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Outputs { uint outputs[]; };
layout(push_constant, scalar) uniform Push { DensifyPush push; };

void main() {
    const uint i = item_index();
    if (i >= push.splats) return;
    vec4 p[3];
    [[unroll]] for (uint plane = 0; plane < 3; ++plane)
        p[plane] = fetch(params, param_texel(push.planes, plane, i));
    outputs[i] = outputs_of(action_of(push, p[0], p[1], p[2], statistics[i]));
}
