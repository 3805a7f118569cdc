#version 460
// SPDX-License-Identifier: Apache-2.0
// Writes each splat's weight as a source, and whether the splat is dead: too transparent to be seen, or not finite.
// One invocation owns splat i. It reads the parameters, with push.frozen the moments, and writes weights[i] and dead[i].
// Weights are opacities scaled to integers, so that their sum does not depend on its order. A splat outside of the
// region has the weight 0. A frozen splat has the weight 0 and is not dead.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/params.glsl"
#include "lib/region.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
TEXELS(0, params);
layout(set = 0, binding = 1, scalar) writeonly buffer Weights { uint weights[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Dead { uint dead[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Moments { uvec4 moments[]; };
layout(push_constant, scalar) uniform Push { McmcPush push; };

void main() {
    const uint i = item_index();
    if (i >= push.splats) return;
    const vec4 p0 = fetch(params, param_texel(push.planes, 0u, i)), p1 = fetch(params, param_texel(push.planes, 1u, i)),
               p2 = fetch(params, param_texel(push.planes, 2u, i));
    const bool alive = is_finite(p0) && is_finite(p1) && is_finite(p2) && p0.w > push.dead_logit;
    const bool frozen = push.frozen != 0u && is_frozen(moments[param_texel(push.planes, 0u, i)]);
    weights[i] = alive && !frozen && in_region(push.region, p0.xyz) ? uint(push.weight_scale / (1.0 + exp(-p0.w))) : 0u;
    dead[i] = alive || frozen ? 0u : 1u;
}
