#version 460
// SPDX-License-Identifier: Apache-2.0
// One Adam step of one training image's bilateral grid.
// One invocation owns a texel. It reads the sums of all parts of the gradient and adds them in a fixed order. It updates the
// texel and its moments. A weak pull towards the identity keeps all grids together from drifting against the splats.
// An update that is not finite is dropped and counted. A frame whose instances did not fit changes nothing.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/adam_step.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) readonly buffer Sums { vec4 sums[]; };
layout(set = 0, binding = 1, scalar) buffer Grids { vec4 grids[]; };
layout(set = 0, binding = 2, scalar) buffer Moments1 { vec4 moments1[]; };
layout(set = 0, binding = 3, scalar) buffer Moments2 { vec4 moments2[]; };
layout(set = 0, binding = 4, scalar) buffer CountsBlock { Counts counts; };
layout(push_constant, scalar) uniform Push { GridUpdatePush push; };

void main() {
    const uint texel = item_index();
    if (texel >= push.texels || counts.instances > push.instance_capacity) return;
    vec4 sum = vec4(0.0);
    for (uint part = 0u; part < push.parts; ++part) sum += sums[push.texels * part + texel];
    const uint at = push.texels * push.photo + texel, row = texel % 3u;
    const vec4 value = grids[at];
    const vec4 identity = vec4(row == 0u, row == 1u, row == 2u, 0.0);
    const vec4 gradient = sum + push.pull * (value - identity);
    AdamState state = AdamState(value, moments1[at], moments2[at]);
    if (!adam_step(state, gradient, push.rate, vec2(push.bias1, push.bias2))) {
        atomicAdd(counts.dropped_updates, 1u);
        return;
    }
    grids[at] = state.value;
    moments1[at] = state.m;
    moments2[at] = state.v;
}
