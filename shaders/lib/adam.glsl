// SPDX-License-Identifier: Apache-2.0
// Adam's step of a splat's parameters, or their gradient alone. The including pass declares the buffers of update.comp, push
// (UpdateBlock, or UpdateViewsPush with ADAM_OF_PUSH defined), SH_DEGREE, GRADIENT_ONLY and PACKED_MOMENTS.
#ifndef EWA_LIB_ADAM
#define EWA_LIB_ADAM
#include "lib/params.glsl"
#include "lib/step_limits.glsl"
#include "lib/moments.glsl"
#include "lib/adam_step.glsl"
#include "lib/sh.glsl"

#ifdef ADAM_OF_PUSH
#define BETA1 push.beta1
#define BETA2 push.beta2
#define EPSILON push.epsilon
#define DECAYED(NEW, OLD, BETA) ((NEW) * (1.0 - (BETA)) + (OLD) * (BETA))
#define FIRST_SPLAT push.first
#else
#define BETA1 float(ADAM_BETA1)
#define BETA2 float(ADAM_BETA2)
#define EPSILON float(ADAM_EPSILON)
#define DECAYED(NEW, OLD, BETA) mix(NEW, OLD, BETA)
#define FIRST_SPLAT 0u
#endif

// Counts of this invocation, added to the total once at the end: lavapipe runs every atomic as a loop over the lanes.
uint dropped_updates = 0u, limited_steps = 0u;

void count_updates() {
    if (dropped_updates > 0u) atomicAdd(counts.dropped_updates, dropped_updates);
    if (limited_steps > 0u) atomicAdd(counts.limited_steps, limited_steps);
}

const uint SH_FLOATS = 3 * (SH_DEGREE + 1) * (SH_DEGREE + 1);
const uint PLANES = (PARAM_SH + SH_FLOATS + 3) / 4;

uint index_of(uint plane, uint i) { return param_texel(push.planes, plane, i); }

// Adam's step of one texel of parameters.
// random: rounds packed moments.
void move_rounded(uint plane, uint i, vec4 value, vec4 raw_gradient, vec4 rate, float depth, uvec4 random) {
    const uint at = index_of(plane, i);
    if (GRADIENT_ONLY) {
        // Infinities become the largest float32. NaN becomes zero and is counted.
        const bvec4 number = equal(raw_gradient, raw_gradient);
        moments1_out[at] = as_texel(
            floatBitsToUint(mix(vec4(0.0), clamp(raw_gradient, -3.402823466e38, 3.402823466e38), number)));
        if (!all(number)) ++dropped_updates;
        return;
    }
    const vec4 largest = vec4(GRADIENT_MAX);
    const vec4 gradient = mix(raw_gradient, clamp(raw_gradient, -largest, largest), greaterThan(abs(raw_gradient), largest));
    const uvec4 words = fetch(moments1, at);
    const vec4 old_m = PACKED_MOMENTS ? first_moment(words) : uintBitsToFloat(words);
    const vec4 m = DECAYED(gradient, old_m, BETA1);
#ifdef ADAM_OF_PUSH
    const vec4 root = second_root(words);
    const vec4 kept_v = PACKED_MOMENTS ? root * (root * BETA2) : uintBitsToFloat(fetch(moments2, at)) * BETA2;
    const vec4 v = gradient * (gradient * (1.0 - BETA2)) + kept_v;
#else
    const vec4 old_v = PACKED_MOMENTS ? second_moment(words) : uintBitsToFloat(fetch(moments2, at));
    const vec4 v = DECAYED(gradient * gradient, old_v, BETA2);
#endif
    vec4 moved = adam_moved(value, m, v, gradient, rate, vec2(push.moment_share, push.gradient_share), push.bias2, EPSILON);
    const bool limited = limit_step(plane, value, depth, moved);
    const bool frozen = is_frozen(words);
    if (is_finite(moved) && is_finite(m) && is_finite(v) && !frozen) {
        if (limited) ++limited_steps;
        params_out[at] = as_texel(moved);
        if (PACKED_MOMENTS) {
            moments1_out[at] = as_texel(pack_moments(m, v, random));
        } else {
            moments1_out[at] = as_texel(floatBitsToUint(m));
            moments2_out[at] = as_texel(floatBitsToUint(v));
        }
    } else if (is_finite(value) && !frozen) {
        ++dropped_updates;
    }
}

void move(uint plane, uint i, vec4 value, vec4 raw_gradient, vec4 rate, float depth) {
    move_rounded(plane, i, value, raw_gradient, rate, depth, moment_random(FIRST_SPLAT + i, plane, push.step, push.seed));
}

const uint FIRST_SH_PLANE = PARAM_SH / 4 + 1;   // of those that hold nothing else

struct ShBasis {
    float value[16];
    vec3 slope[16];
};

ShBasis sh_basis_of(vec3 direction) {
    ShBasis basis;
    sh_basis(SH_DEGREE, direction, basis.value);
    sh_basis_gradient(SH_DEGREE, direction, basis.slope);
    return basis;
}

// Gradient by the spherical harmonics of a plane. Adds that by the unit direction.
vec4 sh_gradient(uint plane, vec4 value, vec3 color_gradient, ShBasis basis, inout vec3 direction_gradient) {
    vec4 gradient = vec4(0.0);
    [[unroll]] for (uint c = 0; c < 4; ++c) {
        const uint s = 4 * plane + c - PARAM_SH;
        if (s < SH_FLOATS) {
            gradient[c] = basis.value[s / 3] * color_gradient[s % 3];
            direction_gradient += (value[c] * color_gradient[s % 3]) * basis.slope[s / 3];
        }
    }
    return gradient;
}

vec4 sh_rates(uint plane) {
    vec4 rate = vec4(0.0);
    [[unroll]] for (uint c = 0; c < 4; ++c) {
        const uint s = 4 * plane + c - PARAM_SH;
        if (s < SH_FLOATS) rate[c] = s < 3 ? push.sh0_rate : push.sh_rest_rate;
    }
    return rate;
}

// Moves all spherical harmonics except the coefficient in plane 2, which it shares with the scales. Returns that one's
// gradient. direction_gradient: dL/d(unit direction).
float move_sh(uint i, vec3 color_gradient, vec3 direction, out vec3 direction_gradient) {
    const ShBasis basis = sh_basis_of(direction);
    direction_gradient = vec3(0.0);
    [[unroll]] for (uint plane = FIRST_SH_PLANE; plane < PLANES; ++plane) {
        const vec4 value = fetch(params, index_of(plane, i));
        const vec4 gradient = sh_gradient(plane, value, color_gradient, basis, direction_gradient);
        move(plane, i, value, gradient, sh_rates(plane), 0.0);
    }
    return basis.value[0] * color_gradient.r;
}
#endif
