#version 460
// SPDX-License-Identifier: Apache-2.0
// One Adam step of one camera's vignette and response, at the end of a step of training.
// One workgroup of one subgroup does all of it. It reads the views' gradients of the step, and uses the mean of those of its
// camera. It updates the camera's values, moments and number of steps, and the means of the photos' values.
// An update that is not finite is dropped and counted. A frame whose instances did not fit changes nothing.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/subgroup.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(set = 0, binding = 0, scalar) readonly buffer Slots { float slots[]; };
layout(set = 0, binding = 1, scalar) buffer Values { float values[]; };
layout(set = 0, binding = 2, scalar) buffer Moments1 { float moments1[]; };
layout(set = 0, binding = 3, scalar) buffer Moments2 { float moments2[]; };
layout(set = 0, binding = 4, scalar) buffer CountsBlock { Counts counts; };
layout(push_constant, scalar) uniform Push { PpispCameraPush push; };
#include "lib/table_step.glsl"

// Gradient of the penalties by value k of the camera.
float penalty_gradient(uint k) {
    const uint kind = k % PPISP_CHANNEL_FLOATS;
    const float value = values[push.camera + k];
    const float mean = (values[push.camera + kind] + values[push.camera + PPISP_CHANNEL_FLOATS + kind] +
                        values[push.camera + 2u * PPISP_CHANNEL_FLOATS + kind]) / 3.0;
    // The penalty is the mean over kinds of the variance over channels: 5 kinds of the vignette, 4 of the response.
    float sum = float(PPISP_CHANNEL_WEIGHT) * 2.0 / 3.0 * (value - mean) / (kind < 5u ? 5.0 : 4.0);
    if (kind < 2u) sum += float(PPISP_CENTER_WEIGHT) * 2.0 / 3.0 * value;
    if (kind >= 2u && kind < 5u && value > 0.0) sum += float(PPISP_RISE_WEIGHT) / 9.0;
    return sum;
}

void main() {
    if (counts.instances > push.instance_capacity) return;
    [[unroll]] for (uint k = 0u; k < PPISP_PHOTO_VALUES; ++k) {
        float sum = 0.0;
        for (uint p = LANE; p < push.photos; p += SUBGROUP) sum += values[PPISP_PHOTO_FLOATS * p + k];
        const float total = subgroup_sum(sum);
        if (LANE == 0u) values[push.means + k] = total / float(push.photos);
    }
    if (LANE != 0u) return;
    float gradient[PPISP_CAMERA_VALUES];
    [[unroll]] for (uint k = 0u; k < PPISP_CAMERA_VALUES; ++k) gradient[k] = 0.0;
    float own = 0.0;
    for (uint view = 0u; view < push.views; ++view) {
        const uint slot = PPISP_CAMERA_FLOATS * view;
        if (slots[slot + PPISP_CAMERA_VALUES] != float(push.camera)) continue;
        own += 1.0;
        [[unroll]] for (uint k = 0u; k < PPISP_CAMERA_VALUES; ++k) gradient[k] += slots[slot + k];
    }
    [[unroll]] for (uint k = 0u; k < PPISP_CAMERA_VALUES; ++k) gradient[k] = gradient[k] / own + penalty_gradient(k);
    const float number = values[push.camera + PPISP_CAMERA_VALUES] + 1.0;
    const vec2 bias = 1.0 / (1.0 - pow(vec2(ADAM_BETA1, ADAM_BETA2), vec2(number)));
    values[push.camera + PPISP_CAMERA_VALUES] = number;
    [[unroll]] for (uint k = 0u; k < PPISP_CAMERA_VALUES; ++k)
        table_step(push.camera + k, gradient[k], push.rate, bias);
}
