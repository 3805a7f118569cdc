#version 460
// SPDX-License-Identifier: Apache-2.0
// One Adam step of one training image's exposure.
// One workgroup of one subgroup does all of it. It reads the partial sums of the gradient and adds them in a fixed
// order. It updates the exposure and its moments.
// A weak pull towards the identity keeps all exposures together from drifting against the splats. An update that is not
// finite is dropped and counted. A frame whose instances did not fit changes nothing: the host repeats it.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"
#include "lib/exposure.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) readonly buffer Sums { vec4 sums[]; };
layout(set = 0, binding = 1, scalar) buffer Exposures { vec4 exposures[]; };
layout(set = 0, binding = 2, scalar) buffer Moments1 { vec4 moments1[]; };
layout(set = 0, binding = 3, scalar) buffer Moments2 { vec4 moments2[]; };
layout(set = 0, binding = 4, scalar) buffer CountsBlock { Counts counts; };
layout(push_constant, scalar) uniform Push { ExposureUpdatePush push; };

void main() {
    if (counts.instances > push.instance_capacity) return;
    [[unroll]] for (uint row = 0; row < 3; ++row) {
        vec4 sum = vec4(0.0);
        for (uint b = LANE; b < push.blocks; b += SUBGROUP) sum += sums[EXPOSURE_TEXELS * b + row];
        sum = vec4(subgroup_sum(sum.x), subgroup_sum(sum.y), subgroup_sum(sum.z), subgroup_sum(sum.w));
        const uint at = EXPOSURE_TEXELS * push.photo + row;
        const vec4 value = exposures[at];
        const vec4 identity = vec4(row == 0u, row == 1u, row == 2u, 0.0);
        const vec4 gradient = sum + push.pull * (value - identity);
        const vec4 m = mix(gradient, moments1[at], float(ADAM_BETA1));
        const vec4 v = mix(gradient * gradient, moments2[at], float(ADAM_BETA2));
        const vec4 moved = value - push.rate * (m * push.bias1) / (sqrt(v * push.bias2) + float(ADAM_EPSILON));
        const bool finite = is_finite(moved) && is_finite(m) && is_finite(v);
        // No lane leaves the loop: the next row's sum needs all of them.
        if (LANE == 0u && finite) {
            exposures[at] = moved;
            moments1[at] = m;
            moments2[at] = v;
        }
        if (LANE == 0u && !finite) atomicAdd(counts.dropped_updates, 1u);
    }
}
