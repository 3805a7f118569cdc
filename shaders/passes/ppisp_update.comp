#version 460
// SPDX-License-Identifier: Apache-2.0
// One Adam step of the exposure and colours of one training image.
// One workgroup of one subgroup does all of it. It reads the partial sums of the gradient and adds them in a fixed order. It
// updates the photo's values and moments, and writes the gradient of its camera's values to the view's slot of the step.
// Penalties keep the means over all photos near 0: all exposures could change one way, and the splats the other way.
// An update that is not finite is dropped and counted. A frame whose instances did not fit changes nothing.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) readonly buffer Sums { float sums[]; };
layout(set = 0, binding = 1, scalar) buffer Values { float values[]; };
layout(set = 0, binding = 2, scalar) buffer Moments1 { float moments1[]; };
layout(set = 0, binding = 3, scalar) buffer Moments2 { float moments2[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Slots { float slots[]; };
layout(set = 0, binding = 5, scalar) buffer CountsBlock { Counts counts; };
layout(push_constant, scalar) uniform Push { PpispUpdatePush push; };
#include "lib/ppisp_values.glsl"
#include "lib/table_step.glsl"

// Derivative of smooth L1.
float smooth_sign(float x, float beta) { return clamp(x / beta, -1.0, 1.0); }

void step_of(uint k, float gradient) {
    table_step(push.photo + k, gradient, push.rate, vec2(push.bias1, push.bias2));
}

void main() {
    if (counts.instances > push.instance_capacity) return;
    float gradient[PPISP_SUM_FLOATS];
    [[unroll]] for (uint k = 0u; k < PPISP_SUM_FLOATS; ++k) {
        float sum = 0.0;
        for (uint b = LANE; b < push.blocks; b += SUBGROUP) sum += sums[PPISP_SUM_FLOATS * b + k];
        gradient[k] = subgroup_sum(sum);
    }
    if (LANE != 0u) return;
    // The gradient of the camera's values, through the maps of the response to its ranges.
    const uint slot = PPISP_CAMERA_FLOATS * push.slot;
    [[unroll]] for (uint k = 0u; k < PPISP_CAMERA_VALUES; ++k) {
        const uint kind = k % PPISP_CHANNEL_FLOATS;
        const float share = sigmoid(values[push.camera + k]);
        const float slope = kind < 5u ? 1.0 : kind < 8u ? share : share * (1.0 - share);
        slots[slot + k] = slope * gradient[10u + k];
    }
    slots[slot + PPISP_CAMERA_VALUES] = float(push.camera);

    const Ppisp ppisp = pushed_ppisp();
    const mat3 by_colors = mat3(gradient[1], gradient[2], gradient[3], gradient[4], gradient[5], gradient[6], gradient[7],
                                gradient[8], gradient[9]);
    const vec2 by_target[4] = homography_backward(ppisp.targets, by_colors);
    step_of(0u, gradient[0] + smooth_sign(values[push.means], float(PPISP_EXPOSURE_BETA)));
    [[unroll]] for (uint t = 0u; t < 4u; ++t) {
        const mat2 matrix = offset_matrix(t);
        const vec2 mean = matrix * vec2(values[push.means + 1u + 2u * t], values[push.means + 2u + 2u * t]);
        const vec2 penalty =
            vec2(smooth_sign(mean.x, float(PPISP_COLOR_BETA)), smooth_sign(mean.y, float(PPISP_COLOR_BETA)));
        const vec2 by_latent = matrix * (by_target[t] + penalty);
        step_of(1u + 2u * t, by_latent.x);
        step_of(2u + 2u * t, by_latent.y);
    }
}
