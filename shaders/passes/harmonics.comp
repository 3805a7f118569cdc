#version 460
// SPDX-License-Identifier: Apache-2.0
// Evaluates spherical harmonics of any number of channels: colour = sum over k of coefficient k times Y_k(direction).
// One invocation owns splat i. It reads 4 channels of its coefficients at a time, for all views. SPEC_MODE: HARMONICS_*
// bits.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/sh.glsl"
#include "lib/harmonics.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_MODE) const uint MODE = 0;
const bool MASKED = (MODE & HARMONICS_MASKED) != 0u, RGB = (MODE & HARMONICS_RGB) != 0u;

layout(set = 0, binding = 0, scalar) readonly buffer Directions { vec3 directions[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Coefficients { float coefficients[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Masks { uint masks[]; };  // 4 a word
layout(set = 0, binding = 3, scalar) writeonly buffer Colors { float colors[]; };
layout(set = 0, binding = 4, scalar) readonly buffer RgbCoefficients { vec3 rgb_coefficients[]; };  // the same
layout(push_constant, scalar) uniform Push { HarmonicsPush push; };

void main() {
    const uint i = item_index();
    if (i >= push.splats) return;
    for (uint first = 0u; first < push.channels; first += 4u) {
        vec4 group[25];
        [[unroll]] for (uint k = 0; k < BASES; ++k)
            group[k] = vec4(RGB ? rgb_coefficients[i * push.coefficients + k] : vec3(0.0), 0.0);
        [[unroll]] for (uint c = 0; c < 4; ++c) {
            if (!RGB && first + c < push.channels)
                [[unroll]] for (uint k = 0; k < BASES; ++k)
                    group[k][c] = coefficients[(i * push.coefficients + k) * push.channels + first + c];
        }
        for (uint v = 0u; v < push.views; ++v) {
            const uint at = v * push.splats + i;
            const bool shown = !MASKED || (masks[at / 4u] >> (8u * (at % 4u)) & 255u) != 0u;
            float norm, basis[25];
            harmonics_basis(unit_direction(directions[at], norm), basis);
            vec4 sum = vec4(0.0);
            [[unroll]] for (uint k = 0; k < BASES; ++k) sum += basis[k] * group[k];
            [[unroll]] for (uint c = 0; c < 4; ++c)
                if (first + c < push.channels) colors[at * push.channels + first + c] = shown ? sum[c] : 0.0;
        }
    }
}
