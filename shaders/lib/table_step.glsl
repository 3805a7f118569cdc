// SPDX-License-Identifier: Apache-2.0
// Adam's step of one value of a learned table. The pass declares the float buffers values, moments1 and moments2, and counts.
#ifndef EWA_LIB_TABLE_STEP
#define EWA_LIB_TABLE_STEP
#include "lib/adam_step.glsl"

// A step that is not finite is dropped and counted.
void table_step(uint at, float gradient, float rate, vec2 bias) {
    AdamState state = AdamState(vec4(values[at]), vec4(moments1[at]), vec4(moments2[at]));
    if (adam_step(state, vec4(gradient), rate, bias)) {
        values[at] = state.value.x;
        moments1[at] = state.m.x;
        moments2[at] = state.v.x;
    } else {
        atomicAdd(counts.dropped_updates, 1u);
    }
}
#endif
