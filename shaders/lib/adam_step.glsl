// SPDX-License-Identifier: Apache-2.0
// Adam's step: of splats, and of all that training learns beside them.
#ifndef EWA_LIB_ADAM_STEP
#define EWA_LIB_ADAM_STEP
// Where a step goes with these moments (Kingma and Ba 2015, algorithm 1). shares: what the step takes of the first moment and of
// the gradient, corrected for their bias. A share of the gradient gives Nesterov's momentum (Dozat 2016, algorithm 2).
vec4 adam_moved(vec4 value, vec4 m, vec4 v, vec4 gradient, vec4 rate, vec2 shares, float bias2, float epsilon) {
    return value - rate * (m * shares.x + gradient * shares.y) / (sqrt(v * bias2) + epsilon);
}

struct AdamState {
    vec4 value, m, v;
};

// bias: 1 / (1 - beta^step) of each moment. A step that is not finite changes nothing. Returns whether it was taken.
bool adam_step(inout AdamState state, vec4 gradient, float rate, vec2 bias) {
    const vec4 m = mix(gradient, state.m, float(ADAM_BETA1));
    const vec4 v = mix(gradient * gradient, state.v, float(ADAM_BETA2));
    const vec4 moved = adam_moved(state.value, m, v, vec4(0.0), vec4(rate), vec2(bias.x, 0.0), bias.y, float(ADAM_EPSILON));
    if (!(is_finite(moved) && is_finite(m) && is_finite(v))) return false;
    state = AdamState(moved, m, v);
    return true;
}
#endif
