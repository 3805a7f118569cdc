#version 460
// SPDX-License-Identifier: Apache-2.0
// Evaluates spherical harmonics of any number of channels: colour = sum over k of coefficient k times Y_k(direction).
// One invocation owns splat i in view workgroup.z. SPEC_MODE: 0 or HARMONICS_MASKED.
#extension GL_GOOGLE_include_directive : require
#include "lib/prelude.glsl"
#include "lib/sh.glsl"
#include "lib/harmonics.glsl"

layout(local_size_x_id = SPEC_GROUP_SIZE) in;
layout(constant_id = SPEC_MODE) const uint MODE = 0;

layout(set = 0, binding = 0, scalar) readonly buffer Directions { vec3 directions[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Coefficients { float coefficients[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Masks { uint masks[]; };  // 4 a word
layout(set = 0, binding = 3, scalar) writeonly buffer Colors { float colors[]; };
layout(push_constant, scalar) uniform Push { HarmonicsPush push; };

void main() {
    const uint i = item_index(), at = gl_WorkGroupID.z * push.splats + i;
    if (i >= push.splats) return;
    const bool shown = MODE != HARMONICS_MASKED || (masks[at / 4u] >> (8u * (at % 4u)) & 255u) != 0u;
    float norm, basis[25];
    harmonics_basis(unit_direction(directions[at], norm), basis);
    for (uint c = 0u; c < push.channels; ++c) {
        float sum = 0.0;
        [[unroll]] for (uint k = 0; k < BASES; ++k)
            sum += basis[k] * coefficients[(i * push.coefficients + k) * push.channels + c];
        colors[at * push.channels + c] = shown ? sum : 0.0;
    }
}
