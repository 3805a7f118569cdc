// SPDX-License-Identifier: Apache-2.0
// A step of Adam of one value, as the passes take it whose values are few.
#ifndef EWA_LIB_ADAM_STEP
#define EWA_LIB_ADAM_STEP
// state: value and both moments. bias: 1 / (1 - beta^step) of each moment. A step that is not finite changes nothing.
// Returns whether it was taken.
bool adam_step(inout vec3 state, float gradient, float rate, vec2 bias) {
    const float m = mix(gradient, state.y, float(ADAM_BETA1));
    const float v = mix(gradient * gradient, state.z, float(ADAM_BETA2));
    const float moved = state.x - rate * (m * bias.x) / (sqrt(v * bias.y) + float(ADAM_EPSILON));
    const vec3 next = vec3(moved, m, v);
    if (!is_finite(next)) return false;
    state = next;
    return true;
}
#endif
