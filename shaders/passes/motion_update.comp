#version 460
// SPDX-License-Identifier: Apache-2.0
// One Adam step of one training camera's motion, or of what is learned of its readout.
// One workgroup of one subgroup does all of it. It reads the partial sums of the gradient and adds them in a fixed
// order. Adam's step, in the coordinates of the camera's basis, updates the motion and its moments.
// A weak pull towards no motion keeps all cameras together from drifting with the splats. An update that is not finite is
// dropped and counted. A frame whose instances did not fit changes nothing: the host repeats it.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"
#include "lib/motion.glsl"
#include "lib/adam_step.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) readonly buffer Sums { float sums[]; };
layout(set = 0, binding = 1, scalar) buffer Motions { float motions[]; };
layout(set = 0, binding = 2, scalar) buffer Moments1 { float moments1[]; };
layout(set = 0, binding = 3, scalar) buffer Moments2 { float moments2[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Bases { float bases[]; };
layout(set = 0, binding = 5, scalar) buffer CountsBlock { Counts counts; };
layout(push_constant, scalar) uniform Push { MotionUpdatePush push; };

float sum_of_row(uint row) {
    float sum = 0.0;
    for (uint b = LANE; b < push.blocks; b += SUBGROUP) sum += sums[(push.first_row + row) * push.blocks + b];
    return subgroup_sum(sum);
}

void main() {
    if (counts.instances > push.instance_capacity) return;
    float gradient[MOTION_VALUES];
    [[unroll]] for (uint i = 0; i < MOTION_VALUES; ++i) gradient[i] = sum_of_row(i);
    if (LANE != 0u) return;
    const uint at = MOTION_FLOATS * push.motion, basis = MOTION_BASIS_FLOATS * push.motion;
    const vec3 turn = vec3(motions[at], motions[at + 1u], motions[at + 2u]);
    // The sums of a pose are relative to the moved camera.
    if (push.first_row == 0u) {
        const vec3 by_turn = turn_gradient(turn, vec3(gradient[0], gradient[1], gradient[2]));
        const vec3 by_shift = shift_gradient(turn, vec3(gradient[4], gradient[5], gradient[6]));
        [[unroll]] for (uint k = 0; k < 3; ++k) {
            gradient[k] = by_turn[k];
            gradient[4 + k] = by_shift[k];
        }
    }
    [[unroll]] for (uint i = 0; i < MOTION_VALUES; ++i)
        gradient[i] += (i < 4u ? push.pull : push.shift_pull) * motions[at + i];

    float m[MOTION_VALUES], v[MOTION_VALUES], moved[MOTION_VALUES];
    [[unroll]] for (uint i = 0; i < MOTION_VALUES; ++i) moved[i] = motions[at + i];
    bool finite = true;
    [[unroll]] for (uint j = 0; j < MOTION_VALUES; ++j) {
        float g = 0.0;
        [[unroll]] for (uint i = 0; i < MOTION_VALUES; ++i) g += bases[basis + MOTION_VALUES * i + j] * gradient[i];
        m[j] = mix(g, moments1[at + j], push.beta1);
        v[j] = mix(g * g, moments2[at + j], push.beta2);
        const float step = adam_moved(vec4(0.0), vec4(m[j]), vec4(v[j]), vec4(0.0), vec4(push.rate), vec2(push.bias1, 0.0),
                                      push.bias2, float(ADAM_EPSILON)).x;
        [[unroll]] for (uint i = 0; i < MOTION_VALUES; ++i) moved[i] += bases[basis + MOTION_VALUES * i + j] * step;
        finite = finite && is_finite(m[j]) && is_finite(v[j]);
    }
    [[unroll]] for (uint i = 0; i < MOTION_VALUES; ++i) finite = finite && is_finite(moved[i]);
    if (!finite) {
        atomicAdd(counts.dropped_updates, 1u);
        return;
    }
    [[unroll]] for (uint i = 0; i < MOTION_VALUES; ++i) {
        motions[at + i] = moved[i];
        moments1[at + i] = m[i];
        moments2[at + i] = v[i];
    }
}
