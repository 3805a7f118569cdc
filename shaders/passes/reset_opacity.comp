#version 460
// SPDX-License-Identifier: Apache-2.0
// Lowers every opacity to at most a given one and zeroes its moments (3DGS, section 5.2).
// One invocation owns splat i. It updates the opacity in the parameters and in both moments. A zero word is a zero moment
// in every format. A frozen splat keeps its opacity.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/params.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) buffer Params { vec4 params[]; };
layout(set = 0, binding = 1, scalar) buffer Moments1 { uvec4 moments1[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Moments2 { uvec4 moments2[]; };
layout(push_constant, scalar) uniform Push { ResetPush push; };

void main() {
    const uint i = item_index();
    if (i >= push.splats) return;
    const uint at = param_texel(push.planes, PARAM_OPACITY / 4u, i);
    if (is_frozen(moments1[at])) return;
    params[at][PARAM_OPACITY % 4u] = min(params[at][PARAM_OPACITY % 4u], push.logit);
    moments1[at][PARAM_OPACITY % 4u] = 0u;
    moments2[at][PARAM_OPACITY % 4u] = 0u;
}
