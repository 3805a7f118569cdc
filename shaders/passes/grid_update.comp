#version 460
// SPDX-License-Identifier: Apache-2.0
// One Adam step of one training image's bilateral grid.
// One invocation owns a texel. It reads the sums of all parts of the gradient and adds them in a fixed order. It updates the
// texel and its moments. A weak pull towards the identity keeps all grids together from drifting against the splats.
// An update that is not finite is dropped and counted. A frame whose instances did not fit changes nothing.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"

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
    const vec4 m = mix(gradient, moments1[at], float(ADAM_BETA1));
    const vec4 v = mix(gradient * gradient, moments2[at], float(ADAM_BETA2));
    const vec4 moved = value - push.rate * (m * push.bias1) / (sqrt(v * push.bias2) + float(ADAM_EPSILON));
    if (!(is_finite(moved) && is_finite(m) && is_finite(v))) {
        atomicAdd(counts.dropped_updates, 1u);
        return;
    }
    grids[at] = moved;
    moments1[at] = m;
    moments2[at] = v;
}
