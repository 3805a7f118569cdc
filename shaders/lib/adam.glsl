// SPDX-License-Identifier: Apache-2.0
// Adam's step of a splat's parameters, or their gradient alone. The including pass declares the buffers of update.comp, push
// (UpdatePush), SH_DEGREE, GRADIENT_ONLY and PACKED_MOMENTS.
#ifndef EWA_LIB_ADAM
#define EWA_LIB_ADAM
#include "lib/params.glsl"
#include "lib/step_limits.glsl"
#include "lib/moments.glsl"
#include "lib/sh.glsl"

const uint SH_FLOATS = 3 * (SH_DEGREE + 1) * (SH_DEGREE + 1);
const uint PLANES = (PARAM_SH + SH_FLOATS + 3) / 4;

uint index_of(uint plane, uint i) { return param_texel(push.planes, plane, i); }

// Adam's step of one texel of parameters (Kingma and Ba 2015, algorithm 1).
// random: rounds packed moments.
void move_rounded(uint plane, uint i, vec4 value, vec4 raw_gradient, vec4 rate, float depth, uvec4 random) {
    const uint at = index_of(plane, i);
    if (GRADIENT_ONLY) {
        // Infinities become the largest float32. NaN becomes zero and is counted.
        const bvec4 number = equal(raw_gradient, raw_gradient);
        moments1_out[at] =
            floatBitsToUint(mix(vec4(0.0), clamp(raw_gradient, -3.402823466e38, 3.402823466e38), number));
        if (!all(number)) atomicAdd(counts.dropped_updates, 1u);
        return;
    }
    const vec4 largest = vec4(GRADIENT_MAX);
    const vec4 gradient = mix(raw_gradient, clamp(raw_gradient, -largest, largest), greaterThan(abs(raw_gradient), largest));
    const uvec4 words = fetch(moments1, at);
    const vec4 old_m = PACKED_MOMENTS ? first_moment(words) : uintBitsToFloat(words);
    const vec4 old_v = PACKED_MOMENTS ? second_moment(words) : uintBitsToFloat(fetch(moments2, at));
    const vec4 m = mix(gradient, old_m, float(ADAM_BETA1));
    const vec4 v = mix(gradient * gradient, old_v, float(ADAM_BETA2));
    vec4 moved = value - rate * (m * push.bias1) / (sqrt(v * push.bias2) + float(ADAM_EPSILON));
    const bool limited = limit_step(plane, value, depth, moved);
    if (is_finite(moved) && is_finite(m) && is_finite(v)) {
        if (limited) atomicAdd(counts.limited_steps, 1u);
        params_out[at] = moved;
        if (PACKED_MOMENTS) {
            moments1_out[at] = pack_moments(m, v, random);
        } else {
            moments1_out[at] = floatBitsToUint(m);
            moments2_out[at] = floatBitsToUint(v);
        }
    } else if (is_finite(value)) {
        atomicAdd(counts.dropped_updates, 1u);
    }
}

void move(uint plane, uint i, vec4 value, vec4 raw_gradient, vec4 rate, float depth) {
    move_rounded(plane, i, value, raw_gradient, rate, depth, moment_random(i, plane, push.step, push.seed));
}

// Moves all spherical harmonics except the coefficient in plane 2, which it shares with the scales. Returns that one's
// gradient. direction_gradient: dL/d(unit direction).
float move_sh(uint i, vec3 color_gradient, vec3 direction, out vec3 direction_gradient) {
    float basis[16];
    vec3 slope[16];
    sh_basis(SH_DEGREE, direction, basis);
    sh_basis_gradient(SH_DEGREE, direction, slope);
    direction_gradient = vec3(0.0);
    [[unroll]] for (uint plane = PARAM_SH / 4 + 1; plane < PLANES; ++plane) {
        const vec4 value = fetch(params, index_of(plane, i));
        vec4 gradient = vec4(0.0), rate = vec4(0.0);
        [[unroll]] for (uint c = 0; c < 4; ++c) {
            const uint s = 4 * plane + c - PARAM_SH;
            if (s < SH_FLOATS) {
                gradient[c] = basis[s / 3] * color_gradient[s % 3];
                rate[c] = s < 3 ? push.sh0_rate : push.sh_rest_rate;
                direction_gradient += (value[c] * color_gradient[s % 3]) * slope[s / 3];
            }
        }
        move(plane, i, value, gradient, rate, 0.0);
    }
    return basis[0] * color_gradient.r;
}
#endif
