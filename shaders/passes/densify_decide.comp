#version 460
// SPDX-License-Identifier: Apache-2.0
// Decides how many splats each splat becomes: 0, 1 or 2.
// One invocation owns splat i. It reads parameters and statistics, with push.frozen the moments, and writes outputs[i].
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/params.glsl"
#include "lib/densify.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
TEXELS(0, params);
layout(set = 0, binding = 1, scalar) readonly buffer Statistics { vec2 statistics[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Outputs { uint outputs[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Moments { uvec4 moments[]; };
layout(push_constant, scalar) uniform Push { DensifyPush push; };

void main() {
    const uint i = item_index();
    if (i >= push.splats) return;
    vec4 p[3];
    [[unroll]] for (uint plane = 0; plane < 3; ++plane)
        p[plane] = fetch(params, param_texel(push.planes, plane, i));
    const bool frozen = push.frozen != 0u && is_frozen(moments[param_texel(push.planes, 0u, i)]);
    outputs[i] = outputs_of(action_of(push, p[0], p[1], p[2], statistics[i], frozen));
}
