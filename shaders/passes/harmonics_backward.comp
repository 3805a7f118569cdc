#version 460
// SPDX-License-Identifier: Apache-2.0
// Gradient of harmonics.
// One invocation owns splat i. It adds the coefficients' gradients of its views in their order, 4 channels at a time.
// SPEC_MODE: HARMONICS_* bits.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/sh.glsl"
#include "lib/harmonics.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
const bool MASKED = (MODE & HARMONICS_MASKED) != 0u, DIRECTIONS = (MODE & HARMONICS_DIRECTIONS) != 0u,
           RGB = (MODE & HARMONICS_RGB) != 0u;

layout(set = 0, binding = 0, scalar) readonly buffer Directions { vec3 directions[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Coefficients { float coefficients[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Masks { uint masks[]; };  // 4 a word
layout(set = 0, binding = 3, scalar) readonly buffer ColorsGradient { float colors_gradient[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer CoefficientsGradient { float coefficients_gradient[]; };
layout(set = 0, binding = 5, scalar) buffer DirectionsGradient { vec3 directions_gradient[]; };
layout(set = 0, binding = 6, scalar) readonly buffer RgbCoefficients { vec3 rgb_coefficients[]; };  // the same
layout(push_constant, scalar) uniform Push { HarmonicsPush push; };

// First of the channels of coefficient k of splat i.
uint coefficient_at(uint i, uint k) { return (i * push.coefficients + k) * push.channels; }

// dL/d(direction of any length), of a group of channels that begins with `first`.
vec3 direction_gradient(uint i, uint first, vec4 by_color, vec3 direction, float norm) {
    vec3 slope[25];
    harmonics_basis_gradient(direction, slope);
    vec3 sum = vec3(0.0);
    if (RGB)
        [[unroll]] for (uint k = 1; k < BASES; ++k)
            sum += dot(rgb_coefficients[i * push.coefficients + k], by_color.rgb) * slope[k];
    [[unroll]] for (uint c = 0; c < 4; ++c) {
        if (!RGB && first + c < push.channels)
            [[unroll]] for (uint k = 1; k < BASES; ++k)
                sum += (coefficients[coefficient_at(i, k) + first + c] * by_color[c]) * slope[k];
    }
    return norm > 0.0 ? (sum - direction * dot(direction, sum)) / norm : vec3(0.0);
}

void main() {
    const uint i = item_index();
    if (i >= push.splats) return;
    for (uint first = 0u; first < push.channels; first += 4u) {
        vec4 sums[25];
        [[unroll]] for (uint k = 0; k < BASES; ++k) sums[k] = vec4(0.0);
        for (uint v = 0u; v < push.views; ++v) {
            const uint at = v * push.splats + i;
            const bool shown = !MASKED || (masks[at / 4u] >> (8u * (at % 4u)) & 255u) != 0u;
            float norm, basis[25];
            const vec3 direction = unit_direction(directions[at], norm);
            harmonics_basis(direction, basis);
            vec4 by_color = vec4(0.0);
            [[unroll]] for (uint c = 0; c < 4; ++c)
                if (first + c < push.channels) by_color[c] = colors_gradient[at * push.channels + first + c];
            if (shown)
                [[unroll]] for (uint k = 0; k < BASES; ++k) sums[k] += basis[k] * by_color;
            if (DIRECTIONS) {
                const vec3 earlier = first == 0u ? vec3(0.0) : directions_gradient[at];
                const vec3 own = shown ? direction_gradient(i, first, by_color, direction, norm) : vec3(0.0);
                directions_gradient[at] = earlier + own;
            }
        }
        [[unroll]] for (uint c = 0; c < 4; ++c) {
            if (first + c < push.channels) {
                [[unroll]] for (uint k = 0; k < BASES; ++k)
                    coefficients_gradient[coefficient_at(i, k) + first + c] = sums[k][c];
                for (uint k = BASES; k < push.coefficients; ++k)
                    coefficients_gradient[coefficient_at(i, k) + first + c] = 0.0;
            }
        }
    }
}
